//! Why a job cannot be verified at all, with advice. Defects of the job are findings in the report.

use std::path::PathBuf;

use claymill_exchange::{MeshError, ReadError, SolidError};
use claymill_toolpath::{Cancelled, FolderError, MoveError};
use thiserror::Error;

use crate::stock::StockError;

/// Why a job could not be verified at all. Defects of the job itself are findings, not errors.
#[derive(Debug, Error)]
pub enum VerifyError {
    /// The job folder cannot be read.
    #[error(transparent)]
    Folder(#[from] FolderError),
    /// The model file cannot be read.
    #[error(transparent)]
    Model(#[from] ReadError),
    /// An obstacle cannot be read.
    #[error(transparent)]
    Obstacle(#[from] MeshError),
    /// The file of the stock cannot be read, or encloses nothing.
    #[error("stock: {0}")]
    Solid(#[from] SolidError),
    /// The job was written in a format that this version does not know.
    #[error("job.json has format version {found}, this claymill reads version {known}")]
    Version {
        /// What the file says.
        found: u32,
        /// What is known.
        known: u32,
    },
    /// The model file or an obstacle is not the one that the job was planned on.
    #[error("{}: the file has changed since the job was planned (SHA-256 {found}, the job has {expected})", path.display())]
    ModelChanged {
        /// The file.
        path: PathBuf,
        /// Hash in `job.json`.
        expected: String,
        /// Hash of the file.
        found: String,
    },
    /// The allowance does not suit a tool.
    #[error(
        "job.json: an allowance of {allowance_mm} mm does not suit the tool {tool}: it has to be a ball that is larger"
    )]
    Allowance {
        /// The tool.
        tool: String,
        /// As the job has it.
        allowance_mm: f64,
    },
    /// A job of a flat or bull-nosed end asks for what is measured of balls only.
    #[error("job.json: {what} of ball ends only: not of {tool}")]
    End {
        /// The tool.
        tool: String,
        /// What there is for balls only, as the beginning of a sentence.
        what: &'static str,
    },
    /// The stock of the job cannot be followed.
    #[error("the stock of the job: {0}")]
    Stock(#[from] StockError),
    /// The work was to end without a result.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
    /// A move is not a curve.
    #[error("toolpaths.jsonl: {0}")]
    Move(#[from] MoveError),
    /// A move names a tool or setup that the job does not list.
    #[error("toolpaths.jsonl: move {seq} names {what} `{name}`, which job.json does not list")]
    Unknown {
        /// The move.
        seq: u64,
        /// "tool" or "setup".
        what: &'static str,
        /// The name.
        name: String,
    },
    /// A move leads far away from the model.
    #[error(
        "toolpaths.jsonl: move {seq} leads {farthest_mm:.0} mm away from the model: more than {limit_mm:.0} mm are implausible"
    )]
    Astray {
        /// The move.
        seq: u64,
        /// How far, mm.
        farthest_mm: f64,
        /// How far it may be, mm.
        limit_mm: f64,
    },
}

impl VerifyError {
    /// What the user can do about it: one whole sentence.
    #[must_use]
    pub fn advice(&self) -> String {
        match self {
            VerifyError::Folder(_)
            | VerifyError::Move(_)
            | VerifyError::Unknown { .. }
            | VerifyError::Allowance { .. }
            | VerifyError::Stock(_)
            | VerifyError::Astray { .. } => {
                "Plan the job again with `claymill plan`; the folder is incomplete or was edited.".into()
            }
            VerifyError::Cancelled(_) => "Verify the folder again.".into(),
            VerifyError::Model(e) => e.advice(),
            VerifyError::Obstacle(e) => e.advice().into(),
            VerifyError::Solid(e) => e.advice(),
            VerifyError::End { .. } => {
                "Leave that out, or plan the job with a ball, for example --tool ball:10.".into()
            }
            VerifyError::Version { .. } => {
                "Use the version of claymill that planned the job, or plan it again.".into()
            }
            VerifyError::ModelChanged { .. } => {
                "Plan the job again on the changed model, or point --model to the original file.".into()
            }
        }
    }
}
