//! Refuses moves that lead implausibly far away from the model, before anything is measured.

use claymill_nurbs::{Aabb, Model, Point3};
use claymill_toolpath::Program;

use crate::VerifyError;

/// Moves stay within the model's own size around it, and this besides, mm.
const BESIDES_MM: f64 = 1e4;

/// Refuses moves that leave the model far behind: to follow one of them to the moon takes longer than all others.
pub(crate) fn check(model: &Model, obstacles: &[[Point3; 3]], program: &Program) -> Result<(), VerifyError> {
    let mut around = Aabb::of(obstacles.iter().flatten());
    for face in &model.faces {
        face.surface.net().iter().for_each(|h| around.add(&Point3::from(h.xyz() / h.w)));
    }
    if around.is_empty() {
        return Ok(());
    }
    let limit_mm = around.diagonal() + BESIDES_MM;
    for m in &program.moves {
        let away_mm = |p: &[f64; 3]| around.distance_squared(&Point3::from(*p)).sqrt();
        let farthest_mm = m.points.iter().map(away_mm).fold(0.0, f64::max);
        if farthest_mm > limit_mm {
            return Err(VerifyError::Astray { seq: m.seq, farthest_mm, limit_mm });
        }
    }
    Ok(())
}
