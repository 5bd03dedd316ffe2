//! Why a model file cannot be read at all, with advice. A damaged face is no such error: it is
//! skipped and reported.

use std::path::PathBuf;

use thiserror::Error;

use crate::ImportReport;

/// Why a file could not be read at all. A single damaged face is no error: see
/// [`ImportReport::skipped`].
#[derive(Debug, Error)]
pub enum ReadError {
    /// The operating system refuses.
    #[error("{}: cannot be opened: {source}", path.display())]
    Open {
        /// The file.
        path: PathBuf,
        /// What the operating system says.
        source: std::io::Error,
    },
    /// Nothing, or nothing but white space.
    #[error("{}: the file is empty", path.display())]
    Empty {
        /// The file.
        path: PathBuf,
    },
    /// Neither IGES nor STEP nor 3dm, whatever the extension says.
    #[error("{}: not an IGES, STEP or 3dm file; it looks like {found}", path.display())]
    UnknownFormat {
        /// The file.
        path: PathBuf,
        /// What the content looks like, in words.
        found: String,
    },
    /// The format is right but this flavour of it cannot be read.
    #[error("{}: {what} cannot be read", path.display())]
    Unsupported {
        /// The file.
        path: PathBuf,
        /// The flavour: `IGES in compressed form`.
        what: String,
    },
    /// The file ends before it should.
    #[error("{}: the file breaks off: {what}", path.display())]
    Truncated {
        /// The file.
        path: PathBuf,
        /// What is missing and where.
        what: String,
    },
    /// The frame of the file (not one face) makes no sense.
    #[error("{}: {entity}: {what}", path.display())]
    Damaged {
        /// The file.
        path: PathBuf,
        /// Where: `global section`, `DE 17`, `#12`.
        entity: String,
        /// What is wrong there.
        what: String,
    },
    /// Parts are placed within parts, or entities used again and again, until the whole is larger than any vehicle.
    #[error("{}: {entity}: {what}", path.display())]
    TooMuch {
        /// The file.
        path: PathBuf,
        /// What unfolds: `#12`, `DE 17`.
        entity: String,
        /// To how much.
        what: String,
    },
    /// The file was read but holds no face that can be used.
    #[error("{}: no usable face: {}", path.display(), faceless(report))]
    NoFaces {
        /// The file.
        path: PathBuf,
        /// What the file does hold.
        report: Box<ImportReport>,
    },
}

impl ReadError {
    /// What the user can do about it: one whole sentence.
    #[must_use]
    pub fn advice(&self) -> String {
        match self {
            ReadError::Open { .. } => "Check the path and the permissions; it must be a file.".into(),
            ReadError::Empty { .. } => "Export or copy the file again; the disk may have been full.".into(),
            ReadError::UnknownFormat { .. } => {
                "Export the model as IGES 5.3 (trimmed surfaces) or STEP AP214 and hand over that file."
                    .into()
            }
            ReadError::Unsupported { .. } => {
                "Export the model as plain-text IGES 5.3 (fixed ASCII) or STEP AP214.".into()
            }
            ReadError::Truncated { .. } => {
                "Copy or export the file again and compare its size with the original.".into()
            }
            ReadError::Damaged { .. } => "Export the file again from its original system.".into(),
            ReadError::TooMuch { .. } => {
                "If the file is sound, export the parts that are to be cut, each once, instead of the whole assembly."
                    .into()
            }
            ReadError::NoFaces { report, .. } => match report.skipped.first() {
                Some(first) => format!("Every face was skipped; for the first one: {}", first.advice),
                None => {
                    "Export surfaces (IGES 144, 128 or B-rep; STEP shells; Rhino polysurfaces), not wireframe or a mesh."
                        .into()
                }
            },
        }
    }
}

/// Why a report has no face.
fn faceless(report: &ImportReport) -> String {
    if let Some(first) = report.skipped.first() {
        let count = report.skipped.len();
        return format!("all {count} faces are damaged, the first ({}): {}", first.entity, first.reason);
    }
    if report.entities.is_empty() {
        return "it holds no entities".into();
    }
    let kinds: Vec<_> =
        report.entities.iter().map(|(name, count)| format!("{} × {name}", count.in_file)).collect();
    format!("it holds only {}", kinds.join(", "))
}
