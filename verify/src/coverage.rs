//! Sums up the area of every face by state, compares it with the planner's area report, and states
//! the residual on the cut area.

use std::collections::BTreeMap;

use claymill_toolpath::{Area, UncutReason};

use crate::distribution::Distribution;
use crate::report::{AreaAt, Coverage, FaceCoverage, SurfaceResidual, SurfaceState, TooTight};
use crate::scene::Scene;
use crate::surface::FaceSamples;

/// So many places of reachable area that was left are named.
const NAMED_PLACES: usize = 20;

/// Sums up areas by state and compares them with the planner's account.
pub(crate) fn account(scene: &Scene<'_>, faces: &[FaceSamples], too_tight: Option<TooTight>) -> Coverage {
    let by_face: Vec<FaceCoverage> = faces.iter().enumerate().map(|(i, f)| face_coverage(i, f)).collect();
    let mut by_state = BTreeMap::new();
    for face in &by_face {
        for (&state, &area) in &face.by_state_mm2 {
            *by_state.entry(state).or_insert(0.0) += area;
        }
    }
    let left = |f: &FaceCoverage| f.by_state_mm2.get(&SurfaceState::ReachableLeft).copied().unwrap_or(0.0);
    let mut worst: Vec<&FaceCoverage> = by_face.iter().filter(|f| left(f) > 0.0).collect();
    worst.sort_by(|a, b| left(b).total_cmp(&left(a)).then(a.face.cmp(&b.face)));
    let reachable_left_at = worst
        .into_iter()
        .take(NAMED_PLACES)
        .filter_map(|f| {
            let samples = &faces[f.face].samples;
            let one = samples.iter().find(|s| s.state == SurfaceState::ReachableLeft)?;
            Some(AreaAt { area_mm2: left(f), at: scene.place(one.point, Some(f.face)) })
        })
        .collect();
    Coverage {
        total_mm2: faces.iter().map(|f| f.area_mm2).sum(),
        planner_difference_mm2: difference(&scene.job.area, &by_state),
        by_state_mm2: by_state,
        least_length_mm: by_face.iter().map(|f| f.least_length_mm).sum(),
        reachable_left_at,
        too_tight,
        faces: by_face,
    }
}

fn face_coverage(face: usize, samples: &FaceSamples) -> FaceCoverage {
    let mut counts = BTreeMap::new();
    for s in &samples.samples {
        *counts.entry(s.state).or_insert(0usize) += 1;
    }
    if counts.is_empty() {
        counts.insert(SurfaceState::NotMeasured, 1);
    }
    let all: usize = counts.values().sum();
    let area = |count: usize| samples.area_mm2 * count as f64 / all as f64;
    let cut = samples.samples.iter().filter(|s| s.state == SurfaceState::Cut);
    FaceCoverage {
        face,
        area_mm2: samples.area_mm2,
        least_length_mm: cut.filter_map(|s| Some(s.area_mm2 / s.step_over_mm?)).sum(),
        by_state_mm2: counts.into_iter().map(|(s, n)| (s, area(n))).collect(),
    }
}

/// The planner's areas minus the measured ones.
fn difference(planner: &Area, measured: &BTreeMap<SurfaceState, f64>) -> BTreeMap<SurfaceState, f64> {
    // The planner does not tell the holder from the tool.
    let as_planned =
        |state| if state == SurfaceState::HolderInTheWay { SurfaceState::TooTight } else { state };
    let mut result: BTreeMap<SurfaceState, f64> = BTreeMap::new();
    for (&state, area) in measured {
        *result.entry(as_planned(state)).or_insert(0.0) -= area;
    }
    *result.entry(SurfaceState::Cut).or_insert(0.0) += planner.cut_mm2;
    for (reason, area) in &planner.uncut_mm2 {
        let state = match reason {
            UncutReason::Hidden => SurfaceState::Hidden,
            UncutReason::TooTight => SurfaceState::TooTight,
            UncutReason::Excluded => SurfaceState::Excluded,
            UncutReason::EarlierTool => SurfaceState::EarlierTool,
            UncutReason::OutOfBounds => SurfaceState::OutOfBounds,
            UncutReason::NotCovered | UncutReason::Roughed => SurfaceState::NotMeasured,
        };
        *result.entry(state).or_insert(0.0) += area;
    }
    result
}

/// Statistics of the material left on the area that counts as cut.
pub(crate) fn residual_on_cut_area(scene: &Scene<'_>, faces: &[FaceSamples]) -> SurfaceResidual {
    let mut heights = Distribution::default();
    for s in faces.iter().flat_map(|f| &f.samples) {
        if let (SurfaceState::Cut, Some(height)) = (s.state, s.residual_mm) {
            heights.add(height, s.area_mm2);
        }
    }
    let limit = scene.options.scallop_limit * scene.scallop_mm();
    SurfaceResidual {
        samples: faces.iter().map(|f| f.samples.len() as u64).sum(),
        p99_mm: heights.percentile(0.99),
        mean_mm: heights.mean(),
        above_limit_share: heights.share(|height| height > limit),
    }
}
