//! Planning around obstacle meshes: their triangles become faces that nobody asks to be cut. The
//! area accounts leave them out again.

use std::borrow::Cow;
use std::ops::Range;

use claymill_nurbs::{FaceId, Model, Point3};
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
    let plan = among_obstacles(model, regions, obstacles, |model, regions, obstacles| {
        plan_crowded(model, regions, obstacles, options, monitor)
    })?;
    Ok(if obstacles.is_empty() { plan } else { plan.of_own_faces(regions) })
}

/// Goes on with a model to which obstacles were added as faces: model, regions, and which faces these are.
pub(crate) fn among_obstacles<T>(
    model: &Model,
    regions: &Regions,
    obstacles: &[[Point3; 3]],
    then: impl FnOnce(&Model, &Regions, Range<FaceId>) -> Result<T, PlanError>,
) -> Result<T, PlanError> {
    let own = model.faces.len();
    let mut crowded = Cow::Borrowed(model);
    for (index, corners) in obstacles.iter().enumerate() {
        let entity = format!("obstacle triangle {index}");
        let built = triangle(corners, &entity);
        crowded.to_mut().faces.extend(built.map_err(|source| PlanError::Face {
            face: own + index,
            entity,
            source,
        })?);
    }
    let all = crowded.faces.len();
    if all == own {
        return then(model, regions, own..own);
    }
    let around = WiderRegions::over(regions, &crowded);
    then(&crowded, &around.as_regions(regions), own..all)
}
