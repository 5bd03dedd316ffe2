//! Builds regions from the region label of each face: order, area, orientation, cone of normals,
//! bounds and border loops.

use std::collections::VecDeque;

use claymill_nurbs::{Aabb, Domain, Face, FaceId, KnotVector, Model, Point3, Vector3};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::account::NakedStretch;
use crate::disjoint_sets::DisjointSets;
use crate::duplicates::Duplicate;
use crate::edge::Edge;
use crate::joint::Joint;
use crate::laps::Lap;

/// Faces that are cut as one surface.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Region {
    /// Number from 0, largest area first; equal areas by place.
    pub id: usize,
    /// Its faces, ascending.
    pub faces: Vec<FaceId>,
    /// Per face: `Su × Sv` points to the other side of the region than on its largest face.
    pub flipped: Vec<bool>,
    /// Area, mm².
    pub area_mm2: f64,
    /// Number of connected pieces of its border: 1 for a sheet, 0 for a closed shell, 2 for a tube.
    pub boundary_loops: usize,
    /// Axis of the cone of normals (unit), on the side of the outside of its largest face.
    pub normal_axis: Vector3,
    /// Largest angle between a sampled normal and the axis, degrees; above 90 the region wraps around.
    pub normal_half_angle_deg: f64,
    /// Box around its borders and a grid of points on its faces (two for each knot span, both ways); the
    /// exact box of a face is [`Face::bounds`].
    pub bounds: Aabb,
}

/// What lies between and around regions.
pub(crate) struct Borders<'a> {
    pub(crate) joints: &'a [Joint],
    pub(crate) naked: &'a [NakedStretch],
    pub(crate) laps: &'a [Lap],
    pub(crate) duplicates: &'a [Duplicate],
}

/// What is measured once per face.
pub(crate) struct FaceFacts {
    pub(crate) area_mm2: f64,
    /// Box of its boundary and of the grid.
    bounds: Aabb,
    /// Unit normals `Su × Sv` on a grid.
    normals: Vec<Vector3>,
}

/// Measures the faces.
pub(crate) fn facts(model: &Model, edges: &[Edge<'_>], duplicates: &[Duplicate]) -> Vec<FaceFacts> {
    let mut facts: Vec<FaceFacts> = model.faces.par_iter().map(FaceFacts::new).collect();
    // What is there twice counts once.
    duplicates.iter().for_each(|d| facts[d.copy].area_mm2 = 0.0);
    for edge in edges {
        edge.stations.iter().for_each(|s| facts[edge.face].bounds.add(&s.point));
    }
    facts
}

/// Builds the regions from the region label of each face, largest first. Returns also the region of each
/// face.
pub(crate) fn regions(
    model: &Model,
    facts: &[FaceFacts],
    labels: &[usize],
    borders: &Borders<'_>,
    tolerance_mm: f64,
) -> (Vec<Region>, Vec<usize>) {
    let flips = flips(labels, borders, facts);
    let mut members: Vec<Vec<FaceId>> = vec![Vec::new(); labels.len()];
    for (face, &label) in labels.iter().enumerate() {
        members[label].push(face);
    }
    members.retain(|faces| !faces.is_empty());
    let mut regions: Vec<Region> =
        members.into_par_iter().map(|faces| Region::new(model, faces, facts, &flips)).collect();
    // Rounded, so that mirror twins compare by place whatever the order of summation.
    let rounded = |x: f64, step: f64| (x / step).round();
    regions.sort_by(|a, b| {
        let key = |r: &Region| {
            let c = r.bounds.centre();
            [rounded(-r.area_mm2, 1e-3), rounded(c.x, 1e-3), rounded(c.y, 1e-3), rounded(c.z, 1e-3)]
        };
        key(a)
            .iter()
            .zip(key(b))
            .map(|(x, y)| x.total_cmp(&y))
            .find(|o| o.is_ne())
            .unwrap_or(a.faces.cmp(&b.faces))
    });
    let mut of_face = vec![0; labels.len()];
    for (id, region) in regions.iter_mut().enumerate() {
        region.id = id;
        region.faces.iter().for_each(|&f| of_face[f] = id);
    }
    count_loops(&mut regions, &of_face, borders, tolerance_mm);
    (regions, of_face)
}

impl FaceFacts {
    fn new(face: &Face) -> Self {
        let ((u0, u1), (v0, v1)) = face.surface.domain();
        let domain = (!face.loops.is_empty()).then(|| Domain::new(face));
        let (rows, columns) = (grid_size(face.surface.knots_u()), grid_size(face.surface.knots_v()));
        let at = |k: usize, of: usize| (k as f64 + 0.5) / of as f64;
        let (mut bounds, mut normals) = (Aabb::empty(), Vec::with_capacity(rows * columns));
        for k in 0..rows * columns {
            let u = u0 + (u1 - u0) * at(k / columns, rows);
            let v = v0 + (v1 - v0) * at(k % columns, columns);
            if domain.as_ref().is_none_or(|d| d.contains(u, v)) {
                let jet = face.surface.jet(u, v);
                bounds.add(&jet.p);
                normals.extend(jet.normal());
            }
        }
        FaceFacts { area_mm2: face.area_mm2(), bounds, normals }
    }
}

/// Sample points along one parameter: two a span, six at least.
fn grid_size(knots: &KnotVector) -> usize {
    (2 * (knots.breaks().len() - 1)).max(6)
}

impl Region {
    fn new(model: &Model, faces: Vec<FaceId>, facts: &[FaceFacts], flips: &[bool]) -> Self {
        let largest = largest(&faces, facts);
        // The outside as the largest face has it.
        let outward = if model.faces[largest].reversed { -1.0 } else { 1.0 };
        let normals = faces.iter().flat_map(|&f| {
            let side = if flips[f] { -outward } else { outward };
            facts[f].normals.iter().map(move |n| n * side)
        });
        let (normal_axis, normal_half_angle_deg) = normal_cone(&normals.collect::<Vec<_>>());
        Region {
            id: 0,
            flipped: faces.iter().map(|&f| flips[f]).collect(),
            area_mm2: faces.iter().map(|&f| facts[f].area_mm2).sum(),
            boundary_loops: 0,
            normal_axis,
            normal_half_angle_deg,
            bounds: faces.iter().fold(Aabb::empty(), |b, &f| b.union(&facts[f].bounds)),
            faces,
        }
    }
}

fn largest(faces: &[FaceId], facts: &[FaceFacts]) -> FaceId {
    let by_area =
        |a: &&FaceId, b: &&FaceId| facts[**a].area_mm2.total_cmp(&facts[**b].area_mm2).then(b.cmp(a));
    *faces.iter().max_by(by_area).expect("a region has a face")
}

/// Whether `Su × Sv` of each face points to the other side of its region than that of the region's largest
/// face, carried from face to face over the joints inside.
fn flips(labels: &[usize], borders: &Borders<'_>, facts: &[FaceFacts]) -> Vec<bool> {
    let mut neighbours: Vec<Vec<(FaceId, bool)>> = vec![Vec::new(); labels.len()];
    let mut members: Vec<Vec<FaceId>> = vec![Vec::new(); labels.len()];
    for (face, &label) in labels.iter().enumerate() {
        members[label].push(face);
    }
    for d in borders.duplicates {
        neighbours[d.original].push((d.copy, !d.normals_agree));
        neighbours[d.copy].push((d.original, !d.normals_agree));
    }
    for joint in borders.joints.iter().filter(|j| j.verdict.is_merged()) {
        let [a, b] = joint.sides.map(|s| s.face);
        if labels[a] == labels[b] {
            neighbours[a].push((b, !joint.normals_agree));
            neighbours[b].push((a, !joint.normals_agree));
        }
    }
    let mut flipped: Vec<Option<bool>> = vec![None; labels.len()];
    for faces in members.iter().filter(|m| !m.is_empty()) {
        let seed = largest(faces, facts);
        flipped[seed] = Some(false);
        let mut queue = VecDeque::from([(seed, false)]);
        while let Some((face, flip)) = queue.pop_front() {
            for &(next, turns) in &neighbours[face] {
                if flipped[next].is_none() {
                    flipped[next] = Some(flip != turns);
                    queue.push_back((next, flip != turns));
                }
            }
        }
    }
    flipped.into_iter().map(Option::unwrap_or_default).collect()
}

/// A small cone around unit normals: from the mean, the axis moves toward the farthest normal by ever
/// smaller steps (Bădoiu and Clarkson's core-set iteration, on the sphere).
fn normal_cone(normals: &[Vector3]) -> (Vector3, f64) {
    let sum: Vector3 = normals.iter().sum();
    let mut axis = sum.try_normalize(1e-9).unwrap_or_else(Vector3::z);
    let farthest = |axis: &Vector3| {
        normals.iter().fold((1.0, *axis), |worst, n| {
            let cos = n.dot(axis);
            if cos < worst.0 { (cos, *n) } else { worst }
        })
    };
    let mut best = (farthest(&axis).0, axis);
    for k in 2..40 {
        let (cos, n) = farthest(&axis);
        if cos > best.0 {
            best = (cos, axis);
        }
        axis = (axis + (n - axis) / f64::from(k)).try_normalize(1e-9).unwrap_or(axis);
    }
    (best.1, best.0.clamp(-1.0, 1.0).acos().to_degrees())
}

/// Counts the connected pieces of each region's border: stretches that share an end belong together.
fn count_loops(regions: &mut [Region], of_face: &[usize], borders: &Borders<'_>, tolerance_mm: f64) {
    let Borders { joints, naked, laps, .. } = borders;
    let mut borders: Vec<Vec<[Point3; 2]>> = vec![Vec::new(); regions.len()];
    for stretch in *naked {
        borders[of_face[stretch.stretch.face]].push(stretch.ends);
    }
    for lap in *laps {
        borders[of_face[lap.stretch.face]].push(lap.ends);
    }
    for joint in *joints {
        let [a, b] = joint.sides.map(|s| of_face[s.face]);
        if a != b {
            borders[a].push(joint.ends[0]);
            borders[b].push(joint.ends[1]);
        }
    }
    // Slivers shorter than the tolerance are not listed: ends of a chain may be that far apart.
    let near = 2.0 * tolerance_mm;
    regions
        .par_iter_mut()
        .zip(borders)
        .for_each(|(region, stretches)| region.boundary_loops = connected(&stretches, near));
}

fn connected(stretches: &[[Point3; 2]], near_mm: f64) -> usize {
    let mut ends: Vec<(Point3, usize)> =
        stretches.iter().enumerate().flat_map(|(i, e)| e.map(|p| (p, i))).collect();
    ends.sort_by(|a, b| a.0.x.total_cmp(&b.0.x));
    let mut sets = DisjointSets::new(stretches.len());
    for (k, (p, i)) in ends.iter().enumerate() {
        for (q, j) in ends[k + 1..].iter().take_while(|(q, _)| q.x - p.x <= near_mm) {
            if (q - p).norm() <= near_mm {
                sets.join(*i, *j);
            }
        }
    }
    (0..stretches.len()).filter(|&i| sets.root(i) == i).count()
}
