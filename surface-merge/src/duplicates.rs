//! Faces that are there more than once.

use std::collections::BTreeMap;

use claymill_nurbs::{Domain, Face, FaceId, Model, Point3, Vector3};
use serde::{Deserialize, Serialize};

use crate::disjoint_sets::DisjointSets;
use crate::edge::Edge;
use crate::lone::LoneFaces;
use crate::matching::Run;

/// A face that lies on another one, boundary on boundary.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Duplicate {
    /// The face that counts: the first of those that are the same.
    pub original: FaceId,
    /// The face that does not: it belongs to the region of the original and has no joints.
    pub copy: FaceId,
    /// `Su × Sv` points to the same side on both.
    pub normals_agree: bool,
}

/// Inner points of a face that are compared, in each direction.
const GRID: usize = 5;

/// Copies among the faces: pairs whose boundaries run along each other on their whole length, and whose
/// insides are within the tolerance (the two halves of a lens share their boundary only).
pub(crate) fn find(
    model: &Model,
    edges: &[Edge<'_>],
    runs: &[Run],
    lone: &LoneFaces<'_>,
    tolerance_mm: f64,
) -> Vec<Duplicate> {
    let mut boundary = vec![(0.0, 0.0); model.faces.len()];
    for edge in edges {
        boundary[edge.face].0 += edge.length_mm();
        // A run may fall short of either end of an edge by the tolerance.
        boundary[edge.face].1 += 2.0 * tolerance_mm;
    }
    let mut shared: BTreeMap<[FaceId; 2], [f64; 2]> = BTreeMap::new();
    for run in runs {
        let on = [(run.a, run.on_a), (run.b, run.on_b)];
        let mut sides = on.map(|(edge, [t0, t1])| {
            let edge = &edges[edge];
            (edge.face, (edge.arc_length(t1) - edge.arc_length(t0)).abs())
        });
        sides.sort_by_key(|s| s.0);
        if sides[0].0 != sides[1].0 {
            let sums = shared.entry(sides.map(|s| s.0)).or_default();
            (0..2).for_each(|k| sums[k] += sides[k].1);
        }
    }
    let mut sets = DisjointSets::new(model.faces.len());
    let mut found = Vec::new();
    for (faces, lengths) in shared {
        let whole = (0..2).all(|k| {
            let (length, slack) = boundary[faces[k]];
            lengths[k] >= length - slack
        });
        if whole && sets.root(faces[0]) != sets.root(faces[1]) {
            let [original, copy] = faces;
            if let Some(normals_agree) = lies_on(&model.faces[copy], original, model, lone, tolerance_mm) {
                sets.join(original, copy);
                found.push(Duplicate { original, copy, normals_agree });
            }
        }
    }
    // Of three that are the same, two are copies of the first.
    found.iter_mut().for_each(|d| d.original = sets.root(d.original));
    found
}

/// Whether all inner points of `face` lie on `other`, and if so whether the normals agree.
fn lies_on(
    face: &Face,
    other: FaceId,
    model: &Model,
    lone: &LoneFaces<'_>,
    tolerance_mm: f64,
) -> Option<bool> {
    let mut agreement = 0.0;
    for (p, normal) in inner_points(face) {
        let foot = lone.closest(other, &p, tolerance_mm)?;
        if let Some((there, _)) = model.faces[other].surface.normal(foot.u, foot.v) {
            agreement += normal.dot(&there);
        }
    }
    (agreement != 0.0).then_some(agreement > 0.0)
}

fn inner_points(face: &Face) -> Vec<(Point3, Vector3)> {
    let domain = Domain::new(face);
    let ((u0, u1), (v0, v1)) = face.surface.domain();
    let at = |k: usize| (k as f64 + 0.5) / GRID as f64;
    let grid = (0..GRID * GRID).map(|k| (u0 + (u1 - u0) * at(k / GRID), v0 + (v1 - v0) * at(k % GRID)));
    grid.filter(|&(u, v)| domain.contains(u, v))
        .filter_map(|(u, v)| face.surface.normal(u, v).map(|n| (face.surface.point(u, v), n.0)))
        .collect()
}
