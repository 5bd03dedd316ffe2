//! Sheets: faces that hang together, and on which side of them the material is.
//!
//! ```text
//!   joints ─► sheets: which faces hang together, and whether their normals agree (hanging)
//!                │
//!                ├─ no open border        its volume says which side is inside
//!                ├─ one side sees out     the other one is inside (sight)
//!                ├─ lies level            no tool comes from below: plates, also with pockets
//!                ├─ the file says it      where all faces agree
//!                └─ otherwise             an assumption, told as such
//! ```
//!
//! Parametrisations say nothing: `Su × Sv` of the patches of one sheet point either way. Sewing tells which of them agree; one
//! sign a sheet is left to be found.

mod decision;
mod hanging;
mod sight;

use claymill_nurbs::{FaceId, FaceMesh, MeshOptions, Model, Vector3, tessellate};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::Merge;
use decision::Known;
use hanging::Hanging;
use sight::Sight;

/// What else is known when material sides are decided.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct SheetOptions {
    /// Orientations in the file are statements (STEP, 3dm, B-reps in IGES), and not only how surfaces happen to be parametrised.
    pub file_states_sides: bool,
    /// The direction that no tool comes from is the opposite of this one.
    pub up: Option<Vector3>,
}

/// Faces that hang together over joints, and their material side.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Sheet {
    /// Its faces, ascending.
    pub faces: Vec<FaceId>,
    /// For each of them: the material is on the side against `Su × Sv`, so that the side of `Su × Sv` is free.
    pub free_along: Vec<bool>,
    /// Area, mm².
    pub area_mm2: f64,
    /// Length of its border without a neighbour of its own, mm: free, on the inside of other faces, or where more than two meet.
    pub open_mm: f64,
    /// Length of joints at which its faces turn over, so that it has no two sides (as a Möbius strip), mm.
    pub turned_mm: f64,
    /// Shares of all directions in which one sees out of the model from the free side, and from the material's.
    pub sees_out: [f64; 2],
    /// Mean of the normals on the free side; short where they point all ways.
    pub mean_free_normal: Vector3,
    /// Share of its area whose outside in the file is the free side.
    pub file_agrees: f64,
    /// What decided.
    pub evidence: Evidence,
    /// Nothing speaks for the other side: not so where it had to be assumed.
    pub clear: bool,
}

/// What decides on which side of a sheet the material is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Evidence {
    /// The sheet is closed: the material is inside.
    Closed,
    /// One side sees less of what is outside of the model.
    Encloses,
    /// It lies level, or its open border does: no tool comes from below.
    Level,
    /// All faces have the same outside in the file.
    File,
    /// Nothing but a slight bulge, what is rather above than below, or the way most faces are turned in the file.
    Assumed,
    /// It has no two sides: each face is judged by itself.
    FaceByFace,
}

impl Sheet {
    /// Whether it has no border.
    #[must_use]
    pub fn is_closed(&self) -> bool {
        self.evidence == Evidence::Closed
    }
}

/// Deviation of the triangles from the faces, as a share of the model's size.
const DEVIATION: f64 = 5e-4;
/// And no less than this, mm.
const LEAST_DEVIATION_MM: f64 = 1e-3;

/// The sheets of a merged model, largest first, with the side of each that is free of material. Every face belongs to one.
#[must_use]
pub fn sheets(model: &Model, merged: &Merge, options: &SheetOptions) -> Vec<Sheet> {
    let meshes = meshes(model);
    let sight = Sight::new(&meshes);
    let hanging = Hanging::new(model.faces.len(), merged);
    let known = Known::new(model, merged, &meshes, &sight);
    let mut sheets: Vec<Sheet> =
        hanging.groups().into_par_iter().map(|group| decision::decide(&known, &group, options)).collect();
    sheets.sort_by(|a, b| b.area_mm2.total_cmp(&a.area_mm2).then(a.faces.cmp(&b.faces)));
    sheets
}

/// Rough triangles of each face; none of one that cannot be meshed.
fn meshes(model: &Model) -> Vec<FaceMesh> {
    let nets = model.faces.iter().flat_map(|f| f.surface.net());
    let bounds = claymill_nurbs::Aabb::of(&nets.map(|h| (h.xyz() / h.w).into()).collect::<Vec<_>>());
    let size_mm = if bounds.is_empty() { 0.0 } else { bounds.diagonal() };
    let deviation_mm = (DEVIATION * size_mm).max(LEAST_DEVIATION_MM);
    let options = MeshOptions { deviation_mm, longest_edge_mm: f64::INFINITY };
    model.faces.par_iter().map(|face| tessellate(face, &options).unwrap_or_default()).collect()
}
