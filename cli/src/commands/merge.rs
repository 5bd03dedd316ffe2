use std::process::ExitCode;

use claymill_nurbs::Model;
use claymill_surface_merge::{Merge, MergeOptions, Preset, merge as find_regions};
use claymill_toolpath::{
    FORMAT_VERSION, FailingRecord, FolderWriter, JointRecord, LapRecord, Program, REGIONS_FILE,
    RegionQualityRecord, RegionRecord, RegionsFile,
};
use rayon::prelude::*;
use serde::Serialize;

use super::export::{ExportFormat, export};
use super::{Context, box_mm, drive, orientation, pictures, sweep, why};
use crate::args::{MergeArgs, PresetName};
use crate::console::outln;
use crate::failure::Failure;
use crate::interrupt;

impl From<PresetName> for Preset {
    fn from(name: PresetName) -> Self {
        match name {
            PresetName::ClassA => Preset::ClassA,
            PresetName::Clay => Preset::Clay,
            PresetName::Tangent => Preset::Tangent,
            PresetName::Paper => Preset::Paper,
        }
    }
}

/// Lines printed of a list that may be long.
const SHOWN: usize = 10;

/// `claymill merge`.
pub(crate) fn merge(context: &Context, args: &MergeArgs) -> Result<ExitCode, Failure> {
    let folder =
        args.out.as_deref().map(|out| FolderWriter::begin_replacing(out, REGIONS_FILE)).transpose()?;
    if let Some(folder) = &folder {
        interrupt::remove_on_interrupt(folder.path().to_owned());
    }
    let format = args.export.as_deref().map(ExportFormat::of).transpose()?;
    let drive_format = args.drive_surfaces.as_deref().map(ExportFormat::of).transpose()?;
    let loaded = context.load(&args.model)?;
    let model = &loaded.import.model;
    context.console.stage("merging");
    let preset = Preset::from(args.preset);
    let merged = regions(model, &preset.options())?;
    let trees = if args.sweep { sweep::trees(&merged, &preset.options()) } else { Vec::new() };
    let mut record = record(&merged, preset);
    if folder.is_some() || context.json {
        context.console.stage("measuring regions");
        add_quality(&mut record, model, &merged, preset.options().ball_radius_mm);
    }
    if let Some(folder) = folder {
        folder.json(REGIONS_FILE, &record)?;
        if args.sweep {
            sweep::save(&folder, &trees)?;
        }
        let axes = orientation(context.console, &args.axes, &loaded.bounds)?;
        context.console.stage("pictures");
        let album = pictures::Album::new(model, &merged.region_of_face, None, merged.tolerance.value_mm);
        album.save_regions(context.console, axes, folder.path())?;
        folder.finish()?;
    }
    if let Some((path, format)) = args.export.as_deref().zip(format) {
        context.console.stage("exporting");
        let album = pictures::Album::new(model, &merged.region_of_face, None, merged.tolerance.value_mm);
        export(path, format, model, &album, &merged.region_of_face, &Program::default())?;
    }
    let mut drives = Vec::new();
    if let Some((path, format)) = args.drive_surfaces.as_deref().zip(drive_format) {
        context.console.stage("drive surfaces");
        let album = pictures::Album::new(model, &merged.region_of_face, None, merged.tolerance.value_mm);
        drives = drive::write(path, format, model, &merged, &album.colours())?;
    }
    context.console.finish();
    if context.json && args.sweep {
        context.print_json(&trees)?;
    } else if context.json {
        context.print_json(&record)?;
    } else {
        print(&record);
        if let Some(count) = args.why {
            why::print(&record, count);
        }
        trees.iter().for_each(sweep::print);
        drive::print(&drives);
    }
    Ok(ExitCode::SUCCESS)
}

/// Regions of a model.
pub(crate) fn regions(model: &Model, options: &MergeOptions) -> Result<Merge, Failure> {
    find_regions(model, options).map_err(|e| {
        Failure::problem(e, "Leave the faces it names out with --skip, or mend them in the CAD system.")
    })
}

/// Measures every region for a ball; one that cannot be triangulated has no quality.
fn add_quality(record: &mut RegionsFile, model: &Model, merged: &Merge, ball_radius_mm: f64) {
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
pub(crate) fn record(merged: &Merge, preset: Preset) -> RegionsFile {
    let region = |r: &claymill_surface_merge::Region| RegionRecord {
        id: r.id,
        faces: r.faces.clone(),
        area_mm2: r.area_mm2,
        boundary_loops: r.boundary_loops,
        normal_axis: r.normal_axis.into(),
        normal_half_angle_deg: r.normal_half_angle_deg,
        box_mm: box_mm(&r.bounds),
        setup_area_mm2: std::collections::BTreeMap::new(),
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
        duplicates: merged.duplicates.iter().map(|d| [d.original, d.copy]).collect(),
    }
}

/// The name under which a plain enum value is serialised.
pub(crate) fn name(value: &impl Serialize) -> String {
    match serde_json::to_value(value) {
        Ok(serde_json::Value::String(name)) => name,
        _ => String::new(),
    }
}

fn print(record: &RegionsFile) {
    let faces: usize = record.regions.iter().map(|r| r.faces.len()).sum();
    outln!(
        "{faces} faces in {} regions (preset {}, tolerance {:.4} mm)",
        record.regions.len(),
        record.preset,
        record.tolerance_mm
    );
    let metres = |mm: f64| mm / 1000.0;
    outln!(
        "edges: {:.3} m, matched {:.3} m, lapped {:.3} m, naked {:.3} m, non-manifold {:.3} m",
        metres(record.boundary_total_mm),
        metres(record.boundary_matched_mm),
        metres(record.boundary_lapped_mm),
        metres(record.boundary_naked_mm),
        metres(record.boundary_non_manifold_mm)
    );
    for [original, copy] in record.duplicates.iter().take(SHOWN) {
        outln!("face {copy} is a copy of face {original} and does not count");
    }
    if record.duplicates.len() > SHOWN {
        outln!("and {} more copies: see --json", record.duplicates.len() - SHOWN);
    }
    let mut laps = std::collections::BTreeMap::<(usize, usize), f64>::new();
    for l in &record.laps {
        *laps.entry((l.face, l.onto)).or_default() += l.length_mm;
    }
    let pairs = laps.len();
    for ((face, onto), length_mm) in laps.into_iter().take(SHOWN) {
        outln!("face {face} ends on the inside of face {onto} along {length_mm:.1} mm");
    }
    if pairs > SHOWN {
        outln!("and {} more pairs of faces that lap: see --json", pairs - SHOWN);
    }
    let mut verdicts = std::collections::BTreeMap::<(&str, &str), usize>::new();
    for j in &record.joints {
        *verdicts.entry((&j.verdict, &j.class)).or_default() += 1;
    }
    for ((verdict, class), count) in verdicts {
        outln!("joints: {count:>6} {class} {verdict}");
    }
    for r in &record.regions {
        outln!(
            "region {:>3}: {:>5} faces, {:>9.4} m², {} loops, normals within {:.0}°",
            r.id,
            r.faces.len(),
            r.area_mm2 * 1e-6,
            r.boundary_loops,
            r.normal_half_angle_deg
        );
    }
}
