//! Which faces a job does not ask to be cut, and which it must not touch.

use claymill_nurbs::{FaceId, Model};
use claymill_toolpath::{Job, UncutReason};

use crate::scene::Scene;

/// Faces left out on request: `--only` and `--skip` choose whole faces, the planner's account names them; and those that are to
/// be avoided.
pub(crate) fn excluded_faces(scene: &Scene<'_>) -> Vec<bool> {
    let mut excluded = vec![false; scene.model.faces.len()];
    for account in &scene.job.faces {
        let left_out = account.area.uncut_mm2.get(&UncutReason::Excluded);
        if let (Some(flag), Some(area)) = (excluded.get_mut(account.face), left_out) {
            *flag = *area > 0.5 * account.area.total_mm2;
        }
    }
    for face in avoided_faces(scene.model, scene.job) {
        excluded[face] = true;
    }
    excluded
}

/// Faces that must be avoided, by their indices in the whole model.
pub(crate) fn avoided_faces(model: &Model, job: &Job) -> impl Iterator<Item = FaceId> {
    job.request.bounds.avoid.iter().copied().filter(|face| *face < model.faces.len())
}
