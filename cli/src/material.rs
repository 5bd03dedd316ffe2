//! On which side of sheets the material is: found, or said by `--material-side`.

use claymill_exchange::{Format, ImportReport};
use claymill_nurbs::{Model, Vector3};
use claymill_paths::Axis;
use claymill_surface_merge::{Evidence, Merge, Sheet, SheetOptions, sheets};
use claymill_toolpath::{FreeSide, SheetRecord};

use crate::args::AxisArgs;
use crate::commands::{Loaded, guess, name};
use crate::console::Console;
use crate::failure::Failure;
use crate::select;

const FORMS: &str = "Write auto, inside, outside, file, against-file, both, or the direction in which the material lies, as in -z; \
                     and for some sheets alone region:3=outside or face:12=-z. `claymill inspect` lists the sheets.";
/// Warnings that name their sheet.
const NAMED: usize = 5;

/// Where the material is.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Side {
    /// As it is found.
    Auto,
    /// Inside of what is closed or bulges.
    Inside,
    /// Outside of it.
    Outside,
    /// Behind the outside of each face in the file.
    File,
    AgainstFile,
    /// On neither: either side is cut.
    Both,
    /// In a direction.
    Toward(Axis),
}

/// A wish, and the faces that it is for: all if none are named.
struct Wish {
    side: Side,
    faces: Option<Vec<bool>>,
}

impl Wish {
    fn parse(text: &str, model: &Model, region_of_face: &[usize]) -> Result<Wish, Failure> {
        let (what, side) = match text.rsplit_once('=') {
            Some((what, side)) => (Some(what), side),
            None => (None, text),
        };
        let side = match side.trim() {
            "auto" => Side::Auto,
            "inside" => Side::Inside,
            "outside" => Side::Outside,
            "file" => Side::File,
            "against-file" => Side::AgainstFile,
            "both" => Side::Both,
            axis => Side::Toward(axis.parse().map_err(|_| {
                Failure::usage(format!("`{text}` does not say on which side the material is"), FORMS)
            })?),
        };
        let faces = what.map(|what| select::named(model, region_of_face, what.trim())).transpose()?;
        Ok(Wish { side, faces })
    }

    fn is_for(&self, face: usize) -> bool {
        self.faces.as_ref().is_none_or(|faces| faces[face])
    }
}

/// Whether orientations in a file mean anything: those of trimmed surfaces in IGES do not.
fn states_sides(report: &ImportReport) -> bool {
    let b_reps = || report.entities.iter().any(|(kind, count)| kind.starts_with("510") && count.used > 0);
    report.format != Format::Iges || b_reps()
}

/// Upwards as told, or as guessed.
pub(crate) fn up(axes: &AxisArgs, loaded: &Loaded) -> Vector3 {
    let up = guess(axes, loaded).map(|guess| guess.orientation.up);
    up.unwrap_or(Axis { index: 2, negative: false }).vector()
}

/// The sheets of a model, largest first, with their sides as found, or as `wishes` say; the last one for a face counts.
pub(crate) fn find(
    loaded: &Loaded,
    merged: &Merge,
    up: Vector3,
    wishes: &[String],
) -> Result<Vec<SheetRecord>, Failure> {
    let model = &loaded.import.model;
    let options = SheetOptions { file_states_sides: states_sides(&loaded.import.report), up: Some(up) };
    let parse = |text: &String| Wish::parse(text, model, &merged.region_of_face);
    let wishes = wishes.iter().map(parse).collect::<Result<Vec<_>, _>>()?;
    let found = sheets(model, merged, &options);
    Ok(found.iter().map(|sheet| as_wished(model, merged, sheet, &wishes)).collect())
}

/// The free side of each face.
pub(crate) fn free_sides(sheets: &[SheetRecord], faces: usize) -> Vec<FreeSide> {
    let mut sides = vec![FreeSide::Both; faces];
    for sheet in sheets {
        for (&face, &side) in sheet.faces.iter().zip(&sheet.free_sides) {
            if let Some(of_face) = sides.get_mut(face) {
                *of_face = side;
            }
        }
    }
    sides
}

fn as_wished(model: &Model, merged: &Merge, sheet: &Sheet, wishes: &[Wish]) -> SheetRecord {
    let wish_of = |face: usize| wishes.iter().rev().find(|wish| wish.is_for(face)).map(|wish| wish.side);
    let [free, material] = sheet.sees_out;
    let bulges_away = sheet.evidence != Evidence::Closed && free < material;
    let along = |k: usize, side: Side| -> FreeSide {
        let (found, face) = (sheet.free_along[k], &model.faces[sheet.faces[k]]);
        FreeSide::one(match side {
            Side::Both => return FreeSide::Both,
            Side::Auto => found,
            Side::Inside => found != bulges_away,
            Side::Outside => found == bulges_away,
            Side::File => !face.reversed,
            Side::AgainstFile => face.reversed,
            Side::Toward(axis) => found == (sheet.mean_free_normal.dot(&axis.vector()) <= 0.0),
        })
    };
    // What is said of some faces holds for their whole sheet, as far as nothing else is said of it.
    let (mut turned_mm2, mut kept_mm2) = (0.0, 0.0);
    let mut free_sides = Vec::with_capacity(sheet.faces.len());
    for (k, &face) in sheet.faces.iter().enumerate() {
        let side = wish_of(face).map(|side| along(k, side));
        match side {
            None | Some(FreeSide::Both) => {}
            Some(side) if side == FreeSide::one(sheet.free_along[k]) => {
                kept_mm2 += merged.area_of_face_mm2[face]
            }
            Some(_) => turned_mm2 += merged.area_of_face_mm2[face],
        }
        free_sides.push(side);
    }
    let turns = turned_mm2 > kept_mm2;
    let is_asked = |side: &Option<Side>| side.is_some_and(|side| side != Side::Auto);
    let asked = sheet.faces.iter().any(|&face| is_asked(&wish_of(face)));
    let mut record = SheetRecord {
        faces: sheet.faces.clone(),
        free_sides: (free_sides.iter().zip(&sheet.free_along))
            .map(|(side, found)| side.unwrap_or(FreeSide::one(*found != turns)))
            .collect(),
        area_mm2: sheet.area_mm2,
        open_mm: sheet.open_mm,
        turned_mm: sheet.turned_mm,
        sees_out: sheet.sees_out,
        file_agrees: sheet.file_agrees,
        mean_free_normal: sheet.mean_free_normal.into(),
        evidence: if asked { "asked".to_owned() } else { name(&sheet.evidence) },
        clear: sheet.clear || asked,
    };
    if record.free_sides.first().is_some_and(|side| *side == FreeSide::one(!sheet.free_along[0])) {
        record.sees_out.reverse();
        record.file_agrees = 1.0 - record.file_agrees;
        record.mean_free_normal = record.mean_free_normal.map(|x| -x);
    }
    record
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
