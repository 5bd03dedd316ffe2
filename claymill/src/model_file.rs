//! A model file that was read and measured.

use std::path::{Path, PathBuf};

use claymill_exchange::Import;
use claymill_nurbs::{Aabb, Face, Model};
use claymill_toolpath::Mirror;
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
    /// The faces are images of those in the file, or these and their images.
    pub mirror: Option<Mirror>,
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
    Ok(ModelFile { path: path.to_owned(), import, face_area_mm2, bounds, mirror: None })
}

impl ModelFile {
    /// The image of what the file holds, or both. A job remembers that it is of the image.
    #[must_use]
    pub fn mirrored(mut self, mirror: Mirror) -> Self {
        let Mirror { axis, keeps_model } = mirror;
        let mut image = self.bounds;
        (image.min[axis], image.max[axis]) = (-image.max[axis], -image.min[axis]);
        self.import.model = mirror.of(&self.import.model);
        self.mirror = Some(mirror);
        self.bounds = if keeps_model { self.bounds.union(&image) } else { image };
        if keeps_model {
            self.face_area_mm2.extend_from_within(..);
        }
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
