//! Units and tolerance of a representation context.

use super::part21::Part21;
use super::value::Entity;
use super::{Context, StepError};
use crate::chart::Limits;
use crate::plausible::LARGEST_TOLERANCE_MM;

/// Pcurves follow their edges this closely, mm.
const FIT_MM: f64 = 1e-4;
/// The file's tolerance counts within these limits, mm, when points are compared.
const SAME_POINT_MM: (f64, f64) = (1e-3, 0.1);
/// An edge may miss its neighbour or its surface by this (or ten times the file's tolerance), mm.
const MISFIT_MM: f64 = 0.5;
/// Conversion-based units may be defined by each other this deep.
const DEEPEST_UNIT: usize = 8;

/// The context of lengths in millimetres and angles in radians, without tolerance.
pub(super) fn millimetres() -> Context {
    context(1.0, 1.0, 0.0, "MM".into())
}

fn context(mm_per_unit: f64, angle_unit: f64, tolerance_mm: f64, declared: String) -> Context {
    let tolerance_mm = tolerance_mm.min(LARGEST_TOLERANCE_MM);
    let same_mm = tolerance_mm.clamp(SAME_POINT_MM.0, SAME_POINT_MM.1);
    Context {
        mm_per_unit,
        angle_unit,
        tolerance_mm,
        declared,
        limits: Limits {
            fit: FIT_MM / mm_per_unit,
            same: same_mm / mm_per_unit,
            misfit: MISFIT_MM.max(10.0 * tolerance_mm) / mm_per_unit,
            mm_per_unit,
        },
    }
}

/// Reads the representation context `#id`; `None` when it declares no unit of length.
pub(super) fn read(file: &Part21, id: u64) -> Option<Context> {
    let entity = file.get(id).ok()?;
    let units = entity.part("GLOBAL_UNIT_ASSIGNED_CONTEXT").ok()?.references(0).ok()?;
    let (mut length, mut angle) = (None, 1.0);
    for unit in units {
        let Ok(unit) = file.get(unit) else { continue };
        if unit.is("LENGTH_UNIT") {
            length = size(file, &unit, MILLI, DEEPEST_UNIT).ok().map(|s| (s, name(&unit)));
        } else if unit.is("PLANE_ANGLE_UNIT") {
            angle = size(file, &unit, 0, DEEPEST_UNIT).unwrap_or(1.0);
        }
    }
    let (mm_per_unit, declared) = length?;
    let usable = |x: f64| x.is_finite() && x > 0.0;
    if !usable(mm_per_unit) || !usable(angle) {
        return None;
    }
    let tolerance_mm = tolerance(file, &entity).unwrap_or(0.0) * mm_per_unit;
    Some(context(mm_per_unit, angle, tolerance_mm, declared))
}

/// The largest length uncertainty, in the unit of the context.
fn tolerance(file: &Part21, context: &Entity) -> Option<f64> {
    let list = context.part("GLOBAL_UNCERTAINTY_ASSIGNED_CONTEXT").ok()?.references(0).ok()?;
    let value = |id: u64| {
        let entity = file.get(id).ok()?;
        let record = entity.part("UNCERTAINTY_MEASURE_WITH_UNIT").ok()?;
        let of_length =
            record.optional_reference(1).is_some_and(|u| file.get(u).is_ok_and(|u| u.is("LENGTH_UNIT")));
        record.number(0).ok().filter(|t| of_length && t.is_finite() && *t >= 0.0)
    };
    list.into_iter().filter_map(value).reduce(f64::max)
}

/// Millimetres in a metre, as a power of ten.
const MILLI: i32 = 3;

/// The size of a unit in metres or radians, times ten to the `scale`: powers are added before they are rounded.
fn size(file: &Part21, unit: &Entity, scale: i32, depth: usize) -> Result<f64, StepError> {
    let depth = depth.checked_sub(1).ok_or(StepError::Endless { id: unit.id })?;
    if let Ok(si) = unit.part("SI_UNIT") {
        return Ok(10.0_f64.powi(scale + power(si.enumeration(0))));
    }
    let measure = file.get(unit.part("CONVERSION_BASED_UNIT")?.reference(1)?)?;
    let record = match measure.only() {
        Ok(record) => record,
        Err(_) => measure.part("MEASURE_WITH_UNIT")?,
    };
    let base = file.get(record.reference(1)?)?;
    Ok(record.number(0)? * size(file, &base, scale, depth)?)
}

/// The power of ten of an SI prefix.
fn power(prefix: &[u8]) -> i32 {
    match prefix {
        b"TERA" => 12,
        b"GIGA" => 9,
        b"MEGA" => 6,
        b"KILO" => 3,
        b"HECTO" => 2,
        b"DECA" => 1,
        b"DECI" => -1,
        b"CENTI" => -2,
        b"MILLI" => -3,
        b"MICRO" => -6,
        b"NANO" => -9,
        _ => 0,
    }
}

/// What the file calls the unit.
fn name(unit: &Entity) -> String {
    if let Ok(record) = unit.part("CONVERSION_BASED_UNIT") {
        return record.text(0).to_uppercase();
    }
    let prefix = unit.part("SI_UNIT").map_or(&b""[..], |si| si.enumeration(0));
    match prefix {
        b"MILLI" => "MM".into(),
        b"CENTI" => "CM".into(),
        other => format!("{}METRE", String::from_utf8_lossy(other)),
    }
}
