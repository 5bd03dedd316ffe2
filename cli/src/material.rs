//! What the console says of the sides of sheets.

use claymill::ModelFile;
use claymill_nurbs::Vector3;
use claymill_paths::Axis;
use claymill_toolpath::{FreeSide, SheetRecord};

use crate::args::AxisArgs;
use crate::commands::guess;
use crate::console::Console;

/// Warnings that name their sheet.
const NAMED: usize = 5;

/// Upwards as told, or as guessed.
pub(crate) fn up(axes: &AxisArgs, loaded: &ModelFile) -> Vector3 {
    let up = guess(axes, loaded).map(|guess| guess.orientation.up);
    up.unwrap_or(Axis { index: 2, negative: false }).vector()
}

/// A sheet in a few words: its faces, area, border, and where its material is, by what.
pub(crate) fn words(sheet: &SheetRecord) -> String {
    let faces = match sheet.faces.len() {
        1 => "1 face".to_owned(),
        count => format!("{count} faces"),
    };
    let open = match sheet.open_mm {
        mm if sheet.evidence == "closed" || mm == 0.0 => "closed".to_owned(),
        mm => format!("open along {mm:.1} mm"),
    };
    let sees = sheet.sees_out.map(|share| format!("{:.0} %", 100.0 * share));
    let why = match sheet.evidence.as_str() {
        "asked" => "as asked for".to_owned(),
        "closed" => "it is closed".to_owned(),
        "encloses" => {
            format!("that side sees out in {} of all directions, the free one in {}", sees[1], sees[0])
        }
        "level" => "no tool comes from below".to_owned(),
        "file" => "as all its faces have it in the file".to_owned(),
        "face_by_face" => "it has no two sides: each face by itself".to_owned(),
        _ => "assumed".to_owned(),
    };
    let contrary = match sheet.evidence.as_str() {
        "encloses" if !sheet.clear && sheet.file_agrees < 0.5 => "; the file has it the other way round",
        "encloses" if !sheet.clear => "; it opens upwards, as a mould would",
        _ => "",
    };
    format!(
        "{faces}, {:.4} m², {open}: material {} ({why}{contrary})",
        sheet.area_mm2 * 1e-6,
        side_words(sheet)
    )
}

/// Where the material of a sheet is.
fn side_words(sheet: &SheetRecord) -> String {
    if sheet.free_sides.iter().all(FreeSide::is_both) {
        return "on neither side".to_owned();
    }
    let [free, material] = sheet.sees_out;
    let toward = Vector3::from(sheet.mean_free_normal);
    let axis = toward.iamax();
    if toward[axis].abs() >= 0.3 {
        let sign = if toward[axis] > 0.0 { '-' } else { '+' };
        return format!("on the {sign}{} side", ["x", "y", "z"][axis]);
    }
    if free >= material { "inside" } else { "outside" }.to_owned()
}

/// Says how the sides of sheets were found, and of which of those that are cut they are unclear.
pub(crate) fn say(console: &Console, sheets: &[SheetRecord], excluded: &[bool]) {
    let cut = |sheet: &&SheetRecord| sheet.faces.iter().any(|&face| !excluded[face]);
    let of = |evidence: &str| sheets.iter().filter(cut).filter(|s| s.evidence == evidence).count();
    let kinds = [
        ("closed", "closed"),
        ("encloses", "by what encloses"),
        ("level", "level"),
        ("file", "as in the file"),
        ("asked", "as asked for"),
        ("assumed", "assumed"),
        ("face_by_face", "without two sides"),
    ];
    let counts: Vec<String> = kinds
        .iter()
        .map(|(evidence, words)| (of(evidence), words))
        .filter(|(count, _)| *count > 0)
        .map(|(count, words)| format!("{count} {words}"))
        .collect();
    let all = sheets.iter().filter(cut).count();
    let noun = if all == 1 { "sheet" } else { "sheets" };
    console
        .say(format!("sides     {all} {noun}: {}; only the side without material is cut", counts.join(", ")));
    let unclear: Vec<&SheetRecord> = sheets.iter().filter(cut).filter(|sheet| !sheet.clear).collect();
    for sheet in unclear.iter().take(NAMED) {
        let first = sheet.faces[0];
        console.say(format!(
            "warning: it is not clear on which side the material is of the sheet with face {first}: {}. Turn it over with \
             --material-side face:{first}={}, or confirm it with face:{first}={}.",
            words(sheet),
            if sheet.sees_out[0] >= sheet.sees_out[1] { "outside" } else { "inside" },
            if sheet.sees_out[0] >= sheet.sees_out[1] { "inside" } else { "outside" },
        ));
    }
    if unclear.len() > NAMED {
        console.say(format!(
            "warning: of {} more sheets it is not clear either; `claymill inspect` lists them",
            unclear.len() - NAMED
        ));
    }
}
