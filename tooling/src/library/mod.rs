//! A tool library: tools with their holders and cutting data, as one file holds them.

mod file;
mod sense;

use std::collections::BTreeMap;

use claymill_toolpath::{Holder, Tool};

pub use file::{LIBRARY_FORMAT, LIBRARY_VERSION, library_schema};
pub(crate) use sense::{MOST_SECTIONS, MOST_TOOLS};

/// Tools by their ids, in the order of the file.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Library {
    /// Name, for lists.
    pub name: String,
    /// The tools. Their ids differ.
    pub tools: Vec<LibraryTool>,
}

/// A tool as a shop has it.
///
/// ```text
///        ┌────┐      ─┐           ─┐
///        │    │ holder│            │
///        └┬──┬┘      ─┘  ─┐        │ gauge length
///         │  │ shank      │        │
///        ┌┴──┴┐     ─┐    │ stick- │
///        │////│ flute│    │ out    │
///        ╰────╯     ─┘   ─┘       ─┘
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct LibraryTool {
    /// Id in jobs, for example `T12`.
    pub id: String,
    /// Its number in the machine.
    pub number: Option<u32>,
    /// What the shop calls it.
    pub name: String,
    /// Its shape.
    pub tool: Tool,
    /// Number of cutting edges.
    pub flutes: Option<u32>,
    /// Length of the cutting edges along the axis, mm.
    pub flute_length_mm: Option<f64>,
    /// Length of the tool alone, mm.
    pub overall_length_mm: Option<f64>,
    /// Whether the edges reach the axis, so that the tool may plunge. `None`: not known.
    pub centre_cutting: Option<bool>,
    /// Diameter around the axis that does not cut, mm.
    pub dead_centre_mm: f64,
    /// Steepest descent while it moves sideways, degrees against the level.
    pub ramp_deg: Option<f64>,
    /// What holds it.
    pub holder: Option<Holder>,
    /// From the tip to the holder, mm. Where there is a holder it is the holder's.
    pub stick_out_mm: Option<f64>,
    /// From the tip to the spindle's nose, mm, where it was measured.
    pub gauge_length_mm: Option<f64>,
    /// Cutting data by the name of a material.
    pub cutting: BTreeMap<String, Cutting>,
}

/// How a tool cuts a material.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cutting {
    /// Speed of the edge or of the spindle.
    pub speed: Speed,
    /// Advance.
    pub advance: Advance,
    /// Width of cut, mm.
    pub ae_mm: Option<f64>,
    /// Depth of cut along the axis, mm.
    pub ap_mm: Option<f64>,
    /// Largest engagement angle, degrees.
    pub engagement_deg: Option<f64>,
    /// Feed straight down, mm/min.
    pub plunge_mm_per_min: Option<f64>,
    /// Feed along ramps, mm/min.
    pub ramp_mm_per_min: Option<f64>,
    /// Feed of leads, mm/min.
    pub lead_mm_per_min: Option<f64>,
}

/// Speed of a tool.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Speed {
    /// Of the edge where it is fastest, m/min.
    Edge {
        /// m/min.
        vc_m_per_min: f64,
    },
    /// Of the spindle, 1/min.
    Spindle {
        /// 1/min.
        rpm: f64,
    },
}

/// Advance of a tool.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Advance {
    /// Of each edge in each turn, mm.
    PerEdge {
        /// mm.
        fz_mm: f64,
    },
    /// In each minute, mm.
    PerMinute {
        /// mm/min.
        feed_mm_per_min: f64,
    },
}

impl Library {
    /// A tool by its id.
    #[must_use]
    pub fn get(&self, id: &str) -> Option<&LibraryTool> {
        self.tools.iter().find(|t| t.id == id)
    }

    /// A tool by its number in the machine.
    #[must_use]
    pub fn numbered(&self, number: u32) -> Option<&LibraryTool> {
        self.tools.iter().find(|t| t.number == Some(number))
    }
}

impl LibraryTool {
    /// A tool of which only id, name and shape are known.
    #[must_use]
    pub fn new(id: impl Into<String>, name: impl Into<String>, tool: Tool) -> Self {
        LibraryTool {
            id: id.into(),
            number: None,
            name: name.into(),
            tool,
            flutes: None,
            flute_length_mm: None,
            overall_length_mm: None,
            centre_cutting: None,
            dead_centre_mm: 0.0,
            ramp_deg: None,
            holder: None,
            stick_out_mm: None,
            gauge_length_mm: None,
            cutting: BTreeMap::new(),
        }
    }

    /// Diameter of the end, mm.
    #[must_use]
    pub fn diameter_mm(&self) -> f64 {
        2.0 * self.tool.radius_mm()
    }

    /// From the tip to the spindle's nose, mm: as measured, or to the upper end of the holder's sections.
    #[must_use]
    pub fn length_in_spindle_mm(&self) -> Option<f64> {
        self.gauge_length_mm.or_else(|| self.holder.as_ref().map(Holder::top_mm))
    }
}
