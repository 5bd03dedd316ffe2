//! Regions, and the tool paths over them, as a model file.

use std::collections::BTreeMap;
use std::path::Path;

use claymill_exchange::{Group, Lines, WriteError, write_glb, write_iges, write_step};
use claymill_nurbs::Model;
use claymill_toolpath::{MoveKind, Program};
use claymill_viewer::flatten;

use super::pictures;
use crate::console::Console;
use crate::failure::{Failure, advice_on};

/// Triangles and lines of a glTF leave what they stand for by no more than this, mm.
const DEVIATION_MM: f64 = 0.05;

impl From<WriteError> for Failure {
    fn from(error: WriteError) -> Self {
        let advice = match &error {
            WriteError::Io { source, .. } => advice_on(source),
            WriteError::UnknownFace { .. } => "",
            WriteError::Face { .. } => {
                "Leave the face out in the CAD system, or look at it with `claymill inspect`."
            }
        };
        Failure::problem(error, advice)
    }
}

/// The formats by the extension of their files.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum ExportFormat {
    Iges,
    Step,
    Glb,
}

impl ExportFormat {
    /// The format that a file name asks for.
    pub(crate) fn of(path: &Path) -> Result<Self, Failure> {
        let extension = path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase());
        match extension.as_deref() {
            Some("igs" | "iges") => Ok(ExportFormat::Iges),
            Some("stp" | "step") => Ok(ExportFormat::Step),
            Some("glb") => Ok(ExportFormat::Glb),
            _ => Err(Failure::usage(
                format!("{}: the extension names no format", path.display()),
                "Name the file .igs, .stp or .glb.",
            )),
        }
    }
}

/// Writes the model, each region a group in its colour of the pictures; tool paths go into a glTF only, and faces that cannot
/// be triangulated do not.
pub(crate) fn export(
    console: &Console,
    path: &Path,
    format: ExportFormat,
    model: &Model,
    album: &pictures::Album<'_>,
    region_of_face: &[usize],
    program: &Program,
) -> Result<(), Failure> {
    let mut groups: Vec<Group> = (album.colours().iter().enumerate())
        .map(|(id, colour)| Group { name: format!("region {id}"), colour: Some(*colour), faces: Vec::new() })
        .collect();
    for (face, &region) in region_of_face.iter().enumerate() {
        if let Some(group) = groups.get_mut(region) {
            group.faces.push(face);
        }
    }
    match format {
        ExportFormat::Iges => write_iges(path, model, &groups)?,
        ExportFormat::Step => write_step(path, model, &groups)?,
        ExportFormat::Glb => {
            for (face, reason) in write_glb(path, model, &groups, &lines(program), DEVIATION_MM)? {
                let entity = &model.faces[face].source.entity;
                console.say(format!("warning: face {face} ({entity}) is left out of the file: {reason}"));
            }
        }
    }
    Ok(())
}

/// The paths of the tool tip by setup and kind.
fn lines(program: &Program) -> Vec<Lines> {
    let mut by_name: BTreeMap<String, Lines> = BTreeMap::new();
    for step in &program.moves {
        let (kind, colour) = match step.kind {
            MoveKind::Cut => ("cut", [30, 30, 30]),
            MoveKind::LeadIn | MoveKind::LeadOut => ("lead", [230, 140, 20]),
            MoveKind::Link => ("link", [20, 110, 220]),
            MoveKind::Rapid => ("rapid", [200, 30, 30]),
        };
        let name = format!("{} {kind}", step.setup);
        let lines = by_name.entry(name.clone()).or_insert_with(|| Lines { name, colour, lines: Vec::new() });
        // A move that cannot be read as a curve is for `verify` to name.
        lines.lines.extend(step.curve().ok().map(|curve| flatten(&curve, DEVIATION_MM)));
    }
    by_name.into_values().collect()
}
