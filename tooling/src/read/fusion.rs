//! Fusion libraries, JSON: flat, ball and bull nose end mills with holders and presets.
//!
//! ```text
//!   geometry: DC diameter   RE corner radius   LCF flutes   shoulder-length   LB below the holder
//!             OAL overall   SFDM shank         NOF flutes   TA taper
//!   start-values.presets: n (1/min), v_c (m/min or ft/min), f_z, v_f, stepover, stepdown
//! ```

use std::path::Path;

use claymill_toolpath::{End, Holder, HolderSection, Tool};
use serde_json::Value;

use super::fields::{count, list, number, positive, text, tidy};
use super::{Gathered, LengthUnit};
use crate::error::{ToolingError, one_line};
use crate::library::{Advance, Cutting, LibraryTool, MOST_SECTIONS, Speed};

/// Presets of a tool that are taken over.
const MOST_PRESETS: usize = 100;
/// Two diameters that differ by less are one, mm.
const SAME_MM: f64 = 1e-6;
/// A foot, m: edge speeds of tools in inches are ft/min.
const FOOT_M: f64 = 0.3048;

pub(super) fn read(file: &Value, path: &Path, gathered: &mut Gathered) -> Result<(), ToolingError> {
    let Some(tools) = file.get("data").and_then(Value::as_array) else {
        return Err(ToolingError::syntax(path, "`data` is no list of tools"));
    };
    Gathered::bound(tools.len(), path)?;
    for (index, tool) in tools.iter().enumerate() {
        let name = match text(tool, "description") {
            "" => format!("tool {} ({})", index + 1, text(tool, "type")),
            name => name.to_owned(),
        };
        let mut notes = Vec::new();
        let read = tool_of(tool, &name, &mut notes);
        if read.is_ok() {
            notes.into_iter().for_each(|n| gathered.note(format!("{}: {n}", one_line(&name))));
        }
        gathered.add(&name, read);
    }
    Ok(())
}

fn tool_of(entry: &Value, name: &str, notes: &mut Vec<String>) -> Result<LibraryTool, String> {
    let kind = text(entry, "type");
    let geometry = entry.get("geometry").unwrap_or(&Value::Null);
    if !["ball end mill", "bull nose end mill", "flat end mill"].contains(&kind) {
        return Err(match kind {
            "holder" => "it is a holder without a tool".into(),
            "" => "it has no type".into(),
            _ => format!("`{}` is no flat, ball or bull nose end mill", one_line(kind)),
        });
    }
    let unit = unit_of(entry)?;
    let mm = |key: &str| positive(geometry, key).map(|v| tidy(v * unit.mm()));
    let radius_mm = 0.5 * mm("DC").ok_or("it has no diameter (`DC`)")?;
    if number(geometry, "TA").is_some_and(|deg| deg != 0.0) {
        return Err("its flank is tapered (`TA`), and a tapered end mill of this format is not read".into());
    }
    let end = match kind {
        "ball end mill" => End::Ball { radius_mm },
        "flat end mill" => End::Flat { radius_mm },
        _ => End::Bull { radius_mm, corner_radius_mm: mm("RE").ok_or("it has no corner radius (`RE`)")? },
    };
    let mut tool = Tool::of(end);
    let flutes_mm = mm("LCF");
    if let Some(shank) = mm("SFDM").filter(|d| (d - 2.0 * radius_mm).abs() > SAME_MM) {
        tool.shank_diameter_mm = Some(shank);
        let from = mm("shoulder-length").or(flutes_mm);
        tool.flute_length_mm =
            Some(from.ok_or("its shank has another diameter, and no height where it begins (`LCF`)")?);
    }
    let place = entry.get("post-process").unwrap_or(&Value::Null);
    let stick_out = mm("LB");
    let holder = entry.get("holder").filter(|h| !h.is_null());
    let holder = match (holder, stick_out) {
        (Some(holder), Some(out)) => Some(holder_of(holder, unit, out)?),
        (Some(_), None) => {
            notes.push("its holder was left out: the length below it (`LB`) is missing".into());
            None
        }
        (None, _) => None,
    };
    if geometry.get("HAND").and_then(Value::as_bool) == Some(false) {
        notes.push("it turns to the left (`HAND` is false): its spindle needs M4".into());
    }
    let mut read = LibraryTool {
        number: count(place, "number"),
        flutes: count(geometry, "NOF"),
        flute_length_mm: flutes_mm,
        overall_length_mm: mm("OAL"),
        holder: holder.filter(|h| !h.sections.is_empty()),
        stick_out_mm: stick_out,
        ..LibraryTool::new("", one_line(name), tool)
    };
    let presets = entry.get("start-values").map_or(&[] as &[Value], |v| list(v, "presets"));
    for preset in presets.iter().take(MOST_PRESETS) {
        match preset_of(preset, unit) {
            Some(cutting) => {
                let key = free_key(&read, preset);
                read.cutting.insert(key, cutting);
            }
            None => notes.push(format!(
                "preset `{}` was left out: it has no speed or no feed",
                one_line(text(preset, "name"))
            )),
        }
    }
    Ok(read)
}

fn unit_of(entry: &Value) -> Result<LengthUnit, String> {
    let word = text(entry, "unit");
    LengthUnit::named(word).ok_or_else(|| format!("its unit `{}` is not known", one_line(word)))
}

fn holder_of(holder: &Value, unit: LengthUnit, stick_out_mm: f64) -> Result<Holder, String> {
    let unit = if holder.get("unit").is_some() { unit_of(holder)? } else { unit };
    let segments = list(holder, "segments");
    if segments.len() > MOST_SECTIONS {
        return Err(format!("its holder has more than {MOST_SECTIONS} segments"));
    }
    let section = |s: &Value| {
        let mm = |key: &str| positive(s, key).map(|v| tidy(v * unit.mm()));
        Some(HolderSection {
            lower_diameter_mm: mm("lower-diameter")?,
            upper_diameter_mm: mm("upper-diameter")?,
            length_mm: mm("height")?,
        })
    };
    let sections = segments.iter().map(section).collect::<Option<Vec<_>>>();
    let sections = sections.ok_or("a segment of its holder has no height or no diameter")?;
    Ok(Holder { stick_out_mm, sections })
}

fn preset_of(preset: &Value, unit: LengthUnit) -> Option<Cutting> {
    let mm = |key: &str| positive(preset, key).map(|v| tidy(v * unit.mm()));
    let edge = || {
        let foot = if unit == LengthUnit::Inch { FOOT_M } else { 1.0 };
        positive(preset, "v_c").map(|v| Speed::Edge { vc_m_per_min: tidy(v * foot) })
    };
    let speed = positive(preset, "n").map(|rpm| Speed::Spindle { rpm }).or_else(edge)?;
    let per_minute = || mm("v_f").map(|feed_mm_per_min| Advance::PerMinute { feed_mm_per_min });
    let advance = mm("f_z").map(|fz_mm| Advance::PerEdge { fz_mm }).or_else(per_minute)?;
    let used = |flag: &str| preset.get(flag).and_then(Value::as_bool) == Some(true);
    Some(Cutting {
        ae_mm: mm("stepover").filter(|_| used("use-stepover")),
        ap_mm: mm("stepdown").filter(|_| used("use-stepdown")),
        plunge_mm_per_min: mm("v_f_plunge"),
        ramp_mm_per_min: mm("v_f_ramp"),
        lead_mm_per_min: mm("v_f_leadIn"),
        ..Cutting::new(speed, advance)
    })
}

/// The name of a preset's material, else its own, in letters that a key has; with a number where it is taken.
fn free_key(tool: &LibraryTool, preset: &Value) -> String {
    let material = preset.get("material").map_or("", |m| text(m, "category"));
    let name = if ["", "all"].contains(&material) { text(preset, "name") } else { material };
    let fitting = |c: char| if c.is_ascii_alphanumeric() { c.to_ascii_lowercase() } else { '-' };
    let key: String = name.chars().map(fitting).take(30).collect();
    let key = match key.trim_matches('-') {
        "" => "preset",
        key => key,
    };
    let numbered = (2..=MOST_PRESETS + 1).map(|n| format!("{key}-{n}"));
    let mut keys = std::iter::once(key.to_owned()).chain(numbered);
    keys.find(|k| !tool.cutting.contains_key(k)).unwrap_or_default()
}
