//! A process with every value filled in, each with the file that it is from.

use std::fmt;
use std::path::PathBuf;

use claymill_toolpath::Tool;

use super::condition::{Condition, Fact, Facts};
use super::files::{CutPattern, StageKind, StrategyName, Way};

/// A value and where it is from.
#[derive(Debug, Clone, PartialEq)]
pub struct Resolved<T> {
    /// The value.
    pub value: T,
    /// Where it is from.
    pub from: Origin,
}

/// Where a value is from.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Origin {
    /// Asked for, for example on the command line.
    Asked,
    /// A process.
    Process {
        /// Its name.
        name: String,
        /// Its file.
        file: PathBuf,
    },
    /// A material.
    Material {
        /// Its name.
        name: String,
        /// Its file.
        file: PathBuf,
    },
    /// No file says anything.
    Default,
}

/// A process with every value filled in.
#[derive(Debug, Clone, PartialEq)]
pub struct Process {
    /// Name of the profile that was resolved.
    pub name: String,
    /// Name of the material.
    pub material: String,
    /// Profiles from the one asked for to the one that inherits from none.
    pub chain: Vec<String>,
    /// Stages in the order of cutting, without those that are left out.
    pub stages: Vec<Stage>,
    /// Stages that are left out, and who says so.
    pub skipped: Vec<(StageKind, Origin)>,
}

/// A stage with every value filled in.
#[derive(Debug, Clone, PartialEq)]
pub struct Stage {
    /// Which.
    pub kind: StageKind,
    /// Material that it leaves on the surface, mm.
    pub allowance_mm: Resolved<f64>,
    /// It runs only where the material to cut varies by more than this, mm.
    pub band_mm: Option<Resolved<f64>>,
    /// Distance of passes.
    pub spacing: Resolved<Spacing>,
    /// Largest depth of one layer or level, mm; `None`: everything in one.
    pub depth_mm: Option<Resolved<f64>>,
    /// Layers or levels.
    pub cut: Option<Resolved<CutPattern>>,
    /// To and fro, or in one direction.
    pub way: Resolved<Way>,
    /// Strategy.
    pub strategy: Resolved<StrategyName>,
    /// Tool.
    pub tool: Resolved<ToolChoice>,
    /// Largest engagement angle, degrees.
    pub engagement_deg: Option<Resolved<f64>>,
    /// Feed, mm/min; `None`: that of the tool's cutting data.
    pub feed_mm_per_min: Option<Resolved<f64>>,
    /// When it runs.
    pub when: Option<Resolved<Condition>>,
}

/// Distance of passes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Spacing {
    /// By scallop height, mm.
    ScallopMm(f64),
    /// Step-over, mm.
    StepMm(f64),
    /// Step-over in radii of the tool.
    StepRadii(f64),
}

/// How a tool is found.
#[derive(Debug, Clone, PartialEq)]
pub enum ToolChoice {
    /// The planner chooses, within these radii.
    Auto {
        /// Least and largest radius, mm.
        radius_mm: Option<[f64; 2]>,
    },
    /// This one.
    Id(String),
}

impl Spacing {
    /// Step-over of a tool on a plane across its axis, mm. Where a scallop height is asked for, it is the widest that leaves no
    /// higher cusp, and no wider than the tool.
    #[must_use]
    pub fn step_mm(&self, tool: &Tool) -> f64 {
        let (radius, corner) = (tool.radius_mm(), tool.corner_radius_mm());
        match *self {
            Spacing::StepMm(mm) => mm,
            Spacing::StepRadii(radii) => radii * radius,
            Spacing::ScallopMm(height) => {
                let height = height.min(corner);
                2.0 * (radius - corner) + 2.0 * (height * (2.0 * corner - height)).sqrt()
            }
        }
    }
}

impl Process {
    /// A stage.
    #[must_use]
    pub fn stage(&self, kind: StageKind) -> Option<&Stage> {
        self.stages.iter().find(|s| s.kind == kind)
    }

    /// Every value of every stage with its origin, a line each, as the plan prints it.
    #[must_use]
    pub fn explain(&self) -> String {
        let mut text = format!("process {} for {}", self.name, self.material);
        text += &format!(" (inherits: {})\n", self.chain.join(" <- "));
        for stage in &self.stages {
            for (field, value, from) in stage.values() {
                text += &format!("{:<7} {field:<16} {value:<28} {from}\n", stage.kind.name());
            }
        }
        for (kind, from) in &self.skipped {
            text += &format!("{:<7} left out {:<36} {from}\n", kind.name(), "");
        }
        text
    }
}

impl Stage {
    /// Whether the stage runs; `None` where that depends on what is not known yet.
    #[must_use]
    pub fn runs(&self, facts: &Facts) -> Option<bool> {
        let band = match (&self.band_mm, facts.get("stock.varies_mm")) {
            (None, _) => Some(true),
            (Some(band), Some(Fact::Number(varies))) => Some(*varies > band.value),
            (Some(_), _) => None,
        };
        let when = self.when.as_ref().map_or(Some(true), |w| w.value.holds(facts));
        match (band, when) {
            (Some(false), _) | (_, Some(false)) => Some(false),
            (Some(true), Some(true)) => Some(true),
            _ => None,
        }
    }

    /// Field, value and origin of everything that is set.
    #[must_use]
    pub fn values(&self) -> Vec<(&'static str, String, &Origin)> {
        let mut rows = Vec::new();
        row(&mut rows, "allowance", Some(&self.allowance_mm), |v| format!("{v} mm"));
        row(&mut rows, "band", self.band_mm.as_ref(), |v| format!("{v} mm"));
        row(&mut rows, "spacing", Some(&self.spacing), ToString::to_string);
        row(&mut rows, "depth", self.depth_mm.as_ref(), |v| format!("{v} mm"));
        row(&mut rows, "cut", self.cut.as_ref(), named);
        row(&mut rows, "way", Some(&self.way), named);
        row(&mut rows, "strategy", Some(&self.strategy), named);
        row(&mut rows, "tool", Some(&self.tool), ToString::to_string);
        row(&mut rows, "engagement", self.engagement_deg.as_ref(), |v| format!("{v}°"));
        row(&mut rows, "feed", self.feed_mm_per_min.as_ref(), |v| format!("{v} mm/min"));
        row(&mut rows, "when", self.when.as_ref(), ToString::to_string);
        rows
    }
}

fn row<'s, T>(
    rows: &mut Vec<(&'static str, String, &'s Origin)>,
    field: &'static str,
    value: Option<&'s Resolved<T>>,
    text: impl Fn(&T) -> String,
) {
    rows.extend(value.map(|v| (field, text(&v.value), &v.from)));
}

/// The name of a choice as files have it.
fn named(choice: &impl serde::Serialize) -> String {
    serde_json::to_value(choice).ok().and_then(|v| v.as_str().map(str::to_owned)).unwrap_or_default()
}

impl fmt::Display for Spacing {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Spacing::ScallopMm(mm) => write!(f, "scallop height {mm} mm"),
            Spacing::StepMm(mm) => write!(f, "step-over {mm} mm"),
            Spacing::StepRadii(radii) => write!(f, "step-over {radii} radii"),
        }
    }
}

impl fmt::Display for ToolChoice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            ToolChoice::Auto { radius_mm: None } => f.write_str("auto"),
            ToolChoice::Auto { radius_mm: Some([low, high]) } => write!(f, "auto, radius {low} to {high} mm"),
            ToolChoice::Id(id) => f.write_str(id),
        }
    }
}

impl fmt::Display for Origin {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Origin::Asked => f.write_str("as asked"),
            Origin::Process { name, file } => write!(f, "process {name}, {}", file.display()),
            Origin::Material { name, file } => write!(f, "material {name}, {}", file.display()),
            Origin::Default => f.write_str("default"),
        }
    }
}
