//! What merging found, and what the user wants of it.

use claymill_surface_merge::Merge;

/// The regions to cut.
#[derive(Debug, Clone)]
pub struct Regions<'a> {
    /// What merging found: regions and joints.
    pub merged: &'a Merge,
    /// Region of each face.
    pub of_face: &'a [usize],
    /// Whether each face is left out by the user's wish.
    pub excluded: &'a [bool],
    /// Area of each face, mm².
    pub face_area_mm2: &'a [f64],
}
