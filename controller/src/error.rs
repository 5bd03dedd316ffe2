//! Refusals by rule, and why programs cannot be read, jobs cannot be written and machine
//! definitions cannot be used.

use std::io;
use std::path::PathBuf;

use claymill_toolpath::{FolderError, MoveError, OutputError};
use thiserror::Error;

/// What a control would reject, or accept and execute wrongly.
#[derive(Debug, Clone, PartialEq, Error)]
#[error("{rule}: {detail}")]
pub struct Refusal {
    /// The rule's name, for example `fanuc-ps1009`.
    pub rule: &'static str,
    /// What is wrong, with its figures.
    pub detail: String,
}

impl Refusal {
    /// A refusal under `rule`.
    pub fn new(rule: &'static str, detail: impl Into<String>) -> Self {
        Refusal { rule, detail: detail.into() }
    }
}

/// Why a program could not be read.
#[derive(Debug, Error)]
pub enum ReadError {
    /// The file cannot be read.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What the operating system said.
        source: io::Error,
    },
    /// A block breaks a rule of its dialect.
    #[error("{} line {line}: {refusal}", path.display())]
    Refused {
        /// The file.
        path: PathBuf,
        /// Line, from 1.
        line: usize,
        /// The rule and what is wrong.
        refusal: Refusal,
    },
    /// No dialect recognises the file.
    #[error("{}: which control the program is for cannot be told from its first lines", .0.display())]
    Unrecognised(PathBuf),
    /// The program does not follow the job.
    #[error("{}: {what}", path.display())]
    Astray {
        /// The file.
        path: PathBuf,
        /// Where it leaves the job.
        what: String,
    },
}

/// Why a job could not be written for a control.
#[derive(Debug, Error)]
pub enum PostError {
    /// The job folder cannot be read.
    #[error(transparent)]
    Folder(#[from] FolderError),
    /// The destination is not written over.
    #[error(transparent)]
    Output(#[from] OutputError),
    /// A move is no curve.
    #[error("toolpaths.jsonl: {0}")]
    Move(#[from] MoveError),
    /// A move names a setup that the job does not list, or the job has no moves.
    #[error("job.json: {0}")]
    Job(String),
    /// Writing failed.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What the operating system said.
        source: io::Error,
    },
    /// The control would execute the move wrongly or not at all.
    #[error("move {seq}: {refusal}")]
    Refused {
        /// The move.
        seq: u64,
        /// The rule and what is wrong.
        refusal: Refusal,
    },
    /// The machine does not reach what the job asks for.
    #[error("the machine does not reach the whole job:\n  {}", .0.join("\n  "))]
    Limits(Vec<String>),
    /// What was written could not be read back.
    #[error("read back: {0}")]
    ReadBack(#[from] ReadError),
    /// A move of the job did not survive.
    #[error("read back: move {seq} {what}")]
    Lost {
        /// What happened to it.
        what: String,
        /// The move.
        seq: u64,
    },
    /// What was written is not the job.
    #[error(
        "the program read back differs from the job by {found_mm} mm at move {seq}, more than {stated_mm} mm"
    )]
    Differs {
        /// Largest difference, mm.
        found_mm: f64,
        /// What was promised, mm.
        stated_mm: f64,
        /// Where.
        seq: u64,
    },
}

/// Why a machine definition is unusable.
#[derive(Debug, Error)]
pub enum MachineError {
    /// The file cannot be read.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What the operating system said.
        source: io::Error,
    },
    /// Not TOML of the documented form.
    #[error("{}: {source}", path.display())]
    Syntax {
        /// The file.
        path: PathBuf,
        /// Place and reason.
        source: Box<toml::de::Error>,
    },
    /// A value that makes no sense.
    #[error("machine definition: {field} {what}")]
    Value {
        /// The field.
        field: &'static str,
        /// What is wrong with it.
        what: String,
    },
}
