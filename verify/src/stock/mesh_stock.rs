//! Stock as a closed triangle mesh: inside is where the surface winds about a point.
//!
//! Winding is counted by the crossings of a ray, with their senses. A ray that passes an edge too near to tell is
//! replaced by another; no direction of them is parallel to what workpieces have.

use std::collections::BTreeMap;
use std::ops::ControlFlow;

use claymill_nurbs::{Aabb, Point3, Vector3};
use rayon::prelude::*;

use super::error::{StockError, placed};
use super::tree::Tree;
use crate::obstacles::closest_on_triangle;

/// Directions of rays, tried in turn.
const RAYS: [[f64; 3]; 7] = [
    [0.4271, 0.2859, 0.8578],
    [-0.6113, 0.3571, 0.7063],
    [0.1913, -0.8231, 0.5347],
    [0.7351, 0.6143, -0.2866],
    [-0.3319, -0.5237, -0.7846],
    [0.9041, -0.1787, 0.3882],
    [-0.2239, 0.9187, -0.3254],
];
/// Crossings nearer to an edge than this part of the triangle's size in view are in doubt.
const DOUBTFUL: f64 = 1e-11;

/// A closed mesh.
pub(super) struct MeshStock {
    /// In the order of the tree.
    triangles: Vec<[Point3; 3]>,
    tree: Tree,
    bounds: Aabb,
}

impl MeshStock {
    pub(super) fn new(points: &[Point3], triangles: &[[u32; 3]]) -> Result<Self, StockError> {
        if triangles.is_empty() {
            return Err(StockError::Empty("mesh"));
        }
        for p in points {
            placed("vertex of the stock, mm,", p.coords.as_slice())?;
        }
        let welded = weld(points);
        let mut corners = Vec::with_capacity(triangles.len());
        let mut edges: BTreeMap<[u32; 2], i32> = BTreeMap::new();
        for (k, t) in triangles.iter().enumerate() {
            if t.iter().any(|&i| i as usize >= points.len()) {
                return Err(StockError::Vertex { triangle: k });
            }
            let t = t.map(|i| welded[i as usize]);
            if t[0] == t[1] || t[1] == t[2] || t[2] == t[0] {
                continue;
            }
            for [a, b] in [[t[0], t[1]], [t[1], t[2]], [t[2], t[0]]] {
                *edges.entry([a.min(b), a.max(b)]).or_default() += if a < b { 1 } else { -1 };
            }
            corners.push(t.map(|i| points[i as usize]));
        }
        let open_edges = edges.values().filter(|n| **n != 0).count();
        if open_edges > 0 {
            return Err(StockError::OpenMesh { open_edges });
        }
        if corners.is_empty() {
            return Err(StockError::Empty("mesh"));
        }
        let boxes: Vec<Aabb> = corners.par_iter().map(Aabb::of).collect();
        let bounds = boxes.iter().fold(Aabb::empty(), |all, b| all.union(b));
        let (tree, order) = Tree::new(&boxes, &vec![0; boxes.len()]);
        Ok(MeshStock { triangles: order.into_iter().map(|i| corners[i as usize]).collect(), tree, bounds })
    }

    pub(super) fn bounds(&self) -> Aabb {
        self.bounds
    }

    pub(super) fn contains(&self, p: &Point3) -> bool {
        if self.bounds.distance_squared(p) > 0.0 {
            return false;
        }
        let mut last = 0;
        for ray in RAYS {
            let (winding, in_doubt) = self.winding(p, &Vector3::from(ray).normalize());
            last = winding;
            if !in_doubt {
                break;
            }
        }
        last != 0
    }

    pub(super) fn signed_mm(&self, p: &Point3) -> f64 {
        let away = |i: usize| (closest_on_triangle(&self.triangles[i], p) - p).norm();
        let distance =
            self.tree.least(p, [0.0, f64::INFINITY], 1, away).map_or(f64::INFINITY, |found| found.0);
        if self.contains(p) { -distance } else { distance }
    }

    /// How often the mesh winds about `p`, by what a ray crosses, and whether a crossing is in doubt.
    fn winding(&self, p: &Point3, ray: &Vector3) -> (i32, bool) {
        let (mut winding, mut in_doubt) = (0, false);
        let along = [ray.x, ray.y, ray.z];
        self.tree.visit(
            1,
            |node| node.met(p, along, [0.0, f64::INFINITY]),
            |i| {
                let [a, b, c] = self.triangles[i].map(|q| q - p);
                // Twice the areas of the triangles that the ray makes with the sides, as seen along it.
                let seen = [b.cross(&c).dot(ray), c.cross(&a).dot(ray), a.cross(&b).dot(ray)];
                let size = a.norm_squared().max(b.norm_squared()).max(c.norm_squared());
                let (low, high) = (
                    seen.iter().fold(f64::MAX, |m, v| m.min(*v)),
                    seen.iter().fold(f64::MIN, |m, v| m.max(*v)),
                );
                let nearly_nothing = DOUBTFUL * size;
                if low < -nearly_nothing && high > nearly_nothing {
                    return ControlFlow::Continue(());
                }
                let volume = a.dot(&b.cross(&c));
                let sum: f64 = seen.iter().sum();
                // The plane is crossed where volume and sum have one sign.
                if volume.signum() == sum.signum() {
                    in_doubt |= seen.iter().any(|v| v.abs() <= nearly_nothing);
                    winding += if sum > 0.0 { 1 } else { -1 };
                }
                ControlFlow::Continue(())
            },
        );
        (winding, in_doubt)
    }
}

/// For every point the first one at its place.
fn weld(points: &[Point3]) -> Vec<u32> {
    let mut order: Vec<u32> = (0..points.len() as u32).collect();
    let key = |i: &u32| points[*i as usize];
    let compare = |a: &u32, b: &u32| {
        let (p, q) = (key(a), key(b));
        p.x.total_cmp(&q.x).then(p.y.total_cmp(&q.y)).then(p.z.total_cmp(&q.z)).then(a.cmp(b))
    };
    order.par_sort_unstable_by(compare);
    let mut first = vec![0; points.len()];
    let mut current: Option<u32> = None;
    for i in order {
        if current.is_none_or(|c| key(&c) != key(&i)) {
            current = Some(i);
        }
        first[i as usize] = current.unwrap_or(i);
    }
    first
}
