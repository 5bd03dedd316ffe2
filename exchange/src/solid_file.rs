//! What a file encloses, as one closed mesh: stock such as a casting, from a mesh or from solids.
//!
//! ```text
//!   STL, OBJ, glTF ─ triangles ───────────────┐
//!                                             ├─ sewn ─► ClosedMesh, or where it is open
//!   IGES, STEP, 3dm ─ faces ─ triangles ──────┘
//! ```

use std::path::{Path, PathBuf};

use claymill_nurbs::{ClosedMesh, NurbsError};
use thiserror::Error;

use crate::{MeshError, MeshFormat, ReadError, read, read_mesh};

/// Faces of solids are within this of their triangles, and borders of meshes are joined within a few of it, mm.
const DEVIATION_MM: f64 = 0.02;

/// Why a file encloses nothing.
#[derive(Debug, Error)]
pub enum SolidError {
    /// The mesh cannot be read.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// The solids cannot be read.
    #[error(transparent)]
    Model(#[from] ReadError),
    /// What was read is open.
    #[error("{}: {source}", path.display())]
    Open {
        /// The file.
        path: PathBuf,
        /// Where it is open.
        source: NurbsError,
    },
}

impl SolidError {
    /// What the user can do about it: one whole sentence.
    #[must_use]
    pub fn advice(&self) -> String {
        match self {
            SolidError::Mesh(error) => error.advice().into(),
            SolidError::Model(error) => error.advice(),
            SolidError::Open { .. } => {
                "Close the body there (caps, missing faces) and export it again as a solid, or as a closed mesh (STL).".into()
            }
        }
    }
}

/// Reads what a file encloses. Its format is recognised by content. Meshes without a unit (STL, OBJ) are scaled by
/// `unitless_mm`: the millimetres in one of their units.
///
/// # Errors
/// The file cannot be read, or encloses nothing.
pub fn read_solid(path: &Path, unitless_mm: f64) -> Result<ClosedMesh, SolidError> {
    let closed = match MeshFormat::of_file(path) {
        Some(_) => {
            let mesh = read_mesh(path, unitless_mm)?;
            ClosedMesh::of_triangles(&mesh.vertices, &mesh.triangles, DEVIATION_MM)
        }
        None => ClosedMesh::of_model(&read(path)?.model, DEVIATION_MM),
    };
    closed.map_err(|source| SolidError::Open { path: path.into(), source })
}
