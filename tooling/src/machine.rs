//! What a machine can reach, turn and hold: travels, spindle, feeds and tool changer.

use std::collections::BTreeMap;
use std::path::Path;

pub use claymill_toolpath::{Changer, RotaryAxis};
use claymill_toolpath::{LONGEST_WRITTEN, read_plain};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::error::{Fault, ToolingError, one_line};

/// No axis travels farther, mm or degrees.
const FARTHEST: f64 = 1e7;
/// No feed or rapid is faster, mm/min.
const FASTEST: f64 = 1e7;
/// No spindle is faster, 1/min, or stronger, kW.
const LARGEST_RPM: f64 = 1e6;
const LARGEST_KW: f64 = 1e4;
/// Tables that only posting and simulation read.
const POSTING: [&str; 22] = [
    "units",
    "digits",
    "tolerance_mm",
    "blend_mm",
    "work_offset",
    "line_numbers",
    "comments",
    "files",
    "max_bytes",
    "arcs",
    "nurbs",
    "max_points",
    "coolant",
    "tool_change",
    "home",
    "retreat_mm",
    "start",
    "end",
    "setups",
    "tools",
    "tilt",
    "dynamics",
];
/// The fields of [`MachineShape`], and the one posting table that is left.
const SHAPE: [&str; 7] = ["name", "axes", "rotary", "feed", "spindle", "changer", "control"];

/// The fields of both kinds in `feed` and `spindle`.
const FEED: [&str; 2] = ["max_mm_per_min", "rapid_mm_per_min"];
const SPINDLE: [&str; 5] = ["min_rpm", "max_rpm", "power_kw", "speed_rpm", "counterclockwise"];

/// The limits of a machine that tools and set-ups must fit.
///
/// Its TOML form reads the tables `axes`, `feed` and `spindle` of a machine definition, and adds `rotary`, `changer` and
/// the spindle's limits. Fields that only posting and simulation need are passed over.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct MachineShape {
    /// Name.
    pub name: String,
    /// Travel of the linear axes `x`, `y`, `z`, mm.
    pub axes: BTreeMap<String, [f64; 2]>,
    /// Rotary axes by name.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub rotary: BTreeMap<String, RotaryAxis>,
    /// Feeds.
    pub feed: FeedLimits,
    /// Spindle.
    pub spindle: SpindleLimits,
    /// Tool changer.
    pub changer: Changer,
}

/// Fastest feeds.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct FeedLimits {
    /// Fastest feed, mm/min.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub max_mm_per_min: Option<f64>,
    /// Rapid rate, mm/min.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rapid_mm_per_min: Option<f64>,
}

/// What a spindle can do.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct SpindleLimits {
    /// Slowest speed, 1/min.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub min_rpm: Option<f64>,
    /// Fastest speed, 1/min.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub max_rpm: Option<f64>,
    /// Power, kW.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub power_kw: Option<f64>,
}

impl MachineShape {
    /// The machine that is taken where none is given: a gantry mill with three axes.
    ///
    /// # Panics
    /// Never: a test reads the file.
    #[must_use]
    pub fn shipped() -> Self {
        let text = include_str!("../data/gantry.toml");
        Self::parse(text.as_bytes(), Path::new("(shipped)/gantry.toml")).unwrap_or_default()
    }

    /// Reads a machine: TOML, or FreeCAD's `.fcm`. With it come notes on what is unusual.
    ///
    /// # Errors
    /// The file cannot be read, is of neither form, or has values that make no sense.
    pub fn read(path: &Path) -> Result<(Self, Vec<String>), ToolingError> {
        let bytes = read_plain(path, LONGEST_WRITTEN)
            .map_err(|source| ToolingError::Io { path: path.to_owned(), source })?;
        if bytes.trim_ascii_start().starts_with(b"{") {
            return crate::read::machine_from_freecad(&bytes, path);
        }
        Self::parse(&bytes, path).map(|machine| (machine, Vec::new()))
    }

    /// Reads a machine from the bytes of a TOML file; `path` is for messages.
    ///
    /// # Errors
    /// As [`MachineShape::read`].
    pub fn parse(bytes: &[u8], path: &Path) -> Result<Self, ToolingError> {
        let text =
            std::str::from_utf8(bytes).map_err(|_| ToolingError::syntax(path, "it is not text in UTF-8"))?;
        let machine: MachineShape = toml::from_str(text).map_err(|e| ToolingError::syntax(path, e))?;
        let table: toml::Table = toml::from_str(text).map_err(|e| ToolingError::syntax(path, e))?;
        known_only(&table, "a machine", &[&SHAPE, &POSTING])
            .map_err(|what| ToolingError::syntax(path, what))?;
        for (name, fields) in [("feed", &FEED[..]), ("spindle", &SPINDLE[..])] {
            let inside = table.get(name).and_then(toml::Value::as_table);
            inside
                .map_or(Ok(()), |inside| known_only(inside, name, &[fields]))
                .map_err(|what| ToolingError::syntax(path, what))?;
        }
        machine.check().map_err(|(entry, fault)| fault.of_entry(path, &entry))?;
        Ok(machine)
    }

    /// The machine as TOML. Reading it gives the same machine.
    #[must_use]
    pub fn to_toml(&self) -> String {
        toml::to_string(self).unwrap_or_default()
    }

    /// Number of axes.
    #[must_use]
    pub fn axis_count(&self) -> usize {
        self.axes.len() + self.rotary.len()
    }

    /// Length of the travel of a linear axis, mm.
    #[must_use]
    pub fn travel_mm(&self, axis: &str) -> Option<f64> {
        self.axes.get(axis).map(|[low, high]| high - low)
    }

    /// Refuses values that make no sense.
    ///
    /// # Errors
    /// The first such value by its table.
    pub fn check(&self) -> Result<(), (String, Fault)> {
        let refuse = |entry: &str, what: &str, remedy: &str| Err((one_line(entry), Fault::new(what, remedy)));
        let travel = |[low, high]: [f64; 2]| low < high && low.abs() <= FARTHEST && high.abs() <= FARTHEST;
        for (name, range) in &self.axes {
            if !["x", "y", "z"].contains(&name.as_str()) {
                return refuse(
                    name,
                    "it is no linear axis",
                    "Linear axes are x, y and z; others go to `rotary`.",
                );
            }
            if !travel(*range) {
                return refuse(
                    name,
                    "its lower limit is not below the upper one, or one is beyond 1e7 mm",
                    "Correct the travel, for example z = [-500, 0].",
                );
            }
        }
        for (name, axis) in &self.rotary {
            if !RotaryAxis::may_be_named(name) {
                return refuse(name, "it is no name of a rotary axis", "Name it a, b or c.");
            }
            if !axis.is_sensible() {
                return refuse(
                    name,
                    "its travel, direction, point or rate makes no sense",
                    "Correct the axis.",
                );
            }
        }
        let within = |v: Option<f64>, most: f64| v.is_none_or(|v| v > 0.0 && v <= most);
        let rates = [self.feed.max_mm_per_min, self.feed.rapid_mm_per_min];
        if !rates.into_iter().all(|v| within(v, FASTEST)) {
            return refuse("feed", "a rate is not above 0 and at most 1e7", "Correct the rate.");
        }
        let spindle = self.spindle;
        let (slow, fast) = (spindle.min_rpm.unwrap_or(0.0), spindle.max_rpm.unwrap_or(LARGEST_RPM));
        if !(slow >= 0.0 && slow <= fast && within(spindle.max_rpm, LARGEST_RPM)) {
            return refuse(
                "spindle",
                "its slowest speed is above the fastest, or one is not from 0 to 1000000",
                "Correct `min_rpm` and `max_rpm`.",
            );
        }
        if !(within(spindle.power_kw, LARGEST_KW) && self.changer.is_sensible()) {
            return refuse("changer", "a size, time or power is not above 0 or beyond reason", "Correct it.");
        }
        Ok(())
    }
}

/// Refuses the first field that is in none of the lists; the first list is the one that the message has.
fn known_only(table: &toml::Table, name: &str, lists: &[&[&str]]) -> Result<(), String> {
    let is_known = |key: &str| lists.iter().any(|list| list.contains(&key));
    match table.keys().find(|key| !is_known(key)) {
        None => Ok(()),
        Some(key) => Err(format!("unknown field `{}`; {name} has {}", one_line(key), lists[0].join(", "))),
    }
}
