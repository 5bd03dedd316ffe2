//! Planes and surfaces with a frame: 108, 190, 192, 194, 196, 198, with their points (116) and directions (123).

use claymill_nurbs::analytic::Frame;
use claymill_nurbs::{Point3, SurfaceKind, Vector3};

use crate::chart::{Carrier, Quadric};

use super::fault::Fault;
use super::file::{File, Record};
use super::placement::Placement;

/// 108: `a x + b y + c z = d`.
pub(crate) fn plane(record: &mut Record, placement: &Placement) -> Result<Frame, Fault> {
    let de = record.de;
    let [a, b, c, d] = record.reals()?;
    let normal = Vector3::new(a, b, c);
    let foot = Point3::from(normal * (d / normal.norm_squared()));
    frame(de, placement, foot, normal, Vector3::zeros())
}

/// 190: a point and a direction.
pub(crate) fn plane_by_point(
    file: &File,
    record: &mut Record,
    placement: &Placement,
) -> Result<Frame, Fault> {
    let de = record.de;
    let (location, normal) = (record.integer()?, record.integer()?);
    frame(de, placement, point(file, location)?, direction(file, normal)?, Vector3::zeros())
}

/// 192, 194, 196 and 198, in millimetres. Form 1 tells where angles start, form 0 leaves that open.
pub(crate) fn quadric(
    file: &File,
    record: &mut Record,
    kind: i64,
    form: i64,
    placement: &Placement,
) -> Result<(Carrier, SurfaceKind), Fault> {
    let de = record.de;
    let mm = placement.uniform_scale().ok_or_else(|| {
        let what = "its matrix stretches it unevenly";
        Fault::Geometry { de, what }
    })?;
    let location = point(file, record.integer()?)?;
    // A sphere needs no axis.
    let axis = match kind {
        196 => Vector3::z(),
        _ => direction(file, record.integer()?)?,
    };
    let radius = |value: f64| {
        let what = "its radius is not positive";
        if value > 0.0 { Ok(value * mm) } else { Err(Fault::Geometry { de, what }) }
    };
    let (quadric, surface_kind) = match kind {
        192 => (Quadric::Cone { radius: radius(record.real()?)?, slope: 0.0 }, SurfaceKind::Cylinder),
        194 => {
            let [at_location, degrees] = record.reals()?;
            if !(at_location >= 0.0 && degrees > 0.0 && degrees < 89.999) {
                let what = "its radius or half-angle makes no sense";
                return Err(Fault::Geometry { de, what });
            }
            let slope = degrees.to_radians().tan();
            (Quadric::Cone { radius: at_location * mm, slope }, SurfaceKind::Cone)
        }
        196 => (Quadric::Torus { major: 0.0, minor: radius(record.real()?)? }, SurfaceKind::Sphere),
        _ => {
            let (major, minor) = (radius(record.real()?)?, radius(record.real()?)?);
            (Quadric::torus(major, minor, true), SurfaceKind::Torus)
        }
    };
    let (axis, start) = match (form, kind) {
        (1, 196) => (direction(file, record.integer()?)?, direction(file, record.integer()?)?),
        (1, _) => (axis, direction(file, record.integer()?)?),
        _ => (axis, Vector3::zeros()),
    };
    let frame = frame(de, placement, location, axis, start)?;
    Ok((Carrier::Quadric { frame, quadric }, surface_kind))
}

fn triple(file: &File, de: i64, kind: i64, wanted: &'static str) -> Result<[f64; 3], Fault> {
    let found = file.entry(de)?.kind;
    if found != kind {
        return Err(Fault::Kind { de, kind: found, wanted });
    }
    file.record(de)?.reals::<3>()
}

/// A point (116), under its own matrix.
fn point(file: &File, de: i64) -> Result<Point3, Fault> {
    let own = Placement::scale(1.0).of_entity(file, de)?;
    Ok(own.point(Point3::from(triple(file, de, 116, "a point")?)))
}

/// A direction (123), under its own matrix.
fn direction(file: &File, de: i64) -> Result<Vector3, Fault> {
    let own = Placement::scale(1.0).of_entity(file, de)?;
    Ok(own.vector(Vector3::from(triple(file, de, 123, "a direction")?)))
}

/// The frame in model space. The axis is rebuilt from two mapped directions across it, which stays right under
/// scaling and mirroring.
fn frame(
    de: i64,
    placement: &Placement,
    origin: Point3,
    axis: Vector3,
    start: Vector3,
) -> Result<Frame, Fault> {
    let what = "its axis has no direction";
    let lost = || Fault::Geometry { de, what };
    let local = Frame::new(origin, axis, start).ok_or_else(lost)?;
    let (x, y) = (placement.vector(local.x), placement.vector(local.y));
    // A mirrored axis still points along the image of the old one.
    let z = x.cross(&y);
    let z = if z.dot(&placement.vector(local.z)) < 0.0 { -z } else { z };
    Frame::new(placement.point(origin), z, x).ok_or_else(lost)
}
