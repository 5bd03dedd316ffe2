//! The model in a setup's frame as triangles with known deviations, and a ball with its shank
//! lowered on them. Results are bounds. It is written apart from the planner's drop cutter.

use std::ops::ControlFlow;

use claymill_nurbs::{Aabb, BoxTree, FaceId, Point3, Vector3};
use nalgebra::Matrix3;
use rayon::prelude::*;

use crate::mesh::Mesh;

/// Facets steeper than this (cosine against the axis) are met by their edges only.
const VERTICAL: f64 = 1e-9;

/// The model as one setup sees it: triangles in a frame whose z is the tool axis, on which a ball with its
/// shank above can be lowered.
///
/// ```text
///        │   │ shank          highest(x, y, r) = height of the ball's centre when
///        │ ● │ ball r         the tool comes down on the triangles; the shank is as
///         ╲_╱                 thick as the ball, so whatever lies in the column
///     ───────────── mesh      stops it
/// ```
///
/// The surface lies within a known deviation of each triangle: a tool thicker by that amount on the triangle
/// bounds the tool on the surface from above, a thinner one from below.
#[derive(Debug)]
pub(crate) struct DropMesh<'a> {
    to_frame: Matrix3<f64>,
    points: Vec<Point3>,
    mesh: &'a Mesh,
    tree: BoxTree,
    worst_deviation: f64,
}

impl<'a> DropMesh<'a> {
    /// Turns the mesh so that `axis` (a unit vector from tip to holder) is up.
    pub(crate) fn new(mesh: &'a Mesh, axis: &Vector3) -> Self {
        let aside = if axis.x.abs() < 0.6 { Vector3::x() } else { Vector3::y() };
        let x = aside.cross(axis).normalize();
        let y = axis.cross(&x);
        let to_frame = Matrix3::from_rows(&[x.transpose(), y.transpose(), axis.transpose()]);
        let points: Vec<Point3> = mesh.points.par_iter().map(|p| to_frame * p).collect();
        let boxes: Vec<Aabb> =
            mesh.triangles.par_iter().map(|t| Aabb::of(t.iter().map(|&i| &points[i as usize]))).collect();
        DropMesh {
            to_frame,
            points,
            mesh,
            tree: BoxTree::new(&boxes),
            worst_deviation: f64::from(mesh.deviation_mm.iter().fold(0.0, |a: f32, b| a.max(*b))),
        }
    }

    /// `p` in the setup's frame.
    pub(crate) fn in_frame(&self, p: &Point3) -> Point3 {
        self.to_frame * p
    }

    /// Largest distance of a surface from its triangles, mm.
    pub(crate) fn worst_deviation_mm(&self) -> f64 {
        self.worst_deviation
    }

    /// A point of the frame in model coordinates.
    pub(crate) fn in_model(&self, p: &Point3) -> Point3 {
        self.to_frame.tr_mul(&p.coords).into()
    }

    /// The face that a triangle is of, and its number there; `None` for obstacles.
    pub(crate) fn face_of(&self, triangle: usize) -> Option<(FaceId, usize)> {
        self.mesh.face_of(triangle)
    }

    /// A box around a face in the frame.
    pub(crate) fn face_box(&self, face: FaceId) -> Aabb {
        self.mesh.face_box_of(face, &self.points)
    }

    /// Calls `item` for every triangle in boxes that are `wanted`, until it breaks.
    pub(crate) fn visit(
        &self,
        mut wanted: impl FnMut(&Aabb) -> bool,
        item: impl FnMut(usize) -> ControlFlow<()>,
    ) {
        self.tree.visit(|boxes| boxes.each(&mut wanted), item);
    }

    /// Distance of the surface from a triangle at most, mm.
    pub(crate) fn deviation(&self, triangle: usize) -> f64 {
        f64::from(self.mesh.deviation_mm[triangle])
    }

    /// Corners of a triangle in the frame.
    pub(crate) fn corners(&self, triangle: usize) -> [Point3; 3] {
        self.mesh.triangles[triangle].map(|i| self.points[i as usize])
    }

    /// Whether a tool of this radius whose ball centre is at `centre` (in the frame) surely enters the model.
    pub(crate) fn blocks(&self, centre: &Point3, radius: f64) -> bool {
        self.stops(centre, radius, |triangle| radius - self.deviation(triangle))
    }

    /// Whether a tool of this radius at `centre` (in the frame) enters an obstacle.
    pub(crate) fn obstacles_block(&self, centre: &Point3, radius: f64) -> bool {
        self.stops(centre, radius, |triangle| if self.face_of(triangle).is_none() { radius } else { 0.0 })
    }

    /// Whether a pin of this radius whose end is about `end` (in the frame) meets the triangles themselves.
    pub(crate) fn screens(&self, end: &Point3, radius: f64) -> bool {
        self.stops(end, radius, |_| radius)
    }

    /// Whether a tool enters a triangle, where its radius depends on the triangle.
    fn stops(&self, centre: &Point3, largest: f64, radius: impl Fn(usize) -> f64) -> bool {
        let mut stopped = false;
        self.visit(
            |b| b.max.z + largest > centre.z && column_distance_squared(b, centre) < largest * largest,
            |i| {
                let r = radius(i);
                stopped =
                    r > 0.0 && lowered(&self.corners(i), centre.x, centre.y, r).is_some_and(|z| z > centre.z);
                if stopped { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
            },
        );
        stopped
    }

    /// An upper bound of the height of the ball's centre when the tool is lowered at the place of `at` (in
    /// the frame), if there is anything below or above it.
    pub(crate) fn highest(&self, at: &Point3, radius: f64) -> Option<f64> {
        let best = std::cell::Cell::new(f64::NEG_INFINITY);
        let thick = radius + self.worst_deviation;
        self.visit(
            |b| b.max.z + thick > best.get() && column_distance_squared(b, at) < thick * thick,
            |i| {
                if let Some(z) = lowered(&self.corners(i), at.x, at.y, radius + self.deviation(i)) {
                    best.set(best.get().max(z));
                }
                ControlFlow::Continue(())
            },
        );
        best.get().is_finite().then(|| best.get())
    }

    /// An upper bound of the model's height within `radius` beside the straight line from `a` to `b`
    /// (in the frame), seen along the axis.
    pub(crate) fn top_along(&self, a: &Point3, b: &Point3, radius: f64) -> Option<f64> {
        let best = std::cell::Cell::new(f64::NEG_INFINITY);
        self.visit(
            |bounds| bounds.max.z > best.get() && passes_over(bounds, a, b, radius),
            |i| {
                let bounds = Aabb::of(&self.corners(i));
                if passes_over(&bounds, a, b, radius) {
                    best.set(best.get().max(bounds.max.z));
                }
                ControlFlow::Continue(())
            },
        );
        best.get().is_finite().then(|| best.get())
    }
}

/// Squared distance of the box from the vertical line through `p`.
fn column_distance_squared(b: &Aabb, p: &Point3) -> f64 {
    let dx = (b.min.x - p.x).max(p.x - b.max.x).max(0.0);
    let dy = (b.min.y - p.y).max(p.y - b.max.y).max(0.0);
    dx * dx + dy * dy
}

/// Whether the line from `a` to `b`, seen from above, crosses the box grown by `margin`.
fn passes_over(bounds: &Aabb, a: &Point3, b: &Point3, margin: f64) -> bool {
    let (mut enter, mut leave) = (0.0_f64, 1.0_f64);
    for axis in 0..2 {
        let (from, step) = (a[axis], b[axis] - a[axis]);
        let (low, high) = (bounds.min[axis] - margin, bounds.max[axis] + margin);
        if step == 0.0 {
            if from < low || from > high {
                return false;
            }
            continue;
        }
        let (s, t) = ((low - from) / step, (high - from) / step);
        enter = enter.max(s.min(t));
        leave = leave.min(s.max(t));
    }
    enter <= leave
}

/// Height of the centre of a ball of radius `r` lowered at `(x, y)` onto a triangle; `None` when it passes
/// beside it.
fn lowered(triangle: &[Point3; 3], x: f64, y: f64, r: f64) -> Option<f64> {
    let [a, b, c] = triangle;
    let facet = on_facet(a, b, c, x, y, r);
    // Where the facet itself is met, its rim is lower.
    facet.or_else(|| {
        let edges = [(a, b), (b, c), (c, a)];
        let heights = edges.iter().flat_map(|(a, b)| [on_vertex(a, x, y, r), on_edge(a, b, x, y, r)]);
        heights.flatten().reduce(f64::max)
    })
}

fn on_vertex(a: &Point3, x: f64, y: f64, r: f64) -> Option<f64> {
    let rest = r * r - (a.x - x).powi(2) - (a.y - y).powi(2);
    (rest >= 0.0).then(|| a.z + rest.sqrt())
}

/// In the vertical plane through the edge the ball is a circle of radius `rho` lowered onto a sloped line.
fn on_edge(a: &Point3, b: &Point3, x: f64, y: f64, r: f64) -> Option<f64> {
    let d = b - a;
    let length = d.x.hypot(d.y);
    if length <= VERTICAL * r {
        return None;
    }
    let (ux, uy) = (d.x / length, d.y / length);
    let along = (x - a.x) * ux + (y - a.y) * uy;
    let beside = (y - a.y) * ux - (x - a.x) * uy;
    let rest = r * r - beside * beside;
    if rest < 0.0 {
        return None;
    }
    let rho = rest.sqrt();
    let slope = d.z / length;
    let stretch = slope.hypot(1.0);
    // Uphill of the centre.
    let contact = along + rho * slope / stretch;
    (0.0..=length).contains(&contact).then(|| a.z + slope * along + rho * stretch)
}

fn on_facet(a: &Point3, b: &Point3, c: &Point3, x: f64, y: f64, r: f64) -> Option<f64> {
    let n = (b - a).cross(&(c - a));
    let size = n.norm();
    if n.z.abs() <= VERTICAL * size {
        return None;
    }
    let n = n * (n.z.signum() / size);
    let (px, py) = (x - r * n.x, y - r * n.y);
    let turn = |p: &Point3, q: &Point3| (q.x - p.x) * (py - p.y) - (q.y - p.y) * (px - p.x);
    let turns = [turn(a, b), turn(b, c), turn(c, a)];
    let inside = turns.iter().all(|t| *t >= 0.0) || turns.iter().all(|t| *t <= 0.0);
    inside.then(|| a.z + (r - n.x * (x - a.x) - n.y * (y - a.y)) / n.z)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Two slopes of angle `a` that meet in a valley along y at x = 0.
    fn v_groove(a: f64) -> Mesh {
        let (w, h) = (50.0, 50.0 * a.tan());
        let at = |x: f64, y: f64, z: f64| Point3::new(x, y, z);
        let points = vec![
            at(0.0, -50.0, 0.0),
            at(0.0, 50.0, 0.0),
            at(w, -50.0, h),
            at(w, 50.0, h),
            at(-w, -50.0, h),
            at(-w, 50.0, h),
        ];
        Mesh {
            triangles: vec![[0, 2, 3], [0, 3, 1], [0, 5, 4], [0, 1, 5]],
            points,
            deviation_mm: vec![0.0; 4],
            ..Mesh::default()
        }
    }

    #[test]
    fn the_groove_of_the_textbook() {
        let mesh = v_groove(30f64.to_radians());
        let drop = DropMesh::new(&mesh, &Vector3::z());
        let at = |x: f64| drop.highest(&drop.in_frame(&Point3::new(x, 0.3, 0.0)), 10.0).unwrap();
        approx::assert_abs_diff_eq!(at(0.0), 11.547_005_383_8, epsilon = 1e-9);
        for x in [-20.0, -6.0, 4.0, 15.0_f64] {
            let expected = x.abs() * 30f64.to_radians().tan() + 10.0 / 30f64.to_radians().cos();
            approx::assert_abs_diff_eq!(at(x), expected, epsilon = 1e-9);
        }
    }

    #[test]
    fn edges_and_vertices_carry_the_ball() {
        let mesh = Mesh {
            points: vec![
                Point3::new(0.0, 0.0, 5.0),
                Point3::new(20.0, 0.0, 5.0),
                Point3::new(0.0, 20.0, 5.0),
            ],
            triangles: vec![[0, 1, 2]],
            deviation_mm: vec![0.0],
            ..Mesh::default()
        };
        let drop = DropMesh::new(&mesh, &Vector3::z());
        let at = |x: f64, y: f64| drop.highest(&drop.in_frame(&Point3::new(x, y, 0.0)), 10.0);
        approx::assert_abs_diff_eq!(at(3.0, 3.0).unwrap(), 15.0, epsilon = 1e-12);
        approx::assert_abs_diff_eq!(at(3.0, -6.0).unwrap(), 13.0, epsilon = 1e-12);
        approx::assert_abs_diff_eq!(at(-6.0, -6.0).unwrap(), 5.0 + 28f64.sqrt(), epsilon = 1e-12);
        assert_eq!(at(-8.0, -8.0), None);
    }

    proptest! {
        #[test]
        fn any_triangle_stops_the_ball_where_its_points_do(corners in [0.0..8.0, 0.0..8.0, 0.0..8.0, 0.0..8.0, 0.0..8.0, 0.0..8.0, 0.0..8.0, 0.0..8.0, 0.0..8.0], x in -4.0..12.0, y in -4.0..12.0) {
            let corner = |i: usize| Point3::new(corners[3 * i], corners[3 * i + 1], corners[3 * i + 2]);
            let triangle = [corner(0), corner(1), corner(2)];
            let r = 3.0;
            let fine = 300;
            let (p, q) = (triangle[1] - triangle[0], triangle[2] - triangle[0]);
            let mut by_points: Option<f64> = None;
            for i in 0..=fine {
                for j in 0..=fine - i {
                    let at = triangle[0] + (p * f64::from(i) + q * f64::from(j)) / f64::from(fine);
                    if let Some(z) = on_vertex(&at, x, y, r) {
                        by_points = Some(by_points.map_or(z, |best| best.max(z)));
                    }
                }
            }
            let exact = lowered(&triangle, x, y, r);
            if let Some(found) = by_points {
                let exact = exact.expect("points of the triangle are met");
                prop_assert!(exact >= found - 1e-9);
                // Where the flank of the ball is met, height depends on the root of the distance.
                prop_assert!(exact - found < 0.5, "{exact} but the points give {found}");
            }
        }
    }

    #[test]
    fn any_axis_gives_the_same_heights() {
        let mesh = v_groove(0.4);
        let axis = Vector3::new(0.3, -0.5, 0.8).normalize();
        let turn = nalgebra::Rotation3::rotation_between(&Vector3::z(), &axis).unwrap();
        let turned = Mesh {
            points: mesh.points.iter().map(|p| turn * p).collect(),
            triangles: mesh.triangles.clone(),
            deviation_mm: mesh.deviation_mm.clone(),
            ..Mesh::default()
        };
        let (straight, oblique) = (DropMesh::new(&mesh, &Vector3::z()), DropMesh::new(&turned, &axis));
        for x in [-30.0, -2.0, 0.0, 7.0] {
            let p = Point3::new(x, 1.0, 2.0);
            let expected = straight.highest(&straight.in_frame(&p), 4.0).unwrap();
            let q = oblique.in_frame(&(turn * p));
            let found = oblique.highest(&q, 4.0).unwrap();
            approx::assert_abs_diff_eq!(found, expected, epsilon = 1e-9);
            let rest = Point3::new(q.x, q.y, found);
            assert!(oblique.blocks(&(rest - Vector3::z() * 1e-6), 4.0));
            assert!(!oblique.blocks(&(rest + Vector3::z() * 1e-6), 4.0));
        }
    }
}
