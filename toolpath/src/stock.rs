//! What a model is cut from.

use std::path::{Path, PathBuf};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::{FilePlace, find_file};

/// What the model is cut from.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "shape", rename_all = "snake_case")]
pub enum Stock {
    /// A layer on all faces, as clay on an armature.
    Layer {
        /// Its thickness along the faces' normals, mm.
        thickness_mm: f64,
    },
    /// A block whose sides are along the model's axes.
    Block {
        /// Box: xmin, ymin, zmin, xmax, ymax, zmax.
        box_mm: [f64; 6],
    },
    /// A round bar along an axis of the model.
    Bar {
        /// Middle of its lower end, mm.
        from_mm: [f64; 3],
        /// Middle of its upper end, mm: farther along one axis.
        to_mm: [f64; 3],
        /// Its diameter, mm.
        diameter_mm: f64,
    },
    /// What a file encloses: a casting, a body that was cut roughly, or what an earlier job left.
    File(StockFile),
}

/// A file whose inside is stock: a closed mesh (STL, OBJ, glTF), or solids (IGES, STEP, 3dm).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct StockFile {
    /// The file, as given on the command line or in the job file. It lies where it fits the model: both have one zero.
    pub path: String,
    /// The same, to be found again from the job folder and from anywhere.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub place: Option<FilePlace>,
    /// SHA-256 of its bytes; empty as long as nobody has read it.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub sha256: String,
    /// Millimetres in one of its units, where its format has none.
    #[serde(default = "millimetre", skip_serializing_if = "is_millimetre")]
    pub unit_mm: f64,
    /// Box around it: xmin, ymin, zmin, xmax, ymax, zmax; `None` as long as nobody has read it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub box_mm: Option<[f64; 6]>,
}

fn millimetre() -> f64 {
    1.0
}

#[allow(clippy::trivially_copy_pass_by_ref, reason = "serde passes a reference")]
fn is_millimetre(unit_mm: &f64) -> bool {
    *unit_mm == 1.0
}

impl StockFile {
    /// A file that was not read yet.
    #[must_use]
    pub fn at(path: &Path, unit_mm: f64) -> Self {
        StockFile {
            path: path.display().to_string(),
            place: None,
            sha256: String::new(),
            unit_mm,
            box_mm: None,
        }
    }

    /// Its file, as seen from the job folder `folder`.
    #[must_use]
    pub fn find(&self, folder: &Path) -> PathBuf {
        find_file(folder, &self.path, self.place.as_ref(), &self.sha256)
    }
}

impl Stock {
    /// Its box, as xmin, ymin, zmin, xmax, ymax, zmax, mm; of a layer none is known without the model, of a file none before
    /// it was read.
    #[must_use]
    pub fn box_mm(&self) -> Option<[f64; 6]> {
        match *self {
            Stock::Layer { .. } => None,
            Stock::File(ref file) => file.box_mm,
            Stock::Block { box_mm } => Some(box_mm),
            Stock::Bar { from_mm, to_mm, diameter_mm } => {
                let axis = self.bar_axis();
                let half = |k: usize| if Some(k) == axis { 0.0 } else { 0.5 * diameter_mm };
                Some(std::array::from_fn(|i| match i {
                    0..3 => from_mm[i] - half(i),
                    _ => to_mm[i - 3] + half(i - 3),
                }))
            }
        }
    }

    /// The axis along which a bar lies: 0 for x, 1 for y, 2 for z. `None` for what is no bar, or does not ascend along one axis.
    #[must_use]
    pub fn bar_axis(&self) -> Option<usize> {
        let Stock::Bar { from_mm, to_mm, .. } = self else { return None };
        let mut along = (0..3).filter(|&k| from_mm[k] != to_mm[k]);
        let axis = along.next().filter(|&k| from_mm[k] < to_mm[k])?;
        along.next().is_none().then_some(axis)
    }
}
