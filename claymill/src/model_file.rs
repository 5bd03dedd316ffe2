//! A model file that was read and measured.

use std::path::{Path, PathBuf};

use claymill_exchange::Import;
use claymill_nurbs::{Aabb, Face, Model};
use rayon::prelude::*;

use crate::error::Error;

/// A model with the file that it is from. Job folders refer to that file, so a model made in code is written first:
/// [`exchange::write_step`](crate::exchange::write_step).
#[derive(Debug, Clone)]
pub struct ModelFile {
    /// Where it was read.
    pub path: PathBuf,
    /// The faces, and what became of each entity of the file.
    pub import: Import,
    /// Area of each face, mm².
    pub face_area_mm2: Vec<f64>,
    /// Of all faces.
    pub bounds: Aabb,
}

/// Reads an IGES, STEP or Rhino 3dm file, whose format is recognised by its content.
///
/// A damaged face does not stop the rest from being read: look at `import.report.skipped` and `import.report.warnings`.
///
/// # Errors
/// The file cannot be opened, is of no known format, or holds no usable face.
pub fn read(path: impl AsRef<Path>) -> Result<ModelFile, Error> {
    let path = path.as_ref();
    let import = claymill_exchange::read(path)?;
    let face_area_mm2 = import.report.faces.iter().map(|face| face.area_read_mm2).collect();
    let boxes: Vec<Aabb> = import.model.faces.par_iter().map(Face::bounds).collect();
    let bounds = boxes.iter().fold(Aabb::empty(), |a, b| a.union(b));
    Ok(ModelFile { path: path.to_owned(), import, face_area_mm2, bounds })
}

impl ModelFile {
    /// The image of the model in the plane through the origin that stands on a coordinate axis, 0 to 2. The file stays what it is:
    /// a job needs one that the image was written to.
    #[must_use]
    pub fn mirrored(mut self, axis: usize) -> Self {
        self.import.model = self.import.model.mirrored(axis);
        (self.bounds.min[axis], self.bounds.max[axis]) = (-self.bounds.max[axis], -self.bounds.min[axis]);
        self
    }

    /// The file's name, without its folder.
    #[must_use]
    pub fn name(&self) -> String {
        self.path.file_name().map_or_else(String::new, |n| n.to_string_lossy().into_owned())
    }

    /// The faces.
    #[must_use]
    pub fn model(&self) -> &Model {
        &self.import.model
    }
}
