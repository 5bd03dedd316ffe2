//! FreeCAD machines (`.fcm`, version 1): travels of the axes and the spindle.

use std::path::Path;

use serde_json::Value;

use super::fields::{number, positive, text, tidy};
use super::{LONGEST_FILE, LengthUnit};
use crate::error::{ToolingError, one_line};
use crate::machine::{MachineShape, RotaryAxis};

/// The version that is read.
const VERSION: u64 = 1;
/// A machine has no more axes than this.
const MOST_AXES: usize = 9;

/// Reads a FreeCAD machine; with it come notes on what is unusual.
///
/// # Errors
/// It is no such file, is damaged, or has values that make no sense.
pub fn machine_from_freecad(bytes: &[u8], path: &Path) -> Result<(MachineShape, Vec<String>), ToolingError> {
    if bytes.len() as u64 > LONGEST_FILE {
        return Err(ToolingError::TooMuch { path: path.into(), what: "MB", most: 16 });
    }
    let file = super::json(super::text(bytes, path)?, path)?;
    let Some(machine) = file.get("machine").filter(|m| m.is_object()) else {
        let what = "it is JSON, but no FreeCAD machine (`machine`)".to_owned();
        return Err(ToolingError::Format { path: path.to_owned(), what });
    };
    if file.get("version").and_then(Value::as_u64) != Some(VERSION) {
        let found = file.get("version").map_or_else(|| "(none)".to_owned(), |v| one_line(&v.to_string()));
        let format = "FreeCAD machines";
        return Err(ToolingError::Version { path: path.to_owned(), format, found, known: VERSION });
    }
    let unit = LengthUnit::named(text(machine, "units"))
        .ok_or_else(|| ToolingError::syntax(path, "`units` is neither metric nor imperial"))?;
    let mut notes = Vec::new();
    let mut shape = MachineShape { name: name(machine), ..MachineShape::default() };
    let empty = serde_json::Map::new();
    let axes = machine.get("axes").and_then(Value::as_object).unwrap_or(&empty);
    if axes.len() > MOST_AXES {
        return Err(ToolingError::TooMuch { path: path.into(), what: "axes", most: MOST_AXES });
    }
    for (axis, entry) in axes {
        axis_of(axis, entry, unit, &mut shape, &mut notes)
            .map_err(|what| ToolingError::syntax(path, format!("axis {}: {what}", one_line(axis))))?;
    }
    let heads = super::fields::list(machine, "toolheads");
    if let Some(head) = heads.iter().find(|h| text(h, "toolhead_type") == "rotary") {
        shape.spindle.min_rpm = positive(head, "min_rpm");
        shape.spindle.max_rpm = positive(head, "max_rpm");
        shape.spindle.power_kw = positive(head, "max_power_kw");
    } else {
        notes.push("it has no spindle".into());
    }
    if heads.len() > 1 {
        notes.push(format!("of {} tool heads the first spindle was read", heads.len()));
    }
    shape.check().map_err(|(entry, fault)| fault.of_entry(path, &entry))?;
    Ok((shape, notes))
}

fn name(machine: &Value) -> String {
    one_line(&format!("{} {}", text(machine, "manufacturer"), text(machine, "name")))
}

fn axis_of(
    axis: &str,
    entry: &Value,
    unit: LengthUnit,
    shape: &mut MachineShape,
    notes: &mut Vec<String>,
) -> Result<(), String> {
    let limits = entry.get("limits").unwrap_or(&Value::Null);
    let (low, high) = (number(limits, "min"), number(limits, "max"));
    let (Some(low), Some(high)) = (low, high) else { return Err("it has no limits".into()) };
    let name = axis.to_ascii_lowercase();
    let joint = entry.get("joint").unwrap_or(&Value::Null);
    match text(entry, "type") {
        "linear" => {
            if let Some(rate) = positive(entry, "max_velocity") {
                let rate = tidy(rate * unit.mm());
                // The slowest axis bounds what every direction can do.
                let slowest = shape.feed.rapid_mm_per_min.map_or(rate, |r| r.min(rate));
                shape.feed.rapid_mm_per_min = Some(slowest);
            }
            shape.axes.insert(name, [tidy(low * unit.mm()), tidy(high * unit.mm())]);
        }
        "rotary" => {
            let direction = triple(joint, "axis").ok_or("it has no direction (`joint.axis`)")?;
            let usual = match name.as_str() {
                "a" => [1.0, 0.0, 0.0],
                "b" => [0.0, 1.0, 0.0],
                _ => [0.0, 0.0, 1.0],
            };
            if direction.map(f64::abs) != usual {
                notes.push(format!("axis {} turns about {direction:?}, which is not usual", one_line(axis)));
            }
            let point = triple(joint, "origin").unwrap_or_default();
            let turns_table = text(entry, "role").starts_with("table");
            shape.rotary.insert(
                name,
                RotaryAxis {
                    travel_deg: [low, high],
                    direction,
                    point_mm: point.map(|v| tidy(v * unit.mm())),
                    turns_table,
                    max_deg_per_min: positive(entry, "max_velocity"),
                },
            );
        }
        kind => return Err(format!("its type `{}` is neither linear nor rotary", one_line(kind))),
    }
    Ok(())
}

fn triple(object: &Value, key: &str) -> Option<[f64; 3]> {
    let list = object.get(key)?.as_array()?;
    let values: Vec<f64> = list.iter().filter_map(Value::as_f64).filter(|v| v.is_finite()).collect();
    values.try_into().ok()
}
