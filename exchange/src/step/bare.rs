//! Surfaces that are faces by themselves, as the items of geometric sets are.

use std::f64::consts::TAU;

use claymill_nurbs::{Face, Point2, Source, SurfaceKind};

use super::curves::composite_parts;
use super::faces::BuiltFace;
use super::part21::{Part21, name_length};
use super::surfaces::{Read, carrier};
use super::value::Entity;
use super::{Context, StepError};
use crate::chart::{self, EdgeUse, Range};
use crate::offset::OFFSET_MM;

/// Whether an instance is a surface that has an end.
pub(super) fn is_surface(text: &[u8]) -> bool {
    match &text[..name_length(text)] {
        b"RECTANGULAR_TRIMMED_SURFACE" | b"CURVE_BOUNDED_SURFACE" => true,
        b"B_SPLINE_SURFACE_WITH_KNOTS" | b"BEZIER_SURFACE" | b"UNIFORM_SURFACE" => true,
        b"QUASI_UNIFORM_SURFACE" | b"SPHERICAL_SURFACE" | b"TOROIDAL_SURFACE" => true,
        b"DEGENERATE_TOROIDAL_SURFACE" | b"OFFSET_SURFACE" => true,
        b"" => memchr::memmem::find(text, b"B_SPLINE_SURFACE").is_some(),
        _ => false,
    }
}

/// Builds the face that is the surface `#id` with its own bounds.
pub(super) fn build(file: &Part21, id: u64, context: &Context) -> Result<BuiltFace, StepError> {
    let entity = file.get(id)?;
    let wrong = |e| StepError::of_chart(id, e);
    let (read, surface, loops, bridged) = match entity.simple_name() {
        "RECTANGULAR_TRIMMED_SURFACE" => {
            let record = entity.only()?;
            let read = unbounded(file, record.reference(1)?, context)?;
            let range = window(&entity, &read, context)?;
            let surface = chart::rectangle(&read.carrier, &range).map_err(wrong)?;
            (read, surface, Vec::new(), Vec::new())
        }
        "CURVE_BOUNDED_SURFACE" => {
            let record = entity.only()?;
            let mut bounds = Vec::new();
            for boundary in record.references(2)? {
                let parts = composite_parts(file, boundary, context.angle_unit)?;
                let edge = |curve| EdgeUse { edge: None, curve, flats: Vec::new() };
                bounds.push(parts.into_iter().map(edge).collect::<Vec<_>>());
            }
            let extent: Vec<_> = bounds.iter().flatten().flat_map(|e| e.curve.points().to_vec()).collect();
            let surface = record.reference(1)?;
            let read = carrier(file, surface, context.angle_unit, &extent, OFFSET_MM / context.mm_per_unit)?;
            let uncut = read.kind == SurfaceKind::Nurbs;
            let patch =
                chart::trimmed(&read.carrier, &bounds, true, uncut, &context.limits).map_err(wrong)?;
            (read, patch.surface, patch.loops, patch.bridged)
        }
        _ => {
            let read = unbounded(file, id, context)?;
            let patch = chart::trimmed(&read.carrier, &[], true, true, &context.limits).map_err(wrong)?;
            (read, patch.surface, Vec::new(), Vec::new())
        }
    };
    let face = Face { surface, loops, reversed: false, kind: read.kind, source: Source::default() };
    let name = entity.only().map(|r| r.text(0)).unwrap_or_default();
    Ok(BuiltFace { face, name, bridged, deviation: read.deviation, repeated: 0 })
}

fn unbounded(file: &Part21, id: u64, context: &Context) -> Result<Read, StepError> {
    carrier(file, id, context.angle_unit, &[], OFFSET_MM / context.mm_per_unit)
}

/// RECTANGULAR_TRIMMED_SURFACE(name, basis, u1, u2, v1, v2, u sense, v sense): the range, from the lower to the
/// upper end even where that runs across the seam.
fn window(entity: &Entity, read: &Read, context: &Context) -> Result<Range, StepError> {
    let record = entity.only()?;
    let ends = |first: usize, sense: usize, d: usize| -> Result<(f64, f64), StepError> {
        let unit = if read.carrier.angles()[d] { context.angle_unit } else { 1.0 };
        let (a, b) = (record.number(first)? * unit, record.number(first + 1)? * unit);
        let (low, high) = if record.flag(sense).unwrap_or(true) { (a, b) } else { (b, a) };
        let period = if read.carrier.angles()[d] { Some(TAU) } else { read.carrier.periods()[d] };
        Ok(match period {
            Some(period) if high <= low => (low, high + period * ((low - high) / period).floor() + period),
            _ => (low.min(high), low.max(high)),
        })
    };
    let ((u0, u1), (v0, v1)) = (ends(2, 6, 0)?, ends(4, 7, 1)?);
    let range = Range { min: read.carrier.at_angles(u0, v0), max: read.carrier.at_angles(u1, v1) };
    let sound = |p: Point2| p.x.is_finite() && p.y.is_finite();
    if sound(range.min) && sound(range.max) && range.min.x < range.max.x && range.min.y < range.max.y {
        return Ok(range);
    }
    Err(StepError::Geometry { id: entity.id, what: "its range of parameters is empty".into() })
}
