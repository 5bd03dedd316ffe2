//! Faces that could not be triangulated: told by name, and written into the job.

use claymill_paths::LeftOut;
use claymill_toolpath::LeftOutFace;

use super::{Loaded, box_mm};
use crate::console::Console;

/// Says what is left out, why, and what is kept clear for it.
pub(super) fn say(console: &Console, loaded: &Loaded, left_out: &[LeftOut]) {
    for face in records(loaded, left_out) {
        let size = |axis: usize| face.box_mm[axis + 3] - face.box_mm[axis];
        console.say(format!(
            "warning: face {} ({}, {:.4} mm²) is left out: {}. Its box, {:.2} x {:.2} x {:.2} mm, is kept clear",
            face.face,
            face.entity,
            face.area_mm2,
            face.reason,
            size(0),
            size(1),
            size(2)
        ));
    }
}

/// What is left out as the job records it.
pub(super) fn records(loaded: &Loaded, left_out: &[LeftOut]) -> Vec<LeftOutFace> {
    let record = |l: &LeftOut| LeftOutFace {
        face: l.face,
        entity: loaded.import.model.faces.get(l.face).map_or_else(String::new, |f| f.source.entity.clone()),
        area_mm2: loaded.face_area_mm2.get(l.face).copied().unwrap_or(0.0),
        reason: l.reason.to_string(),
        box_mm: box_mm(&l.bounds),
    };
    left_out.iter().map(record).collect()
}
