//! Areas too tight for the ball: the width that it bridges, and the largest smaller ball that fits
//! (by the shrinking-ball algorithm).

use claymill_nurbs::{Point3, Vector3};
use rayon::prelude::*;

use crate::distribution::Distribution;
use crate::reach::Reach;
use crate::report::{BallShare, ResidualSample, SurfaceState, TooTight};
use crate::scene::Scene;
use crate::surface::FaceSamples;

/// Smaller balls that are asked about, as shares of the tool's radius.
const SMALLER: [f64; 4] = [0.75, 0.5, 0.25, 0.1];
/// A ball that enters a face by no more than this fits, mm.
const FITS_MM: f64 = 1e-3;
/// The smallest share of the tool's radius that is looked at.
const SMALLEST: f64 = 0.01;

/// A place that is too tight for the tool.
struct Place<'a> {
    sample: &'a ResidualSample,
    /// Of the strip that the ball bridges, mm.
    width_mm: Option<f64>,
    /// Radius of the largest ball that touches here and enters no face.
    fits_mm: f64,
}

impl<'a> Place<'a> {
    fn new(scene: &Scene<'_>, reach: &Reach<'_>, sample: &'a ResidualSample) -> Self {
        let normal = reach.best_facing(&sample.normal, scene.free_sides[sample.face]);
        let radius_mm = scene.job.request.tool.radius_mm();
        Place {
            sample,
            width_mm: bridged_mm(scene, reach, &sample.point, &normal, radius_mm),
            fits_mm: scene.closest.largest_ball_mm(
                &sample.point,
                &normal,
                [SMALLEST * radius_mm, radius_mm],
                FITS_MM,
            ),
        }
    }
}

/// How wide the strips are that the tool bridges, and which smaller balls get there; `None` where nothing is too tight.
///
/// ```text
///      ╲  ●  ╱      the ball over p touches in q: half of what it bridges is |p − q|
///       q╲ ╱        the ball that touches p shrinks until it enters nothing
///         p
/// ```
pub(crate) fn measure(scene: &Scene<'_>, reach: &Reach<'_>, faces: &[FaceSamples]) -> Option<TooTight> {
    // What a ball bridges, and which one would fit, says nothing of other ends.
    if !scene.job.request.tool.is_ball() {
        return None;
    }
    let samples: Vec<&ResidualSample> =
        faces.iter().flat_map(|f| &f.samples).filter(|s| s.state == SurfaceState::TooTight).collect();
    let radius_mm = scene.job.request.tool.radius_mm();
    let places: Vec<Place<'_>> = samples.into_par_iter().map(|s| Place::new(scene, reach, s)).collect();
    let area_mm2: f64 = places.iter().map(|p| p.sample.area_mm2).sum();
    let (mut widths, mut fitting) = (Distribution::default(), Distribution::default());
    for place in &places {
        fitting.add(place.fits_mm, place.sample.area_mm2);
        place.width_mm.into_iter().for_each(|mm| widths.add(mm, place.sample.area_mm2));
    }
    let bridged = places.iter().filter_map(|p| Some((p.width_mm?, p.sample)));
    // Of equally wide ones the first.
    let widest = bridged.rev().max_by(|a, b| a.0.total_cmp(&b.0));
    let share = |part: f64| {
        let ball_mm = (100.0 * part * radius_mm).round() / 100.0;
        BallShare { radius_mm: ball_mm, share: fitting.share(|mm| mm >= ball_mm * (1.0 - 1e-6)) }
    };
    (area_mm2 > 0.0).then(|| TooTight {
        area_mm2,
        width_median_mm: widths.percentile(0.5),
        width_p95_mm: widths.percentile(0.95),
        width_max_mm: widths.max(),
        width_max_at: widest.map(|(_, sample)| scene.place(sample.point, Some(sample.face))),
        balls: SMALLER.map(share).to_vec(),
    })
}

/// What the ball bridges that hangs over `p`, across, in the setup where that is least; `None` where none hangs closely over
/// it: beside walls, and where the shank does not get past.
fn bridged_mm(
    scene: &Scene<'_>,
    reach: &Reach<'_>,
    p: &Point3,
    normal: &Vector3,
    radius_mm: f64,
) -> Option<f64> {
    let touched = |centre: Point3| scene.closest.closest(&centre, 1.1 * radius_mm);
    let half_mm = reach.lowered_over(p, normal).filter_map(touched).map(|q| (q.point - p).norm());
    half_mm.min_by(f64::total_cmp).filter(|mm| *mm <= 2.0 * radius_mm).map(|mm| 2.0 * mm)
}
