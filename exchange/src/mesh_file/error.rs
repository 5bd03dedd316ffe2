//! Why an obstacle mesh (STL, OBJ, glTF) cannot be read, with advice.

use std::path::PathBuf;

use thiserror::Error;

/// Why a mesh could not be read.
#[derive(Debug, Error)]
pub enum MeshError {
    /// The operating system refuses.
    #[error("{}: cannot be opened: {source}", path.display())]
    Open {
        /// The file.
        path: PathBuf,
        /// What the operating system says.
        source: std::io::Error,
    },
    /// Neither STL nor OBJ nor glTF.
    #[error("{}: not an STL, OBJ or glTF mesh", path.display())]
    UnknownFormat {
        /// The file.
        path: PathBuf,
    },
    /// The content is damaged, cut short, or of a kind that cannot be read.
    #[error("{}: {fault}", path.display())]
    Damaged {
        /// The file.
        path: PathBuf,
        /// What is wrong, and where.
        fault: MeshFault,
    },
    /// No triangle with an area.
    #[error("{}: the mesh has no triangles", path.display())]
    NoTriangles {
        /// The file.
        path: PathBuf,
    },
    /// The unit that was given is no length.
    #[error("{mm} mm is no unit of length")]
    Unit {
        /// What was given.
        mm: f64,
    },
}

/// What is wrong inside a mesh file.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum MeshFault {
    /// The file ends before it should.
    #[error("the file breaks off: {0}")]
    Truncated(String),
    /// Something in it makes no sense.
    #[error("{place}: {what}")]
    Wrong {
        /// Where: `line 12`, `triangle 3`, `accessor 4`.
        place: String,
        /// What is wrong there.
        what: String,
    },
    /// It is sound but uses something that is not read.
    #[error("{0} cannot be read")]
    Unsupported(String),
}

impl MeshFault {
    pub(super) fn wrong(place: impl Into<String>, what: impl Into<String>) -> Self {
        MeshFault::Wrong { place: place.into(), what: what.into() }
    }
}

impl MeshError {
    /// What the user can do about it: one whole sentence.
    #[must_use]
    pub fn advice(&self) -> &'static str {
        match self {
            MeshError::Open { .. } => "Check the path and the permissions.",
            MeshError::UnknownFormat { .. } => "Export the obstacle as binary STL.",
            MeshError::Damaged { fault: MeshFault::Unsupported(_), .. } => {
                "Export the mesh without compression and extensions, or as binary STL."
            }
            MeshError::Damaged { .. } => "Copy or export the mesh again.",
            MeshError::NoTriangles { .. } => "Export the surfaces of the obstacle, not points or lines.",
            MeshError::Unit { .. } => "Give the millimetres in one unit of the file: 1, 25.4, 1000, ...",
        }
    }
}
