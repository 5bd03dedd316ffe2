//! Curves in the digits that are written: reversed, joined and straightened without leaving them.

use claymill_nurbs::{Curve3, KnotVector, Point3};
use claymill_toolpath::{WRITTEN_STEP_MM, round_to_written};

/// Reversing mirrors the knots; rounding them again keeps the written digits.
pub(crate) fn reversed_from_zero(curve: &Curve3) -> Curve3 {
    let back = curve.reversed();
    in_written_digits(&back, 0.0).unwrap_or(back)
}

/// What of a curve without weights is between two parameters, in written digits and from parameter zero.
pub(crate) fn written_between(curve: &Curve3, [from, to]: [f64; 2]) -> Option<Curve3> {
    in_written_digits(&curve.between(from, to).filter(|part| part.weights().is_none())?, from)
}

/// The curve in written digits, its parameters from `zero` on.
fn in_written_digits(curve: &Curve3, zero: f64) -> Option<Curve3> {
    let knots = curve.knots().as_slice().iter().map(|&k| round_to_written(k - zero)).collect();
    let points = curve.points().iter().map(|p| p.map(round_to_written)).collect();
    KnotVector::new(curve.knots().degree(), knots).and_then(|knots| Curve3::new(knots, points, None)).ok()
}

/// A stretch that vanished between two others leaves a gap of a few of the written digits: they end halfway.
pub(crate) fn join(before: Option<&mut Curve3>, after: &mut Curve3) {
    let Some(before) = before else { return };
    let (a, b) = (before.points()[before.points().len() - 1], after.points()[0]);
    if a != b {
        let halfway = nalgebra::center(&a, &b).map(round_to_written);
        move_end(before, true, halfway);
        move_end(after, false, halfway);
    }
}

/// No curve is longer than its control polygon.
pub(crate) fn polygon_mm(curve: &Curve3) -> f64 {
    curve.points().windows(2).map(|w| (w[1] - w[0]).norm()).sum()
}

/// The straight way between the ends of a curve. In one so short the written digits, and ends that were moved, make
/// loops which no machine could follow at any speed.
pub(crate) fn straightened(curve: &Curve3) -> Curve3 {
    let points = curve.points();
    let (a, b) = (points[0], points[points.len() - 1]);
    let length = round_to_written((b - a).norm()).max(WRITTEN_STEP_MM);
    let line = [0.0, 1.0 / 3.0, 2.0 / 3.0, 1.0].map(|x| (a + (b - a) * x).map(round_to_written));
    one_span(line, length).unwrap_or_else(|| curve.clone())
}

/// The cubic of four control points, of which the parameter runs to `length`.
pub(crate) fn one_span(points: [Point3; 4], length: f64) -> Option<Curve3> {
    let knots = KnotVector::new(3, [[0.0; 4], [length; 4]].concat()).ok()?;
    Curve3::new(knots, points.to_vec(), None).ok()
}

/// The curve with its first or last control point at a place.
pub(crate) fn move_end(curve: &mut Curve3, last: bool, to: Point3) {
    let mut points = curve.points().to_vec();
    let index = if last { points.len() - 1 } else { 0 };
    points[index] = to;
    if let Ok(moved) = Curve3::new(curve.knots().clone(), points, None) {
        *curve = moved;
    }
}
