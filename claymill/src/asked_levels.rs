//! Whether levels can be meant as they are asked for.

use claymill_clearing::{LARGEST_LIMIT_DEG, LEAST_LIMIT_DEG};
use claymill_paths::PlanOptions;
use claymill_toolpath::Levels;

use crate::job_error::JobError;
use crate::limits::{LEAST_RAMP_DEG, STEEPEST_RAMP_DEG};

/// Whether an operation with these options can rough by levels.
///
/// # Errors
/// They cannot, and what of it.
pub(crate) fn check(levels: &Levels, options: &PlanOptions) -> Result<(), JobError> {
    let Levels { step_down_mm, engagement_deg, band_mm, dead_centre_mm, ramp_deg } = *levels;
    if !(LEAST_LIMIT_DEG..=LARGEST_LIMIT_DEG).contains(&engagement_deg) {
        return Err(JobError::Engagement { engagement_deg });
    }
    let flutes_mm = options.tool.flute_length_mm.unwrap_or(f64::INFINITY);
    if !(step_down_mm > 0.0 && step_down_mm.is_finite()) {
        return Err(JobError::StepDown { step_down_mm });
    }
    if step_down_mm > flutes_mm {
        return Err(JobError::StepBelowFlutes { step_down_mm, flutes_mm });
    }
    if !(band_mm > 0.0 && band_mm.is_finite()) {
        return Err(JobError::Band { band_mm });
    }
    let diameter_mm = 2.0 * options.tool.radius_mm();
    if let Some(dead_centre_mm) = dead_centre_mm.filter(|mm| !(0.0..diameter_mm).contains(mm)) {
        return Err(JobError::DeadCentre { dead_centre_mm, diameter_mm });
    }
    if let Some(ramp_deg) = ramp_deg.filter(|deg| !(LEAST_RAMP_DEG..=STEEPEST_RAMP_DEG).contains(deg)) {
        return Err(JobError::Ramp { ramp_deg });
    }
    let refused = [
        (options.allowance_mm < 0.0, "an allowance below the surface"),
        (options.rest_of.is_some() || options.rest_above_mm.is_some(), "rest_of and rest_above"),
        (!options.bounds.is_centre_box_at_most(), "bounds other than centre_within, and faces to be avoided"),
        (options.pencil, "pencil passes"),
        (options.tool.taper_deg.is_some(), "a tool with a taper"),
    ];
    match refused.into_iter().find(|(asked, _)| *asked) {
        Some((_, what)) => Err(JobError::NotByLevels { what }),
        None => Ok(()),
    }
}
