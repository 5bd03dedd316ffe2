//! The triangle nearest to a point, by a box hierarchy, and the point at which a ball is drawn:
//! contact while it cuts, tip when it is away.

use claymill_nurbs::{Aabb, Point3, Vector3, nearest_on_triangle};

use crate::shapes::SurfaceMesh;

/// Triangles under one leaf.
const LEAF: usize = 4;
/// Beyond this many ball radii from its centre a surface has nothing to do with a move.
const REACH_RADII: f64 = 3.0;

/// The triangles of a scene, to be found by distance.
///
/// ```text
///   corners   sorted so that every branch is a range; the halves of a range are its children
///   boxes     heap order, the root is 1
/// ```
pub(crate) struct TriangleTree {
    corners: Vec<[[f32; 3]; 3]>,
    boxes: Vec<Aabb>,
    leaves: usize,
}

impl TriangleTree {
    /// Sorts the triangles by halving along the longest side.
    pub(crate) fn new(surfaces: &[SurfaceMesh]) -> Self {
        let place = |s: &SurfaceMesh, i: u32| s.vertices[i as usize].position;
        let of_surface = |s| move |t: &[u32]| [place(s, t[0]), place(s, t[1]), place(s, t[2])];
        let mut corners: Vec<[[f32; 3]; 3]> =
            surfaces.iter().flat_map(|s| s.indices.chunks_exact(3).map(of_surface(s))).collect();
        let leaves = corners.len().div_ceil(LEAF).max(1).next_power_of_two();
        let mut boxes = vec![Aabb::empty(); 2 * leaves];
        sort(&mut corners, leaves);
        let count = corners.len();
        for leaf in 0..leaves {
            for p in corners[leaf * count / leaves..(leaf + 1) * count / leaves].iter().flatten() {
                boxes[leaves + leaf].add(&double(p));
            }
        }
        for node in (1..leaves).rev() {
            boxes[node] = boxes[2 * node].union(&boxes[2 * node + 1]);
        }
        TriangleTree { corners, boxes, leaves }
    }

    /// The point of the triangles nearest to `p` and nearer than `reach_mm`.
    pub(crate) fn nearest(&self, p: &Point3, reach_mm: f64) -> Option<Point3> {
        let (mut best2, mut best) = (reach_mm * reach_mm, None);
        let mut waiting = vec![(1, distance2(&self.boxes[1], p))];
        while let Some((node, box2)) = waiting.pop() {
            if box2 >= best2 {
                continue;
            }
            if node < self.leaves {
                let mut children = [2 * node, 2 * node + 1].map(|n| (n, distance2(&self.boxes[n], p)));
                if children[0].1 < children[1].1 {
                    children.swap(0, 1);
                }
                waiting.extend(children);
                continue;
            }
            let (leaf, n) = (node - self.leaves, self.corners.len());
            for triangle in &self.corners[leaf * n / self.leaves..(leaf + 1) * n / self.leaves] {
                let q = nearest_on_triangle(p, triangle.each_ref().map(double));
                let d2 = (q - p).norm_squared();
                if d2 < best2 {
                    (best2, best) = (d2, Some(q));
                }
            }
        }
        best
    }

    /// Where a ball of `radius_mm` at this tip is drawn: at the point of the ball nearest to the surface,
    /// which is the contact point while it cuts. A tip itself is inside the surface on every slope. As the
    /// ball leaves the surface the point moves over to the tip, so that retracts hang together with cuts.
    pub(crate) fn touched(&self, tip: &Point3, axis: &Vector3, radius_mm: f64) -> Point3 {
        let centre = tip + axis * radius_mm;
        let Some(foot) = self.nearest(&centre, REACH_RADII * radius_mm) else {
            return *tip;
        };
        let way = foot - centre;
        let distance = way.norm();
        if distance <= radius_mm {
            return foot;
        }
        let on_ball = centre + way * (radius_mm / distance);
        let gone = (distance - radius_mm) / ((REACH_RADII - 1.0) * radius_mm);
        on_ball + (tip - on_ball) * gone
    }
}

fn double(p: &[f32; 3]) -> Point3 {
    Point3::from(p.map(f64::from))
}

/// Distributes the triangles over so many leaves.
fn sort(corners: &mut [[[f32; 3]; 3]], leaves: usize) {
    // The ranges are the whole's, so that they are those that `nearest` reads.
    fn halve(corners: &mut [[[f32; 3]; 3]], first: usize, count: usize, of: [usize; 2]) {
        if count < 2 {
            return;
        }
        let [leaves, total] = of;
        let thrice_middle = |t: &[[f32; 3]; 3], axis: usize| t[0][axis] + t[1][axis] + t[2][axis];
        let spread = |axis: usize| {
            let all = corners.iter().map(|t| thrice_middle(t, axis));
            all.clone().fold(f32::NEG_INFINITY, f32::max) - all.fold(f32::INFINITY, f32::min)
        };
        let spreads = [0, 1, 2].map(spread);
        let axis = (0..3).max_by(|&a, &b| spreads[a].total_cmp(&spreads[b])).unwrap_or(0);
        let split = (first + count / 2) * total / leaves - first * total / leaves;
        if split > 0 && split < corners.len() {
            corners.select_nth_unstable_by(split, |s, t| {
                thrice_middle(s, axis).total_cmp(&thrice_middle(t, axis))
            });
        }
        let (low, high) = corners.split_at_mut(split);
        rayon::join(|| halve(low, first, count / 2, of), || halve(high, first + count / 2, count / 2, of));
    }
    let total = corners.len();
    halve(corners, 0, leaves, [leaves, total]);
}

fn distance2(b: &Aabb, p: &Point3) -> f64 {
    if b.is_empty() {
        return f64::INFINITY;
    }
    (0..3).map(|i| (b.min[i] - p[i]).max(p[i] - b.max[i]).max(0.0).powi(2)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shapes::SurfaceVertex;

    /// A height field over a square of 100 mm: `z(x, y)` on a grid of 2 mm.
    fn field(z: impl Fn(f64, f64) -> f64) -> SurfaceMesh {
        let n = 51_u32;
        let vertex = |k: u32| {
            let (x, y) = (2.0 * f64::from(k / n), 2.0 * f64::from(k % n));
            SurfaceVertex {
                position: [x as f32, y as f32, z(x, y) as f32],
                normal: [0.0, 0.0, 1.0],
                colour: [255; 4],
            }
        };
        let quads = (0..n - 1).flat_map(|i| (0..n - 1).map(move |j| i * n + j));
        let indices = quads.flat_map(|a| [a, a + n, a + n + 1, a, a + n + 1, a + 1]).collect();
        SurfaceMesh { vertices: (0..n * n).map(vertex).collect(), indices }
    }

    #[test]
    fn finds_what_a_linear_search_finds() {
        let mesh = field(|x, y| 10.0 * (x / 17.0).sin() * (y / 11.0).cos());
        let tree = TriangleTree::new(std::slice::from_ref(&mesh));
        for k in 0..200 {
            let t = f64::from(k);
            let p = Point3::new((t * 7.3) % 110.0 - 5.0, (t * 3.7) % 110.0 - 5.0, (t * 1.9) % 40.0 - 20.0);
            let nearest = |best: f64, t: &[u32]| {
                let corner = |i: u32| double(&mesh.vertices[i as usize].position);
                let q = nearest_on_triangle(&p, [corner(t[0]), corner(t[1]), corner(t[2])]);
                best.min((q - p).norm())
            };
            let slow = mesh.indices.chunks_exact(3).fold(f64::INFINITY, nearest);
            let fast = tree.nearest(&p, 100.0).map(|q| (q - p).norm());
            approx::assert_abs_diff_eq!(fast.unwrap(), slow, epsilon = 1e-12);
        }
    }

    #[test]
    fn a_cutting_ball_is_drawn_where_it_touches_and_a_retracted_one_at_its_tip() {
        let slope = 1.0_f64;
        let tree = TriangleTree::new(&[field(|x, _| slope * x)]);
        let radius = 10.0;
        let normal = Vector3::new(-slope, 0.0, 1.0).normalize();
        let contact = Point3::new(50.0, 50.0, 50.0);
        let tip = contact + normal * radius - Vector3::z() * radius;
        let inside = (tip - contact).dot(&normal);
        approx::assert_abs_diff_eq!(inside, radius * (1.0 - normal.z), epsilon = 1e-9);
        let drawn = tree.touched(&tip, &Vector3::z(), radius);
        approx::assert_abs_diff_eq!(drawn, contact, epsilon = 1e-5);
        // On the way up: no jump, never inside, and at last the tip itself.
        let mut last = drawn;
        for k in 1..=400 {
            let lifted = tip + Vector3::z() * (0.1 * f64::from(k));
            let drawn = tree.touched(&lifted, &Vector3::z(), radius);
            assert!((drawn - last).norm() < 0.3, "a jump of {}", (drawn - last).norm());
            assert!((drawn - contact).dot(&normal) > -1e-4, "inside the surface");
            last = drawn;
        }
        assert_eq!(last, tip + Vector3::z() * 40.0);
    }

    #[test]
    fn an_empty_scene_leaves_the_tip_where_it_is() {
        let tip = Point3::new(1.0, 2.0, 3.0);
        assert_eq!(TriangleTree::new(&[]).touched(&tip, &Vector3::z(), 10.0), tip);
    }
}
