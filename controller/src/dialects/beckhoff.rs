//! B-splines of the ISG kernel: control points as linear blocks between `#SPLINE ON` and `#SPLINE OFF`, uniform
//! clamped knots, no weights. Each piece is written with five points, more than the four that are needed.

use claymill_nurbs::{Curve3, KnotVector, Point3};
use std::fmt::Write as _;

use super::Page;
use crate::Refusal;
use crate::lower::Splines;

const FEWEST_POINTS: usize = 4;
const MOST_POINTS: usize = 10_000;

pub(crate) fn splines() -> Splines {
    Splines {
        pieces: true,
        degrees: [3, 3],
        weights: None,
        weight_digits: 0,
        knot_digits: 6,
        largest_knot: 1e6,
        planes: None,
        max_points: 5,
        exact_points: false,
        first_weight_one: false,
        halved: true,
        biarcs: false,
    }
}

pub(crate) fn write(out: &mut String, page: &Page, curve: &Curve3, rate: Option<&str>) {
    out.push_str("#SPLINE ON\n");
    for (i, p) in curve.points().iter().enumerate().skip(1) {
        let _ = write!(out, "G1 {}", page.xyz(p));
        if let (1, Some(rate)) = (i, rate) {
            let _ = write!(out, " {rate}");
        }
        out.push('\n');
    }
    out.push_str("#SPLINE OFF\n");
}

/// The curve of the points between `#SPLINE ON` and `#SPLINE OFF`, the position before them first.
pub(crate) fn close(points: Vec<Point3>) -> Result<Curve3, Refusal> {
    let n = points.len();
    if !(FEWEST_POINTS..=MOST_POINTS).contains(&n) {
        return Err(Refusal::new(
            "beckhoff-points",
            format!(
                "{n} control points between #SPLINE ON and #SPLINE OFF; at least {FEWEST_POINTS} are needed"
            ),
        ));
    }
    Curve3::new(KnotVector::clamped_uniform(3, n), points, None)
        .map_err(|e| Refusal::new("beckhoff-curve", e.to_string()))
}
