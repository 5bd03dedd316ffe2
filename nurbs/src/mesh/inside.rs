//! Whether points are inside of a closed mesh, and how far away its surface is.

use std::ops::ControlFlow;

use super::ClosedMesh;
use crate::box_tree::BoxTree;
use crate::{Aabb, Point3, Vector3};

/// Way of the rays whose crossings are counted: along nothing that bodies have.
const RAY: [f64; 3] = [0.4271, 0.2859, 0.8578];

/// A closed mesh that was prepared for questions.
#[derive(Debug)]
pub struct Inside<'m> {
    mesh: &'m ClosedMesh,
    tree: BoxTree,
}

impl<'m> Inside<'m> {
    /// Sorts the triangles.
    #[must_use]
    pub fn new(mesh: &'m ClosedMesh) -> Self {
        let boxes: Vec<Aabb> =
            mesh.triangles.iter().map(|t| Aabb::of(&t.map(|i| mesh.points[i as usize]))).collect();
        Inside { mesh, tree: BoxTree::new(&boxes) }
    }

    fn corners(&self, triangle: usize) -> [Point3; 3] {
        self.mesh.triangles[triangle].map(|i| self.mesh.points[i as usize])
    }

    /// Distance of a point from the surface, mm; infinite if it is farther than `within_mm`.
    #[must_use]
    pub fn distance_mm(&self, p: &Point3, within_mm: f64) -> f64 {
        let mut best = within_mm * within_mm;
        self.tree.nearest_first(
            p,
            &mut best,
            |best| *best,
            |best, k| {
                *best = best.min((nearest_on_triangle(p, self.corners(k)) - p).norm_squared());
            },
        );
        if best < within_mm * within_mm { best.sqrt() } else { f64::INFINITY }
    }

    /// Whether a point is inside: a ray from it leaves more often than it enters. On the surface it is not defined.
    #[must_use]
    pub fn contains(&self, p: &Point3) -> bool {
        let way = Vector3::from(RAY);
        let mut crossings = 0;
        self.tree.visit(
            |boxes| boxes.each(|b| meets_ray(b, p, &way)),
            |k| {
                let [a, b, c] = self.corners(k).map(|q| q - p);
                // Twice the areas of the triangles that the ray makes with the sides, as seen along it.
                let seen = [b.cross(&c).dot(&way), c.cross(&a).dot(&way), a.cross(&b).dot(&way)];
                let is_met = seen.iter().all(|v| *v >= 0.0) || seen.iter().all(|v| *v < 0.0);
                let volume = a.dot(&b.cross(&c));
                crossings +=
                    u32::from(is_met && volume.is_sign_positive() == (seen.iter().sum::<f64>() > 0.0));
                ControlFlow::Continue(())
            },
        );
        crossings % 2 == 1
    }
}

fn meets_ray(b: &Aabb, p: &Point3, way: &Vector3) -> bool {
    let [mut from, mut to] = [0.0f64, f64::INFINITY];
    for k in 0..3 {
        let [one, other] = [(b.min[k] - p[k]) / way[k], (b.max[k] - p[k]) / way[k]];
        from = from.max(one.min(other));
        to = to.min(one.max(other));
    }
    from <= to
}

/// The nearest point of a triangle: inside, if the foot on its plane is, else on one of its sides.
#[must_use]
pub fn nearest_on_triangle(p: &Point3, [a, b, c]: [Point3; 3]) -> Point3 {
    let (u, v, w) = (b - a, c - a, p - a);
    let (uu, uv, vv, uw, vw) = (u.dot(&u), u.dot(&v), v.dot(&v), u.dot(&w), v.dot(&w));
    let determinant = uu * vv - uv * uv;
    if determinant > 1e-12 * uu * vv {
        let (s, t) = ((vv * uw - uv * vw) / determinant, (uu * vw - uv * uw) / determinant);
        if s >= 0.0 && t >= 0.0 && s + t <= 1.0 {
            return a + u * s + v * t;
        }
    }
    let on_side = |from: Point3, to: Point3| {
        let d = to - from;
        let length2 = d.norm_squared();
        let t = if length2 > 0.0 { ((p - from).dot(&d) / length2).clamp(0.0, 1.0) } else { 0.0 };
        from + d * t
    };
    let sides = [on_side(a, b), on_side(b, c), on_side(c, a)];
    let nearer = |x: Point3, y: Point3| if (y - p).norm_squared() < (x - p).norm_squared() { y } else { x };
    nearer(nearer(sides[0], sides[1]), sides[2])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A cube of 10 mm with a corner at the origin.
    fn cube() -> ClosedMesh {
        let points: Vec<Point3> = Aabb::of_corners([0.0, 0.0, 0.0, 10.0, 10.0, 10.0]).vertices().to_vec();
        let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        let triangles = quads.into_iter().flat_map(|[a, b, c, d]: [u32; 4]| [[a, b, c], [a, c, d]]);
        ClosedMesh { points, triangles: triangles.collect(), deviation_mm: 0.0 }
    }

    #[test]
    fn a_cube_contains_what_is_between_its_sides() {
        let cube = cube();
        approx::assert_abs_diff_eq!(cube.volume_mm3(), 1000.0, epsilon = 1e-9);
        let inside = Inside::new(&cube);
        for k in 0..1000 {
            let at = |n: u32| f64::from(k * n % 997) / 997.0 * 14.0 - 2.0;
            let p = Point3::new(at(131), at(257), at(419));
            let expected = p.iter().all(|c| (0.0..10.0).contains(c));
            let aside = p.iter().map(|c| (c - 10.0).max(-c)).fold(f64::MIN, f64::max);
            if aside.abs() > 1e-9 {
                assert_eq!(inside.contains(&p), expected, "{p}");
            }
            let out = p.iter().map(|c| (c - 10.0).max(-c).max(0.0).powi(2)).sum::<f64>().sqrt();
            let distance_mm = if expected { -aside } else { out };
            approx::assert_abs_diff_eq!(inside.distance_mm(&p, 100.0), distance_mm, epsilon = 1e-9);
        }
        assert_eq!(inside.distance_mm(&Point3::new(-5.0, 5.0, 5.0), 4.9), f64::INFINITY);
    }
}
