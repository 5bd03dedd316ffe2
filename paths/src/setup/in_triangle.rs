//! Places in triangles of the plane.

use claymill_nurbs::Point2;

/// Whether a place is in a triangle, or on its sides.
pub(crate) fn contains(corners: &[Point2; 3], p: Point2) -> bool {
    let [a, b, c] = corners.map(|q| q - p);
    let turns = [a.perp(&b), b.perp(&c), c.perp(&a)];
    turns.iter().all(|t| *t >= 0.0) || turns.iter().all(|t| *t <= 0.0)
}
