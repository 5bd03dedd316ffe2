//! Curves in space and in parameter planes as NURBS.

use std::f64::consts::TAU;

use claymill_nurbs::analytic::{Frame, circle_arc, ellipse_arc, hyperbola_arc, parabola_arc, segment};
use claymill_nurbs::{Curve2, Curve3, KnotVector, NurbsCurve, Point3, Vector3};
use nalgebra::Point;

use super::StepError;
use super::error::OfEntity;
use super::part21::Part21;
use super::placement::{direction, frame, point, point2, vector};
use super::value::Entity;
use crate::along::parameter_near;
use crate::bezier::chained;
use crate::offset::WORST_CURVE_SHARE;
use crate::subcurve::{joined, subcurve};

/// Basis curves may be nested this deep.
pub(super) const DEEPEST_BASIS: usize = 12;

/// `cosh` of more than this is beyond all coordinates.
const FARTHEST_HYPERBOLA: f64 = 30.0;

/// A curve before its ends are known.
#[derive(Debug, Clone)]
pub(super) enum Curve {
    /// `origin + t · direction`.
    Line { origin: Point3, direction: Vector3 },
    /// `o + a cos t · x + b sin t · y`.
    Ellipse { frame: Frame, a: f64, b: f64 },
    /// `o + f t² · x + 2 f t · y`.
    Parabola { frame: Frame, focal: f64 },
    /// `o + a cosh t · x + b sinh t · y`.
    Hyperbola { frame: Frame, a: f64, b: f64 },
    /// Anything with ends of its own.
    Bounded(Curve3),
}

/// A curve in space and, for surface curves, the ids of its pcurves.
pub(super) struct SpaceCurve {
    pub(super) curve: Curve,
    pub(super) pcurves: Vec<u64>,
}

/// Reads the curve `#id`.
pub(super) fn space_curve(file: &Part21, id: u64, angle_unit: f64) -> Result<SpaceCurve, StepError> {
    nested(file, id, angle_unit, DEEPEST_BASIS)
}

fn nested(file: &Part21, id: u64, angle_unit: f64, depth: usize) -> Result<SpaceCurve, StepError> {
    let depth = depth.checked_sub(1).ok_or(StepError::Endless { id })?;
    let entity = file.get(id)?;
    let mut pcurves = Vec::new();
    let curve = match entity.simple_name() {
        "LINE" => {
            let r = entity.only()?;
            Curve::Line { origin: point(file, r.reference(1)?)?, direction: vector(file, r.reference(2)?)? }
        }
        "CIRCLE" => {
            let r = entity.only()?;
            let radius = r.number(2)?;
            Curve::Ellipse { frame: frame(file, r.reference(1)?)?, a: radius, b: radius }
        }
        "ELLIPSE" => {
            let r = entity.only()?;
            Curve::Ellipse { frame: frame(file, r.reference(1)?)?, a: r.number(2)?, b: r.number(3)? }
        }
        "PARABOLA" => {
            let r = entity.only()?;
            Curve::Parabola { frame: frame(file, r.reference(1)?)?, focal: length(id, r.number(2)?)? }
        }
        "HYPERBOLA" => {
            let r = entity.only()?;
            let (a, b) = (length(id, r.number(2)?)?, length(id, r.number(3)?)?);
            Curve::Hyperbola { frame: frame(file, r.reference(1)?)?, a, b }
        }
        name if is_composite(name) => Curve::Bounded(composite(file, &entity, angle_unit, depth)?),
        "OFFSET_CURVE_3D" => Curve::Bounded(offset(file, &entity, angle_unit, depth)?),
        "POLYLINE" => Curve::Bounded(polyline(file, id, &entity.only()?.references(1)?)?),
        "TRIMMED_CURVE" => trimmed(file, &entity, angle_unit, depth)?,
        "SURFACE_CURVE" | "SEAM_CURVE" | "INTERSECTION_CURVE" => {
            let r = entity.only()?;
            pcurves = r.references(2)?;
            nested(file, r.reference(1)?, angle_unit, depth)?.curve
        }
        _ if is_spline(&entity) => Curve::Bounded(spline(file, &entity, point)?),
        _ => {
            let name = entity.name();
            return Err(StepError::Unsupported { id, name });
        }
    };
    Ok(SpaceCurve { curve, pcurves })
}

/// A curve in a parameter plane on the parameters `range` of the edge that it belongs to.
pub(super) fn plane_curve(file: &Part21, id: u64, range: (f64, f64)) -> Result<Curve2, StepError> {
    let entity = file.get(id)?;
    if is_spline(&entity) {
        let curve = spline(file, &entity, point2)?;
        return piece(&curve, range.0, range.1).ok_or_else(|| empty(id));
    }
    if entity.simple_name() == "LINE" {
        let r = entity.only()?;
        let (origin, along) = (point2(file, r.reference(1)?)?, vector(file, r.reference(2)?)?.xy());
        return Ok(Curve2::line(origin + along * range.0, origin + along * range.1));
    }
    Err(StepError::Unsupported { id, name: entity.name() })
}

impl Curve {
    /// The curve between two points on it, run in its own direction (`forward`) or against it. Equal points
    /// on a closed curve mean the whole curve. Returns the curve and the parameters of the file's own curve
    /// at its lower and upper end when those are the same numbers (B-splines and lines only).
    pub(super) fn between(
        &self,
        id: u64,
        start: &Point3,
        end: &Point3,
        forward: bool,
        tolerance: f64,
    ) -> Result<(Curve3, (f64, f64)), StepError> {
        let (low, high) = if forward { (start, end) } else { (end, start) };
        let (curve, range) = match self {
            Curve::Line { origin, direction } => {
                let parameter = |p: &Point3| (p - origin).dot(direction) / direction.norm_squared();
                (Curve3::line(*low, *high), (parameter(low), parameter(high)))
            }
            Curve::Ellipse { frame, a, b } => {
                let angle = |p: &Point3| {
                    let l = frame.local(p);
                    (l.y * a).atan2(l.x * b)
                };
                let from = angle(low);
                let same = (low - high).norm() <= tolerance;
                let sweep = if same { TAU } else { (angle(high) - from).rem_euclid(TAU) };
                let range = (from, from + sweep);
                (ellipse_arc(frame, *a, *b, range).of(id)?, range)
            }
            Curve::Parabola { frame, focal } => {
                let range = (frame.local(low).y / (2.0 * focal), frame.local(high).y / (2.0 * focal));
                (parabola_arc(frame, *focal, range).of(id)?, range)
            }
            Curve::Hyperbola { frame, a, b } => {
                let range = ((frame.local(low).y / b).asinh(), (frame.local(high).y / b).asinh());
                (hyperbola_arc(frame, *a, *b, range).of(id)?, range)
            }
            Curve::Bounded(curve) => {
                let curve = clipped(curve, low, high, tolerance).ok_or_else(|| StepError::Geometry {
                    id,
                    what: "the vertices do not lie on the edge's curve in its direction".into(),
                })?;
                let range = curve.domain();
                (curve, range)
            }
        };
        Ok((if forward { curve } else { curve.reversed() }, range))
    }
}

/// The part of `curve` from `low` to `high`.
fn clipped(curve: &Curve3, low: &Point3, high: &Point3, tolerance: f64) -> Option<Curve3> {
    let (first, last) = curve.domain();
    let (start, end) = (curve.start(), curve.end());
    let near = |a: &Point3, b: &Point3| (a - b).norm() <= tolerance;
    let closed = near(&start, &end);
    if near(&start, low) && near(&end, high) {
        return Some(curve.clone());
    }
    let from = if near(&start, low) { first } else { parameter_near(curve, low) };
    let to = if near(&end, high) { last } else { parameter_near(curve, high) };
    if from < to && !(closed && near(low, high)) {
        return piece(curve, from, to);
    }
    // Round the seam of a closed curve.
    let (tail, head) = (piece(curve, from, last), piece(curve, first, to));
    match (tail, head) {
        (Some(tail), Some(head)) if closed => joined(&tail, &head),
        (Some(tail), None) if closed => Some(tail),
        _ => None,
    }
}

/// The part of `curve` between two parameters, as far as it goes.
fn piece<const D: usize>(curve: &NurbsCurve<D>, from: f64, to: f64) -> Option<NurbsCurve<D>> {
    let (first, last) = curve.domain();
    if from <= first && to >= last {
        return Some(curve.clone());
    }
    subcurve(curve, from.max(first), to.min(last)).ok()
}

/// Straight segments through points.
pub(super) fn polyline(file: &Part21, id: u64, points: &[u64]) -> Result<Curve3, StepError> {
    let points: Result<Vec<_>, _> = points.iter().map(|p| point(file, *p)).collect();
    let mut points = points?;
    points.dedup();
    if points.len() < 2 {
        return Err(empty(id));
    }
    Curve3::new(KnotVector::clamped_uniform(1, points.len()), points, None).of(id)
}

/// TRIMMED_CURVE(name, basis, trim 1, trim 2, sense, master).
fn trimmed(file: &Part21, entity: &Entity, angle_unit: f64, depth: usize) -> Result<Curve, StepError> {
    let r = entity.only()?;
    let id = entity.id;
    let basis = nested(file, r.reference(1)?, angle_unit, depth)?.curve;
    let forward = r.flag(4)?;
    let trim = |index: usize| -> Result<(Option<f64>, Option<Point3>), StepError> {
        let (mut parameter, mut at) = (None, None);
        for value in r.list(index)? {
            parameter = parameter.or(super::value::number(value));
            if let (Some(id), None) = (super::value::reference(value), at) {
                at = Some(point(file, id)?);
            }
        }
        Ok((parameter, at))
    };
    let prefers_points = r.enumeration(5) == b"CARTESIAN";
    let ends = [trim(2)?, trim(3)?].map(|(parameter, at)| match (parameter, at) {
        (_, Some(p)) if prefers_points || parameter.is_none() => Some(p),
        (Some(t), _) => Some(basis.at(t, angle_unit)),
        _ => None,
    });
    let [Some(start), Some(end)] = ends else {
        return Err(StepError::Geometry { id, what: "it has no trimming points".into() });
    };
    let tolerance = 1e-7 * (1.0 + start.coords.amax().max(end.coords.amax()));
    Ok(Curve::Bounded(basis.between(id, &start, &end, forward, tolerance)?.0))
}

impl Curve {
    /// The point at the file's own parameter.
    fn at(&self, t: f64, angle_unit: f64) -> Point3 {
        match self {
            Curve::Line { origin, direction } => origin + direction * t,
            Curve::Ellipse { frame, a, b } => {
                let t = t * angle_unit;
                frame.point(a * t.cos(), b * t.sin(), 0.0)
            }
            Curve::Parabola { frame, focal } => frame.point(focal * t * t, 2.0 * focal * t, 0.0),
            Curve::Hyperbola { frame, a, b } => {
                let t = t.clamp(-FARTHEST_HYPERBOLA, FARTHEST_HYPERBOLA);
                frame.point(a * t.cosh(), b * t.sinh(), 0.0)
            }
            Curve::Bounded(curve) => curve.point(t.clamp(curve.domain().0, curve.domain().1)),
        }
    }

    /// The range of parameters in which an endless conic stays within `reach` of its centre, whatever sweeps it.
    pub(super) fn within(&self, reach: f64) -> Option<(f64, f64)> {
        let end = match self {
            Curve::Parabola { focal, .. } => 0.5 * reach / focal,
            Curve::Hyperbola { b, .. } => (reach / b).asinh().min(FARTHEST_HYPERBOLA),
            _ => return None,
        };
        Some((-end, end))
    }

    /// Where its frame stands, for conics without end.
    pub(super) fn endless_centre(&self) -> Option<Point3> {
        match self {
            Curve::Parabola { frame, .. } | Curve::Hyperbola { frame, .. } => Some(frame.origin),
            _ => None,
        }
    }

    /// The whole curve; what has no ends gets the given range of its own parameter.
    pub(super) fn whole(&self, id: u64, line_range: (f64, f64)) -> Result<Curve3, StepError> {
        match self {
            Curve::Parabola { frame, focal } => parabola_arc(frame, *focal, line_range).of(id),
            Curve::Hyperbola { frame, a, b } => hyperbola_arc(frame, *a, *b, line_range).of(id),
            Curve::Line { .. } => {
                let (a, b) = line_range;
                segment(self.at(a, 1.0), self.at(b, 1.0), line_range).of(id)
            }
            Curve::Ellipse { frame, a, b } if a == b => circle_arc(frame, *a, (0.0, TAU)).of(id),
            Curve::Ellipse { frame, a, b } => ellipse_arc(frame, *a, *b, (0.0, TAU)).of(id),
            Curve::Bounded(curve) => Ok(curve.clone()),
        }
    }
}

fn length(id: u64, value: f64) -> Result<f64, StepError> {
    let what = || StepError::Geometry { id, what: format!("a half-axis is {value}") };
    (value > 0.0).then_some(value).ok_or_else(what)
}

/// COMPOSITE_CURVE(name, segments, self-intersect) as one curve.
fn composite(file: &Part21, entity: &Entity, angle_unit: f64, depth: usize) -> Result<Curve3, StepError> {
    let parts = parts(file, entity, angle_unit, depth)?;
    chained(&parts).ok_or_else(|| empty(entity.id))?.of(entity.id)
}

/// The parts of the composite curve `#id`, or the curve itself.
pub(super) fn composite_parts(file: &Part21, id: u64, angle_unit: f64) -> Result<Vec<Curve3>, StepError> {
    let entity = file.get(id)?;
    if is_composite(entity.simple_name()) {
        return parts(file, &entity, angle_unit, DEEPEST_BASIS);
    }
    Ok(vec![bounded(id, &nested(file, id, angle_unit, DEEPEST_BASIS)?.curve)?])
}

fn is_composite(name: &str) -> bool {
    matches!(
        name,
        "COMPOSITE_CURVE" | "COMPOSITE_CURVE_ON_SURFACE" | "BOUNDARY_CURVE" | "OUTER_BOUNDARY_CURVE"
    )
}

/// The curve, which must have ends of its own.
fn bounded(id: u64, curve: &Curve) -> Result<Curve3, StepError> {
    if curve.endless_centre().is_some() || matches!(curve, Curve::Line { .. }) {
        return Err(StepError::Geometry {
            id,
            what: "a curve without ends stands where one with ends must".into(),
        });
    }
    curve.whole(id, (0.0, 1.0))
}

/// Segments are COMPOSITE_CURVE_SEGMENT(transition, same sense, curve).
fn parts(file: &Part21, entity: &Entity, angle_unit: f64, depth: usize) -> Result<Vec<Curve3>, StepError> {
    let segment = |id: u64| {
        let segment = file.get(id)?;
        let record = match segment.only() {
            Ok(record) => record,
            Err(_) => segment.part("COMPOSITE_CURVE_SEGMENT")?,
        };
        let part = bounded(id, &nested(file, record.reference(2)?, angle_unit, depth)?.curve)?;
        Ok(if record.flag(1)? { part } else { part.reversed() })
    };
    entity.only()?.references(1)?.into_iter().map(segment).collect()
}

/// OFFSET_CURVE_3D(name, basis, distance, self-intersect, reference direction): to the side `V × T`.
fn offset(file: &Part21, entity: &Entity, angle_unit: f64, depth: usize) -> Result<Curve3, StepError> {
    let (id, r) = (entity.id, entity.only()?);
    let basis = nested(file, r.reference(1)?, angle_unit, depth)?.curve;
    let (distance, normal) = (r.number(2)?, direction(file, r.reference(4)?)?);
    let basis = bounded(id, &basis)?;
    let (curve, off) = crate::offset::curve(&basis, &normal, |_| distance).of(id)?;
    if off > WORST_CURVE_SHARE {
        return Err(StepError::Geometry { id, what: "the offset curve folds or has corners".into() });
    }
    Ok(curve)
}

fn is_spline(entity: &Entity) -> bool {
    ["B_SPLINE_CURVE", "B_SPLINE_CURVE_WITH_KNOTS", "BEZIER_CURVE", "QUASI_UNIFORM_CURVE", "UNIFORM_CURVE"]
        .iter()
        .any(|name| entity.is(name))
}

/// Any B-spline curve, simple or complex.
fn spline<const D: usize>(
    file: &Part21,
    entity: &Entity,
    read_point: impl Fn(&Part21, u64) -> Result<Point<f64, D>, StepError>,
) -> Result<NurbsCurve<D>, StepError> {
    let id = entity.id;
    // A simple instance starts with its name and holds everything; a complex one spreads it over parts.
    let simple = entity.only().ok();
    let (base, skip) = match simple {
        Some(record) => (record, 1),
        None => (entity.part("B_SPLINE_CURVE")?, 0),
    };
    let degree = base.count(skip)?;
    let points: Result<Vec<_>, _> = base.references(skip + 1)?.iter().map(|p| read_point(file, *p)).collect();
    let points = points?;
    let knots = if entity.is("B_SPLINE_CURVE_WITH_KNOTS") {
        let (record, first) = match simple {
            Some(record) => (record, 6),
            None => (entity.part("B_SPLINE_CURVE_WITH_KNOTS")?, 0),
        };
        let count = points.len().saturating_add(degree).saturating_add(1).min(2 * points.len());
        repeated(id, &record.numbers(first)?, &record.numbers(first + 1)?, count)?
    } else {
        implied_knots(entity, "CURVE", degree, points.len()).ok_or_else(|| empty(id))?
    };
    let weights = match entity.part("RATIONAL_B_SPLINE_CURVE") {
        Ok(record) => Some(record.numbers(0)?),
        Err(_) => None,
    };
    NurbsCurve::new(KnotVector::new(degree, knots).of(id)?, points, weights).of(id)
}

/// Knots written out with their multiplicities, `count` in all. A multiplicity takes a few bytes, whatever it says.
pub(super) fn repeated(
    id: u64,
    multiplicities: &[f64],
    values: &[f64],
    count: usize,
) -> Result<Vec<f64>, StepError> {
    let wrong = |what: &str| StepError::Geometry { id, what: what.into() };
    if multiplicities.len() != values.len() {
        return Err(wrong("knots and multiplicities differ in number"));
    }
    let whole = |m: &f64| m.fract() == 0.0 && (1.0..=count as f64).contains(m);
    if !multiplicities.iter().all(whole) || multiplicities.iter().sum::<f64>() > count as f64 {
        return Err(wrong("a knot multiplicity makes no sense"));
    }
    let pairs = multiplicities.iter().zip(values);
    Ok(pairs.flat_map(|(m, k)| std::iter::repeat_n(*k, *m as usize)).collect())
}

/// The knots that BEZIER_, QUASI_UNIFORM_ and UNIFORM_ curves and surfaces stand for (ISO 10303-42).
pub(super) fn implied_knots(entity: &Entity, what: &str, degree: usize, points: usize) -> Option<Vec<f64>> {
    if degree == 0 || points <= degree {
        return None;
    }
    let is = |kind: &str| entity.is(&format!("{kind}_{what}"));
    if is("UNIFORM") {
        return Some((0..points + degree + 1).map(|i| i as f64 - degree as f64).collect());
    }
    let inner = if is("BEZIER") { degree } else { 1 };
    let spans = (points - 1).checked_div(inner).filter(|s| s * inner == points - 1);
    let spans = if inner == 1 { points - degree } else { spans? };
    let mut knots = vec![0.0; degree + 1];
    knots.extend((1..spans).flat_map(|k| vec![k as f64; inner]));
    knots.extend(vec![spans as f64; degree + 1]);
    Some(knots)
}

fn empty(id: u64) -> StepError {
    StepError::Geometry { id, what: "the curve is empty".into() }
}
