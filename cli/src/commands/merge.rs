//! `claymill merge`: joins faces into regions and reports regions, joints and gaps. It also builds
//! the record of `regions.json` for other commands.

use std::path::PathBuf;
use std::process::ExitCode;

use claymill_nurbs::Model;
use claymill_surface_merge::{Merge, MergeError, MergeOptions, Preset, merge as find_regions};
use claymill_toolpath::{
    FORMAT_VERSION, FailingRecord, FolderWriter, JointRecord, Kind, LapRecord, Output, Program, REGIONS_FILE,
    RegionQualityRecord, RegionRecord, RegionsFile, SmallRegionRecord, WideGapRecord,
};
use rayon::prelude::*;
use serde::Serialize;

use super::export::{ExportFormat, export};
use super::{Context, box_mm, drive, orientation, pictures, sweep, why};
use crate::args::{MergeArgs, PresetName};
use crate::console::{counted, metres, outln};
use crate::failure::Failure;
use crate::{interrupt, material, output};

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

/// A model file to be written: as it was told, and in which format.
type Target = (Output, PathBuf, ExportFormat);

/// Lines printed of a list that may be long.
const SHOWN: usize = 10;

/// `claymill merge`.
pub(crate) fn merge(context: &Context, args: &MergeArgs) -> Result<ExitCode, Failure> {
    let folder =
        args.out.as_deref().map(|out| FolderWriter::begin_replacing(out, REGIONS_FILE)).transpose()?;
    folder.iter().flat_map(FolderWriter::leftovers).for_each(interrupt::remove_on_interrupt);
    let target = |path: &Option<PathBuf>| -> Result<Option<Target>, Failure> {
        let Some(path) = path.clone() else { return Ok(None) };
        let format = ExportFormat::of(&path)?;
        let out = output::begin_beside_text(context, &path, Kind::Model, std::slice::from_ref(&args.model))?;
        Ok(Some((out, path, format)))
    };
    let (exported, drive_surfaces) = (target(&args.export)?, target(&args.drive_surfaces)?);
    let loaded = context.load(&args.model)?;
    let model = &loaded.import.model;
    context.console.stage("merging");
    let preset = Preset::from(args.preset);
    let options = args.merging.options(preset, model)?;
    let merged = regions(model, &options)?;
    say_parts(context, &args.merging.keep_together, &options, &merged);
    let trees = if args.sweep { sweep::trees(&merged, &options) } else { Vec::new() };
    let mut record = record(&merged, preset);
    record.sheets = material::find(&loaded, &merged, material::up(&args.axes, &loaded), &[])?;
    if folder.is_some() || context.json {
        context.console.stage("measuring regions");
        add_quality(&mut record, model, &merged, options.ball_radius_mm);
    }
    if let Some(folder) = folder {
        folder.json(REGIONS_FILE, &record)?;
        if args.sweep {
            sweep::save(&folder, &trees)?;
        }
        let axes = orientation(context.console, &args.axes, &loaded)?;
        context.console.stage("pictures");
        let album = pictures::Album::new(model, &merged.region_of_face, None, merged.tolerance.value_mm)
            .with_sides(&record.sheets);
        album.save_regions(context.console, axes, folder.path())?;
        if let Some(kept) = folder.finish()? {
            context.console.say(format!("kept      what came into the folder meanwhile: {}", kept.display()));
        }
    }
    if let Some((out, path, format)) = exported {
        context.console.stage("exporting");
        let album = pictures::Album::new(model, &merged.region_of_face, None, merged.tolerance.value_mm);
        output::staged(&out, &path, |staged| {
            export(
                context.console,
                staged,
                format,
                model,
                &album,
                &merged.region_of_face,
                &Program::default(),
            )
        })?;
        out.finish(Kind::Model)?;
    }
    let mut drives = Vec::new();
    if let Some((out, path, format)) = drive_surfaces {
        context.console.stage("drive surfaces");
        let album = pictures::Album::new(model, &merged.region_of_face, None, merged.tolerance.value_mm);
        drives = output::staged(&out, &path, |staged| {
            drive::write(staged, format, model, &merged, &album.colours())
        })?;
        out.finish(Kind::Model)?;
    }
    context.console.finish();
    if context.json && args.sweep {
        context.print_json(&trees)?;
    } else if context.json {
        context.print_json(&record)?;
    } else {
        if !context.console.is_quiet() {
            print(&record, options.high.angle_deg);
        }
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
    find_regions(model, options).map_err(|e| match e {
        MergeError::NotFinite { .. } => Failure::problem(e, "Mend the face in the CAD system."),
        MergeError::Contradiction { .. } => {
            Failure::usage(e, "Name fewer faces with --keep-together or --keep-apart.")
        }
        e => Failure::usage(e, ""),
    })
}

/// Says which faces could not be kept together because no joints connect them.
fn say_parts(context: &Context, wishes: &[String], options: &MergeOptions, merged: &Merge) {
    for (wish, faces) in wishes.iter().zip(&options.constraints.together) {
        let regions: std::collections::BTreeSet<usize> =
            faces.iter().map(|&f| merged.region_of_face[f]).collect();
        if regions.len() > 1 {
            context.console.say(format!(
                "warning: --keep-together {wish}: still {} regions, for no joints connect them",
                regions.len()
            ));
        }
    }
}

/// Measures every region for a ball; one that cannot be triangulated has no quality.
pub(super) fn add_quality(record: &mut RegionsFile, model: &Model, merged: &Merge, ball_radius_mm: f64) {
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
pub(crate) fn name(value: &impl Serialize) -> String {
    match serde_json::to_value(value) {
        Ok(serde_json::Value::String(name)) => name,
        _ => String::new(),
    }
}

fn print(record: &RegionsFile, angle_limit_deg: f64) {
    let faces: usize = record.regions.iter().map(|r| r.faces.len()).sum();
    outln!(
        "{} in {} (preset {}, tolerance {:.4} mm)",
        counted(faces, "face"),
        counted(record.regions.len(), "region"),
        record.preset,
        record.tolerance_mm
    );
    outln!(
        "edges: {} m, matched {} m, lapped {} m, naked {} m, non-manifold {} m",
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
    print_gaps(record);
    let mut verdicts = std::collections::BTreeMap::<(&str, &str), usize>::new();
    for j in &record.joints {
        *verdicts.entry((&j.verdict, &j.class)).or_default() += 1;
    }
    for ((verdict, class), count) in verdicts {
        outln!("joints: {count:>6} {class} {verdict}");
    }
    print_small(record, angle_limit_deg);
    for r in &record.regions {
        outln!(
            "region {:>3}: {:>11}, {:>9.4} m², {}, normals within {:.0}°",
            r.id,
            counted(r.faces.len(), "face"),
            r.area_mm2 * 1e-6,
            counted(r.boundary_loops, "loop"),
            r.normal_half_angle_deg
        );
    }
}

/// Neighbours too far apart to be joined, pair by pair, widest first.
fn print_gaps(record: &RegionsFile) {
    let mut pairs = std::collections::BTreeMap::<[usize; 2], [f64; 2]>::new();
    for g in &record.gaps {
        let [length, gap] = pairs.entry([g.face.min(g.beside), g.face.max(g.beside)]).or_default();
        *length += g.length_mm;
        *gap = gap.max(g.gap_max_mm);
    }
    let mut pairs: Vec<_> = pairs.into_iter().collect();
    pairs.sort_by(|a, b| b.1[1].total_cmp(&a.1[1]).then(a.0.cmp(&b.0)));
    if pairs.is_empty() {
        return;
    }
    let length: f64 = pairs.iter().map(|(_, [length, _])| length).sum();
    outln!(
        "gaps wider than the tolerance: {} along {:.3} m of the naked edges; they are not joined",
        pairs.len(),
        length / 1000.0
    );
    for ([a, b], [length, gap]) in pairs.iter().take(SHOWN) {
        outln!("faces {a} and {b} gape by up to {gap:.4} mm along {length:.1} mm");
    }
    if pairs.len() > SHOWN {
        outln!("and {} more pairs that gape: see --json", pairs.len() - SHOWN);
    }
}

/// What was absorbed, and what is small and could not be.
fn print_small(record: &RegionsFile, angle_limit_deg: f64) {
    for s in record.small.iter().take(2 * SHOWN) {
        let mut faces: Vec<String> = s.faces.iter().take(SHOWN).map(ToString::to_string).collect();
        if s.faces.len() > SHOWN {
            faces.push(format!("and {} more", s.faces.len() - SHOWN));
        }
        let faces = if faces.len() == 1 {
            format!("face {}", faces[0])
        } else {
            format!("faces {}", faces.join(", "))
        };
        let width = s.width_mm.map_or_else(|| "closed".to_owned(), |w| format!("{w:.2} mm wide"));
        let what = format!("{faces} ({:.1} mm², {width})", s.area_mm2);
        match (s.absorbed, s.neighbour) {
            (true, _) => outln!(
                "absorbed into region {}: {what}, along {:.1} mm within {:.3}°",
                s.region,
                s.border_mm,
                s.angle_max_deg
            ),
            (false, Some(n)) => outln!(
                "region {} stays small: {what}; its smoothest border, with region {n}, bends by {:.3}° (limit {angle_limit_deg}°)",
                s.region,
                s.angle_max_deg
            ),
            (false, None) => outln!("region {} stays small: {what}; nothing is beside it", s.region),
        }
    }
    if record.small.len() > 2 * SHOWN {
        outln!("and {} more small regions: see --json", record.small.len() - 2 * SHOWN);
    }
}
