//! `claymill inspect`: what a model file holds. Faces, units, boundary, gaps, sheets and defects,
//! as text or as JSON.

use std::collections::BTreeMap;
use std::process::ExitCode;

use claymill::{Merged, Merging};
use claymill_exchange::{ImportReport, Skipped};
use claymill_nurbs::{Face, SurfaceKind};
use claymill_surface_merge::defects::{Defect, defects};
use claymill_surface_merge::{BoundaryAccount, Tolerance};
use claymill_toolpath::{Kind, SheetRecord};
use serde::Serialize;

use super::inspect_mesh::{inspect_mesh, is_mesh};
use super::inspect_picture::save_picture;
use super::{Context, guess};
use crate::args::InspectArgs;
use crate::console::{outln, six_digits};
use crate::failure::Failure;
use crate::{material, output};

/// What `claymill inspect --json` prints.
#[derive(Debug, Serialize)]
struct Inspection<'a> {
    file: String,
    faces: usize,
    area_mm2: f64,
    box_mm: [f64; 6],
    units: &'a str,
    unit_mm: f64,
    tolerance_mm: f64,
    system: &'a Option<String>,
    faces_in_file: usize,
    skipped: &'a [Skipped],
    surface_kinds: BTreeMap<SurfaceKind, usize>,
    degrees: BTreeMap<String, usize>,
    rational: usize,
    trimmed: usize,
    /// Length of the boundaries of all faces and where it goes.
    boundary: BoundaryAccount,
    /// Length of edges that no other face shares, mm.
    free_boundary_mm: f64,
    /// How the vehicle lies in its file.
    axes: Axes,
    /// How near neighbours had to be, with the histogram of gaps.
    gaps: Tolerance,
    /// Faces that hang together, and on which side of them the material is.
    sheets: Vec<SheetRecord>,
    /// How many defects there are of each code.
    defect_counts: BTreeMap<&'static str, usize>,
    defects: Vec<Defect>,
    report: &'a ImportReport,
}

/// The axes that `plan` takes unless others are told.
#[derive(Debug, Serialize)]
struct Axes {
    up: String,
    length: String,
    is_likely: bool,
    reason: String,
}

/// `claymill inspect`.
pub(crate) fn inspect(context: &Context, args: &InspectArgs) -> Result<ExitCode, Failure> {
    if is_mesh(args) {
        return inspect_mesh(context, args);
    }
    let inputs = std::slice::from_ref(&args.model);
    let out = args.out.as_ref().map(|path| output::begin_beside_text(context, path, Kind::Picture, inputs));
    let out = out.transpose()?;
    let loaded = context.load(&args.model, None)?;
    let model = &loaded.import.model;
    context.console.stage("looking for defects");
    let mut merged = claymill::merge(&loaded, &Merging::default())?;
    let defects = defects(model, &merged.found, &loaded.face_area_mm2);
    merged.find_sides(&loaded, material::up(&args.axes, &loaded), &[])?;
    let Merged { found: merged, record, .. } = merged;
    let sheets = record.sheets;
    if let Some((path, out)) = args.out.as_ref().zip(out) {
        context.console.stage("drawing");
        output::staged(&out, path, |staged| {
            save_picture(context, args, &loaded, &merged, &defects, &sheets, staged)
        })?;
        out.finish(Kind::Picture)?;
        context.console.say(path.display());
    }
    context.console.finish();
    let (faces, report) = (&loaded.import.model.faces, &loaded.import.report);
    let mut surface_kinds = BTreeMap::new();
    let mut degrees = BTreeMap::new();
    for f in faces {
        *surface_kinds.entry(f.kind).or_default() += 1;
        let (p, q) = (f.surface.knots_u().degree(), f.surface.knots_v().degree());
        *degrees.entry(format!("{}x{}", p.min(q), p.max(q))).or_default() += 1;
    }
    let mut defect_counts = BTreeMap::new();
    for defect in &defects {
        *defect_counts.entry(defect.code.code()).or_default() += 1;
    }
    let guess = guess(&args.axes, &loaded)?;
    let found = Inspection {
        axes: Axes {
            up: guess.orientation.up.to_string(),
            length: guess.orientation.front.to_string(),
            is_likely: guess.is_likely,
            reason: guess.reason,
        },
        file: args.model.display().to_string(),
        faces: faces.len(),
        area_mm2: loaded.face_area_mm2.iter().sum(),
        box_mm: loaded.bounds.corners(),
        units: &report.units.declared,
        unit_mm: report.units.mm_per_unit,
        tolerance_mm: report.tolerance_mm,
        system: &report.system,
        faces_in_file: report.faces_in_file,
        skipped: &report.skipped,
        surface_kinds,
        degrees,
        rational: faces.iter().filter(|f| f.surface.is_rational()).count(),
        trimmed: faces.iter().filter(|f| !f.loops.is_empty()).count(),
        boundary: merged.account,
        free_boundary_mm: merged.account.naked_mm,
        gaps: merged.tolerance,
        sheets,
        defect_counts,
        defects,
        report,
    };
    if context.json {
        context.print_json(&found)?;
    } else {
        print(&found);
        print_borders(&found);
        print_sheets(&found);
        print_defects(&found, faces);
    }
    Ok(ExitCode::SUCCESS)
}

fn print(found: &Inspection) {
    let size: Vec<String> = (0..3).map(|k| format!("{:.1}", found.box_mm[k + 3] - found.box_mm[k])).collect();
    outln!("{}", found.file);
    outln!("  written by  {}", found.system.as_deref().unwrap_or("(does not say)"));
    outln!("  units       {} ({} mm each)", found.units, six_digits(found.unit_mm));
    outln!("  tolerance   {} mm", six_digits(found.tolerance_mm));
    outln!(
        "  faces       {} in the file, {} read, {} skipped",
        found.faces_in_file,
        found.faces,
        found.skipped.len()
    );
    let judged = found.report.faces.iter().filter(|f| f.area_in_file_mm2.is_some()).count();
    let doubtful = found.report.faces.iter().filter(|f| f.doubt.is_some()).count();
    outln!(
        "  checked     {judged} of {} by the area that their edges in the file enclose, {doubtful} in doubt",
        found.faces
    );
    outln!("  trimmed     {} of {}, rational {}", found.trimmed, found.faces, found.rational);
    outln!("  area        {:.4} m²", found.area_mm2 * 1e-6);
    outln!("  size        {} mm", size.join(" x "));
    let certain = if found.axes.is_likely { "" } else { "not certain: " };
    let (up, length) = (&found.axes.up, &found.axes.length);
    outln!("  axes        --up {up} --length={length} ({certain}{})", found.axes.reason);
    let listed = |name: String, count: &usize| format!("{count} {name}");
    let kinds: Vec<_> =
        found.surface_kinds.iter().map(|(k, n)| listed(format!("{k:?}").to_lowercase(), n)).collect();
    outln!("  surfaces    {}", kinds.join(", "));
    let degrees: Vec<_> = found.degrees.iter().map(|(k, n)| listed(format!("of degree {k}"), n)).collect();
    outln!("  degrees     {}", degrees.join(", "));
    for (entity, count) in found.report.entities.iter().filter(|(_, count)| count.used > 0) {
        outln!("  entity      {entity}: {} in the file, {} used", count.in_file, count.used);
    }
    let unused = found.report.entities.values().filter(|count| count.used == 0).count();
    if unused > 0 {
        outln!("  entities    {} that hold no geometry or are not used; --json lists all", kinds_of(unused));
    }
    for r in found.report.repairs.iter().take(super::LISTED) {
        outln!("  mended      {}: {} ({:.4} mm)", r.entity, r.what, r.size_mm);
    }
    if found.report.repairs.len() > super::LISTED {
        outln!("  mended      ... and {} more", found.report.repairs.len() - super::LISTED);
    }
}

fn kinds_of(count: usize) -> String {
    if count == 1 { "1 other kind".to_owned() } else { format!("{count} other kinds") }
}

/// The free boundary and the gaps of what is joined, decade by decade.
fn print_borders(found: &Inspection) {
    outln!(
        "  boundary    {:.1} mm, free {:.1} mm, more than two faces {:.1} mm",
        found.boundary.total_mm,
        found.free_boundary_mm,
        found.boundary.non_manifold_mm
    );
    let mut decades: BTreeMap<i32, f64> = BTreeMap::new();
    for bin in found.gaps.histogram.iter().filter(|b| b.length_mm > 0.0) {
        *decades.entry(bin.gap_mm.log10().ceil() as i32).or_default() += bin.length_mm;
    }
    for (decade, length) in decades {
        outln!("  gaps        up to {} mm: {length:.1} mm", 10.0_f64.powi(decade));
    }
}

/// The largest sheets, and all whose material side is unclear as far as they fit.
fn print_sheets(found: &Inspection) {
    let unclear = found.sheets.iter().filter(|s| !s.clear).count();
    let (mut listed, mut doubtful) = (0, 0);
    for sheet in &found.sheets {
        let shown = if sheet.clear { &mut listed } else { &mut doubtful };
        *shown += 1;
        if *shown > super::LISTED {
            continue;
        }
        let note = if sheet.clear { "" } else { " UNCLEAR: say --material-side" };
        outln!("  sheet       face {}: {}{note}", sheet.faces[0], material::words(sheet));
    }
    let more = found.sheets.len() - listed.min(super::LISTED) - doubtful.min(super::LISTED);
    if more > 0 {
        outln!("  sheet       ... and {more} more, {unclear} unclear in all; --json lists them");
    }
}

/// The worst defects of each code.
fn print_defects(found: &Inspection, faces: &[Face]) {
    if found.defects.is_empty() {
        outln!("  defects     none");
    }
    for of_code in found.defects.chunk_by(|a, b| a.code == b.code) {
        let code = of_code[0].code;
        outln!("  defect      {} × {}: {}", of_code.len(), code.code(), code.words());
        for defect in of_code.iter().take(super::LISTED) {
            let named = defect.faces.iter().map(|id| format!("face {id} ({})", faces[*id].source.entity));
            let named: Vec<_> = named.collect();
            let at = defect.at;
            outln!(
                "              {:.4} at {:.3} {:.3} {:.3}: {}",
                defect.size,
                at.x,
                at.y,
                at.z,
                named.join(", ")
            );
        }
        if of_code.len() > super::LISTED {
            outln!("              ... and {} more; --json lists all", of_code.len() - super::LISTED);
        }
    }
}
