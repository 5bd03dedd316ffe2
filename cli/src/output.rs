//! What commands have to say before they write a file: which inputs must stay, and what is replaced.

use std::path::{Path, PathBuf};

use claymill_toolpath::{Job, Kind, Output, OutputError, job_files};

use crate::commands::Context;
use crate::failure::Failure;
use crate::interrupt::remove_on_interrupt;

impl From<OutputError> for Failure {
    fn from(error: OutputError) -> Self {
        let advice = match error {
            OutputError::Folder(e) => return e.into(),
            OutputError::Input { .. } => "Choose another name with -o; an input is never written over.",
            OutputError::Foreign(_) => "Choose another name, or say --force to replace it.",
            OutputError::Several { .. } => {
                "Name a file, or write one program for the whole job (files = \"one\")."
            }
        };
        Failure::problem(&error, advice)
    }
}

/// Looks at a destination before any work is done.
pub(crate) fn begin(
    context: &Context,
    told: &Path,
    kind: Kind,
    inputs: &[PathBuf],
) -> Result<Output, Failure> {
    if context.json && Output::is_standard(told) {
        return Err(Failure::usage(
            "--json and the file would both go to standard output",
            "Name a file with -o, or leave --json out.",
        ));
    }
    let output = Output::begin(told, kind, inputs, context.force)?;
    remove_on_interrupt(output.leftovers());
    Ok(output)
}

/// As [`begin`], for commands that print their result on standard output.
pub(crate) fn begin_beside_text(
    context: &Context,
    told: &Path,
    kind: Kind,
    inputs: &[PathBuf],
) -> Result<Output, Failure> {
    if Output::is_standard(told) {
        return Err(Failure::usage(
            "the result is printed on standard output already",
            "Name a file for the rest.",
        ));
    }
    begin(context, told, kind, inputs)
}

/// Writes to a destination through `by`, whose failures name the destination, not the place beside it.
pub(crate) fn staged<T, E: Into<Failure>>(
    out: &Output,
    told: &Path,
    by: impl FnOnce(&Path) -> Result<T, E>,
) -> Result<T, Failure> {
    by(&out.staged()).map_err(|e| e.into().about(out.folder(), told))
}

/// Writes bytes to a destination.
pub(crate) fn write(output: Output, kind: Kind, bytes: &[u8]) -> Result<(), Failure> {
    Ok(output.write(kind, bytes)?)
}

/// The files that a command reads of a model, or of a job in a folder and its model.
pub(crate) fn inputs(what: &Path, job: Option<&Job>, model: Option<&Path>) -> Vec<PathBuf> {
    let mut files = match job {
        Some(job) => {
            let mut files = job_files(what);
            files.push(job.model.find(what));
            files
        }
        None => vec![what.to_owned()],
    };
    files.extend(model.map(Path::to_owned));
    files
}

/// Makes folders on the way to a file.
pub(crate) fn make_parent(path: &Path) -> Result<(), Failure> {
    match path.parent().filter(|p| !p.as_os_str().is_empty()) {
        Some(parent) => std::fs::create_dir_all(parent).map_err(Failure::at(parent)),
        None => Ok(()),
    }
}
