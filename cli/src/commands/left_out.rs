//! Faces that could not be triangulated: told by name.

use claymill_toolpath::LeftOutFace;

use crate::console::Console;

/// Says what is left out, why, and what is kept clear for it.
pub(super) fn say(console: &Console, left_out: &[LeftOutFace]) {
    for face in left_out {
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
