//! The report's sections on the model file, material sides, tolerances and timings, and how to plan
//! the job again.

use std::collections::BTreeMap;

use claymill_toolpath::{Job, Mirror, RegionsFile, SheetRecord};
use maud::{Markup, html};

use super::figures::{area, count, deviation, duration, length, plural};

/// What of the file a job cuts.
fn cut_of(Mirror { axis, keeps_model }: Mirror) -> String {
    let plane = ["x", "y", "z"][axis];
    match keeps_model {
        true => format!("the faces in the file and their images in the plane {plane} = 0"),
        false => format!("the images of the faces in the plane {plane} = 0"),
    }
}

/// The file: what was read, what not, and why.
pub(super) fn section(job: &Job, regions: &RegionsFile) -> Markup {
    let m = &job.model;
    let mut reasons: BTreeMap<&str, Vec<&str>> = BTreeMap::new();
    for skipped in &m.skipped {
        reasons.entry(&skipped.reason).or_default().push(&skipped.entity);
    }
    let mut reasons: Vec<_> = reasons.into_iter().collect();
    reasons.sort_by(|a, b| b.1.len().cmp(&a.1.len()).then(a.0.cmp(b.0)));
    let [x0, y0, z0, x1, y1, z1] = m.box_mm;
    let rows = [
        ("File", m.path.clone()),
        ("SHA-256", m.sha256.clone()),
        ("Unit in the file", format!("{} ({} mm)", m.units, m.unit_mm)),
        (
            "Faces",
            format!(
                "{} in the file, {} read, {} skipped",
                count(m.faces_in_file as u64),
                count(m.faces_read as u64),
                count(m.skipped.len() as u64)
            ),
        ),
        ("Area", area(m.area_mm2)),
        ("Box, mm", format!("x {x0:.2} to {x1:.2}, y {y0:.2} to {y1:.2}, z {z0:.2} to {z1:.2}")),
    ];
    let flaws = flaws(regions);
    let mirror = m.mirror.map(cut_of);
    html! {
        h2 id="file" { "The model's file" }
        table { tbody {
            @for (name, value) in &rows { tr { th scope="row" { (name) } td { (value) } } }
            @if let Some(mirror) = &mirror { tr { th scope="row" { "What is cut" } td { (mirror) } } }
        } }
        h3 { "Its flaws" }
        table { tbody { @for (name, value) in &flaws { tr { th scope="row" { (name) } td { (value) } } } } }
        @if !regions.sheets.is_empty() { (material_sides(&regions.sheets)) }
        p.soft { code { "claymill inspect" } " lists defects face by face, each with its place." }
        @if !reasons.is_empty() {
            h3 { (plural(m.skipped.len() as u64, "face")) " could not be read" }
            div.wide { table {
                thead { tr { th.n scope="col" { "Faces" } th scope="col" { "Reason" } th scope="col" { "Entities" } } }
                tbody { @for (reason, entities) in &reasons { tr {
                    td.n { (count(entities.len() as u64)) }
                    td { (reason) }
                    td { (first_few(entities)) }
                } } }
            } }
        }
    }
}

/// Sheets named in the report: the largest, and before them those in doubt.
const SHEETS_NAMED: usize = 12;

/// On which side of what hangs together the material is.
fn material_sides(sheets: &[SheetRecord]) -> Markup {
    let mut named: Vec<&SheetRecord> = sheets.iter().collect();
    named.sort_by_key(|sheet| sheet.clear);
    let why = |sheet: &SheetRecord| match sheet.evidence.as_str() {
        "asked" => "as asked for",
        "closed" => "it is closed",
        "encloses" if !sheet.clear => {
            "one side sees less of the outside; the file, or an opening upwards, speaks against it"
        }
        "encloses" => "one side sees less of the outside",
        "level" => "it lies level, and no tool comes from below",
        "file" => "all its faces have it so in the file",
        "face_by_face" => "it has no two sides: each face by itself",
        _ => "assumed",
    };
    let toward = |sheet: &SheetRecord| {
        let [x, y, z] = sheet.mean_free_normal.map(|x| x + 0.0);
        if sheet.free_sides.iter().all(claymill_toolpath::FreeSide::is_both) {
            "both".to_owned()
        } else if x * x + y * y + z * z < 0.09 {
            "all around".to_owned()
        } else {
            format!("{x:.2}, {y:.2}, {z:.2}")
        }
    };
    html! {
        h3 { "Material sides" }
        p { "Faces that hang together are a sheet. Only the side without material is cut; the other one is hatched in pictures. "
            code { "--material-side" } " says otherwise." }
        div.wide { table {
            thead { tr {
                th.n scope="col" { "Faces" } th.n scope="col" { "Area" } th.n scope="col" { "Open border" }
                th scope="col" { "Free side faces" } th scope="col" { "Because" } th scope="col" { "Clear" }
            } }
            tbody { @for sheet in named.iter().take(SHEETS_NAMED) { tr {
                td.n { (count(sheet.faces.len() as u64)) }
                td.n { (area(sheet.area_mm2)) }
                td.n { (length(sheet.open_mm)) }
                td { (toward(sheet)) }
                td { (why(sheet)) }
                td { @if sheet.clear { "yes" } @else { strong { "no: check it" } } }
            } } }
        } }
        @if sheets.len() > SHEETS_NAMED { p.soft { "And " (sheets.len() - SHEETS_NAMED) " more in regions.json." } }
    }
}

/// What is wrong with the model as a whole, as far as merging saw it.
fn flaws(regions: &RegionsFile) -> Vec<(&'static str, String)> {
    let lapped_mm: f64 = regions.laps.iter().map(|l| l.length_mm).sum();
    let widest = regions.laps.iter().map(|l| l.gap_mm).fold(0.0, f64::max);
    let worst = regions.joints.iter().max_by(|a, b| a.gap_max_mm.total_cmp(&b.gap_max_mm));
    let mut rows = Vec::new();
    if let Some(joint) = worst {
        let [a, b] = joint.faces;
        rows.push((
            "Widest gap at a joint",
            format!("{}, between faces {a} and {b}", deviation(joint.gap_max_mm)),
        ));
    }
    rows.push(("Free boundary", length(regions.boundary_naked_mm)));
    rows.push(("Edges of more than two faces", length(regions.boundary_non_manifold_mm)));
    rows.push(("Faces that are there twice", count(regions.duplicates.len() as u64)));
    let laps = plural(regions.laps.len() as u64, "stretch").replace("stretchs", "stretches");
    let gap = if regions.laps.is_empty() {
        String::new()
    } else {
        format!(", at most {} apart", deviation(widest))
    };
    rows.push(("Edges on the inside of another face", format!("{laps}, {}{gap}", length(lapped_mm))));
    rows
}

fn first_few(entities: &[&str]) -> String {
    const SHOWN: usize = 12;
    let mut text = entities[..entities.len().min(SHOWN)].join(", ");
    if entities.len() > SHOWN {
        text += &format!(" and {} more", entities.len() - SHOWN);
    }
    text
}

pub(super) fn tolerances_and_timings(job: &Job) -> Markup {
    let total: f64 = job.timings.iter().map(|t| t.seconds).sum();
    html! {
        h2 { "Tolerances and computing time" }
        div.wide { table {
            caption { "Every tolerance that was used; the unit is in the name" }
            tbody { @for (name, value) in &job.tolerances {
                tr { th scope="row" { code { (name) } } td.n { (value) } }
            } }
        } }
        div.wide { table {
            caption { "Computing time by stage; largest memory " (format!("{:.0} MB", job.peak_memory_mb)) }
            tbody { @for timing in &job.timings {
                tr { th scope="row" { (timing.stage) } td.n { (duration(timing.seconds)) } }
            } }
            tfoot { tr { th scope="row" { "all stages" } td.n { (duration(total)) } } }
        } }
    }
}

pub(super) fn reproduce(command: &str, job: &Job) -> Markup {
    html! {
        h2 id="again" { "How to make this job again" }
        pre { (command) }
        p.soft {
            "With claymill " (job.claymill_version) " and the file whose SHA-256 is given above, the same command "
            "writes the same bytes, apart from computing times and memory."
        }
    }
}
