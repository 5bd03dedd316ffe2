//! What merging found, and what the user wants of it.

use claymill_contact::OpenStretch;
use claymill_surface_merge::{EdgeStretch, Merge};

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

/// Stretches of borders beside which merging found no other face.
#[must_use]
pub fn open_borders(merged: &Merge) -> Vec<OpenStretch> {
    let open = merged.naked.iter().map(|naked| {
        let EdgeStretch { face, loop_index, edge_index, from, to } = naked.stretch;
        OpenStretch { face, loop_index, edge_index, range: [from, to], length_mm: naked.length_mm }
    });
    open.collect()
}
