//! Closest points on single faces, where other faces must not hide them. Indexes are built on
//! demand.

use std::sync::OnceLock;

use claymill_nurbs::{Aabb, ClosestPoints, Face, FaceId, Foot, Model, Point3};

/// Each face on its own, for exact distances from one face that others must not hide. Indexes are built
/// when they are first asked.
pub(crate) struct LoneFaces<'m> {
    faces: &'m [Face],
    boxes: Vec<Aabb>,
    /// By the left end of their box.
    by_left: Vec<FaceId>,
    widest_mm: f64,
    lone: &'m [OnceLock<Model>],
    indexes: Vec<OnceLock<ClosestPoints<'m>>>,
}

impl<'m> LoneFaces<'m> {
    /// `lone` has a cell for each face.
    pub(crate) fn new(model: &'m Model, lone: &'m [OnceLock<Model>]) -> Self {
        // No point of a face lies outside its control points.
        let hull = |face: &Face| {
            let net = face.surface.net().iter().map(|h| Point3::from(h.xyz() / h.w));
            Aabb::of(&net.collect::<Vec<_>>())
        };
        let boxes: Vec<Aabb> = model.faces.iter().map(hull).collect();
        let mut by_left: Vec<FaceId> = (0..boxes.len()).collect();
        by_left.sort_by(|a, b| boxes[*a].min.x.total_cmp(&boxes[*b].min.x).then(a.cmp(b)));
        let widest_mm = boxes.iter().map(|b| b.max.x - b.min.x).fold(0.0, f64::max);
        let indexes = boxes.iter().map(|_| OnceLock::new()).collect();
        LoneFaces { faces: &model.faces, boxes, by_left, widest_mm, lone, indexes }
    }

    /// Faces whose box touches `query`, ascending.
    pub(crate) fn touching(&self, query: &Aabb) -> Vec<FaceId> {
        let first = self.by_left.partition_point(|&f| self.boxes[f].min.x < query.min.x - self.widest_mm);
        let apart = |b: &Aabb| (0..3).any(|k| b.min[k] > query.max[k] || b.max[k] < query.min[k]);
        let from = self.by_left[first..].iter().take_while(|&&f| self.boxes[f].min.x <= query.max.x);
        let mut found: Vec<FaceId> = from.copied().filter(|&f| !apart(&self.boxes[f])).collect();
        found.sort_unstable();
        found
    }

    /// The point of `face` nearest to `p`, if nearer than `within_mm`.
    pub(crate) fn closest(&self, face: FaceId, p: &Point3, within_mm: f64) -> Option<Foot> {
        if self.boxes[face].distance_squared(p) > within_mm * within_mm {
            return None;
        }
        let index = self.indexes[face].get_or_init(|| {
            let alone = || Model { faces: vec![self.faces[face].clone()], ..Model::default() };
            ClosestPoints::new(self.lone[face].get_or_init(alone))
        });
        index.closest(p, within_mm)
    }
}
