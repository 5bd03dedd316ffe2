use crate::Face;

/// The part of the parameter plane that belongs to a face, ready for fast inside tests.
#[derive(Debug, Clone)]
pub struct Domain {}

impl Domain {
    /// Prepares the inside test of `face`.
    #[must_use]
    pub fn new(face: &Face) -> Self {
        let _ = face;
        todo!()
    }

    /// Whether `(u, v)` belongs to the face (exact winding number of the trim loops; geometry.md §1.6).
    #[must_use]
    pub fn contains(&self, u: f64, v: f64) -> bool {
        let _ = (u, v);
        todo!()
    }
}
