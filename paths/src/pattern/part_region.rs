//! What the passes of a part are laid on.

use claymill_nurbs::FaceId;

use crate::pattern::levels::sweeps::Sweeps;
use crate::pattern::near::PassIndex;

/// The faces of a region, as a setup cuts them.
pub(crate) struct PartRegion<'b, 'a, 'm> {
    /// In ascending order.
    pub(crate) faces: &'b [FaceId],
    /// What sweeps them, where they have a mesh.
    pub(crate) sweeps: Option<&'b Sweeps<'a, 'm>>,
    /// How much of them the setup cuts.
    pub(crate) area_mm2: f64,
    /// The passes along the valleys.
    pub(crate) in_valleys: PassIndex<'b>,
}

impl PartRegion<'_, '_, '_> {
    /// Whether the face is one of them.
    pub(crate) fn owns(&self, face: FaceId) -> bool {
        self.faces.binary_search(&face).is_ok()
    }
}
