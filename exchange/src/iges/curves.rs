//! Curve entities as NURBS.

use std::f64::consts::TAU;

use claymill_nurbs::analytic::{self, Frame};
use claymill_nurbs::{Curve2, Curve3, KnotVector, NurbsError, Point2, Point3, Vector3};
use nalgebra::Matrix2;

use crate::arc_length::ArcLength;
use crate::offset::WORST_CURVE_SHARE;
use crate::subcurve::subcurve;

use super::fault::Fault;
use super::file::{File, Record};
use super::placement::Placement;

/// Composite curves nest no deeper than this.
const DEEPEST: usize = 16;
/// Parameters at the ends may differ from the knots by rounding, relative to the domain.
const SAME_PARAMETER: f64 = 1e-9;

/// The pieces of curve `de` in order, mapped by `placement`.
pub(crate) fn read(file: &File, de: i64, placement: &Placement) -> Result<Vec<Curve3>, Fault> {
    let mut pieces = Vec::new();
    collect(file, de, placement, DEEPEST, &mut pieces)?;
    Ok(pieces)
}

/// The pieces of a curve in a surface's parameter plane.
pub(crate) fn read_flat(file: &File, de: i64) -> Result<Vec<Curve2>, Fault> {
    let flat = |c: &Curve3| {
        let points = c.points().iter().map(|p| Point2::new(p.x, p.y)).collect();
        Curve2::new(c.knots().clone(), points, c.weights().map(<[f64]>::to_vec))
    };
    read(file, de, &Placement::scale(1.0))?
        .iter()
        .map(|c| flat(c).map_err(|source| Fault::Nurbs { de, source }))
        .collect()
}

fn collect(
    file: &File,
    de: i64,
    placement: &Placement,
    depth: usize,
    pieces: &mut Vec<Curve3>,
) -> Result<(), Fault> {
    let entry = file.entry(de)?;
    let placement = placement.of_entity(file, de)?;
    let mut record = file.record(de)?;
    if entry.kind == 102 {
        if depth == 0 {
            return Err(Fault::Nested { de });
        }
        for part in record.pointers()? {
            // Points and connect points may stand between the curves.
            if !matches!(file.entry(part)?.kind, 116 | 132) {
                collect(file, part, &placement, depth - 1, pieces)?;
            }
        }
        return Ok(());
    }
    if entry.kind == 130 {
        let parts = offset(file, &mut record, depth)?;
        let image = |c: &Curve3| placed(c, &placement).map_err(|source| Fault::Nurbs { de, source });
        pieces.extend(parts.iter().map(image).collect::<Result<Vec<_>, _>>()?);
        return Ok(());
    }
    let curve = match entry.kind {
        100 => arc(&mut record)?,
        104 => conic(&mut record)?,
        106 => polyline(&mut record, entry.form)?,
        110 => Some(line(&mut record)?),
        112 => Some(parametric_spline(&mut record)?),
        126 => Some(b_spline(&mut record)?),
        kind => return Err(Fault::Unsupported { de, kind }),
    };
    if let Some(curve) = curve {
        pieces.push(placed(&curve, &placement).map_err(|source| Fault::Nurbs { de, source })?);
    }
    Ok(())
}

/// The curve mapped by `placement`.
fn placed(curve: &Curve3, placement: &Placement) -> Result<Curve3, NurbsError> {
    let points = curve.points().iter().map(|p| placement.point(*p)).collect();
    Curve3::new(curve.knots().clone(), points, curve.weights().map(<[f64]>::to_vec))
}

fn plane(z: f64, origin: Point2, x: Vector3) -> Result<Frame, Fault> {
    Frame::new(Point3::new(origin.x, origin.y, z), Vector3::z(), x).ok_or(Fault::NoArea)
}

/// 100: anticlockwise from start to end; a whole circle where they meet. `None` for a point.
fn arc(record: &mut Record) -> Result<Option<Curve3>, Fault> {
    let [z, cx, cy, x0, y0, x1, y1] = record.reals()?;
    let frame = plane(z, Point2::new(cx, cy), Vector3::x())?;
    let radius = (x0 - cx).hypot(y0 - cy);
    // The file's own parameter: its angle from zero on.
    let from = (y0 - cy).atan2(x0 - cx).rem_euclid(TAU);
    let chord = (x1 - x0).hypot(y1 - y0);
    let to = if chord <= 1e-9 * radius { from } else { (y1 - cy).atan2(x1 - cx).rem_euclid(TAU) };
    let to = if to > from { to } else { to + TAU };
    if radius == 0.0 {
        return Ok(None);
    }
    let sound = analytic::circle_arc(&frame, radius, (from, to));
    sound.map(Some).map_err(|source| Fault::Nurbs { de: record.de, source })
}

/// 104: `a x² + b x y + c y² + d x + e y + f = 0` from start to end.
fn conic(record: &mut Record) -> Result<Option<Curve3>, Fault> {
    let de = record.de;
    let [a, b, c, d, e, f, z, x0, y0, x1, y1] = record.reals()?;
    let (start, end) = (Point2::new(x0, y0), Point2::new(x1, y1));
    let form = Matrix2::new(a, 0.5 * b, 0.5 * b, c);
    let determinant = form.determinant();
    let nurbs = |source| Fault::Nurbs { de, source };
    if determinant > 1e-12 * form.norm_squared() {
        // An ellipse: x'ᵀ M x' = k about the centre, anticlockwise.
        let gradient = nalgebra::Vector2::new(d, e);
        let centre = form.try_inverse().map(|m| Point2::from(m * gradient * -0.5));
        let centre = centre.ok_or(Fault::NoArea)?;
        let k = -(f + 0.5 * gradient.dot(&centre.coords));
        let eigen = (form / k).symmetric_eigen();
        if eigen.eigenvalues.iter().any(|l| l.is_nan() || *l <= 0.0) {
            let what = "the conic arc has no points";
            return Err(Fault::Geometry { de, what });
        }
        let [p, q] = [eigen.eigenvalues[0].sqrt().recip(), eigen.eigenvalues[1].sqrt().recip()];
        let axis = eigen.eigenvectors.column(0);
        let frame = plane(z, centre, Vector3::new(axis[0], axis[1], 0.0))?;
        let angle = |at: Point2| {
            let l = frame.local(&Point3::new(at.x, at.y, z));
            (l.y / q).atan2(l.x / p)
        };
        let (from, to) = (angle(start), angle(end));
        let closed = (end - start).norm() <= 1e-9 * p.max(q);
        let to = match (closed, to > from) {
            (true, _) => from + TAU,
            (false, true) => to,
            (false, false) => to + TAU,
        };
        return analytic::ellipse_arc(&frame, p, q, (from, to)).map(Some).map_err(nurbs);
    }
    if (end - start).norm() == 0.0 {
        return Ok(None);
    }
    // A parabola or hyperbola: one rational quadratic. In homogeneous coordinates the end tangents meet at the
    // pole of the chord; with the quadratic form q and its bilinear form, w² = -q(P0, P2) / (2 q(P1, P1)).
    let quadric = nalgebra::Matrix3::new(a, 0.5 * b, 0.5 * d, 0.5 * b, c, 0.5 * e, 0.5 * d, 0.5 * e, f);
    let lift = |p: Point2| nalgebra::Vector3::new(p.x, p.y, 1.0);
    let (p0, p2) = (lift(start), lift(end));
    let pole = (quadric * p0).cross(&(quadric * p2));
    let what = "the conic arc's ends have no common tangent point";
    if pole.z.abs() <= f64::EPSILON * pole.norm() {
        return Err(Fault::Geometry { de, what });
    }
    let p1 = pole / pole.z;
    let square = -p0.dot(&(quadric * p2)) / (2.0 * p1.dot(&(quadric * p1)));
    if square.is_nan() || square <= 0.0 {
        return Err(Fault::Geometry { de, what });
    }
    let points = [p0, p1, p2].map(|p| Point3::new(p.x, p.y, z)).to_vec();
    let weights = vec![1.0, square.sqrt(), 1.0];
    Curve3::new(KnotVector::clamped_uniform(2, 3), points, Some(weights)).map(Some).map_err(nurbs)
}

/// 106, forms 1–3, 11–13 and 63: points joined by lines. `None` for fewer than two distinct points.
fn polyline(record: &mut Record, form: i64) -> Result<Option<Curve3>, Fault> {
    let de = record.de;
    if !matches!(form, 1..=3 | 11..=13 | 63) {
        return Err(Fault::Unsupported { de, kind: 106 });
    }
    let kind = record.integer()?;
    let count = record.count()?;
    let z = if kind == 1 { record.real()? } else { 0.0 };
    let mut points = record.required(count, |r| match kind {
        1 => r.reals().map(|[x, y]| Point3::new(x, y, z)),
        2 => r.reals().map(|[x, y, z]| Point3::new(x, y, z)),
        _ => r.reals().map(|[x, y, z, _, _, _]| Point3::new(x, y, z)),
    })?;
    points.dedup();
    if points.len() < 2 {
        return Ok(None);
    }
    let knots = KnotVector::clamped_uniform(1, points.len());
    Curve3::new(knots, points, None).map(Some).map_err(|source| Fault::Nurbs { de, source })
}

/// 110.
fn line(record: &mut Record) -> Result<Curve3, Fault> {
    let [a, b, c, d, e, f] = record.reals()?;
    Ok(Curve3::line(Point3::new(a, b, c), Point3::new(d, e, f)))
}

/// 112: cubic polynomials in the distance from their break point, as Bézier pieces.
fn parametric_spline(record: &mut Record) -> Result<Curve3, Fault> {
    let de = record.de;
    record.skip(3)?;
    let segments = record.count()?;
    let breaks = record.required(segments + 1, Record::real)?;
    let coefficients = record.required(segments, Record::reals::<12>)?;
    let mut points = Vec::new();
    for (span, c) in breaks.windows(2).zip(&coefficients) {
        let h = span[1] - span[0];
        let axis = |k: usize| {
            bezier_from_powers([c[4 * k], c[4 * k + 1] * h, c[4 * k + 2] * h * h, c[4 * k + 3] * h * h * h])
        };
        let [x, y, z] = [axis(0), axis(1), axis(2)];
        let first = usize::from(!points.is_empty());
        points.extend((first..4).map(|i| Point3::new(x[i], y[i], z[i])));
    }
    let nurbs = |source| Fault::Nurbs { de, source };
    let knots = bezier_knots(&breaks).map_err(nurbs)?;
    Curve3::new(knots, points, None).map_err(nurbs)
}

/// Bernstein coefficients of `a + b t + c t² + d t³` on `[0, 1]`.
pub(crate) fn bezier_from_powers([a, b, c, d]: [f64; 4]) -> [f64; 4] {
    [a, a + b / 3.0, a + (2.0 * b + c) / 3.0, a + b + c + d]
}

/// Cubic knots with triple inner breaks.
pub(crate) fn bezier_knots(breaks: &[f64]) -> Result<KnotVector, NurbsError> {
    let mut knots: Vec<f64> = breaks.iter().flat_map(|b| [*b; 3]).collect();
    if let (Some(first), Some(last)) = (breaks.first(), breaks.last()) {
        knots.insert(0, *first);
        knots.push(*last);
    }
    KnotVector::new(3, knots)
}

/// 130: a curve at a constant distance from another, or at one that changes evenly, to the side `V × T`.
fn offset(file: &File, record: &mut Record, depth: usize) -> Result<Vec<Curve3>, Fault> {
    let de = record.de;
    let nurbs = |source| Fault::Nurbs { de, source };
    let depth = depth.checked_sub(1).ok_or(Fault::Nested { de })?;
    let (base, rule) = (record.integer()?, record.integer()?);
    record.skip(2)?;
    let by_length = record.integer()? != 2;
    let [d1, t1, d2, t2, x, y, z, from, to] = record.reals()?;
    let mut bases = Vec::new();
    collect(file, base, &Placement::scale(1.0), depth, &mut bases)?;
    // Lines and B-splines run by the file's own parameter; for others only the whole curve is certain.
    let own_parameter = matches!(file.entry(base)?.kind, 110 | 112 | 126);
    if let ([only], true, true) = (bases.as_mut_slice(), own_parameter, to > from) {
        let (low, high) = only.domain();
        if from > low || to < high {
            *only = subcurve(only, from.max(low), to.min(high)).map_err(nurbs)?;
        }
    }
    let normal = Vector3::new(x, y, z).try_normalize(0.0);
    let what = "the offset curve's plane has no normal";
    let normal = normal.ok_or(Fault::Geometry { de, what })?;
    let image = |(curve, deviation): (Curve3, f64)| {
        let what = "the offset curve folds or has corners";
        if deviation > WORST_CURVE_SHARE { Err(Fault::Geometry { de, what }) } else { Ok(curve) }
    };
    match (rule, bases.as_slice()) {
        (1, _) => {
            let parallel =
                |c: &Curve3| crate::offset::curve(c, &normal, |_| d1).map_err(nurbs).and_then(image);
            bases.iter().map(parallel).collect()
        }
        (2, [only]) => {
            let lengths = ArcLength::new(only);
            let at = |t: f64| {
                let s = if by_length { lengths.share(t) * lengths.total() } else { t };
                d1 + (d2 - d1) * (s - t1) / (t2 - t1)
            };
            let tapered = crate::offset::curve(only, &normal, at).map_err(nurbs)?;
            Ok(vec![image(tapered)?])
        }
        _ => Err(Fault::Unsupported { de, kind: 130 }),
    }
}

/// 126, cut to its parameter range.
fn b_spline(record: &mut Record) -> Result<Curve3, Fault> {
    let de = record.de;
    let upper = record.count()?;
    let degree = record.count()?;
    record.skip(4)?;
    let knots = record.required(upper + degree + 2, Record::real)?;
    let weights = record.required(upper + 1, Record::real)?;
    let points = record.required(upper + 1, |r| r.reals().map(|[x, y, z]| Point3::new(x, y, z)))?;
    let [t0, t1] = record.reals()?;
    let nurbs = |source| Fault::Nurbs { de, source };
    let knots = KnotVector::new(degree, level(knots)).map_err(nurbs)?;
    let whole = Curve3::new(knots, points, Some(weights)).map_err(nurbs)?;
    let (a, b) = whole.domain();
    let slack = SAME_PARAMETER * (b - a);
    // An omitted or reversed range means the whole curve.
    if t1 - t0 > slack && (t0 > a + slack || t1 < b - slack) {
        return subcurve(&whole, t0.clamp(a, b), t1.clamp(a, b)).map_err(nurbs);
    }
    Ok(whole)
}

/// Knots of which writers let the last digits decrease, levelled.
pub(crate) fn level(mut knots: Vec<f64>) -> Vec<f64> {
    let range = knots.last().zip(knots.first()).map_or(0.0, |(b, a)| b - a);
    for i in 1..knots.len() {
        if knots[i] < knots[i - 1] && knots[i - 1] - knots[i] <= SAME_PARAMETER * range {
            knots[i] = knots[i - 1];
        }
    }
    knots
}
