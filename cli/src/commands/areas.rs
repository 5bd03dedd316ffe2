//! The areas of all faces, and which of them are not as accurate as usual.

use claymill_nurbs::{Face, FaceArea};
use rayon::prelude::*;

use crate::console::Console;

/// Faces named, at most.
const NAMED: usize = 5;

/// Measures faces, mm²; says where the integration had to end early.
pub(super) fn of_faces_mm2(console: &Console, faces: &[Face]) -> Vec<f64> {
    let areas: Vec<FaceArea> = faces.par_iter().map(Face::area).collect();
    let rough: Vec<usize> = (0..faces.len()).filter(|&face| !areas[face].is_exact()).collect();
    for &face in rough.iter().take(NAMED) {
        let FaceArea { mm2, accuracy } = areas[face];
        let known = if accuracy.is_finite() {
            format!("is known to {accuracy:.0e} of it only")
        } else {
            "is a guess".to_owned()
        };
        console.say(format!(
            "warning: face {face} ({}): its surface is so uneven that its area, {mm2:.3} mm², {known}",
            faces[face].source.entity
        ));
    }
    if rough.len() > NAMED {
        console.say(format!("warning: so are the areas of {} more faces", rough.len() - NAMED));
    }
    areas.iter().map(|area| area.mm2).collect()
}
