use claymill_nurbs::{FaceMesh, MeshOptions, Model, Point3, tessellate};
use rayon::prelude::*;

/// Triangles of all faces together.
#[derive(Debug, Default)]
pub(crate) struct Mesh {
    pub(crate) points: Vec<Point3>,
    pub(crate) triangles: Vec<[u32; 3]>,
    /// Largest distance of a surface from its triangles, mm.
    pub(crate) deviation_mm: f64,
}

/// Triangulates every face; `None` for faces that cannot be triangulated.
pub(crate) fn face_meshes(model: &Model, options: &MeshOptions) -> Vec<Option<FaceMesh>> {
    model
        .faces
        .par_iter()
        .map(|face| tessellate(face, options).ok())
        .collect()
}

impl Mesh {
    /// Joins the faces' meshes.
    pub(crate) fn joined(faces: &[Option<FaceMesh>]) -> Self {
        let mut mesh = Mesh::default();
        for face in faces.iter().flatten() {
            let first = mesh.points.len() as u32;
            mesh.points.extend_from_slice(&face.points);
            mesh.triangles
                .extend(face.triangles.iter().map(|t| t.map(|i| first + i)));
            let deviation = face.deviation_mm.iter().fold(0.0, |a: f32, b| a.max(*b));
            mesh.deviation_mm = mesh.deviation_mm.max(f64::from(deviation));
        }
        mesh
    }
}
