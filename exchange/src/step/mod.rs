//! The STEP reader (ISO 10303-21 files of AP203, AP214 and AP242 with boundary representations).
//!
//! ```text
//!   bytes ─ part21 (index) ─┬─ assembly: which faces, where, in which unit
//!                           └─ faces: edges + surface ─ chart ─► Face
//! ```

mod assembly;
mod bare;
mod contents;
mod curves;
mod edges;
mod error;
mod faces;
mod look;
mod part21;
mod placement;
mod products;
mod script;
mod styles;
mod surfaces;
mod unfolding;
mod units;
mod value;
mod writer;

use std::collections::BTreeMap;
use std::path::Path;

use claymill_nurbs::{Model, Source};
use rayon::prelude::*;

use crate::audit;
use crate::chart::Limits;
use crate::{EntityCount, Format, Import, ImportReport, ReadError, Repair, Skipped};
use assembly::PlacedFace;
use contents::Lost;
use error::StepError;
use faces::BuiltFace;
use part21::Part21;
use styles::Styles;
use value::Entity;
pub use writer::write_step;

/// Units and tolerances of a representation. Geometry is built in the file's unit of length.
#[derive(Debug, Clone, PartialEq)]
struct Context {
    mm_per_unit: f64,
    /// Radians in the file's unit of angle.
    angle_unit: f64,
    /// As declared, mm; 0 when it is not.
    tolerance_mm: f64,
    /// What the file calls its unit of length.
    declared: String,
    /// In file units.
    limits: Limits,
}

/// Reads a STEP Part 21 file.
pub(crate) fn read(bytes: &[u8], path: &Path) -> Result<Import, ReadError> {
    let file = Part21::index(bytes).map_err(|e| ReadError::Truncated {
        path: path.into(),
        what: format!("{} (line {})", e.what, e.line),
    })?;
    let faces = assembly::faces(&file).map_err(|e| ReadError::TooMuch {
        path: path.into(),
        entity: format!("#{}", e.id),
        what: e.what,
    })?;
    let styles = Styles::read(&file);
    let mut report = ImportReport::new(Format::Step);
    report.system = system(&file);
    report.warnings = faces.warnings;
    if !file.duplicates.is_empty() {
        report.warnings.push(format!(
            "{} instance numbers occur more than once, the first is #{}: the first instance of each counts.",
            file.duplicates.len(),
            file.duplicates[0]
        ));
    }
    let used: Vec<&Context> = faces.placed.iter().map(|p| &faces.contexts[p.context]).collect();
    if let Some(first) = used.first() {
        report.units.declared.clone_from(&first.declared);
        report.units.mm_per_unit = first.mm_per_unit;
        report.tolerance_mm = used.iter().fold(0.0, |m, c| c.tolerance_mm.max(m));
        if used.iter().any(|c| c.mm_per_unit != first.mm_per_unit) {
            report.warnings.push("The parts of the assembly use different units of length.".into());
        }
    }

    let read: Vec<_> = faces
        .placed
        .par_iter()
        .map(|placed| {
            let context = &faces.contexts[placed.context];
            let face = match faces.oversized.get(&placed.id) {
                Some(bytes) => Err(StepError::TooMuch { id: placed.id, bytes: *bytes }),
                None => face(&file, placed, context, &styles),
            };
            let face = face.map(|(face, repairs)| {
                let reading =
                    audit::reading(&face, &look::bounds(&file, placed, context), context.tolerance_mm);
                (face, repairs, reading)
            });
            (placed, face)
        })
        .collect();
    let mut model = Model {
        faces: Vec::with_capacity(read.len()),
        tolerance_mm: report.tolerance_mm,
        coordinate_step_mm: report.units.mm_per_unit * coordinate_step(&file),
    };
    for (placed, result) in read {
        report.faces_in_file += 1;
        match result {
            Ok((face, repairs, reading)) => {
                model.faces.push(face);
                report.repairs.extend(repairs);
                report.faces.push(reading);
            }
            Err(error) => report.skipped.push(Skipped {
                entity: format!("#{}", placed.id),
                what: file.get(placed.id).map_or_else(|_| "ADVANCED_FACE".into(), |e| e.name()),
                reason: error.to_string(),
                advice: error.advice().into(),
            }),
        }
    }
    for Lost { id, shell } in &faces.lost {
        report.faces_in_file += 1;
        let found = file.get(*id);
        let what = found.as_ref().map_or_else(|_| "ADVANCED_FACE".into(), Entity::name);
        let error = match found {
            Ok(entity) => entity.unexpected("a face"),
            Err(error) => error,
        };
        report.skipped.push(Skipped {
            entity: format!("#{id}"),
            what,
            reason: format!("{error}; the shell #{shell} refers to it"),
            advice: error.advice().into(),
        });
    }
    report.faces_read = model.faces.len();
    report.entities = entities(&file);
    Ok(Import { model, report })
}

/// Builds one face and puts it in its place.
fn face(
    file: &Part21,
    placed: &PlacedFace,
    context: &Context,
    styles: &Styles,
) -> Result<(claymill_nurbs::Face, Vec<Repair>), StepError> {
    let BuiltFace { face, name, bridged, deviation, repeated } = match placed.bare {
        true => bare::build(file, placed.id, context)?,
        false => faces::build(file, placed.id, context)?,
    };
    let mm = context.mm_per_unit;
    let to_model = |p: claymill_nurbs::Point3| placed.placement.transform_point(&(p * mm));
    let mut face =
        faces::placed(&face, to_model).map_err(|source| StepError::Kernel { id: placed.id, source })?;
    face.reversed ^= placed.reversed;
    face.source = Source {
        entity: format!("#{}", placed.id),
        name: Some(name).filter(|n| !n.is_empty() && n != "NONE"),
        layer: styles.layer(&placed.owners),
        colour: styles.colour(&placed.owners),
    };
    // Two instances of one part share no edges.
    let apart = file.largest_id().wrapping_add(1).wrapping_mul(placed.instance - 1);
    for edge in face.loops.iter_mut().flat_map(|l| &mut l.edges) {
        edge.shared = edge.shared.map(|id| id.wrapping_add(apart));
    }
    let repair = |what: &str, size: f64| Repair {
        entity: format!("#{}", placed.id),
        what: what.into(),
        size_mm: size * mm,
    };
    let approximated = Some(deviation).filter(|d| *d > 0.0);
    let approximated = approximated.map(|d| repair("offset surface approximated by a B-spline", d));
    let bridged = bridged.into_iter().map(|size| repair("gap in trim loop bridged", size));
    let again = (repeated > 0).then(|| repair(&format!("{repeated} repeated trim loops left out"), 0.0));
    Ok((face, approximated.into_iter().chain(bridged).chain(again).collect()))
}

/// FILE_NAME(name, time, authors, organisations, preprocessor, originating system, authorisation).
fn system(file: &Part21) -> Option<String> {
    let header = file.header("FILE_NAME")?;
    let record = header.only().ok()?;
    let (preprocessor, origin) = (record.text(4), record.text(5));
    [origin, preprocessor].into_iter().find(|s| !s.trim().is_empty())
}

fn entities(file: &Part21) -> BTreeMap<String, EntityCount> {
    let mut counts: BTreeMap<&[u8], EntityCount> = BTreeMap::new();
    for (name, used) in file.usage() {
        let count = counts.entry(name).or_default();
        count.in_file += 1;
        count.used += usize::from(used);
    }
    let text = |name: &[u8]| match name {
        b"" => "complex instance".to_owned(),
        _ => String::from_utf8_lossy(name).into_owned(),
    };
    counts.into_iter().map(|(name, count)| (text(name), count)).collect()
}

/// Points looked at to find the number of digits.
const DIGIT_SAMPLE: usize = 2000;

/// The size of the last digit of the coordinates, in file units: small numbers carry more digits behind the
/// point than large ones, so that only those of a hundredth of the large ones and above count.
fn coordinate_step(file: &Part21) -> f64 {
    let points: Vec<u64> = file.of_type(|name| name == b"CARTESIAN_POINT").collect();
    let stride = points.len().div_ceil(DIGIT_SAMPLE).max(1);
    let number = |token: &[u8]| -> Option<(f64, i32)> {
        let text = std::str::from_utf8(token).ok()?.trim();
        let value: f64 = text.parse().ok()?;
        let (mantissa, exponent) = text.split_once(['E', 'e']).unwrap_or((text, "0"));
        let decimals = mantissa.split_once('.').map_or(0, |(_, tail)| tail.trim_end_matches('0').len());
        // Exponents beyond those of numbers are damage.
        let exponent = exponent.parse::<i32>().ok().filter(|e| e.abs_diff(0) < 400)?;
        Some((value.abs(), i32::try_from(decimals).ok()? - exponent))
    };
    let numbers: Vec<(f64, i32)> = points
        .iter()
        .step_by(stride)
        .flat_map(|id| file.text(*id).split(|b| matches!(b, b'(' | b')' | b',')).filter_map(number))
        .collect();
    // One far-away helper point must not decide what is large.
    let mut sizes: Vec<f64> = numbers.iter().map(|n| n.0).collect();
    sizes.sort_by(f64::total_cmp);
    let large = sizes.get(sizes.len() * 9 / 10).copied().unwrap_or(0.0);
    let telling = numbers.iter().filter(|n| n.0 >= 0.01 * large);
    telling.map(|n| n.1).max().map_or(0.0, |decimals| 10.0_f64.powi(-decimals))
}
