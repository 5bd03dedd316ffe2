//! What the passes of a part are laid on.

use claymill_nurbs::FaceId;
use claymill_surface_merge::RegionMesh;

use crate::near::LaidNear;

/// The faces of a region, as a setup cuts them.
pub(crate) struct Ground<'a> {
    /// In ascending order.
    pub(crate) faces: &'a [FaceId],
    /// Their mesh, where there is one.
    pub(crate) mesh: Option<&'a RegionMesh<'a>>,
    /// The passes along the valleys.
    pub(crate) in_valleys: LaidNear<'a>,
}

impl Ground<'_> {
    /// Whether the face is one of them.
    pub(crate) fn owns(&self, face: FaceId) -> bool {
        self.faces.binary_search(&face).is_ok()
    }
}
