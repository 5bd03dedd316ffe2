//! What all writers share: groups of faces, errors, and files that appear whole or not at all.

use std::fs;
use std::path::{Path, PathBuf};

use claymill_nurbs::{FaceId, Model, NurbsError};
use thiserror::Error;

/// Faces that belong together under one name and colour, as a region does.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Group {
    /// Its name.
    pub name: String,
    /// Red, green, blue; faces of the group are written in it.
    pub colour: Option<[u8; 3]>,
    /// Indices into [`Model::faces`].
    pub faces: Vec<FaceId>,
}

/// Why a file could not be written. The file at the path given is then as it was before.
#[derive(Debug, Error)]
pub enum WriteError {
    /// The operating system refuses.
    #[error("{}: cannot be written: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What the operating system says.
        source: std::io::Error,
    },
    /// A group names a face that the model does not have.
    #[error("group `{group}` names face {face}, but the model has {count} faces")]
    UnknownFace {
        /// The group.
        group: String,
        /// The index.
        face: FaceId,
        /// Number of faces.
        count: usize,
    },
    /// A face cannot be expressed in the format.
    #[error("face {face}: {source}")]
    Face {
        /// The face.
        face: FaceId,
        /// What is wrong.
        source: NurbsError,
    },
}

/// The group of each face; of several the last.
pub(crate) fn group_of_face(model: &Model, groups: &[Group]) -> Result<Vec<Option<usize>>, WriteError> {
    let mut group_of = vec![None; model.faces.len()];
    for (index, group) in groups.iter().enumerate() {
        for &face in &group.faces {
            *group_of.get_mut(face).ok_or_else(|| WriteError::UnknownFace {
                group: group.name.clone(),
                face,
                count: model.faces.len(),
            })? = Some(index);
        }
    }
    Ok(group_of)
}

/// Writes the file beside its place and then puts it there.
pub(crate) fn write_whole(path: &Path, bytes: &[u8]) -> Result<(), WriteError> {
    let mut beside = path.as_os_str().to_owned();
    beside.push(".partial");
    let written = fs::write(&beside, bytes).and_then(|()| fs::rename(&beside, path));
    written.map_err(|source| {
        // What is half-written is of no use; that it cannot be removed either adds nothing to the message.
        let _ = fs::remove_file(&beside);
        WriteError::Io { path: path.into(), source }
    })
}
