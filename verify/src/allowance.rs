//! A job with an allowance, as the tool that touches the surface where the job's own leaves the allowance.
//!
//! A ball that stays `e` off all faces is one that is larger by `e` and touches them, with the same centre (Minkowski sum). All
//! measurements are made with that one: what it enters is less than the allowance, and its cusps are those of the step-over.

use std::borrow::Cow;

use claymill_toolpath::{Job, Program, raise_tips, swollen_scallop_mm};

use crate::error::VerifyError;

/// The job and its moves on the surface itself.
///
/// # Errors
/// Nothing is left of a tool, or one with an allowance is no ball.
pub(crate) fn on_the_surface<'a>(
    job: &'a Job,
    program: &'a Program,
) -> Result<(Cow<'a, Job>, Cow<'a, Program>), VerifyError> {
    let allowance_mm = job.request.allowance_mm;
    if allowance_mm == 0.0 {
        return Ok((Cow::Borrowed(job), Cow::Borrowed(program)));
    }
    let (mut swollen, mut program) = (job.clone(), program.clone());
    let request = &mut swollen.request;
    request.scallop_mm = swollen_scallop_mm(request.tool.radius_mm(), request.scallop_mm, allowance_mm);
    let tools = swollen.tools.iter_mut().map(|record| &mut record.tool);
    for tool in tools.chain([&mut request.tool]).chain(&mut request.rest_of) {
        let too_small = || VerifyError::Allowance { tool: tool.to_string(), allowance_mm };
        *tool = tool.swollen(allowance_mm).ok_or_else(too_small)?;
    }
    // The holder is where it is.
    for holder in swollen.tools.iter_mut().filter_map(|record| record.holder.as_mut()) {
        holder.stick_out_mm += allowance_mm;
    }
    for mm in swollen.tools.iter_mut().flat_map(|record| record.setup_stick_out_mm.values_mut()) {
        *mm += allowance_mm;
    }
    raise_tips(&mut program.moves, -allowance_mm);
    request.allowance_mm = 0.0;
    Ok((Cow::Owned(swollen), Cow::Owned(program)))
}
