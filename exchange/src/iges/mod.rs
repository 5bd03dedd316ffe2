//! The IGES reader and writer.
//!
//! ```text
//!   cards ─► global, directory, parameters ─► file ─► roots (which entities are faces)
//!                                              │           │
//!                     placement, curves, surfaces, topology ─► faces ─► trim ─► Face
//! ```

mod attributes;
mod cards;
mod compressed;
mod curves;
mod deck;
mod digits;
mod directory;
mod faces;
mod fault;
mod file;
mod global;
mod look;
mod placement;
mod quadrics;
mod roots;
mod surfaces;
mod tokens;
mod topology;
mod unfolding;
mod writer;

use std::path::Path;

use claymill_nurbs::Model;
use rayon::prelude::*;

use crate::audit;
use crate::plausible::LARGEST_TOLERANCE_MM;
use crate::unfolding::Allowance;
use crate::{Format, Import, ImportReport, ReadError, Skipped, Units};

pub use writer::write_iges;

use cards::Cards;
use faces::FaceReader;
use file::File;
use topology::EdgeLists;

/// Reads an IGES file.
pub(crate) fn read(bytes: &[u8], path: &Path) -> Result<Import, ReadError> {
    let length = bytes.len();
    let fixed;
    let bytes = if compressed::is_compressed(bytes) {
        fixed = compressed::expanded(bytes);
        &fixed
    } else {
        bytes
    };
    let cards = Cards::new(bytes);
    check_frame(&cards, path)?;
    let foreign = cards.foreign;
    let file = File::new(cards);
    let global = &file.global;

    let mut report = ImportReport::new(Format::Iges);
    report.system.clone_from(&global.system);
    report.units = Units { declared: global.unit.clone(), mm_per_unit: global.mm_per_unit };
    report.tolerance_mm = (global.resolution * global.mm_per_unit).min(LARGEST_TOLERANCE_MM);
    report.warnings.clone_from(&global.warnings);
    frame_warnings(&file, foreign, &mut report);

    let edge_lists = EdgeLists::new(&file);
    let allowance = Allowance::new(length);
    let roots = roots::find(&file, &edge_lists, global.mm_per_unit, allowance).map_err(|e| {
        let what = format!("the file unfolds to {}, more than its {length} bytes can stand for", e.sum);
        ReadError::TooMuch { path: path.into(), entity: format!("DE {}", e.de), what }
    })?;
    let reader = FaceReader { file: &file, edge_lists, tolerance_mm: report.tolerance_mm };
    let made: Vec<_> = roots
        .par_iter()
        .map(|root| {
            let made = reader.face(root)?;
            let bounds = look::bounds(&file, &reader.edge_lists, root);
            let reading = audit::reading(&made.face, &bounds, report.tolerance_mm);
            Ok::<_, fault::Fault>((made, reading))
        })
        .collect();

    let mut model = Model {
        tolerance_mm: report.tolerance_mm,
        coordinate_step_mm: digits::coordinate_step(&file) * global.mm_per_unit,
        ..Model::default()
    };
    report.faces_in_file = roots.len();
    for (root, made) in roots.iter().zip(made) {
        match made {
            Ok((made, reading)) => {
                model.faces.push(made.face);
                report.faces.push(reading);
                report.repairs.extend(made.repairs);
            }
            Err(fault) => report.skipped.push(Skipped {
                entity: root.label(),
                what: file.entry(root.de).map_or_else(|_| String::new(), |e| directory::kind_name(e.kind)),
                reason: fault.to_string(),
                advice: fault.advice().into(),
            }),
        }
    }
    report.faces_read = model.faces.len();
    for (de, entry) in file.entries() {
        let count = report.entities.entry(directory::kind_name(entry.kind)).or_default();
        count.in_file += 1;
        count.used += usize::from(file.is_used(de));
    }
    Ok(Import { model, report })
}

/// Refuses files of which the frame is missing.
fn check_frame(cards: &Cards, path: &Path) -> Result<(), ReadError> {
    if cards.binary && cards.directory.is_empty() {
        let what = "IGES in binary form".into();
        return Err(ReadError::Unsupported { path: path.into(), what });
    }
    let missing = match (cards.headed, cards.directory.is_empty(), cards.parameters.is_empty()) {
        (false, ..) => "the start and global sections are missing",
        (true, true, _) => "the directory section is missing",
        (true, false, true) => "the parameter section is missing",
        _ => return Ok(()),
    };
    Err(ReadError::Truncated { path: path.into(), what: missing.into() })
}

fn frame_warnings(file: &File, foreign: usize, report: &mut ImportReport) {
    if !file.is_terminated() {
        report.warnings.push(
            "The terminate section is missing: the end of the file may be lost; compare its size with the original."
                .into(),
        );
    }
    if foreign > 0 {
        report.warnings.push(format!(
            "{foreign} lines belong to no section and were ignored; the file may have been edited or damaged."
        ));
    }
    if file.miscounted() {
        report.warnings.push(
            "The counts in the terminate section are not those of the file: cards may be lost; compare its size with \
             the original."
                .into(),
        );
    }
    let damaged = file.damaged_entries();
    if damaged > 0 {
        report.warnings.push(format!(
            "{damaged} directory entries are damaged or missing: faces may be lost; export the file again."
        ));
    }
}
