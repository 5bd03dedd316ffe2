//! What merging found, in the form of `regions.json`.

use claymill_nurbs::Model;
use claymill_surface_merge::{Merge, Preset};
use claymill_toolpath::{
    FORMAT_VERSION, FailingRecord, JointRecord, LapRecord, RegionQualityRecord, RegionRecord, RegionsFile,
    SmallRegionRecord, WideGapRecord,
};
use rayon::prelude::*;
use serde::Serialize;

/// Measures every region for a ball; one that cannot be triangulated has no quality.
pub(crate) fn add_quality(record: &mut RegionsFile, model: &Model, merged: &Merge, ball_radius_mm: f64) {
    record.regions.par_iter_mut().for_each(|region| {
        let found = claymill_surface_merge::quality(model, merged, region.id, ball_radius_mm).ok();
        region.quality = found.map(|q| RegionQualityRecord {
            euler: q.euler,
            genus: q.genus,
            tightest_concave_radius_mm: q.tightest_concave_radius_mm,
            largest_ball_radius_mm: q.largest_ball_radius_mm,
            rest_area_mm2: q.rest_area_mm2,
            total_curvature_sr: q.total_curvature_sr,
            length_mm: q.length_mm,
            width_mm: q.width_mm,
            single_valued: q.single_valued,
        });
    });
}

/// What `regions.json` holds.
pub(crate) fn regions(merged: &Merge, preset: Preset) -> RegionsFile {
    let region = |r: &claymill_surface_merge::Region| RegionRecord {
        id: r.id,
        faces: r.faces.clone(),
        area_mm2: r.area_mm2,
        boundary_loops: r.boundary_loops,
        normal_axis: r.normal_axis.into(),
        normal_half_angle_deg: r.normal_half_angle_deg,
        box_mm: r.bounds.corners(),
        setup_area_mm2: std::collections::BTreeMap::new(),
        stick_out_needed_mm: std::collections::BTreeMap::new(),
        quality: None,
    };
    let joint = |j: &claymill_surface_merge::Joint| JointRecord {
        faces: [j.sides[0].face, j.sides[1].face],
        length_mm: j.length_mm,
        class: format!("{:?}", j.continuity),
        verdict: name(&j.verdict),
        why: j.why.clone(),
        gap_max_mm: j.gap_normal_mm.max.hypot(j.gap_lateral_mm.max),
        gap_normal_max_mm: j.gap_normal_mm.max,
        angle_max_deg: j.angle_deg.max,
        angle_p95_deg: j.angle_deg.p95,
        angle_rms_deg: j.angle_deg.rms,
        angle_mid_deg: j.angle_deg.mid,
        curvature_max: j.curvature_machining.max,
        curvature_p95: j.curvature_machining.p95,
        curvature_rms: j.curvature_machining.rms,
        curvature_mid: j.curvature_machining.mid,
        curvature_relative_max: j.curvature_relative.max,
        failing: j.failing.map(|f| FailingRecord {
            measure: name(&f.measure),
            value: f.value,
            limit: f.limit,
            share_over: f.share_over,
            at_mm: f.at.into(),
        }),
        regions_if_merged: j.regions_if_merged,
    };
    let lap = |l: &claymill_surface_merge::Lap| LapRecord {
        face: l.stretch.face,
        onto: l.onto,
        length_mm: l.length_mm,
        gap_mm: l.gap_mm,
        ends_mm: l.ends.map(Into::into),
    };
    let gap = |g: &claymill_surface_merge::WideGap| WideGapRecord {
        face: g.stretch.face,
        beside: g.beside,
        to_edge: g.to_edge,
        length_mm: g.length_mm,
        gap_max_mm: g.gap_max_mm,
        at_mm: g.at.into(),
    };
    let small = |s: &claymill_surface_merge::SmallRegion| SmallRegionRecord {
        faces: s.faces.clone(),
        area_mm2: s.area_mm2,
        width_mm: s.width_mm,
        absorbed: s.absorbed,
        region: s.region,
        neighbour: s.neighbour,
        border_mm: s.border_mm,
        angle_max_deg: s.angle_max_deg,
    };
    RegionsFile {
        format_version: FORMAT_VERSION,
        preset: name(&preset),
        tolerance_mm: merged.tolerance.value_mm,
        regions: merged.regions.iter().map(region).collect(),
        joints: merged.joints.iter().map(joint).collect(),
        boundary_total_mm: merged.account.total_mm,
        boundary_matched_mm: merged.account.matched_mm,
        boundary_lapped_mm: merged.account.lapped_mm,
        boundary_naked_mm: merged.account.naked_mm,
        boundary_non_manifold_mm: merged.account.non_manifold_mm,
        laps: merged.laps.iter().map(lap).collect(),
        gaps: merged.wide_gaps.iter().map(gap).collect(),
        duplicates: merged.duplicates.iter().map(|d| [d.original, d.copy]).collect(),
        small: merged.small.iter().map(small).collect(),
        sheets: Vec::new(),
    }
}

/// The name under which a plain enum value is serialised.
pub fn name(value: &impl Serialize) -> String {
    match serde_json::to_value(value) {
        Ok(serde_json::Value::String(name)) => name,
        _ => String::new(),
    }
}
