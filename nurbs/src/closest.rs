use crate::{FaceId, Model, Point3};

/// Closest points over all faces of a model: a hierarchy of boxes around small surface pieces, then Newton
/// on the exact surfaces and on the exact boundary curves.
#[derive(Debug)]
pub struct ClosestPoints<'a> {
    model: &'a Model,
}

/// The nearest point of the model.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Foot {
    /// The face it lies on.
    pub face: FaceId,
    /// Its parameter `u`.
    pub u: f64,
    /// Its parameter `v`.
    pub v: f64,
    /// The point, mm.
    pub point: Point3,
    /// Its distance from the query, mm.
    pub distance_mm: f64,
    /// Whether it lies on the boundary of its face.
    pub on_boundary: bool,
}

impl<'a> ClosestPoints<'a> {
    /// Builds the index over all faces (in parallel).
    #[must_use]
    pub fn new(model: &'a Model) -> Self {
        ClosestPoints { model }
    }

    /// The model.
    #[must_use]
    pub fn model(&self) -> &'a Model {
        self.model
    }

    /// The point of the model nearest to `p`, if any lies within `within_mm`. Exact to 1e-9 mm: the
    /// distance returned is never larger than the true one by more than that.
    #[must_use]
    pub fn closest(&self, p: &Point3, within_mm: f64) -> Option<Foot> {
        let _ = (p, within_mm);
        todo!()
    }
}
