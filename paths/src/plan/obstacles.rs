//! Planning around obstacle meshes: their triangles become faces that nobody asks to be cut. The
//! area accounts leave them out again.

use claymill_nurbs::{Model, Point3};
use claymill_toolpath::Monitor;

use crate::plan::covered::{WiderRegions, triangle};
use crate::plan::error::PlanError;
use crate::plan::options::PlanOptions;
use crate::plan::plan_crowded;
use crate::plan::planned::Plan;
use crate::plan::regions::Regions;

/// Plans a job as [`plan()`](crate::plan()) does, with obstacles that no move comes nearer to than
/// [`PlanOptions::check_clearance_mm`]: triangles in the model's coordinates. They are faces that nobody asks to be cut, so that
/// everything that keeps paths off faces keeps them off obstacles; the distance is kept by balls that are larger by it.
///
/// # Errors
/// As [`plan()`](crate::plan()).
pub fn plan_around(
    model: &Model,
    regions: &Regions,
    obstacles: &[[Point3; 3]],
    options: &PlanOptions,
    monitor: &dyn Monitor,
) -> Result<Plan, PlanError> {
    let own = model.faces.len();
    let mut crowded = model.clone();
    for (index, corners) in obstacles.iter().enumerate() {
        let entity = format!("obstacle triangle {index}");
        let built = triangle(corners, &entity);
        crowded.faces.extend(built.map_err(|source| PlanError::Face {
            face: own + index,
            entity,
            source,
        })?);
    }
    let added = crowded.faces.len() - own;
    if added == 0 {
        return plan_crowded(model, regions, own..own, options, monitor);
    }
    let around = WiderRegions::over(regions, &crowded);
    let plan = plan_crowded(&crowded, &around.as_regions(regions), own..own + added, options, monitor)?;
    Ok(plan.of_own_faces(regions))
}
