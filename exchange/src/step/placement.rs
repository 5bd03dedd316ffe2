//! Points, directions and axis placements.

use claymill_nurbs::analytic::Frame;
use claymill_nurbs::{Point2, Point3, Vector3};

use super::StepError;
use super::part21::Part21;

fn coordinates(file: &Part21, id: u64, name: &'static str) -> Result<Vec<f64>, StepError> {
    file.get(id)?.part(name)?.numbers(1)
}

/// A CARTESIAN_POINT in space; missing coordinates are 0.
pub(super) fn point(file: &Part21, id: u64) -> Result<Point3, StepError> {
    let c = coordinates(file, id, "CARTESIAN_POINT")?;
    let at = |i: usize| c.get(i).copied().unwrap_or(0.0);
    Ok(Point3::new(at(0), at(1), at(2)))
}

/// A CARTESIAN_POINT in a parameter plane.
pub(super) fn point2(file: &Part21, id: u64) -> Result<Point2, StepError> {
    point(file, id).map(|p| p.xy())
}

/// A VERTEX_POINT.
pub(super) fn vertex(file: &Part21, id: u64) -> Result<Point3, StepError> {
    point(file, file.get(id)?.part("VERTEX_POINT")?.reference(1)?)
}

/// A DIRECTION; not normalised.
pub(super) fn direction(file: &Part21, id: u64) -> Result<Vector3, StepError> {
    let c = coordinates(file, id, "DIRECTION")?;
    let at = |i: usize| c.get(i).copied().unwrap_or(0.0);
    Ok(Vector3::new(at(0), at(1), at(2)))
}

/// A VECTOR: unit direction times magnitude.
pub(super) fn vector(file: &Part21, id: u64) -> Result<Vector3, StepError> {
    let entity = file.get(id)?;
    let record = entity.part("VECTOR")?;
    let unit = direction(file, record.reference(1)?)?.try_normalize(0.0);
    let unit = unit.ok_or_else(|| no_direction(id))?;
    Ok(unit * record.number(2)?)
}

/// An AXIS2_PLACEMENT_3D, or an AXIS1_PLACEMENT with any direction across its axis.
pub(super) fn frame(file: &Part21, id: u64) -> Result<Frame, StepError> {
    let entity = file.get(id)?;
    let record = match entity.part("AXIS2_PLACEMENT_3D") {
        Ok(record) => record,
        Err(other) => entity.part("AXIS1_PLACEMENT").map_err(|_| other)?,
    };
    let optional = |index: usize, default: Vector3| match record.optional_reference(index) {
        Some(id) => direction(file, id),
        None => Ok(default),
    };
    let origin = point(file, record.reference(1)?)?;
    let (z, x) = (optional(2, Vector3::z())?, optional(3, Vector3::x())?);
    Frame::new(origin, z, x).ok_or_else(|| no_direction(id))
}

fn no_direction(id: u64) -> StepError {
    StepError::Geometry { id, what: "its direction has no length".into() }
}
