//! Generates samples by name, scales them and writes them as IGES or STEP with their answers.

use std::ffi::OsString;
use std::path::{Path, PathBuf};

use claymill_exchange::{WriteError, write_iges, write_step};
use thiserror::Error;

use crate::{Flaw, FlawError, RoadsterOptions, Sample, panel, ribbon, roadster};

/// The names that [`write_sample`] knows.
pub const SAMPLES: [&str; 3] = ["roadster", "panel", "ribbon"];

/// Why a sample could not be written.
#[derive(Debug, Error)]
pub enum SampleError {
    /// There is no such sample.
    #[error("there is no sample named `{name}`; the samples are: {}", SAMPLES.join(", "))]
    Unknown {
        /// The name asked for.
        name: String,
    },
    /// A flaw cannot be planted.
    #[error(transparent)]
    Flaw(#[from] FlawError),
    /// The model could not be written.
    #[error(transparent)]
    Model(#[from] WriteError),
    /// The answers could not be written.
    #[error("{}: cannot be written: {source}", path.display())]
    Answers {
        /// The file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
}

/// Generates the sample `name` with flaws planted.
///
/// # Errors
/// There is no such sample, or a flaw cannot be planted into it.
pub fn generate(name: &str, options: &RoadsterOptions, flaws: &[Flaw]) -> Result<Sample, SampleError> {
    match name {
        "roadster" => Ok(roadster(options).damaged(flaws, options.seed)?),
        "panel" => Ok(panel(options.patches, options.seed).damaged(flaws, options.seed)?),
        "ribbon" => Ok(ribbon(options.patches, options.seed, flaws)?),
        _ => Err(SampleError::Unknown { name: name.to_owned() }),
    }
}

/// Generates the sample `name` and writes it; see [`Sample::write`].
///
/// # Errors
/// As [`generate`] and [`Sample::write`].
pub fn write_sample(name: &str, options: &RoadsterOptions, path: &Path) -> Result<Sample, SampleError> {
    let sample = generate(name, options, &[])?;
    sample.write(path)?;
    Ok(sample)
}

impl Sample {
    /// Writes the model to `path`, as STEP where that ends in `.stp` or `.step`, else as IGES, and its answers beside it (`roadster.igs`,
    /// `roadster.answers.json`). The model holds faces only: no groups, names or layers that would tell.
    /// The same sample gives the same bytes.
    ///
    /// # Errors
    /// One of the files cannot be written; one that could not be written whole is not left behind.
    pub fn write(&self, path: &Path) -> Result<(), SampleError> {
        let is_step =
            path.extension().is_some_and(|e| ["stp", "step"].iter().any(|step| e.eq_ignore_ascii_case(step)));
        if is_step { write_step(path, &self.model, &[]) } else { write_iges(path, &self.model, &[]) }?;
        write_answers(self, &path.with_extension("answers.json"))
    }

    /// The same vehicle at another scale: 0.4 is what studios call a two-fifths model.
    #[must_use]
    pub fn scaled(mut self, factor: f64) -> Self {
        for face in &mut self.model.faces {
            face.surface = face.surface.mapped(|p| p * factor);
        }
        for joint in &mut self.answers.joints {
            joint.length_mm *= factor;
        }
        self.answers.totals.joint_length_mm *= factor;
        for planted in &mut self.answers.flaws {
            planted.length_mm *= factor;
            planted.size *= match planted.flaw.parse() {
                Ok(Flaw::Gap(_) | Flaw::Shift(_) | Flaw::Round(_)) => factor,
                Ok(Flaw::Curvature(_)) => 1.0 / factor,
                _ => 1.0,
            };
        }
        self.model.coordinate_step_mm *= factor;
        self
    }
}

fn write_answers(sample: &Sample, path: &Path) -> Result<(), SampleError> {
    let failed = |source| SampleError::Answers { path: path.into(), source };
    let text = serde_json::to_vec(&sample.answers).map_err(|e| failed(e.into()))?;
    let mut beside = OsString::from(path);
    beside.push(".partial");
    let written = std::fs::write(&beside, text).and_then(|()| std::fs::rename(&beside, path));
    written.map_err(|source| {
        // What is half-written is of no use; that it cannot be removed either adds nothing to the message.
        let _ = std::fs::remove_file(&beside);
        failed(source)
    })
}
