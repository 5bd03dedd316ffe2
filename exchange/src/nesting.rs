//! Which trim loops are outer loops, which are holes, and which say nothing at all; and surfaces that enclose
//! nothing.

use claymill_nurbs::{NurbsSurface, Point2, TrimEdge, TrimLoop, turn_by_nesting};

use crate::trim::{TrimError, pace};

/// A loop this near to the sides of the domain is the natural boundary, mm.
const NATURAL_MM: f64 = 1e-6;
/// Chords per knot span when areas are compared.
const SAMPLES: usize = 6;

/// Signed area of a loop in the parameter plane, from `SAMPLES` chords a span.
fn signed_area(trim: &TrimLoop) -> f64 {
    let ring = polygon(trim);
    let next = ring.iter().cycle().skip(1);
    // Relative to the first point: far windows would lose digits.
    let Some(o) = ring.first() else { return 0.0 };
    let cross = ring.iter().zip(next).map(|(a, b)| (a - o).perp(&(b - o)));
    0.5 * cross.sum::<f64>()
}

fn polygon(trim: &TrimLoop) -> Vec<Point2> {
    let along = |e: &TrimEdge| -> Vec<Point2> {
        let breaks = e.pcurve.knots().breaks();
        let count = if e.pcurve.knots().degree() == 1 { 1 } else { SAMPLES };
        breaks
            .windows(2)
            .flat_map(|w| (0..count).map(move |i| w[0] + (w[1] - w[0]) * i as f64 / count as f64))
            .map(|t| e.pcurve.point(t))
            .collect()
    };
    trim.edges.iter().flat_map(along).collect()
}

/// Turns outer loops anticlockwise and holes clockwise, whatever the file says: a loop inside an odd number of
/// others is a hole. Loops without area are dropped.
///
/// # Errors
/// No loop encloses any area.
pub(crate) fn orient(surface: &NurbsSurface, loops: Vec<TrimLoop>) -> Result<Vec<TrimLoop>, TrimError> {
    let [pace_u, pace_v] = pace(surface);
    let sizable = |l: &TrimLoop| signed_area(l).abs() * pace_u * pace_v > crate::DEGENERATE_MM2;
    let mut sized: Vec<TrimLoop> = loops.into_iter().filter(sizable).collect();
    if sized.is_empty() {
        return Err(TrimError::NoArea);
    }
    turn_by_nesting(&mut sized);
    Ok(sized)
}

/// Whether the loops say no more than that the face is the whole surface: one loop along the four sides.
pub(crate) fn is_natural(surface: &NurbsSurface, loops: &[TrimLoop]) -> bool {
    let [only] = loops else { return false };
    let ((u0, u1), (v0, v1)) = surface.domain();
    let [pace_u, pace_v] = pace(surface);
    let at = |x: f64, side: f64, pace: f64| (x - side).abs() * pace <= NATURAL_MM;
    let on_side = |e: &TrimEdge| {
        let points = e.pcurve.points();
        points.iter().all(|p| at(p.x, u0, pace_u))
            || points.iter().all(|p| at(p.x, u1, pace_u))
            || points.iter().all(|p| at(p.y, v0, pace_v))
            || points.iter().all(|p| at(p.y, v1, pace_v))
    };
    // Edges on the sides and the area of the rectangle: the loop goes once round.
    let whole = (u1 - u0) * (v1 - v0);
    only.edges.iter().all(on_side) && (signed_area(only).abs() - whole).abs() <= 1e-6 * whole
}

/// Whether the control net, and with it the surface, encloses no area.
pub(crate) fn has_no_area(surface: &NurbsSurface) -> bool {
    let (nu, nv) = surface.size();
    let cell = |i: usize, j: usize| {
        let p = |i, j| surface.control_point(i, j);
        let (a, b) = (p(i + 1, j + 1) - p(i, j), p(i, j + 1) - p(i + 1, j));
        a.cross(&b).norm()
    };
    let cells = (0..nu - 1).flat_map(|i| (0..nv - 1).map(move |j| (i, j)));
    let area: f64 = cells.map(|(i, j)| 0.5 * cell(i, j)).sum();
    area < crate::DEGENERATE_MM2
}
