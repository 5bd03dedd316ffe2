//! Triangles of all faces and obstacles together, each with its deviation. A face without triangles
//! is replaced by its box.

use claymill_nurbs::{Aabb, FaceId, FaceMesh, MeshOptions, Model, Point3, tessellate};
use rayon::prelude::*;

/// Triangles of all faces together.
#[derive(Debug, Default)]
pub(crate) struct Mesh {
    pub(crate) points: Vec<Point3>,
    pub(crate) triangles: Vec<[u32; 3]>,
    /// Per triangle: bound on the distance of the surface from it, mm.
    pub(crate) deviation_mm: Vec<f32>,
    /// First triangle of every face, and of the obstacles behind them.
    pub(crate) first_of_face: Vec<usize>,
}

/// Triangulates every face; `None` for faces that cannot be triangulated.
pub(crate) fn face_meshes(model: &Model, options: &MeshOptions) -> Vec<Option<FaceMesh>> {
    model.faces.par_iter().map(|face| tessellate(face, options).ok()).collect()
}

impl Mesh {
    /// Joins the faces' meshes and the triangles of obstacles. Where a face has no mesh its box, which holds all of it,
    /// stands in its place.
    pub(crate) fn joined(model: &Model, faces: &[Option<FaceMesh>], obstacles: &[[Point3; 3]]) -> Self {
        let mut mesh = Mesh::default();
        for (face, own) in faces.iter().zip(&model.faces) {
            mesh.first_of_face.push(mesh.triangles.len());
            let Some(face) = face else {
                mesh.add_box(&own.bounds());
                continue;
            };
            let first = mesh.points.len() as u32;
            mesh.points.extend_from_slice(&face.points);
            mesh.triangles.extend(face.triangles.iter().map(|t| t.map(|i| first + i)));
            mesh.deviation_mm.extend_from_slice(&face.deviation_mm);
        }
        mesh.first_of_face.push(mesh.triangles.len());
        for corners in obstacles {
            let first = mesh.points.len() as u32;
            mesh.points.extend_from_slice(corners);
            mesh.triangles.push([first, first + 1, first + 2]);
            mesh.deviation_mm.push(0.0);
        }
        mesh
    }

    /// Twelve triangles.
    fn add_box(&mut self, bounds: &Aabb) {
        let first = self.points.len() as u32;
        self.points.extend(bounds.vertices());
        for axis in 0..3 {
            let (along, across) = (1 << ((axis + 1) % 3), 1 << ((axis + 2) % 3));
            for corner in [0u32, 1 << axis] {
                let opposite = corner + along + across;
                for triangle in [[corner, corner + along, opposite], [corner, opposite, corner + across]] {
                    self.triangles.push(triangle.map(|i| first + i));
                    self.deviation_mm.push(0.0);
                }
            }
        }
    }

    /// A box around a face: around its triangles and as far around them as the surface may be.
    pub(crate) fn face_box(&self, face: FaceId) -> Aabb {
        self.face_box_of(face, &self.points)
    }

    /// The same with other coordinates of the points.
    pub(crate) fn face_box_of(&self, face: FaceId, points: &[Point3]) -> Aabb {
        let own = self.first_of_face[face]..self.first_of_face[face + 1];
        let corners = self.triangles[own.clone()].iter().flatten();
        let deviation_mm = self.deviation_mm[own].iter().copied().fold(0.0, f32::max);
        Aabb::of(corners.map(|&i| &points[i as usize])).inflated(f64::from(deviation_mm))
    }

    /// The face that a triangle is of, and its number there; `None` for obstacles.
    pub(crate) fn face_of(&self, triangle: usize) -> Option<(FaceId, usize)> {
        let behind = self.first_of_face.partition_point(|&first| first <= triangle);
        let face = behind.checked_sub(1).filter(|_| behind < self.first_of_face.len())?;
        Some((face, triangle - self.first_of_face[face]))
    }
}
