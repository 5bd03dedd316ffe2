//! Sums up the area and length that are cut from the material side of faces, or from inside of a
//! body.

use crate::contact::InMaterial;
use crate::report::{ResidualSample, SidesKept};
use crate::scene::Scene;
use crate::surface::FaceSamples;

/// Sums up what is cut from the side of the material; `None` where no face has one and nothing is cut from inside of a body.
pub(crate) fn account(scene: &Scene<'_>, along: InMaterial, faces: &[FaceSamples]) -> Option<SidesKept> {
    let one_sided = faces.iter().zip(&scene.free_sides).filter(|(_, side)| !side.is_both());
    let samples = || faces.iter().flat_map(|f| &f.samples);
    let sum = |is_wrong: fn(&ResidualSample) -> bool| {
        samples().filter(|s| is_wrong(s)).map(|s| s.area_mm2).sum::<f64>() + 0.0
    };
    let place = |s: &ResidualSample| scene.place(s.point, Some(s.face));
    let inside = samples().find(|s| s.cut_from_inside);
    let of_sample = || samples().find(|s| s.cut_from_material).map(place);
    let kept = SidesKept {
        one_sided_mm2: one_sided.map(|(face, _)| face.area_mm2).sum(),
        wrong_mm2: sum(|s| s.cut_from_material),
        wrong_length_mm: along.length_mm,
        wrong_at: along.at.or_else(of_sample),
        inside_mm2: sum(|s| s.cut_from_inside),
        inside_at: inside.map(place),
    };
    (kept.one_sided_mm2 > 0.0 || kept.inside_mm2 > 0.0).then_some(kept)
}
