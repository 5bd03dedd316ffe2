//! FreeCAD tool bits (`.fctb`, version 2): one tool a file, lengths as texts with a unit.

use std::path::Path;

use claymill_toolpath::{End, Tool};
use serde_json::Value;

use super::Gathered;
use super::fields::{text, tidy};
use super::length::length_mm;
use crate::error::{ToolingError, one_line};
use crate::library::LibraryTool;

/// The version that is read.
const VERSION: u64 = 2;
/// Two diameters that differ by less are one, mm.
const SAME_MM: f64 = 1e-6;

pub(super) fn read(file: &Value, path: &Path, gathered: &mut Gathered) -> Result<(), ToolingError> {
    if file.get("version").and_then(Value::as_u64) != Some(VERSION) {
        let found = file.get("version").map_or_else(|| "(none)".to_owned(), |v| one_line(&v.to_string()));
        let format = "FreeCAD tool bits";
        return Err(ToolingError::Version { path: path.to_owned(), format, found, known: VERSION });
    }
    let name = match text(file, "name") {
        "" => path.file_stem().map(|s| s.to_string_lossy().into_owned()).unwrap_or_default(),
        name => name.to_owned(),
    };
    let read = tool_of(file, &name);
    gathered.add(&name, read);
    Ok(())
}

fn tool_of(file: &Value, name: &str) -> Result<LibraryTool, String> {
    let parameter = file.get("parameter").unwrap_or(&Value::Null);
    let length = |key: &str| match parameter.get(key) {
        None => Ok(None),
        Some(value) => {
            let mm = value.as_str().map_or_else(|| value.as_f64(), length_mm);
            let mm = mm.ok_or_else(|| format!("`{key}` is no length: {}", one_line(&value.to_string())))?;
            Ok::<_, String>(Some(tidy(mm)).filter(|mm| *mm != 0.0))
        }
    };
    // Older files have the shape's file alone.
    let shape = match text(file, "shape-type") {
        "" => text(file, "shape").rsplit(['/', '\\']).next().unwrap_or_default(),
        shape => shape,
    };
    let shape = shape.to_ascii_lowercase();
    let shape = shape.trim_end_matches(".fcstd");
    if !["ballend", "bullnose", "endmill"].contains(&shape) {
        return Err(format!("`{}` is no end mill, ball end or bull nose", one_line(shape)));
    }
    let radius_mm = 0.5 * length("Diameter")?.ok_or("it has no `Diameter`")?;
    let end = match shape {
        "ballend" => End::Ball { radius_mm },
        "endmill" => End::Flat { radius_mm },
        _ => {
            let corner = length("CornerRadius")?.ok_or(
                "it has no `CornerRadius`; files of older versions have `FlatRadius`, which is not read",
            )?;
            End::Bull { radius_mm, corner_radius_mm: corner }
        }
    };
    let edges_mm = length("CuttingEdgeHeight")?;
    let mut tool = Tool::of(end);
    if let Some(shank) = length("ShankDiameter")?.filter(|d| (d - 2.0 * radius_mm).abs() > SAME_MM) {
        tool.shank_diameter_mm = Some(shank);
        tool.flute_length_mm =
            Some(edges_mm.ok_or("its shank has another diameter, but no `CuttingEdgeHeight`")?);
    }
    Ok(LibraryTool {
        flutes: flutes(parameter).or_else(|| flutes(file.get("attribute")?)),
        flute_length_mm: edges_mm,
        overall_length_mm: length("Length")?,
        ..LibraryTool::new("", one_line(name), tool)
    })
}

/// The number of flutes, which is a number or a text.
fn flutes(object: &Value) -> Option<u32> {
    let value = object.get("Flutes")?;
    let number = value.as_u64().or_else(|| value.as_str()?.trim().parse().ok())?;
    u32::try_from(number).ok().filter(|n| *n > 0)
}
