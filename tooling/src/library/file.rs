//! claymill's own form of a library, TOML: read, written, and its schema.

use std::collections::BTreeMap;
use std::path::Path;

use claymill_toolpath::{Holder, Tool};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Advance, Cutting, Library, LibraryTool, Speed};
use crate::error::{Fault, ToolingError};

/// What `format` says in a library.
pub const LIBRARY_FORMAT: &str = "claymill-tools";
/// Version of the form; raised when an old reader would misread a new file.
pub const LIBRARY_VERSION: u64 = 1;

/// A tool library as its TOML file holds it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct LibraryFile {
    /// `claymill-tools`.
    format: String,
    /// Version of the form: 1.
    version: u64,
    /// Name, for lists.
    #[serde(default)]
    name: String,
    /// The tools.
    #[serde(default)]
    tools: Vec<ToolEntry>,
}

/// A tool of a library file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct ToolEntry {
    /// Id in jobs, for example `T12`: letters, digits, `-`, `_` and `.`.
    id: String,
    /// Its number in the machine.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    number: Option<u32>,
    /// What the shop calls it.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    name: String,
    /// Its shape as `--tool` takes it: `ball:10`, `flat:5,length:20,shank:12`, `bull:10:2`; radii in mm.
    tool: String,
    /// Number of cutting edges.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    flutes: Option<u32>,
    /// Length of the cutting edges along the axis, mm.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    flute_length_mm: Option<f64>,
    /// Length of the tool alone, mm.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    overall_length_mm: Option<f64>,
    /// Whether the edges reach the axis, so that the tool may plunge.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    centre_cutting: Option<bool>,
    /// Diameter around the axis that does not cut, mm.
    #[serde(default, skip_serializing_if = "is_zero")]
    dead_centre_mm: f64,
    /// Steepest descent while it moves sideways, degrees.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    ramp_deg: Option<f64>,
    /// Its holder as `--holder` takes it: the stick-out alone for the usual chuck, or with the sections from the tool
    /// up, `60:27-34x50,63x26`; mm.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    holder: Option<String>,
    /// From the tip to the holder, mm, where no holder is described.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    stick_out_mm: Option<f64>,
    /// From the tip to the spindle's nose as measured, mm.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    gauge_length_mm: Option<f64>,
    /// Cutting data by the name of a material.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    cutting: BTreeMap<String, CuttingEntry>,
}

/// How a tool cuts a material: one of `vc_m_per_min` and `rpm`, one of `fz_mm` and `feed_mm_per_min`.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub(super) struct CuttingEntry {
    /// Speed of the edge, m/min.
    #[serde(skip_serializing_if = "Option::is_none")]
    vc_m_per_min: Option<f64>,
    /// Speed of the spindle, 1/min.
    #[serde(skip_serializing_if = "Option::is_none")]
    rpm: Option<f64>,
    /// Advance of each edge in each turn, mm.
    #[serde(skip_serializing_if = "Option::is_none")]
    fz_mm: Option<f64>,
    /// Feed, mm/min.
    #[serde(skip_serializing_if = "Option::is_none")]
    feed_mm_per_min: Option<f64>,
    /// Width of cut, mm.
    #[serde(skip_serializing_if = "Option::is_none")]
    ae_mm: Option<f64>,
    /// Depth of cut, mm.
    #[serde(skip_serializing_if = "Option::is_none")]
    ap_mm: Option<f64>,
    /// Largest engagement angle, degrees.
    #[serde(skip_serializing_if = "Option::is_none")]
    engagement_deg: Option<f64>,
    /// Feed straight down, mm/min.
    #[serde(skip_serializing_if = "Option::is_none")]
    plunge_mm_per_min: Option<f64>,
    /// Feed along ramps, mm/min.
    #[serde(skip_serializing_if = "Option::is_none")]
    ramp_mm_per_min: Option<f64>,
    /// Feed of leads, mm/min.
    #[serde(skip_serializing_if = "Option::is_none")]
    lead_mm_per_min: Option<f64>,
}

fn is_zero(v: &f64) -> bool {
    *v == 0.0
}

/// The JSON Schema of a library file.
#[must_use]
pub fn library_schema() -> schemars::Schema {
    schemars::schema_for!(LibraryFile)
}

impl Library {
    /// Reads claymill's own form; `path` is for messages.
    ///
    /// # Errors
    /// The text is not of the form, or a tool makes no sense.
    pub fn parse(text: &str, path: &Path) -> Result<Self, ToolingError> {
        let file: LibraryFile = crate::form::parse(text, path, LIBRARY_FORMAT, LIBRARY_VERSION)?;
        if file.tools.len() > super::MOST_TOOLS {
            return Err(ToolingError::TooMuch { path: path.into(), what: "tools", most: super::MOST_TOOLS });
        }
        let read = |entry: ToolEntry| {
            let id = crate::error::one_line(&entry.id);
            entry.read().map_err(|fault| fault.of_entry(path, &id))
        };
        let tools = file.tools.into_iter().map(read).collect::<Result<_, _>>()?;
        let library = Library { name: file.name, tools };
        library.check().map_err(|(entry, fault)| fault.of_entry(path, &entry))?;
        Ok(library)
    }

    /// The library in claymill's own form. Reading it gives the same library.
    #[must_use]
    pub fn to_toml(&self) -> String {
        let file = LibraryFile {
            format: LIBRARY_FORMAT.into(),
            version: LIBRARY_VERSION,
            name: self.name.clone(),
            tools: self.tools.iter().map(ToolEntry::of).collect(),
        };
        // Only maps with keys that are no texts cannot be written, and there are none.
        toml::to_string(&file).unwrap_or_default()
    }
}

impl ToolEntry {
    fn read(self) -> Result<LibraryTool, Fault> {
        let tool: Tool = self.tool.parse().map_err(|e: claymill_toolpath::ToolError| {
            Fault::new(
                e.to_string(),
                "Write `tool` as ball:R, flat:R or bull:R:CORNER, for example \"ball:10\".",
            )
        })?;
        let holder =
            self.holder.as_deref().map(|text| Holder::parse(text, &tool)).transpose().map_err(|e| {
                Fault::new(
                    e.to_string(),
                    "Write `holder` as for --holder, for example \"60:27-34x50,63x26\".",
                )
            })?;
        if self.holder.is_some() && self.stick_out_mm.is_some() {
            return Err(Fault::new(
                "both `holder` and `stick_out_mm` state the stick-out",
                "Leave `stick_out_mm` out; `holder` begins with it.",
            ));
        }
        let cutting = self.cutting.into_iter().map(|(material, entry)| {
            let read = entry
                .read()
                .map_err(|f| Fault::new(format!("cutting data of {material}: {}", f.what), f.remedy));
            read.map(|cutting| (material, cutting))
        });
        Ok(LibraryTool {
            id: self.id,
            number: self.number,
            name: self.name,
            tool,
            flutes: self.flutes,
            flute_length_mm: self.flute_length_mm,
            overall_length_mm: self.overall_length_mm,
            centre_cutting: self.centre_cutting,
            dead_centre_mm: self.dead_centre_mm,
            ramp_deg: self.ramp_deg,
            stick_out_mm: holder.as_ref().map(|h| h.stick_out_mm).or(self.stick_out_mm),
            holder,
            gauge_length_mm: self.gauge_length_mm,
            cutting: cutting.collect::<Result<_, _>>()?,
        })
    }

    fn of(tool: &LibraryTool) -> Self {
        ToolEntry {
            id: tool.id.clone(),
            number: tool.number,
            name: tool.name.clone(),
            tool: tool.tool.to_string(),
            flutes: tool.flutes,
            flute_length_mm: tool.flute_length_mm,
            overall_length_mm: tool.overall_length_mm,
            centre_cutting: tool.centre_cutting,
            dead_centre_mm: tool.dead_centre_mm,
            ramp_deg: tool.ramp_deg,
            holder: tool.holder.as_ref().map(ToString::to_string),
            stick_out_mm: tool.stick_out_mm.filter(|_| tool.holder.is_none()),
            gauge_length_mm: tool.gauge_length_mm,
            cutting: tool.cutting.iter().map(|(m, c)| (m.clone(), CuttingEntry::of(c))).collect(),
        }
    }
}

impl CuttingEntry {
    fn read(self) -> Result<Cutting, Fault> {
        let one_of = |names: &str| {
            Fault::new(format!("exactly one of {names} must be given"), format!("Give one of {names}."))
        };
        let speed = match (self.vc_m_per_min, self.rpm) {
            (Some(vc_m_per_min), None) => Speed::Edge { vc_m_per_min },
            (None, Some(rpm)) => Speed::Spindle { rpm },
            _ => return Err(one_of("`vc_m_per_min` and `rpm`")),
        };
        let advance = match (self.fz_mm, self.feed_mm_per_min) {
            (Some(fz_mm), None) => Advance::PerEdge { fz_mm },
            (None, Some(feed_mm_per_min)) => Advance::PerMinute { feed_mm_per_min },
            _ => return Err(one_of("`fz_mm` and `feed_mm_per_min`")),
        };
        Ok(Cutting {
            speed,
            advance,
            ae_mm: self.ae_mm,
            ap_mm: self.ap_mm,
            engagement_deg: self.engagement_deg,
            plunge_mm_per_min: self.plunge_mm_per_min,
            ramp_mm_per_min: self.ramp_mm_per_min,
            lead_mm_per_min: self.lead_mm_per_min,
        })
    }

    fn of(cutting: &Cutting) -> Self {
        let mut entry = CuttingEntry {
            ae_mm: cutting.ae_mm,
            ap_mm: cutting.ap_mm,
            engagement_deg: cutting.engagement_deg,
            plunge_mm_per_min: cutting.plunge_mm_per_min,
            ramp_mm_per_min: cutting.ramp_mm_per_min,
            lead_mm_per_min: cutting.lead_mm_per_min,
            ..CuttingEntry::default()
        };
        match cutting.speed {
            Speed::Edge { vc_m_per_min } => entry.vc_m_per_min = Some(vc_m_per_min),
            Speed::Spindle { rpm } => entry.rpm = Some(rpm),
        }
        match cutting.advance {
            Advance::PerEdge { fz_mm } => entry.fz_mm = Some(fz_mm),
            Advance::PerMinute { feed_mm_per_min } => entry.feed_mm_per_min = Some(feed_mm_per_min),
        }
        entry
    }
}
