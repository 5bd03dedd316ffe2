//! Whether a job may go to a machine.

use std::path::Path;

use claymill_toolpath::{Job, Program, Standing, read_judged};

use crate::commands::Context;
use crate::failure::Failure;

/// A job that may be run: one whose very moves passed verification, or one that was asked for all the same. What a program of
/// it must say then comes with it.
pub(crate) fn cleared(
    context: &Context,
    folder: &Path,
    unverified: bool,
) -> Result<(Job, Program, Option<String>), Failure> {
    let (job, program, standing) = read_judged(folder)?;
    if standing == Standing::Passed {
        return Ok((job, program, None));
    }
    if !unverified {
        let advice = match standing {
            Standing::NotPassed { .. } => {
                "Change the job until it passes; --unverified runs it all the same, and its programs say so."
            }
            _ => {
                "Run `claymill verify` on the folder, or plan the job again; --unverified runs it all the same, and its \
                 programs say so."
            }
        };
        return Err(Failure::problem(format!("{}: {standing}", folder.display()), advice));
    }
    context.console.say(format!("warning: UNVERIFIED: {standing}"));
    let note = format!("UNVERIFIED JOB, {}: written on request, --unverified", standing.in_short());
    Ok((job, program, Some(note)))
}
