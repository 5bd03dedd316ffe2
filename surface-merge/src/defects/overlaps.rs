//! Faces that lie on each other.

use std::sync::OnceLock;

use claymill_nurbs::{Aabb, ClosestPoints, Domain, Face, FaceId, Model, Point3, Vector3};
use rayon::prelude::*;

use super::{Defect, DefectCode, GAP_MM};

/// Inner points of a face that are looked at, in each direction.
const GRID: usize = 4;
/// Areas that differ by less than this part are the same.
const SAME_AREA: f64 = 1e-4;
/// Cosine of the angle between normals of faces that lie on each other: 5°.
const PARALLEL: f64 = 0.996;

/// A face on its own, for exact distances.
struct Lone {
    model: Model,
    bounds: Aabb,
}

pub(super) fn of(model: &Model, areas_mm2: &[f64]) -> Vec<Defect> {
    let lone: Vec<Lone> = (model.faces.par_iter())
        .map(|face| Lone {
            bounds: hull(face),
            model: Model { faces: vec![face.clone()], ..Model::default() },
        })
        .collect();
    let indexes: Vec<OnceLock<ClosestPoints<'_>>> = lone.iter().map(|_| OnceLock::new()).collect();
    let mut by_left: Vec<FaceId> = (0..lone.len()).collect();
    by_left.sort_by(|a, b| lone[*a].bounds.min.x.total_cmp(&lone[*b].bounds.min.x).then(a.cmp(b)));
    let widest = lone.iter().map(|l| l.bounds.max.x - l.bounds.min.x).fold(0.0, f64::max);
    let overlapped = |id: FaceId| -> Vec<Defect> {
        let points = inner_points(&model.faces[id]);
        let reach = Aabb::of(points.iter().map(|p| &p.0)).inflated(GAP_MM);
        let first = by_left.partition_point(|k| lone[*k].bounds.min.x < reach.min.x - widest);
        let last = by_left.partition_point(|k| lone[*k].bounds.min.x <= reach.max.x);
        let mut found = Vec::new();
        for &other in &by_left[first.min(last)..last] {
            if other == id || apart(&lone[other].bounds, &reach) {
                continue;
            }
            let lies_on = |(p, normal): &&(Point3, Vector3)| {
                if lone[other].bounds.distance_squared(p) > GAP_MM * GAP_MM {
                    return false;
                }
                let index = indexes[other].get_or_init(|| ClosestPoints::new(&lone[other].model));
                // Faces that pierce each other are no overlap.
                index.closest(p, GAP_MM).is_some_and(|foot| {
                    let there = model.faces[other].surface.normal(foot.u, foot.v);
                    there.is_some_and(|n| n.0.dot(normal).abs() > PARALLEL)
                })
            };
            let near: Vec<_> = points.iter().filter(lies_on).collect();
            let Some((at, _)) = near.first() else { continue };
            let same =
                near.len() == points.len() && (areas_mm2[id] / areas_mm2[other] - 1.0).abs() < SAME_AREA;
            let (code, size) =
                if same { (DefectCode::Duplicate, areas_mm2[id]) } else { (DefectCode::Overlap, GAP_MM) };
            let faces = vec![id.min(other), id.max(other)];
            found.push(Defect { code, faces, at: *at, size });
        }
        found
    };
    let mut found: Vec<Defect> = (0..model.faces.len()).into_par_iter().flat_map_iter(overlapped).collect();
    // Either face finds the other.
    found.sort_by(|a, b| a.faces.cmp(&b.faces).then(a.code.cmp(&b.code)));
    found.dedup_by(|later, first| later.faces == first.faces);
    found
}

fn apart(a: &Aabb, b: &Aabb) -> bool {
    (0..3).any(|k| a.min[k] > b.max[k] || a.max[k] < b.min[k])
}

/// A box around the control points: no point of the face lies outside.
fn hull(face: &Face) -> Aabb {
    Aabb::of(&face.surface.net().iter().map(|h| Point3::from(h.xyz() / h.w)).collect::<Vec<_>>())
}

/// Points of the face, with its normals, that are clear of its boundary: touching neighbours are no overlap.
fn inner_points(face: &Face) -> Vec<(Point3, Vector3)> {
    let domain = Domain::new(face);
    let ((u0, u1), (v0, v1)) = if face.loops.is_empty() { face.surface.domain() } else { window(face) };
    let step = (1.0 / GRID as f64).min(0.25) * 0.5;
    let mut points = Vec::new();
    for i in 0..GRID {
        for j in 0..GRID {
            let (x, y) = ((i as f64 + 0.5) / GRID as f64, (j as f64 + 0.5) / GRID as f64);
            let at = |x: f64, y: f64| (u0 + (u1 - u0) * x, v0 + (v1 - v0) * y);
            let inside = |x: f64, y: f64| {
                let (u, v) = at(x, y);
                domain.contains(u, v)
            };
            // In narrow faces even the middle is near the boundary: then nothing is certain.
            let (u, v) = at(x, y);
            let p = face.surface.point(u, v);
            let clear = [(step, 0.0), (-step, 0.0), (0.0, step), (0.0, -step)].iter().all(|(dx, dy)| {
                let (u, v) = at(x + 0.9 * dx, y + 0.9 * dy);
                inside(x + 0.9 * dx, y + 0.9 * dy) && (face.surface.point(u, v) - p).norm() > 10.0 * GAP_MM
            });
            if let Some((normal, _)) = face.surface.normal(u, v).filter(|_| clear) {
                points.push((p, normal));
            }
        }
    }
    points
}

/// The rectangle around the trim loops.
fn window(face: &Face) -> ((f64, f64), (f64, f64)) {
    let inf = f64::INFINITY;
    let mut range = ((inf, -inf), (inf, -inf));
    for p in face.loops.iter().flat_map(|l| &l.edges).flat_map(|e| e.pcurve.points()) {
        range.0 = (range.0.0.min(p.x), range.0.1.max(p.x));
        range.1 = (range.1.0.min(p.y), range.1.1.max(p.y));
    }
    let ((u0, u1), (v0, v1)) = face.surface.domain();
    ((range.0.0.max(u0), range.0.1.min(u1)), (range.1.0.max(v0), range.1.1.min(v1)))
}
