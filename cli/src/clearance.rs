//! Whether a job may go to a machine.

use std::path::Path;

use claymill::{Cleared, JobFolder, Standing};

use crate::commands::Context;
use crate::failure::Failure;

/// A job that may be run: one whose very moves passed verification, or one that was asked for all the same.
pub(crate) fn cleared(context: &Context, folder: &Path, unverified: bool) -> Result<Cleared, Failure> {
    let job = JobFolder::open(folder)?;
    if !unverified {
        return Ok(job.cleared()?);
    }
    if *job.standing() != Standing::Passed {
        context.console.say(format!("warning: UNVERIFIED: {}", job.standing()));
    }
    Ok(job.cleared_on_request())
}
