//! Places in triangles of the plane, and triangles in space.

use claymill_nurbs::{FaceMesh, Point2, Vector3};

/// The area of a triangle of a mesh, mm², along its normal on the side of `Su × Sv`.
pub(crate) fn area_vector(mesh: &FaceMesh, triangle: &[u32; 3]) -> Vector3 {
    let [a, b, c] = triangle.map(|i| mesh.points[i as usize]);
    let [p, q, r] = triangle.map(|i| mesh.uv[i as usize]);
    0.5 * (b - a).cross(&(c - a)) * (q - p).perp(&(r - p)).signum()
}

/// Whether a place is in a triangle, or on its sides.
pub(crate) fn contains(corners: &[Point2; 3], p: Point2) -> bool {
    let [a, b, c] = corners.map(|q| q - p);
    let turns = [a.perp(&b), b.perp(&c), c.perp(&a)];
    turns.iter().all(|t| *t >= 0.0) || turns.iter().all(|t| *t <= 0.0)
}
