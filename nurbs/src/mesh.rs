use crate::{Face, NurbsError, Point2, Point3};

/// How fine a face is triangulated.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MeshOptions {
    /// Largest distance of the face from its triangles, mm.
    pub deviation_mm: f64,
    /// Longest triangle edge, mm.
    pub longest_edge_mm: f64,
}

/// A triangulated face. Every vertex lies exactly on the surface and knows its parameters, every triangle
/// lies inside one face, so that linear interpolation in `(u, v)` gives exact surface points.
#[derive(Debug, Clone, Default)]
pub struct FaceMesh {
    /// Parameters of the vertices.
    pub uv: Vec<Point2>,
    /// The vertices, mm.
    pub points: Vec<Point3>,
    /// Triangles, anticlockwise in the parameter plane (so that their normal agrees with `Su × Sv`).
    pub triangles: Vec<[u32; 3]>,
    /// Per triangle: bound on the distance of the surface piece from it, mm.
    pub deviation_mm: Vec<f32>,
    /// Boundary loops as vertex indices, in order, first not repeated.
    pub rings: Vec<Vec<u32>>,
}

/// Triangulates the face.
///
/// # Errors
/// The trim loops cannot be triangulated.
pub fn tessellate(face: &Face, options: &MeshOptions) -> Result<FaceMesh, NurbsError> {
    let _ = (face, options);
    todo!()
}
