//! The files of materials and processes, TOML.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// What `format` says in a material and in a process.
pub(super) const MATERIAL_FORMAT: &str = "claymill-material";
/// What `format` says in a process.
pub const PROCESS_FORMAT: &str = "claymill-process";
/// Version of both forms.
pub(super) const VERSION: u64 = 1;

/// A material, and what every process does with it unless it says otherwise.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Material {
    /// `claymill-material`.
    pub format: String,
    /// Version of the form: 1.
    pub version: u64,
    /// Name, for example `clay`: lower case, as conditions and tables of cutting data have it.
    pub name: String,
    /// Other names under which tools have cutting data for it.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub also: Vec<String>,
    /// What it is.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub description: String,
    /// A sheet thinner than this does not hold while it is cut, mm.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub web_mm: Option<f64>,
    /// Least and largest thickness of material over its armature, mm.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub layer_mm: Option<[f64; 2]>,
    /// How far the armature lies below the finished surface, from and to, mm.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub armature_mm: Option<[f64; 2]>,
    /// Least and largest feed, mm/min.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub feed_mm_per_min: Option<[f64; 2]>,
    /// Wear of a tool in each second of cutting, as seconds that it costs.
    pub wear: f64,
    /// Values of stages.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub stages: BTreeMap<StageKind, StageValues>,
}

/// A process: the stages of a job, which may inherit from another process.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct ProcessFile {
    /// `claymill-process`.
    pub format: String,
    /// Version of the form: 1.
    pub version: u64,
    /// Name.
    pub name: String,
    /// The process whose values hold where this one has none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub inherits: Option<String>,
    /// Whether a material's values go before this one's.
    pub general: bool,
    /// When the process is chosen by itself, for example `material = clay & machine.axes >= 3`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub when: Option<String>,
    /// The stages.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub stages: BTreeMap<StageKind, StageValues>,
}

/// A stage of a job, in the order of cutting.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum StageKind {
    /// Most of the material.
    Rough,
    /// An even thickness for the finish.
    Semi,
    /// The surface.
    Finish,
    /// What the finishing tool could not reach.
    Rest,
    /// Valleys in which a ball touches on both sides.
    Pencil,
}

/// Values of a stage. What is left out is inherited.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct StageValues {
    /// The stage is left out; `false` brings back one that an inherited process leaves out.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub skip: Option<bool>,
    /// Material that the stage leaves on the surface, mm.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub allowance_mm: Option<f64>,
    /// The stage runs only where the material to cut varies in thickness by more than this, mm.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub band_mm: Option<f64>,
    /// Scallop height between passes, mm. Excludes `step_mm` and `step_radii`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub scallop_mm: Option<f64>,
    /// Step-over, mm. Excludes `scallop_mm` and `step_radii`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub step_mm: Option<f64>,
    /// Step-over in radii of the tool. Excludes `scallop_mm` and `step_mm`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub step_radii: Option<f64>,
    /// Largest depth of one layer or level, mm. Without it everything is cut in one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub depth_mm: Option<f64>,
    /// Layers or levels; for roughing.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cut: Option<CutPattern>,
    /// To and fro, or in one direction.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub way: Option<Way>,
    /// Strategy, as `--strategy` names it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub strategy: Option<StrategyName>,
    /// Id of a tool, or `auto`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tool: Option<String>,
    /// Least and largest radius of a tool that is chosen, mm.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub radius_mm: Option<[f64; 2]>,
    /// Largest engagement angle, degrees.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub engagement_deg: Option<f64>,
    /// Feed, mm/min. Without it that of the tool's cutting data.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub feed_mm_per_min: Option<f64>,
    /// When the stage runs, for example `rest.area_mm2 > 1000`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub when: Option<String>,
}

/// How roughing divides what it removes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum CutPattern {
    /// Layers that follow the surface.
    Layers,
    /// Levels across the tool axis.
    Levels,
}

/// Direction of passes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Way {
    /// To and fro.
    Lace,
    /// In one direction, climb.
    Climb,
    /// In one direction, conventional.
    Conventional,
}

/// Strategy of passes on the surface.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum StrategyName {
    /// The cheapest for each part.
    Auto,
    /// Parallel rows.
    Planar,
    /// Between two sides of a region.
    Flow,
    /// Constant step-over on the surface.
    Scallop,
    /// Constant height.
    Waterline,
    /// Rows where shallow, waterlines where steep.
    SteepShallow,
    /// Parameter lines of every patch.
    Isoparametric,
}

impl StageKind {
    /// All, in the order of cutting.
    pub const ALL: [StageKind; 5] =
        [StageKind::Rough, StageKind::Semi, StageKind::Finish, StageKind::Rest, StageKind::Pencil];

    /// Its name in files.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            StageKind::Rough => "rough",
            StageKind::Semi => "semi",
            StageKind::Finish => "finish",
            StageKind::Rest => "rest",
            StageKind::Pencil => "pencil",
        }
    }
}

impl std::fmt::Display for StageKind {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.name())
    }
}

impl Material {
    /// Whether it goes under this name.
    #[must_use]
    pub fn is_named(&self, name: &str) -> bool {
        self.name == name || self.also.iter().any(|n| n == name)
    }
}

/// The JSON Schema of a material's file.
#[must_use]
pub fn material_schema() -> schemars::Schema {
    schemars::schema_for!(Material)
}

/// The JSON Schema of a process's file.
#[must_use]
pub fn process_schema() -> schemars::Schema {
    schemars::schema_for!(ProcessFile)
}
