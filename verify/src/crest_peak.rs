//! The highest crest exactly: samples along the passes come near to it only.

use claymill_nurbs::{Foot, Hint, Point3, Vector3};
use rayon::prelude::*;

use crate::golden::golden_section;
use crate::reach::Reach;
use crate::report::{Crests, Place, SurfaceState};
use crate::scene::Scene;
use crate::surface::FaceSamples;
use crate::swept::{Left, Swept};

/// So many of the most promising places are climbed from: of the crests beside passes, and of the samples of the surface.
const FROM_CRESTS: usize = 48;
const FROM_SURFACE: usize = 16;
/// Of each pass, no more than these are kept until all are known.
pub(crate) const OF_PASS: usize = 4;
/// They are climbed from in groups, until the next ones promise less than what was found.
const GROUP: usize = 16;
/// Heights above this many scallop heights are no crests.
const CAP: f64 = 9.0;
/// Steps across a crest, by the golden section of a step-over.
const ACROSS_STEPS: u32 = 16;
/// Steps along a crest are halved from half a step-over down to this share of it, and no more than so many are made.
const ALONG_LEAST: f64 = 1e-3;
const ALONG_STEPS: u32 = 40;

/// A place on the surface from where a crest may rise, and how high it may be.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Seed {
    pub(crate) at: Point3,
    /// Crests are looked at in this order.
    pub(crate) promise_mm: f64,
}

/// Keeps the most promising ones, in order.
pub(crate) fn keep_best(seeds: &mut Vec<Seed>, count: usize) {
    seeds.sort_by(|a, b| {
        let order = |p: &Point3| (p.x, p.y, p.z);
        let (a_at, b_at) = (order(&a.at), order(&b.at));
        b.promise_mm
            .total_cmp(&a.promise_mm)
            .then(a_at.partial_cmp(&b_at).unwrap_or(std::cmp::Ordering::Equal))
    });
    seeds.truncate(count);
}

/// A place on a crest from which it falls everywhere.
struct Peak<'a> {
    foot: Foot,
    left: Left<'a>,
}

/// Climbs from where crests are high, and raises the highest one to what is found.
///
/// ```text
///     pass ───────────────────            along: the way of the nearest pass, in steps that are halved
///          ^ ^ ^ ^ x peak   link          across: the ridge is found anew after each step
///     pass ───────────────╮  │
/// ```
pub(crate) fn raise(
    scene: &Scene<'_>,
    swept: &Swept<'_>,
    reach: &Reach<'_>,
    faces: &[FaceSamples],
    mut seeds: Vec<Seed>,
    crests: &mut Crests,
) {
    let counts = |s: &SurfaceState| matches!(s, SurfaceState::Cut | SurfaceState::ReachableLeft);
    let on_surface = faces.iter().flat_map(|f| &f.samples).filter(|s| counts(&s.state));
    let mut others: Vec<Seed> =
        on_surface.filter_map(|s| Some(Seed { at: s.point, promise_mm: s.residual_mm? })).collect();
    keep_best(&mut others, FROM_SURFACE);
    keep_best(&mut seeds, FROM_CRESTS);
    // Samples of the surface are anywhere beside their crests: they promise whatever these do.
    let step_over_mm = scene.step_over_mm(scene.job.request.tool.radius_mm());
    let climber = Climber { scene, swept, cap_mm: CAP * scene.scallop_mm(), step_over_mm };
    let limit = scene.options.scallop_limit * scene.scallop_mm();
    let spare = limit - scene.scallop_mm();
    let groups = [&others[..]].into_iter().chain(seeds.chunks(GROUP));
    for (index, group) in groups.enumerate() {
        if index > 0 && group[0].promise_mm <= crests.max_mm {
            break;
        }
        let peaks: Vec<Option<Peak<'_>>> = group.par_iter().map(|seed| climber.climb(&seed.at)).collect();
        for Peak { foot, left } in peaks.into_iter().flatten() {
            if left.height_mm <= crests.max_mm {
                continue;
            }
            let Some(normal) = climber.normal(&foot, &left) else { continue };
            if left.height_mm > limit
                && !reach.is_left(&foot.point, &normal, spare, scene.free_sides[foot.face].is_both())
            {
                continue;
            }
            crests.max_mm = left.height_mm;
            let top = foot.point + normal * left.height_mm;
            crests.max_at = Some(Place {
                move_seq: Some(left.track.seq),
                parameter: Some(left.parameter),
                ..scene.place(top, Some(foot.face))
            });
            let of_region = crests.by_region.iter_mut().find(|r| r.region == left.track.region);
            if let Some(region) = of_region {
                region.max_mm = region.max_mm.max(left.height_mm);
            }
        }
    }
}

struct Climber<'a, 'b> {
    scene: &'b Scene<'a>,
    swept: &'b Swept<'a>,
    cap_mm: f64,
    step_over_mm: f64,
}

impl<'b> Climber<'_, 'b> {
    fn climb(&self, from: &Point3) -> Option<Peak<'b>> {
        let mut hint = Hint::default();
        let start = self.look(from, &mut hint)?;
        let n = self.normal(&start.foot, &start.left)?;
        let along = (start.left.way - n * n.dot(&start.left.way)).try_normalize(1e-12)?;
        let across = n.cross(&along);
        let mut best = self.ridge(from, &across, &mut hint)?;
        let mut step_mm = 0.5 * self.step_over_mm;
        for _ in 0..ALONG_STEPS {
            let sides = [step_mm, -step_mm].map(|mm| {
                // From the ridge as it is now: crests bend.
                self.ridge(&(best.foot.point + along * mm), &across, &mut hint)
            });
            let higher =
                sides.into_iter().flatten().max_by(|a, b| a.left.height_mm.total_cmp(&b.left.height_mm));
            match higher.filter(|h| h.left.height_mm > best.left.height_mm) {
                Some(higher) => best = higher,
                None => step_mm *= 0.5,
            }
            if step_mm < ALONG_LEAST * self.step_over_mm {
                break;
            }
        }
        Some(best)
    }

    /// The highest place across a crest within half a step-over.
    fn ridge(&self, about: &Point3, across: &Vector3, hint: &mut Hint) -> Option<Peak<'b>> {
        let mut best: Option<Peak<'b>> = None;
        let mut height = |mm: f64| {
            let peak = self.look(&(about + across * mm), hint);
            let height = peak.as_ref().map_or(0.0, |p| p.left.height_mm);
            if let Some(peak) = peak
                && best.as_ref().is_none_or(|b| height > b.left.height_mm)
            {
                best = Some(peak);
            }
            height
        };
        height(0.0);
        golden_section([-0.5 * self.step_over_mm, 0.5 * self.step_over_mm], ACROSS_STEPS, height);
        best
    }

    /// What is left on the surface next to a place.
    fn look(&self, near: &Point3, hint: &mut Hint) -> Option<Peak<'b>> {
        let foot = self.scene.closest.closest_from(near, self.step_over_mm, hint)?;
        let (n, _) = self.scene.model.faces[foot.face].surface.normal(foot.u, foot.v)?;
        let free = self.scene.free_sides[foot.face];
        let left = self.swept.left_on(&foot.point, &n, self.cap_mm, self.scene.options.chord_mm, free)?;
        Some(Peak { foot, left })
    }

    /// The normal on the side that was cut.
    fn normal(&self, foot: &Foot, left: &Left<'_>) -> Option<Vector3> {
        let (n, _) = self.scene.model.faces[foot.face].surface.normal(foot.u, foot.v)?;
        let centre = left.track.centre(left.parameter).0;
        Some(if (centre - foot.point).dot(&n) < 0.0 { -n } else { n })
    }
}
