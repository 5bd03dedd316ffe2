//! What reading a file gives: the model, and a report of units, skipped faces, repairs and
//! warnings. Size, unit and doubtful faces are checked for plausibility.

use std::collections::BTreeMap;

use claymill_nurbs::{Aabb, Model, Point3};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::trim::BRIDGED_MM;
use crate::{FaceReading, Format, audit};

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
    /// What the file says of each face that was read, and whether that is what was read: in the model's order.
    pub faces: Vec<FaceReading>,
    /// What was mended or approximated in faces that were read, in file order.
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

/// A face that was mended, or approximated, to be read.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Repair {
    /// The entity in the file: `DE 4711`, `#4711`.
    pub entity: String,
    /// What was done: `gap in trim loop bridged`.
    pub what: String,
    /// How large the defect or the deviation is, mm.
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

/// Models with a larger diagonal than this, mm, are no vehicle or part: 100 m.
const LARGEST_PLAUSIBLE_MM: f64 = 1e5;
/// Models with a smaller diagonal than this, mm, are no vehicle or part.
const SMALLEST_PLAUSIBLE_MM: f64 = 10.0;

/// Nets of fewer neighbours than this tell nothing.
const FEWEST_STEPS: usize = 1000;
/// Half of the neighbouring control points of a part are farther apart than this, mm: finer nets come from metres
/// that are declared as millimetres.
const FINEST_NET_MM: f64 = 0.2;

impl Import {
    /// Adds a warning where the size makes the declared unit doubtful.
    pub(crate) fn with_size_checked(mut self) -> Self {
        let mut bounds = Aabb::empty();
        let mut steps = Vec::new();
        for face in &self.model.faces {
            let columns = face.surface.size().1;
            let net: Vec<Point3> = face.surface.net().iter().map(|h| Point3::from(h.xyz() / h.w)).collect();
            net.iter().for_each(|p| bounds.add(p));
            steps.extend(
                net.windows(2)
                    .enumerate()
                    .filter(|(k, _)| (k + 1) % columns != 0)
                    .map(|(_, w)| (w[1] - w[0]).norm()),
            );
            steps.extend(net.iter().zip(&net[columns..]).map(|(a, b)| (b - a).norm()));
        }
        let diagonal = bounds.diagonal();
        let unit = &self.report.units.declared;
        if !bounds.is_empty() && !(SMALLEST_PLAUSIBLE_MM..=LARGEST_PLAUSIBLE_MM).contains(&diagonal) {
            self.report.warnings.push(format!(
                "The model is {diagonal:.3} mm across, which is implausible for a vehicle or a part: check the unit \
                 ({unit}) in the original system."
            ));
            return self;
        }
        let middle = steps.len() / 2;
        if steps.len() > FEWEST_STEPS {
            let (_, median, _) = steps.select_nth_unstable_by(middle, f64::total_cmp);
            if *median < FINEST_NET_MM {
                self.report.warnings.push(format!(
                    "Half of the control points are nearer than {median:.3} mm to their neighbours, in a model of \
                     {diagonal:.1} mm, which is implausible for a vehicle or a part: check the unit ({unit}) in the \
                     original system."
                ));
            }
        }
        self
    }
}

/// So many faces in doubt are named one by one.
const NAMED: usize = 5;

impl Import {
    /// Adds a warning for faces of which the file's own edges say something else, and for wide gaps.
    pub(crate) fn with_doubts_told(mut self) -> Self {
        let report = &mut self.report;
        if report.faces.is_empty() {
            // Of a format that is not looked at a second time.
            let told_nothing = |face| audit::reading(face, &audit::Bounds::default(), 0.0);
            report.faces = self.model.faces.par_iter().map(told_nothing).collect();
        }
        let doubtful =
            || (report.faces.iter().enumerate()).filter_map(|(k, f)| Some((k, f, f.doubt.as_ref()?)));
        let told = |(k, face, doubt): (usize, &FaceReading, &String)| {
            format!(
                "Face {k} ({}) is in doubt: {doubt}. Compare it with the original, or leave it out.",
                face.entity
            )
        };
        let mut warnings: Vec<String> = doubtful().take(NAMED).map(told).collect();
        let more = doubtful().skip(NAMED).count();
        if more > 0 {
            warnings.push(format!("{more} more faces are in doubt; claymill inspect --json lists all."));
        }
        let wide = report.repairs.iter().filter(|r| r.what.contains("bridged") && r.size_mm > BRIDGED_MM);
        warnings.extend(wide.map(|r| {
            format!(
                "{}: a gap of {:.3} mm in a trim loop was closed by a straight line. Compare the face with the original, \
                 or leave it out.",
                r.entity, r.size_mm
            )
        }));
        report.warnings.append(&mut warnings);
        self
    }
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
            faces: Vec::new(),
            repairs: Vec::new(),
            entities: BTreeMap::new(),
            warnings: Vec::new(),
        }
    }
}
