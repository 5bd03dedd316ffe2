use std::collections::BTreeMap;

use claymill_nurbs::Model;
use serde::{Deserialize, Serialize};

use crate::Format;

/// A model and the story of its reading.
#[derive(Debug, Clone)]
pub struct Import {
    /// The faces that could be read, mm.
    pub model: Model,
    /// What was in the file and what became of it.
    pub report: ImportReport,
}

/// What was in a file and what became of it.
///
/// `faces_in_file == faces_read + skipped.len()` always holds.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ImportReport {
    /// The format that was recognised.
    pub format: Format,
    /// The program that wrote the file, as far as it says so.
    pub system: Option<String>,
    /// The unit of length and the scale that was applied.
    pub units: Units,
    /// The tolerance that the file declares, mm; 0 when it declares none.
    pub tolerance_mm: f64,
    /// Faces that the file holds.
    pub faces_in_file: usize,
    /// Faces in the model.
    pub faces_read: usize,
    /// The faces that are missing from the model, in file order.
    pub skipped: Vec<Skipped>,
    /// What was mended in faces that were read, in file order.
    pub repairs: Vec<Repair>,
    /// How many entities of each type the file holds and how many of them served a face, by type:
    /// `128 B-spline surface`, `ADVANCED_FACE`.
    pub entities: BTreeMap<String, EntityCount>,
    /// Whole sentences about things to check before machining: implausible size, unknown unit, ...
    pub warnings: Vec<String>,
}

/// The unit of length of a file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Units {
    /// As the file declares it: `MM`, `INCH`, `METRE`.
    pub declared: String,
    /// Every length was multiplied by this: millimetres in one file unit, model scale included.
    pub mm_per_unit: f64,
}

/// A face of the file that is not in the model.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Skipped {
    /// The entity in the file: `DE 4711`, `#4711`.
    pub entity: String,
    /// What it is: `144 trimmed surface`, `ADVANCED_FACE`.
    pub what: String,
    /// What is wrong with it.
    pub reason: String,
    /// What to do about it.
    pub advice: String,
}

/// A face that needed mending to be read.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Repair {
    /// The entity in the file: `DE 4711`, `#4711`.
    pub entity: String,
    /// What was done: `gap in trim loop bridged`.
    pub what: String,
    /// How large the defect was, mm.
    pub size_mm: f64,
}

/// Entities of one type.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct EntityCount {
    /// In the file.
    pub in_file: usize,
    /// Used for a face, its name, colour or layer.
    pub used: usize,
}

impl ImportReport {
    /// The report of a file of which nothing but the format is known yet.
    pub(crate) fn new(format: Format) -> Self {
        ImportReport {
            format,
            system: None,
            units: Units { declared: String::new(), mm_per_unit: 1.0 },
            tolerance_mm: 0.0,
            faces_in_file: 0,
            faces_read: 0,
            skipped: Vec::new(),
            repairs: Vec::new(),
            entities: BTreeMap::new(),
            warnings: Vec::new(),
        }
    }
}
