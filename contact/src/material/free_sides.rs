//! The sides of faces that are free of material.

use claymill_nurbs::FaceId;
use claymill_toolpath::FreeSide;

/// The free side of each face; either one of faces beyond the end of the list.
#[derive(Debug, Clone, Copy, Default)]
pub struct FreeSides<'a>(&'a [FreeSide]);

impl<'a> FreeSides<'a> {
    /// The free sides of the faces, by their index.
    #[must_use]
    pub fn new(of_face: &'a [FreeSide]) -> Self {
        FreeSides(of_face)
    }

    /// The free side of a face.
    #[must_use]
    pub fn of(self, face: FaceId) -> FreeSide {
        self.0.get(face).copied().unwrap_or_default()
    }

    /// Whether a ball may touch the face on the side of `Su × Sv`, or, if not `along`, on the other.
    #[must_use]
    pub fn allow(self, face: FaceId, along: bool) -> bool {
        self.of(face).allows(along)
    }
}
