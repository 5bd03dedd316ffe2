//! Why a file of tools, machines, materials or processes is refused, and what to do about it.

use std::path::{Path, PathBuf};

use thiserror::Error;

/// Why a file was refused. The message names file, entry and cause; [`advice`](Self::advice) is the remedy.
#[derive(Debug, Error)]
pub enum ToolingError {
    /// The operating system did not give the file.
    #[error("cannot read {}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
    /// No format that is known.
    #[error("{}: {what}", path.display())]
    Format {
        /// The file.
        path: PathBuf,
        /// What it looks like.
        what: String,
    },
    /// The file is damaged, or has fields that its format does not have.
    #[error("{}: {what}", path.display())]
    Syntax {
        /// The file.
        path: PathBuf,
        /// What is wrong, with the place where it is known.
        what: String,
    },
    /// A version of the format that is not known.
    #[error("{}: version {found} of {format} is not known; version {known} is", path.display())]
    Version {
        /// The file.
        path: PathBuf,
        /// The format's name.
        format: &'static str,
        /// Version that the file states.
        found: String,
        /// Version that is read.
        known: u64,
    },
    /// More entries, or more bytes, than any real file has.
    #[error("{}: more than {most} {what}", path.display())]
    TooMuch {
        /// The file.
        path: PathBuf,
        /// What there is too much of.
        what: &'static str,
        /// The bound.
        most: usize,
    },
    /// An entry makes no sense.
    #[error("{}: {entry}: {fault}", path.display())]
    Entry {
        /// The file.
        path: PathBuf,
        /// Name of the tool, stage or axis.
        entry: String,
        /// What is wrong and what to do.
        fault: Fault,
    },
    /// Profiles that inherit from each other in a circle, or from one that is not there, or that contradict.
    #[error("process {process}: {fault}")]
    Process {
        /// Name of the profile that was to be resolved.
        process: String,
        /// What is wrong and what to do.
        fault: Fault,
    },
}

/// What is wrong with an entry, and the remedy.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("{what}")]
pub struct Fault {
    /// The cause with its figures.
    pub what: String,
    /// What to do.
    pub remedy: String,
}

impl Fault {
    pub(crate) fn new(what: impl Into<String>, remedy: impl Into<String>) -> Self {
        Fault { what: what.into(), remedy: remedy.into() }
    }

    pub(crate) fn of_entry(self, path: &Path, entry: &str) -> ToolingError {
        ToolingError::Entry { path: path.to_owned(), entry: entry.to_owned(), fault: self }
    }
}

impl ToolingError {
    /// One line of advice.
    #[must_use]
    pub fn advice(&self) -> &str {
        match self {
            ToolingError::Io { .. } => "Check the path and the rights of the file.",
            ToolingError::Format { .. } => {
                "Give a claymill tool file (.toml), a Fusion library (.json, .tools), a FreeCAD tool bit (.fctb) or \
                 a LinuxCNC tool table (.tbl)."
            }
            ToolingError::Syntax { .. } => {
                "Export the file again, or correct the place named. docs/tools.md has the form of claymill's own files."
            }
            ToolingError::Version { .. } => {
                "Save the file in the version that is read, or use a claymill that reads this one."
            }
            ToolingError::TooMuch { .. } => "Split the file.",
            ToolingError::Entry { fault, .. } | ToolingError::Process { fault, .. } => &fault.remedy,
        }
    }

    pub(crate) fn syntax(path: &Path, what: impl std::fmt::Display) -> Self {
        ToolingError::Syntax { path: path.to_owned(), what: what.to_string() }
    }
}

/// A name as messages and tables show it: one line of at most 80 characters.
pub(crate) fn one_line(text: &str) -> String {
    let clean: String = text.chars().map(|c| if c.is_control() { ' ' } else { c }).take(80).collect();
    clean.trim().to_owned()
}
