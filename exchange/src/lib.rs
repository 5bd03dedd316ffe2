//! Reading and writing model files.
//!
//! ```text
//!                    ┌─ iges ────┐
//!   bytes ─ format? ─┼─ step ────┼─► Import = Model (faces, mm) + ImportReport (what was read, what not, why)
//!                    └─ threedm ─┘
//!
//!   Model + groups ─► write_iges, write_step, write_glb
//!
//!   bytes ─ STL, OBJ, glTF? ─► ObstacleMesh (triangles, mm): never machined
//! ```
//!
//! Every face of a file is accounted for: it is in the model, or it is listed in the report with its entity,
//! the reason and what to do about it. A damaged face never stops the rest from being read. All lengths leave
//! this crate in millimetres, whatever the file says; units come from the file's declaration, never from its
//! name or the size of its coordinates.
//!
//! ```no_run
//! let import = claymill_exchange::read("body.igs".as_ref())?;
//! println!("{} faces, {} skipped", import.model.faces.len(), import.report.skipped.len());
//! # Ok::<(), claymill_exchange::ReadError>(())
//! ```

// What is to be said is returned: only the command prints.
#![cfg_attr(not(test), warn(clippy::print_stdout, clippy::print_stderr))]

mod along;
mod arc_length;
mod audit;
mod bezier;
mod chart;
mod contents;
mod error;
mod export;
mod foot;
mod format;
mod glb;
mod hermite;
mod iges;
mod import;
mod interpolant;
mod lift;
mod mesh_file;
mod nesting;
mod offset;
mod plausible;
mod solid_file;
mod step;
mod subcurve;
mod threedm;
mod trim;
mod unfolding;
mod warp;

use std::path::Path;

pub use audit::FaceReading;
pub use error::ReadError;
pub use export::{Group, WriteError};
pub use format::Format;
pub use glb::{Lines, write_glb};
pub use iges::write_iges;
pub use import::{EntityCount, Import, ImportReport, Repair, Skipped, Units};
pub use mesh_file::{MeshError, MeshFault, MeshFormat, ObstacleMesh, read_mesh, read_mesh_bytes, stl_bytes};
pub use solid_file::{SolidError, read_solid};
pub use step::write_step;

/// A face smaller than this is degenerate, mm².
pub(crate) const DEGENERATE_MM2: f64 = 1e-6;

/// Names are no longer than this: one of a megabyte may belong to every face.
const LONGEST_NAME: usize = 255;

/// A name of the file, cut where it is none.
pub(crate) fn shortened(mut name: String) -> String {
    if let Some((end, _)) = name.char_indices().nth(LONGEST_NAME) {
        name.truncate(end);
        name.shrink_to_fit();
    }
    name
}

/// Reads a model file. The format is recognised by content; the extension is not looked at.
///
/// # Errors
/// The file cannot be opened, is empty, is of no known format, breaks off, or holds no usable face. Each
/// error names the file and offers [`ReadError::advice`].
pub fn read(path: &Path) -> Result<Import, ReadError> {
    let bytes = contents::contents(path).map_err(|source| ReadError::Open { path: path.into(), source })?;
    read_bytes(&bytes, path)
}

/// Reads a model from memory; `path` serves messages only.
///
/// # Errors
/// As [`read`].
pub fn read_bytes(bytes: &[u8], path: &Path) -> Result<Import, ReadError> {
    if bytes.iter().all(u8::is_ascii_whitespace) {
        return Err(ReadError::Empty { path: path.into() });
    }
    let import = match Format::of(bytes) {
        Ok(Format::Iges) => iges::read(bytes, path),
        Ok(Format::Step) => step::read(bytes, path),
        Ok(Format::Rhino3dm) => threedm::read(bytes, path),
        Err(found) => Err(ReadError::UnknownFormat { path: path.into(), found }),
    }?;
    let import = import.with_plausible_faces();
    if import.model.faces.is_empty() {
        return Err(ReadError::NoFaces { path: path.into(), report: Box::new(import.report) });
    }
    Ok(import.with_size_checked().with_doubts_told())
}
