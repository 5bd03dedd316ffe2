//! Planning around obstacle meshes: their triangles become faces that nobody asks to be cut. The
//! area accounts leave them out again.

use std::collections::BTreeMap;

use claymill_nurbs::{Model, Point3};
use claymill_toolpath::{Area, UncutReason};

use crate::crowd::{WiderRegions, triangle};
use crate::plan::{Plan, PlanError, PlanOptions, Progress, Regions, plan_crowded};

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
    progress: Progress,
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
        return plan_crowded(model, regions, own..own, options, progress);
    }
    let around = WiderRegions::over(regions, &crowded);
    let plan = plan_crowded(&crowded, &around.as_regions(regions), own..own + added, options, progress)?;
    Ok(of_own_faces(plan, regions))
}

/// The accounts of a plan without the faces that were added to the regions' own.
pub(crate) fn of_own_faces(mut plan: Plan, regions: &Regions) -> Plan {
    plan.faces.truncate(regions.of_face.len());
    plan.region_setup_area_mm2.truncate(regions.of_face.iter().max().map_or(0, |m| m + 1));
    plan.area = plan.faces.iter().fold(Area::default(), |mut sum, face| {
        sum.total_mm2 += face.area.total_mm2;
        sum.cut_mm2 += face.area.cut_mm2;
        let uncut: &BTreeMap<UncutReason, f64> = &face.area.uncut_mm2;
        uncut.iter().for_each(|(reason, area)| *sum.uncut_mm2.entry(*reason).or_default() += area);
        sum
    });
    plan
}
