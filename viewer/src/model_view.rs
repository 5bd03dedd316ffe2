//! A model as pictures see it: faces, triangles, regions.

use claymill_nurbs::{FaceMesh, Model};
use claymill_toolpath::FreeSide;

/// A model as the caller sees it: the faces, their triangles and the region that each belongs to.
#[derive(Debug, Clone, Copy)]
pub struct ModelView<'a> {
    /// The model.
    pub model: &'a Model,
    /// One mesh a face ([`claymill_nurbs::tessellate`]); a face that could not be meshed has an empty one.
    pub meshes: &'a [FaceMesh],
    /// Region of each face, from 0.
    pub region_of_face: &'a [usize],
    /// Which faces are cut; the others are drawn grey. `None`: all.
    pub cut: Option<&'a [bool]>,
    /// Distance within which edges of two faces count as one joint, mm.
    pub joint_tolerance_mm: f64,
    /// The side of each face that is free of material: the other one is hatched. `None`: both are alike.
    pub free_sides: Option<&'a [FreeSide]>,
}

/// What decides a surface's colour.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Colouring {
    /// Clay all over: for pictures in which something else matters.
    Clay,
    /// A colour a region.
    Region,
    /// The colours of the file; clay where it gives none.
    File,
}

/// Largest distance of the triangles of all meshes from their surfaces, mm.
pub(crate) fn mesh_deviation_mm(meshes: &[FaceMesh]) -> f32 {
    meshes.iter().flat_map(|m| m.deviation_mm.iter().copied()).fold(0.0, f32::max)
}
