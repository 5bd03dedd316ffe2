//! Region surfaces to plan on: one mesh over all faces of a region, and fields on it.
//!
//! ```text
//!   faces, joints ─► polygons with shared corners ─► triangles in the parameter plane of each face
//!                                                       │ joined at the corners
//!   iso-lines on the NURBS ◄─ field ◄─ harmonic, distance ◄─ mesh
//! ```
//!
//! The mesh carries the pattern: which way passes run and how far apart. It need not be exact, for a pattern
//! 1 % accuracy is plenty. Points that are cut are exact: every triangle lies inside one face and knows the
//! parameters of its corners, so that a point on it is `S(u, v)` on the NURBS and not a point of the facet.
//!
//! ```
//! use claymill_nurbs::analytic::{Frame, plane_patch};
//! use claymill_nurbs::{Face, Model, Point3, Source, SurfaceKind, Vector3};
//! use claymill_surface_merge::{MergeOptions, RegionMesh, merge};
//!
//! let frame = Frame::new(Point3::origin(), Vector3::z(), Vector3::x()).unwrap();
//! let plate = |x: (f64, f64)| Face {
//!     surface: plane_patch(&frame, x, (0.0, 40.0)).unwrap(),
//!     loops: Vec::new(),
//!     reversed: false,
//!     kind: SurfaceKind::Plane,
//!     source: Source::default(),
//! };
//! let model = Model { faces: vec![plate((0.0, 30.0)), plate((30.0, 100.0))], ..Model::default() };
//! let merged = merge(&model, &MergeOptions::default()).unwrap();
//! let mesh = RegionMesh::of_region(&model, &merged, 0, 8.0)?;
//! // From one long side of the two plates to the other, straight across their joint.
//! let guides = mesh.guides();
//! let field = mesh.harmonic(&guides.from, &guides.to)?;
//! let lines = field.iso_line(0.5);
//! assert_eq!(lines.len(), 1);
//! assert!((lines[0].length_mm() - 100.0).abs() < 1e-9);
//! assert!(lines[0].points.iter().all(|p| (p.at.point.y - 20.0).abs() < 1e-9));
//! # Ok::<(), claymill_surface_merge::FieldError>(())
//! ```

mod arrival;
mod build;
mod chosen;
mod connectivity;
mod distance;
mod drive;
mod field;
mod flatten;
mod guides;
mod harmonic;
mod intrinsic;
mod iso_line;
mod outline;
mod sparse;

use std::collections::BTreeSet;

use claymill_nurbs::{FaceId, Model, Point2, Point3};
use thiserror::Error;

use crate::joint::Joint;
use crate::{Merge, Verdict};
use connectivity::NONE;

pub use connectivity::BoundaryLoop;
pub use drive::{DriveSurface, NoDriveSurface};
pub use field::Field;
pub use guides::{GuideKind, Guides};
pub use iso_line::{IsoPoint, Polyline};

/// A point of a face.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SurfacePoint {
    /// The face.
    pub face: FaceId,
    /// Its parameters `(u, v)`.
    pub uv: Point2,
    /// The point `S(u, v)`, mm.
    pub point: Point3,
}

/// A conforming triangle mesh over some faces of a model.
///
/// Conforming: along joints both faces have the same vertices, at T-junctions and across small gaps too, so
/// that there are no cracks. Where two faces are apart by a gap, their common vertices lie on one of the two;
/// the parameters of the corners are each face's own.
#[derive(Debug)]
pub struct RegionMesh<'m> {
    model: &'m Model,
    vertices: Vec<SurfacePoint>,
    triangles: Vec<[u32; 3]>,
    corners: Vec<[Point2; 3]>,
    face_of: Vec<FaceId>,
    twins: Vec<u32>,
    loops: Vec<BoundaryLoop>,
    skipped: Vec<FaceId>,
    edge_mm: f64,
}

/// Why there is no mesh, or no field on it.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum FieldError {
    /// The edge length is no positive number.
    #[error("an edge length of {value} mm was asked for: it must be positive")]
    EdgeLength {
        /// What was asked for, mm.
        value: f64,
    },
    /// None of the faces can be triangulated.
    #[error("the faces enclose nothing that could be triangulated with edges of {edge_mm} mm")]
    Empty {
        /// The edge length, mm.
        edge_mm: f64,
    },
    /// There is no vertex to start from, or all vertices are fixed.
    #[error("the field has no {what}")]
    NoGuide {
        /// What is missing.
        what: &'static str,
    },
    /// The metric gives a weight that is no positive number.
    #[error("the metric is {value} beside vertex {vertex}: it must be positive")]
    Metric {
        /// A vertex beside.
        vertex: u32,
        /// The value.
        value: f64,
    },
    /// The equations could not be solved: their matrix is not positive definite.
    #[error("the equations of the field could not be solved ({reason})")]
    Singular {
        /// What the solver said.
        reason: String,
    },
}

impl<'m> RegionMesh<'m> {
    /// The mesh over `faces`, joined along those of `joints` that have both sides among them. Triangles have
    /// edges of about `edge_mm`, smaller ones where the surface or its border is strongly curved.
    ///
    /// Borders are sampled so that the straight lines between samples, in the parameter plane, keep within
    /// 0.01 mm of them. Edges shorter than twice the widest gap (and than 0.2 mm) become points.
    ///
    /// # Errors
    /// An edge length that is not positive, or faces that enclose nothing.
    pub fn new(
        model: &'m Model,
        faces: &[FaceId],
        joints: &[Joint],
        edge_mm: f64,
    ) -> Result<Self, FieldError> {
        RegionMesh::over(model, faces, joints.iter(), edge_mm)
    }

    fn over<'j>(
        model: &'m Model,
        faces: &[FaceId],
        joints: impl Iterator<Item = &'j Joint>,
        edge_mm: f64,
    ) -> Result<Self, FieldError> {
        if !(edge_mm > 0.0 && edge_mm.is_finite()) {
            return Err(FieldError::EdgeLength { value: edge_mm });
        }
        let members: BTreeSet<FaceId> = faces.iter().copied().filter(|&f| f < model.faces.len()).collect();
        let faces: Vec<FaceId> = members.iter().copied().collect();
        let inside = |j: &&Joint| !j.outdone && j.sides.iter().all(|s| members.contains(&s.face));
        let joints: Vec<&Joint> = joints.filter(inside).collect();
        let polygons = outline::polygons(model, &faces, &joints, edge_mm);
        let raw = build::build(model, &faces, &polygons, edge_mm);
        if raw.triangles.is_empty() {
            return Err(FieldError::Empty { edge_mm });
        }
        let mut mesh = RegionMesh {
            model,
            twins: connectivity::twins(&raw.triangles),
            vertices: raw.vertices,
            triangles: raw.triangles,
            corners: raw.corners,
            face_of: raw.face_of,
            loops: Vec::new(),
            skipped: raw.skipped,
            edge_mm,
        };
        mesh.orient();
        mesh.twins = connectivity::twins(&mesh.triangles);
        mesh.loops = connectivity::loops(&mesh.triangles, &mesh.twins, |a, b| mesh.distance_mm(a, b));
        Ok(mesh)
    }

    /// The mesh of a region that was found by merging; copies of faces are left out.
    ///
    /// # Errors
    /// The same as [`RegionMesh::new`]; a region that does not exist encloses nothing.
    pub fn of_region(
        model: &'m Model,
        merged: &Merge,
        region: usize,
        edge_mm: f64,
    ) -> Result<Self, FieldError> {
        let copies: BTreeSet<FaceId> = merged.duplicates.iter().map(|d| d.copy).collect();
        let all = merged.regions.get(region).map_or(&[][..], |r| &r.faces);
        let faces: Vec<FaceId> = all.iter().copied().filter(|f| !copies.contains(f)).collect();
        let joined = |j: &&Joint| j.verdict.is_merged() || j.verdict == Verdict::Enclosed;
        let mine = merged.joints.iter().filter(|j| merged.region_of_face[j.sides[0].face] == region);
        let joints = mine.filter(|j| joined(j) || j.sides[0].face == j.sides[1].face);
        RegionMesh::over(model, &faces, joints, edge_mm)
    }

    /// The model that the faces belong to.
    #[must_use]
    pub fn model(&self) -> &'m Model {
        self.model
    }

    /// The vertices, each as a point of one of its faces.
    #[must_use]
    pub fn vertices(&self) -> &[SurfacePoint] {
        &self.vertices
    }

    /// The triangles, anticlockwise as seen from the outside of the largest face.
    #[must_use]
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// The face that each triangle lies in.
    #[must_use]
    pub fn face_of_triangle(&self) -> &[FaceId] {
        &self.face_of
    }

    /// The parameters of each triangle's corners on its face.
    #[must_use]
    pub fn corners(&self) -> &[[Point2; 3]] {
        &self.corners
    }

    /// The loops around the mesh, longest first; none when it is closed.
    #[must_use]
    pub fn loops(&self) -> &[BoundaryLoop] {
        &self.loops
    }

    /// Faces that are narrower than the gaps of the model and have no triangles.
    #[must_use]
    pub fn skipped(&self) -> &[FaceId] {
        &self.skipped
    }

    /// The edge length asked for, mm.
    #[must_use]
    pub fn edge_mm(&self) -> f64 {
        self.edge_mm
    }

    /// Area of all triangles, mm².
    #[must_use]
    pub fn area_mm2(&self) -> f64 {
        (0..self.triangles.len()).map(|t| self.triangle_area_mm2(t)).sum()
    }

    /// Euler characteristic: vertices − edges + triangles; 1 for a disk, 0 for a ring, 2 for a closed shell.
    #[must_use]
    pub fn euler(&self) -> i64 {
        let border = self.twins.iter().filter(|t| **t == NONE).count();
        let edges = (self.twins.len() - border) / 2 + border;
        self.vertices.len() as i64 - edges as i64 + self.triangles.len() as i64
    }

    fn triangle_area_mm2(&self, triangle: usize) -> f64 {
        let [a, b, c] = self.triangles[triangle].map(|v| self.point(v));
        0.5 * (b - a).cross(&(c - a)).norm()
    }

    fn point(&self, vertex: u32) -> Point3 {
        self.vertices[vertex as usize].point
    }

    fn distance_mm(&self, a: u32, b: u32) -> f64 {
        (self.point(a) - self.point(b)).norm()
    }

    /// Turns all triangles to the outside of the largest face, part by part where the mesh is in parts.
    fn orient(&mut self) {
        let mut areas = std::collections::BTreeMap::<FaceId, (f64, usize)>::new();
        for t in 0..self.triangles.len() {
            areas.entry(self.face_of[t]).or_insert((0.0, t)).0 += self.triangle_area_mm2(t);
        }
        let mut by_area: Vec<_> = areas.into_iter().collect();
        by_area.sort_by(|a, b| b.1.0.total_cmp(&a.1.0).then(a.0.cmp(&b.0)));
        let seeds: Vec<(usize, bool)> =
            by_area.iter().map(|&(face, (_, first))| (first, self.model.faces[face].reversed)).collect();
        let turned = connectivity::turned(&self.triangles, &self.twins, &seeds);
        for (t, _) in turned.iter().enumerate().filter(|(_, turn)| **turn) {
            self.triangles[t].swap(1, 2);
            self.corners[t].swap(1, 2);
        }
    }

    /// The triangle across a side, if there is one.
    fn across(&self, side: usize) -> Option<usize> {
        (self.twins[side] != NONE).then(|| self.twins[side] as usize)
    }
}
