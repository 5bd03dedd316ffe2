//! Surface entities as carriers.

use std::f64::consts::TAU;

use claymill_nurbs::analytic::{Frame, extrusion, revolution};
use claymill_nurbs::{Aabb, KnotVector, NurbsSurface, Point3, SurfaceKind};

use super::StepError;
use super::curves::{Curve, DEEPEST_BASIS, implied_knots, repeated, space_curve};
use super::error::OfEntity;
use super::part21::Part21;
use super::placement::{frame, point, vector};
use super::value::{Entity, Value, number, reference};
use crate::chart::{Carrier, Quadric, SplineChart};
use crate::offset::{OFFSET_MM, WORST_OFFSET_MM};

/// A carrier, what it was in the file, and how far it is from that, in file units.
pub(super) struct Read {
    pub(super) carrier: Carrier,
    pub(super) kind: SurfaceKind,
    pub(super) deviation: f64,
}

/// Reads the surface `#id`. Unbounded sweeps are made long enough for `boundary`, points of the face's loops;
/// `tolerance` is for what cannot be a NURBS exactly.
pub(super) fn carrier(
    file: &Part21,
    id: u64,
    angle_unit: f64,
    boundary: &[Point3],
    tolerance: f64,
) -> Result<Read, StepError> {
    nested(file, id, angle_unit, boundary, tolerance, DEEPEST_BASIS)
}

fn nested(
    file: &Part21,
    id: u64,
    angle_unit: f64,
    boundary: &[Point3],
    tolerance: f64,
    depth: usize,
) -> Result<Read, StepError> {
    let depth = depth.checked_sub(1).ok_or(StepError::Endless { id })?;
    let entity = file.get(id)?;
    let positive = |value: f64| {
        (value > 0.0)
            .then_some(value)
            .ok_or_else(|| StepError::Geometry { id, what: format!("a radius is {value}") })
    };
    let (quadric, kind) = match entity.simple_name() {
        "PLANE" => (Quadric::Plane, SurfaceKind::Plane),
        "CYLINDRICAL_SURFACE" => {
            let radius = positive(entity.only()?.number(2)?)?;
            (Quadric::Cone { radius, slope: 0.0 }, SurfaceKind::Cylinder)
        }
        "CONICAL_SURFACE" => {
            let r = entity.only()?;
            let slope = (r.number(3)? * angle_unit).tan();
            if slope == 0.0 || slope.abs() > 1e6 {
                return Err(StepError::Geometry {
                    id,
                    what: "the half-angle of the cone makes no sense".into(),
                });
            }
            let radius = r.number(2)?;
            (Quadric::Cone { radius, slope }, SurfaceKind::Cone)
        }
        "SPHERICAL_SURFACE" => {
            let minor = positive(entity.only()?.number(2)?)?;
            (Quadric::Torus { major: 0.0, minor }, SurfaceKind::Sphere)
        }
        "TOROIDAL_SURFACE" | "DEGENERATE_TOROIDAL_SURFACE" => {
            let r = entity.only()?;
            let (major, minor) = (positive(r.number(2)?)?, positive(r.number(3)?)?);
            // DEGENERATE_TOROIDAL_SURFACE(name, position, major, minor, select outer).
            (Quadric::torus(major, minor, r.flag(4).unwrap_or(true)), SurfaceKind::Torus)
        }
        "SURFACE_OF_LINEAR_EXTRUSION" => {
            let surface = linear_extrusion(file, &entity, angle_unit, boundary)?;
            return Ok(exact(surface, SurfaceKind::Extrusion));
        }
        "SURFACE_OF_REVOLUTION" => {
            let surface = of_revolution(file, &entity, angle_unit, boundary)?;
            return Ok(exact(surface, SurfaceKind::Revolution));
        }
        // The trim loops of a face lie inside the bounds of its surface, so that the bounds add nothing.
        "RECTANGULAR_TRIMMED_SURFACE" | "CURVE_BOUNDED_SURFACE" => {
            return nested(file, entity.only()?.reference(1)?, angle_unit, boundary, tolerance, depth);
        }
        "OFFSET_SURFACE" => return offset(file, &entity, angle_unit, boundary, tolerance, depth),
        _ if is_spline(&entity) => {
            return Ok(exact(spline(file, &entity)?, SurfaceKind::Nurbs));
        }
        _ => {
            let name = entity.name();
            return Err(StepError::Unsupported { id, name });
        }
    };
    let frame = frame(file, entity.only()?.reference(1)?)?;
    Ok(Read { carrier: Carrier::Quadric { frame, quadric }, kind, deviation: 0.0 })
}

fn exact(surface: NurbsSurface, kind: SurfaceKind) -> Read {
    Read { carrier: Carrier::Spline(SplineChart::new(surface)), kind, deviation: 0.0 }
}

/// OFFSET_SURFACE(name, basis, distance, self-intersect).
fn offset(
    file: &Part21,
    entity: &Entity,
    angle_unit: f64,
    boundary: &[Point3],
    tolerance: f64,
    depth: usize,
) -> Result<Read, StepError> {
    let (id, r) = (entity.id, entity.only()?);
    let distance = r.number(2)?;
    // An endless basis must reach as far as the boundary of what is parallel to it.
    let far = distance.abs();
    let reach = Aabb::of(boundary).inflated(far);
    let boundary: Vec<Point3> = if boundary.is_empty() { Vec::new() } else { reach.vertices().into() };
    let basis = nested(file, r.reference(1)?, angle_unit, &boundary, tolerance, depth)?;
    let wrong = |what: &str| StepError::Geometry { id, what: what.into() };
    let carrier = match basis.carrier {
        Carrier::Quadric { frame, quadric } => {
            let (quadric, along) =
                quadric.offset(distance).ok_or_else(|| wrong("the offset surface vanishes"))?;
            let frame = Frame { origin: frame.origin + frame.z * along, ..frame };
            return Ok(Read { carrier: Carrier::Quadric { frame, quadric }, ..basis });
        }
        Carrier::Spline(chart) => chart,
    };
    let (surface, deviation) = crate::offset::surface(carrier.surface(), distance, tolerance).of(id)?;
    if deviation > tolerance * (WORST_OFFSET_MM / OFFSET_MM) {
        return Err(wrong("the offset surface folds or has creases"));
    }
    Ok(Read {
        carrier: Carrier::Spline(SplineChart::new(surface)),
        kind: SurfaceKind::Offset,
        deviation: deviation + basis.deviation,
    })
}

/// SURFACE_OF_LINEAR_EXTRUSION(name, curve, vector), just long enough.
fn linear_extrusion(
    file: &Part21,
    entity: &Entity,
    angle_unit: f64,
    boundary: &[Point3],
) -> Result<NurbsSurface, StepError> {
    let (id, r) = (entity.id, entity.only()?);
    let along = vector(file, r.reference(2)?)?;
    let curve = space_curve(file, r.reference(1)?, angle_unit)?.curve;
    let curve = match &curve {
        // Extruded lines are slanted planes: both directions are solved for at once.
        Curve::Line { origin, direction } => {
            let (a, b, c) = (direction.norm_squared(), direction.dot(&along), along.norm_squared());
            let parameter = |p: &Point3| {
                let d = p - origin;
                (d.dot(direction) * c - d.dot(&along) * b) / (a * c - b * b)
            };
            curve.whole(id, widened(boundary.iter().map(parameter)))?
        }
        _ => curve.whole(id, reach(&curve, boundary))?,
    };
    let height = |p: &Point3| p.coords.dot(&along) / along.norm_squared();
    let (low, high) = range(boundary.iter().map(height));
    let (curve_low, curve_high) = range(curve.points().iter().map(height));
    extrusion(&curve, &along, widened([low - curve_high, high - curve_low].into_iter())).of(id)
}

/// SURFACE_OF_REVOLUTION(name, curve, axis), the whole turn.
fn of_revolution(
    file: &Part21,
    entity: &Entity,
    angle_unit: f64,
    boundary: &[Point3],
) -> Result<NurbsSurface, StepError> {
    let (id, r) = (entity.id, entity.only()?);
    let axis = frame(file, r.reference(2)?)?;
    let curve = space_curve(file, r.reference(1)?, angle_unit)?.curve;
    let line_range = match &curve {
        Curve::Line { origin, direction } => {
            // Turning keeps the height over the axis' foot; where the line runs across the axis the distance
            // from it bounds the parameter instead.
            let (rise, start) = (direction.dot(&axis.z), (origin - axis.origin).dot(&axis.z));
            if rise.abs() > 1e-9 * direction.norm() {
                widened(boundary.iter().map(|p| ((p - axis.origin).dot(&axis.z) - start) / rise))
            } else {
                let away = |p: &Point3| (p - axis.origin).cross(&axis.z).norm();
                let outward = (origin - axis.origin).dot(direction).signum() / direction.norm();
                widened(boundary.iter().map(|p| outward * (away(p) - away(origin))))
            }
        }
        _ => reach(&curve, boundary),
    };
    let curve = curve.whole(id, line_range)?;
    revolution(&curve, &axis.origin, &axis.z, (0.0, TAU)).of(id)
}

/// For conics without end: twice as far as any point of the boundary is from their centre.
fn reach(curve: &Curve, boundary: &[Point3]) -> (f64, f64) {
    let Some(centre) = curve.endless_centre() else { return (0.0, 1.0) };
    let far = boundary.iter().map(|p| (p - centre).norm()).fold(1e-3, f64::max);
    curve.within(2.0 * far).unwrap_or((0.0, 1.0))
}

fn range(values: impl Iterator<Item = f64>) -> (f64, f64) {
    values.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(v), b.max(v)))
}

/// The range of the values and a thousandth more, so that rounding cannot push a boundary outside.
fn widened(values: impl Iterator<Item = f64>) -> (f64, f64) {
    let (low, high) = range(values);
    let more = 1e-3 * (high - low).max(1e-6);
    (low - more, high + more)
}

fn is_spline(entity: &Entity) -> bool {
    [
        "B_SPLINE_SURFACE",
        "B_SPLINE_SURFACE_WITH_KNOTS",
        "BEZIER_SURFACE",
        "QUASI_UNIFORM_SURFACE",
        "UNIFORM_SURFACE",
    ]
    .iter()
    .any(|name| entity.is(name))
}

/// Any B-spline surface, simple or complex.
fn spline(file: &Part21, entity: &Entity) -> Result<NurbsSurface, StepError> {
    let id = entity.id;
    let simple = entity.only().ok();
    let (base, skip) = match simple {
        Some(record) => (record, 1),
        None => (entity.part("B_SPLINE_SURFACE")?, 0),
    };
    let degrees = [base.count(skip)?, base.count(skip + 1)?];
    let net = base.table(skip + 2, reference)?;
    let size = [net.len(), net.first().map_or(0, Vec::len)];
    let points: Result<Vec<Point3>, _> = net.iter().flatten().map(|p| point(file, *p)).collect();
    let points = points?;
    let knots = if entity.is("B_SPLINE_SURFACE_WITH_KNOTS") {
        let (r, first) = match simple {
            Some(record) => (record, 8),
            None => (entity.part("B_SPLINE_SURFACE_WITH_KNOTS")?, 0),
        };
        let count = [0, 1].map(|k| (size[k] + degrees[k] + 1).min(2 * size[k]));
        [
            repeated(id, &r.numbers(first)?, &r.numbers(first + 2)?, count[0])?,
            repeated(id, &r.numbers(first + 1)?, &r.numbers(first + 3)?, count[1])?,
        ]
    } else {
        let knots = |k: usize| {
            implied_knots(entity, "SURFACE", degrees[k], size[k]).ok_or_else(|| StepError::Geometry {
                id,
                what: "the control net does not fit the degree".into(),
            })
        };
        [knots(0)?, knots(1)?]
    };
    let weights = match entity.part("RATIONAL_B_SPLINE_SURFACE") {
        Ok(record) => Some(record.table(0, |v: &Value| number(v))?.concat()),
        Err(_) => None,
    };
    let [knots_u, knots_v] = knots;
    let (knots_u, knots_v) =
        (KnotVector::new(degrees[0], knots_u).of(id)?, KnotVector::new(degrees[1], knots_v).of(id)?);
    NurbsSurface::new(knots_u, knots_v, points, weights).of(id)
}
