//! `claymill merge`: joins faces into regions and reports regions, joints and gaps.

use std::path::PathBuf;
use std::process::ExitCode;

use claymill::Merged;
use claymill_surface_merge::Preset;
use claymill_toolpath::{FolderWriter, Kind, Output, Program, REGIONS_FILE, RegionsFile};

use super::export::{ExportFormat, export};
use super::{Context, drive, orientation, pictures, sweep, why};
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
    interrupt::remove_on_interrupt(folder.iter().flat_map(FolderWriter::leftovers));
    let target = |path: &Option<PathBuf>| -> Result<Option<Target>, Failure> {
        let Some(path) = path.clone() else { return Ok(None) };
        let format = ExportFormat::of(&path)?;
        let out = output::begin_beside_text(context, &path, Kind::Model, std::slice::from_ref(&args.model))?;
        Ok(Some((out, path, format)))
    };
    let (exported, drive_surfaces) = (target(&args.export)?, target(&args.drive_surfaces)?);
    let loaded = context.load(&args.model, args.mirror)?;
    let model = &loaded.import.model;
    context.console.stage("merging");
    let preset = Preset::from(args.preset);
    let mut found = claymill::merge(&loaded, &args.merging.merging(preset)?)?;
    say_parts(context, &args.merging.keep_together, &found);
    let trees = if args.sweep { sweep::trees(&found.found, &found.options) } else { Vec::new() };
    found.find_sides(&loaded, material::up(&args.axes, &loaded), &[])?;
    if folder.is_some() || context.json {
        context.console.stage("measuring regions");
        found.measure_quality(&loaded);
    }
    let Merged { found: merged, record, options } = found;
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

/// Says which faces could not be kept together because no joints connect them.
fn say_parts(context: &Context, wishes: &[String], merged: &Merged) {
    for (wish, faces) in wishes.iter().zip(&merged.options.constraints.together) {
        let regions: std::collections::BTreeSet<usize> =
            faces.iter().map(|&f| merged.found.region_of_face[f]).collect();
        if regions.len() > 1 {
            context.console.say(format!(
                "warning: --keep-together {wish}: still {} regions, for no joints connect them",
                regions.len()
            ));
        }
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
