//! How much of all directions each side of a sheet sees past the model: rays from sampled places
//! against all triangles.

use std::ops::ControlFlow;

use claymill_nurbs::{Aabb, BoxTree, FaceId, FaceMesh, Point3, Vector3};
use rayon::prelude::*;

use super::hanging::Group;

/// Directions that are looked in, spread evenly.
const DIRECTIONS: usize = 96;
/// Directions nearer to the surface than this (sine) tell nothing: the triangles are flat, the surface is not.
const GRAZING: f64 = 0.05;
/// Places on a whole model that is looked from, and on a sheet at least and at most.
const PLACES: f64 = 4096.0;
const PLACES_ON_SHEET: (usize, usize) = (24, 768);

/// All triangles of a model, to look past.
pub(super) struct Sight {
    triangles: Vec<[Point3; 3]>,
    /// Of each face the first.
    first: Vec<usize>,
    tree: BoxTree,
    directions: Vec<Vector3>,
    size_mm: f64,
    area_mm2: f64,
}

/// A place on a sheet.
struct Spot {
    triangle: usize,
    at: Point3,
    /// On the side that is looked at first.
    normal: Vector3,
}

impl Sight {
    pub(super) fn new(meshes: &[FaceMesh]) -> Self {
        let of_mesh = |mesh: &FaceMesh| mesh.triangles.len();
        let mut first = Vec::with_capacity(meshes.len() + 1);
        first.push(0);
        meshes.iter().for_each(|mesh| first.push(first[first.len() - 1] + of_mesh(mesh)));
        let triangles: Vec<[Point3; 3]> = meshes.iter().flat_map(corners).collect();
        let boxes: Vec<Aabb> = triangles.iter().map(Aabb::of).collect();
        let bounds = boxes.iter().fold(Aabb::empty(), |all, b| all.union(b));
        Sight {
            tree: BoxTree::new(&boxes),
            area_mm2: triangles.iter().map(|t| double_area(t).norm() * 0.5).sum(),
            size_mm: if bounds.is_empty() { 0.0 } else { bounds.diagonal() },
            directions: directions(),
            triangles,
            first,
        }
    }

    /// Shares of the directions in which one sees past everything, from the side of the first face's `Su × Sv` and from the other,
    /// on the mean of a group of faces.
    pub(super) fn sees_out(&self, group: &Group) -> [f64; 2] {
        let spots = self.spots(&group.faces, &group.turned);
        if spots.is_empty() {
            return [0.0; 2];
        }
        let seen: Vec<[f64; 2]> = spots.par_iter().map(|spot| self.relative_to(spot)).collect();
        [0, 1].map(|side| seen.iter().map(|s| s[side]).sum::<f64>() / spots.len() as f64)
    }

    /// Places that each stand for the same area.
    fn spots(&self, faces: &[FaceId], turned: &[bool]) -> Vec<Spot> {
        let triangles = || {
            faces.iter().zip(turned).flat_map(|(&face, &turned)| {
                (self.first[face]..self.first[face + 1]).map(move |k| (k, if turned { -1.0 } else { 1.0 }))
            })
        };
        let area_mm2 = |k: usize| 0.5 * double_area(&self.triangles[k]).norm();
        let all_mm2: f64 = triangles().map(|(k, _)| area_mm2(k)).sum();
        if all_mm2 <= 0.0 {
            return Vec::new();
        }
        let (least, most) = PLACES_ON_SHEET;
        let count = ((PLACES * all_mm2 / self.area_mm2).ceil() as usize).clamp(least, most);
        let (mut spots, mut covered_mm2) = (Vec::with_capacity(count), 0.0);
        for (k, side) in triangles() {
            covered_mm2 += area_mm2(k);
            while spots.len() < count
                && (spots.len() as f64 + 0.5) * all_mm2 <= covered_mm2 * count as f64
                && let Some(normal) = double_area(&self.triangles[k]).try_normalize(0.0)
            {
                // Anywhere inside, and never in the same place of two triangles.
                let turn = |ratio: f64| (0.5 + ratio * spots.len() as f64).fract();
                let (mut s, mut r) = (turn(0.754_877_666), turn(0.569_840_291));
                if s + r > 1.0 {
                    (s, r) = (1.0 - s, 1.0 - r);
                }
                let [a, b, c] = self.triangles[k];
                let at = a + (b - a) * s + (c - a) * r;
                spots.push(Spot { triangle: k, at, normal: normal * side });
            }
        }
        spots
    }

    fn relative_to(&self, spot: &Spot) -> [f64; 2] {
        let (mut out, mut looked) = ([0usize; 2], [0usize; 2]);
        for direction in &self.directions {
            let cosine = direction.dot(&spot.normal);
            if cosine.abs() < GRAZING {
                continue;
            }
            let side = usize::from(cosine < 0.0);
            looked[side] += 1;
            out[side] += usize::from(!self.is_hidden(spot, direction));
        }
        [0, 1].map(|side| out[side] as f64 / looked[side].max(1) as f64)
    }

    /// Whether anything but its own triangle stands in front of a place.
    fn is_hidden(&self, spot: &Spot, direction: &Vector3) -> bool {
        let mut hidden = false;
        let visit = |item: usize| {
            hidden = item != spot.triangle && is_crossed(&self.triangles[item], &spot.at, direction);
            if hidden { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        };
        self.tree.visit(|boxes| boxes.each(|b| meets(b, &spot.at, direction, self.size_mm)), visit);
        hidden
    }
}

fn corners(mesh: &FaceMesh) -> impl Iterator<Item = [Point3; 3]> {
    mesh.triangles.iter().map(|t| t.map(|i| mesh.points[i as usize]))
}

fn double_area([a, b, c]: &[Point3; 3]) -> Vector3 {
    (b - a).cross(&(c - a))
}

/// A spiral over the sphere, turned so that none lies along an axis or a plane of symmetry.
fn directions() -> Vec<Vector3> {
    let golden = std::f64::consts::PI * (3.0 - 5.0_f64.sqrt());
    let turn = nalgebra::Rotation3::from_euler_angles(0.31, 0.47, 0.83);
    let at = |k: usize| {
        let z = 1.0 - (2.0 * k as f64 + 1.0) / DIRECTIONS as f64;
        let (r, angle) = ((1.0 - z * z).sqrt(), golden * k as f64);
        turn * Vector3::new(r * angle.cos(), r * angle.sin(), z)
    };
    (0..DIRECTIONS).map(at).collect()
}

/// Whether a line from `from` along a unit vector passes through a triangle.
fn is_crossed([a, b, c]: &[Point3; 3], from: &Point3, along: &Vector3) -> bool {
    let (ab, ac) = (b - a, c - a);
    let p = along.cross(&ac);
    let determinant = ab.dot(&p);
    if determinant == 0.0 {
        return false;
    }
    let to = from - a;
    let s = to.dot(&p) / determinant;
    let q = to.cross(&ab);
    let t = along.dot(&q) / determinant;
    s >= 0.0 && t >= 0.0 && s + t <= 1.0 && ac.dot(&q) / determinant > 0.0
}

/// Whether a line along a unit vector meets a box.
fn meets(b: &Aabb, from: &Point3, along: &Vector3, length_mm: f64) -> bool {
    let (mut start, mut end) = (0.0f64, length_mm);
    for axis in 0..3 {
        let (low, high) = (b.min[axis] - from[axis], b.max[axis] - from[axis]);
        if along[axis].abs() < f64::MIN_POSITIVE {
            if low > 0.0 || high < 0.0 {
                return false;
            }
            continue;
        }
        let (x, y) = (low / along[axis], high / along[axis]);
        (start, end) = (start.max(x.min(y)), end.min(x.max(y)));
    }
    start <= end * (1.0 + 1e-12)
}
