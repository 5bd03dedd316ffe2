//! The whole job: what each setup cuts, the passes of each part, the program.
//!
//! ```text
//!   covered ──► laying ──► parts, each by itself ──► joining ──► Plan
//!   triangles   what a     passes of one setup       order, ways,
//!   over all    setup cuts  over one region          totals
//! ```

pub(crate) mod covered;
pub(crate) mod error;
mod joining;
pub(crate) mod kept_plan;
pub(crate) mod keys;
mod laying;
pub(crate) mod obstacles;
pub(crate) mod options;
pub(crate) mod parts;
pub(crate) mod planned;
pub(crate) mod probe_keys;
pub(crate) mod regions;
mod whole;

use std::ops::Range;

use claymill_nurbs::{FaceId, Model};
use claymill_toolpath::{Monitor, Stage};

use crate::plan::error::PlanError;
use crate::plan::laying::Laying;
use crate::plan::options::PlanOptions;
use crate::plan::planned::Plan;
use crate::plan::regions::Regions;
use crate::plan::whole::{Whole, check, on_the_surface};

/// Plans the whole job; see the crate's documentation for the stages.
///
/// The monitor is asked between stages, regions and parts: a part that is begun is finished first.
///
/// # Errors
/// Options that do not suit the model, faces that cannot be covered, nothing to cut, or the monitor ends it.
pub fn plan(
    model: &Model,
    regions: &Regions,
    options: &PlanOptions,
    monitor: &dyn Monitor,
) -> Result<Plan, PlanError> {
    let own = model.faces.len();
    plan_crowded(model, regions, own..own, options, monitor)
}

/// The same for a model of which these faces are obstacles.
pub(crate) fn plan_crowded(
    model: &Model,
    regions: &Regions,
    obstacles: Range<FaceId>,
    options: &PlanOptions,
    monitor: &dyn Monitor,
) -> Result<Plan, PlanError> {
    check(options, !obstacles.is_empty())?;
    let laid = on_the_surface(options)?;
    let whole = Whole::new(model, regions, obstacles, &laid)?;
    monitor.at(Stage::Setups, 0.0);
    let known = whole.keys.as_ref().and_then(|keys| keys.known_plan(model, regions));
    let plan = match known {
        Some(plan) => plan,
        None => {
            let (plan, left_out) = whole.laid(monitor, |laying| laying.plan())?;
            if left_out.is_empty() {
                whole.keys.as_ref().inspect(|keys| keys.keep_plan(model, regions, &plan));
                plan
            } else {
                Plan { left_out, ..plan }.of_own_faces(regions)
            }
        }
    };
    Ok(if options.allowance_mm == 0.0 { plan } else { plan.with_allowance(options.allowance_mm) })
}

/// Goes on with what is decided before passes are laid.
fn with_whole<T>(
    model: &Model,
    regions: &Regions,
    obstacles: Range<FaceId>,
    options: &PlanOptions,
    monitor: &dyn Monitor,
    then: impl FnOnce(&Laying) -> Result<T, PlanError>,
) -> Result<T, PlanError> {
    check(options, !obstacles.is_empty())?;
    let laid = on_the_surface(options)?;
    monitor.at(Stage::Setups, 0.0);
    Ok(Whole::new(model, regions, obstacles, &laid)?.laid(monitor, then)?.0)
}
