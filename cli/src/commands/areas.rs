//! Says which areas of faces are not as accurate as usual.

use claymill_exchange::FaceReading;
use claymill_nurbs::FaceArea;

use crate::console::Console;

/// Faces named, at most.
const NAMED: usize = 5;

/// Says where the integration had to end early.
pub(super) fn say_rough(console: &Console, faces: &[FaceReading]) {
    let is_rough = |face: &FaceReading| face.area_accuracy.is_none_or(|accuracy| accuracy > FaceArea::USUAL);
    let rough: Vec<usize> = (0..faces.len()).filter(|&face| is_rough(&faces[face])).collect();
    for &face in rough.iter().take(NAMED) {
        let FaceReading { entity, area_read_mm2, area_accuracy, .. } = &faces[face];
        let known = match area_accuracy {
            Some(accuracy) => format!("is known to {accuracy:.0e} of it only"),
            None => "is a guess".to_owned(),
        };
        console.say(format!(
            "warning: face {face} ({entity}): its surface is so uneven that its area, {area_read_mm2:.3} mm², {known}"
        ));
    }
    if rough.len() > NAMED {
        console.say(format!("warning: so are the areas of {} more faces", rough.len() - NAMED));
    }
}
