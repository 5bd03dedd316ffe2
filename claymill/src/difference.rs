//! What differs between two states of a model: faces that came, went and moved.
//!
//! Faces whose geometry is the same bit for bit are the same face, wherever in the file they are. Of the others, two whose boxes
//! lie in one place are one face that was changed.

use std::collections::BTreeMap;

use claymill_nurbs::{Aabb, ClosestPoints, Face, FaceId, Model};
use claymill_toolpath::{KeyMaker, PartKey};
use rayon::prelude::*;
use serde::Serialize;

use crate::model_file::ModelFile;

/// So many points along each side of a face's domain are looked at.
const LOOKS: usize = 9;
/// The boxes of a face before and after differ by no more than this share of their diagonals.
const SAME_PLACE: f64 = 0.25;

/// What differs between two models.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Difference {
    /// How many faces are the same.
    pub unchanged: usize,
    /// Their area, mm².
    pub unchanged_mm2: f64,
    /// Faces that are only in the second model, by their index there.
    pub added: Vec<FaceAt>,
    /// Faces that are only in the first model, by their index there.
    pub removed: Vec<FaceAt>,
    /// Faces that were changed.
    pub changed: Vec<Changed>,
}

/// A face that only one of the models has.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FaceAt {
    /// Its index.
    pub face: FaceId,
    /// Its entity in the file.
    pub entity: String,
    /// Its area, mm².
    pub area_mm2: f64,
    /// The box around it: xmin, ymin, zmin, xmax, ymax, zmax, mm.
    pub box_mm: [f64; 6],
}

/// A face that was changed.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Changed {
    /// Its index in the first model.
    pub before: FaceId,
    /// As it is in the second one.
    #[serde(flatten)]
    pub after: FaceAt,
    /// How far points of it are from the first model at most, mm. A face that was only cut anew has moved by nothing.
    pub moved_mm: f64,
}

impl Difference {
    /// Whether nothing differs.
    #[must_use]
    pub fn is_none(&self) -> bool {
        self.added.is_empty() && self.removed.is_empty() && self.changed.is_empty()
    }

    /// The farthest that any face has moved, mm.
    #[must_use]
    pub fn moved_mm(&self) -> f64 {
        self.changed.iter().map(|changed| changed.moved_mm).fold(0.0, f64::max)
    }
}

/// What differs between a model as it was and as it is now.
#[must_use]
pub fn difference(before: &ModelFile, after: &ModelFile) -> Difference {
    let mut known: BTreeMap<PartKey, Vec<FaceId>> = BTreeMap::new();
    for (face, key) in keys(before.model()).into_iter().enumerate() {
        known.entry(key).or_default().push(face);
    }
    let mut found = Difference::default();
    let mut new = Vec::new();
    for (face, key) in keys(after.model()).into_iter().enumerate() {
        if known.get_mut(&key).and_then(Vec::pop).is_some() {
            found.unchanged += 1;
            found.unchanged_mm2 += after.face_area_mm2[face];
        } else {
            new.push(face_at(after, face));
        }
    }
    let mut old: Vec<FaceAt> = known.into_values().flatten().map(|face| face_at(before, face)).collect();
    old.sort_by_key(|at| at.face);
    let closest = ClosestPoints::new(before.model());
    for after_it in new {
        let nearest = (old.iter().enumerate())
            .map(|(k, old)| (k, apart(&old.box_mm, &after_it.box_mm)))
            .filter(|(_, apart)| *apart <= SAME_PLACE)
            .min_by(|a, b| a.1.total_cmp(&b.1));
        match nearest {
            Some((k, _)) => {
                let before = old.remove(k).face;
                let moved_mm = moved_mm(&closest, &after.model().faces[after_it.face]);
                found.changed.push(Changed { before, after: after_it, moved_mm });
            }
            None => found.added.push(after_it),
        }
    }
    found.removed = old;
    found
}

fn keys(model: &Model) -> Vec<PartKey> {
    model.faces.par_iter().map(|face| KeyMaker::new("face").face(face).finish()).collect()
}

fn face_at(file: &ModelFile, face: FaceId) -> FaceAt {
    let of = &file.model().faces[face];
    let (entity, area_mm2) = (of.source.entity.clone(), file.face_area_mm2[face]);
    FaceAt { face, entity, area_mm2, box_mm: of.bounds().corners() }
}

/// How far the corners of two boxes are from each other, as a share of the diagonal of the larger one.
fn apart(a: &[f64; 6], b: &[f64; 6]) -> f64 {
    let (a, b) = (Aabb::of_corners(*a), Aabb::of_corners(*b));
    let mm = (a.min - b.min).norm().max((a.max - b.max).norm());
    mm / a.diagonal().max(b.diagonal()).max(f64::MIN_POSITIVE)
}

/// How far points of a face are from a model at most, mm.
fn moved_mm(closest: &ClosestPoints<'_>, face: &Face) -> f64 {
    let ((u0, u1), (v0, v1)) = face.surface.domain();
    let domain = (!face.loops.is_empty()).then(|| claymill_nurbs::Domain::new(face));
    let share = |k: usize| (k as f64 + 0.5) / LOOKS as f64;
    let looks = (0..LOOKS).flat_map(|i| (0..LOOKS).map(move |j| (share(i), share(j))));
    let places = looks.map(|(s, t)| (u0 + (u1 - u0) * s, v0 + (v1 - v0) * t));
    let inside = places.filter(|&(u, v)| domain.as_ref().is_none_or(|d| d.contains(u, v)));
    let far = |(u, v): (f64, f64)| {
        let point = face.surface.point(u, v);
        closest.closest(&point, f64::INFINITY).map_or(0.0, |foot| foot.distance_mm)
    };
    inside.map(far).fold(0.0, f64::max)
}
