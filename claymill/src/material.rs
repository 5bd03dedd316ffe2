//! On which side of sheets the material is: found, or as [`Job::material_side`](crate::Job::material_side) says.

use claymill_exchange::{Format, Import, ImportReport};
use claymill_nurbs::{Model, Vector3};
use claymill_paths::Axis;
use claymill_surface_merge::{Evidence, Merge, Sheet, SheetOptions, sheets};
use claymill_toolpath::{FreeSide, SheetRecord};
use thiserror::Error;

use crate::record::name;
use crate::select::{SelectError, named_faces};

const FORMS: &str = "Write auto, inside, outside, file, against-file, both, or the direction in which the material lies, as in -z; \
                     and for some sheets alone region:3=outside or face:12=-z. `claymill inspect` lists the sheets.";

/// Why a text does not say on which side the material is.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum MaterialError {
    /// There is no such side.
    #[error("`{text}` does not say on which side the material is")]
    Side {
        /// The text.
        text: String,
    },
    /// It names no faces.
    #[error(transparent)]
    Select(#[from] SelectError),
}

impl MaterialError {
    /// What to do about it, in one sentence.
    #[must_use]
    pub fn advice(&self) -> String {
        match self {
            MaterialError::Side { .. } => FORMS.to_owned(),
            MaterialError::Select(e) => e.advice(),
        }
    }
}

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
    fn parse(text: &str, model: &Model, region_of_face: &[usize]) -> Result<Wish, MaterialError> {
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
            axis => Side::Toward(axis.parse().map_err(|_| MaterialError::Side { text: text.to_owned() })?),
        };
        let faces =
            what.map(|what| named_faces(model, region_of_face, &[what.trim().to_owned()])).transpose()?;
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

/// The sheets of a model, largest first, with their sides as found, or as `wishes` say; the last one for a face counts.
pub(crate) fn find(
    import: &Import,
    merged: &Merge,
    up: Vector3,
    wishes: &[String],
) -> Result<Vec<SheetRecord>, MaterialError> {
    let model = &import.model;
    let options = SheetOptions { file_states_sides: states_sides(&import.report), up: Some(up) };
    let parse = |text: &String| Wish::parse(text, model, &merged.region_of_face);
    let wishes = wishes.iter().map(parse).collect::<Result<Vec<_>, _>>()?;
    let found = sheets(model, merged, &options);
    Ok(found.iter().map(|sheet| as_wished(model, merged, sheet, &wishes)).collect())
}

/// The free side of each face.
#[must_use]
pub fn free_sides(sheets: &[SheetRecord], faces: usize) -> Vec<FreeSide> {
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
