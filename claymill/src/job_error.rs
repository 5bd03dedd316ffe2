//! Why a job cannot be meant as it is asked for, with advice.

use claymill_clearing::{LARGEST_LIMIT_DEG, LEAST_LIMIT_DEG};
use claymill_paths::SetupError;
use thiserror::Error;

use crate::limits::{
    LARGEST_CLEARANCE_MM, LARGEST_FEED_MM_PER_MIN, LARGEST_MARGIN_MM, LARGEST_TOOL, LEAST_RAMP_DEG,
    LEAST_RAPID_MM, LOWEST_SCALLOP_MM, MOST_LINES, STEEP_LIMITS_DEG, STEEPEST_RAMP_DEG,
};

/// Why a job cannot be meant as it is asked for.
#[derive(Debug, Clone, PartialEq, Error)]
#[allow(missing_docs, reason = "each field is named in the message of its variant")]
pub enum JobError {
    /// There is no such setup.
    #[error(transparent)]
    Setup(#[from] SetupError),
    /// Scallops are too low.
    #[error("scallop height {scallop_mm} mm is below {LOWEST_SCALLOP_MM} mm, to which passes are exact")]
    Scallop { scallop_mm: f64 },
    /// Borders are seen along the axes of the model.
    #[error("containment by the centre or the edge of the tool is for setups along the model's axes")]
    TiltedContainment,
    /// No stock is as thick.
    #[error("stock of {stock_mm} mm above what is left is not between 0 and {LARGEST_CLEARANCE_MM} mm")]
    StockAbove { stock_mm: f64 },
    /// No thickness of stock is worth passes.
    #[error(
        "a rest above {above_mm} mm of stock: the thickness must be above 0, and no more than {LARGEST_CLEARANCE_MM} mm"
    )]
    RestAbove { above_mm: f64 },
    /// Nobody knows what there is to be cut.
    #[error("levels rough a stock, and this job has none")]
    LevelsWithoutStock,
    /// A slot, or no cut at all.
    #[error("an engagement of {engagement_deg}° is not between {LEAST_LIMIT_DEG}° and {LARGEST_LIMIT_DEG}°")]
    Engagement { engagement_deg: f64 },
    /// Nothing of the tool would cut.
    #[error(
        "a dead centre of {dead_centre_mm} mm is not between 0 and the tool's diameter, {diameter_mm} mm"
    )]
    DeadCentre { dead_centre_mm: f64, diameter_mm: f64 },
    /// Too flat to end, or a plunge.
    #[error("a ramp of {ramp_deg}° is not between {LEAST_RAMP_DEG}° and {STEEPEST_RAMP_DEG}°")]
    Ramp { ramp_deg: f64 },
    /// No level is as deep.
    #[error("a step-down of {step_down_mm} mm is not above 0")]
    StepDown { step_down_mm: f64 },
    /// Above its flutes a tool does not cut.
    #[error("a step-down of {step_down_mm} mm is deeper than the flutes are long, {flutes_mm} mm")]
    StepBelowFlutes { step_down_mm: f64, flutes_mm: f64 },
    /// Stairs have a height.
    #[error("a band of {band_mm} mm is not above 0")]
    Band { band_mm: f64 },
    /// What only passes over the surface know.
    #[error("{what}: an operation that roughs by levels has none of these")]
    NotByLevels { what: &'static str },
    /// A job has operations, and not too many.
    #[error("a job has from 1 to {most} operations")]
    Operations { most: usize },
    /// Operations are told apart by their names.
    #[error("two operations are called `{name}`")]
    TwiceNamed { name: String },
    /// Tools are told apart by their numbers.
    #[error("operation `{name}` has another tool with the number of an earlier one, {id}")]
    OneNumber { id: String, name: String },
    /// Nothing would be left of the ball, or no stock is as thick.
    #[error(
        "an allowance of {allowance_mm} mm is not between {least_mm} mm, the ball's radius below the surface, and {LARGEST_CLEARANCE_MM} mm"
    )]
    Allowance { allowance_mm: f64, least_mm: f64 },
    /// No machine cuts like this.
    #[error("feed {feed_mm_per_min} mm/min is not between 0 and {LARGEST_FEED_MM_PER_MIN}")]
    Feed { feed_mm_per_min: f64 },
    /// Rows have no direction.
    #[error("the angle of the rows must be a number")]
    RowAngle,
    /// No tool has this number.
    #[error("a tool has a number from 1 to {LARGEST_TOOL}")]
    ToolNumber,
    /// Nothing is steep, or all is.
    #[error(
        "the limit between shallow and steep is between {} and {} degrees, not {steep_deg}",
        STEEP_LIMITS_DEG.0,
        STEEP_LIMITS_DEG.1
    )]
    Steep { steep_deg: f64 },
    /// A number of lines for a strategy without.
    #[error("only isoparametric has a number of lines")]
    LinesOfOthers,
    /// Too many lines, or none.
    #[error("a patch has between 1 and {MOST_LINES} lines, not {lines}")]
    Lines { lines: usize },
    /// Places beside sides for a strategy without.
    #[error("only flow, scallop and auto start from a side of a region")]
    GuidesOfOthers,
    /// Nobody keeps away so far.
    #[error("a distance to what is avoided of {margin_mm} mm: it is between 0 and {LARGEST_MARGIN_MM}")]
    Margin { margin_mm: f64 },
    /// Nobody goes on so far.
    #[error("an extension of {extension_mm} mm: it is between 0 and {LARGEST_MARGIN_MM}")]
    Extension { extension_mm: f64 },
    /// There is nothing in a box.
    #[error("box {number} is empty: its {axis} runs from {from_mm} to {to_mm} mm")]
    EmptyBox { number: usize, axis: &'static str, from_mm: f64, to_mm: f64 },
    /// Holders keep no such distance.
    #[error(
        "holders cannot keep {clearance_mm} mm from the model: it must be between 0 and {LARGEST_CLEARANCE_MM}"
    )]
    HolderClearance { clearance_mm: f64 },
    /// The ball keeps no such distance.
    #[error(
        "the ball cannot keep {clearance_mm} mm from obstacles: it is between 0 and {LARGEST_CLEARANCE_MM}"
    )]
    ObstacleClearance { clearance_mm: f64 },
    /// Rapids keep no such distance.
    #[error(
        "rapids cannot keep {clearance_mm} mm: it is between {LEAST_RAPID_MM} and {LARGEST_CLEARANCE_MM}"
    )]
    RapidClearance { clearance_mm: f64 },
    /// The file of a stock is another one than the job was planned with.
    #[error("{}: the stock has changed since the job was planned", path.display())]
    StockChanged { path: std::path::PathBuf },
    /// A bar that lies along no axis.
    #[error("a bar from {from_mm:?} to {to_mm:?} does not ascend along one axis")]
    Bar { from_mm: [f64; 3], to_mm: [f64; 3] },
}

impl JobError {
    /// What to do about it, in one sentence.
    #[must_use]
    pub fn advice(&self) -> &'static str {
        match self {
            JobError::TiltedContainment => "Let the contact be contained, or use setups that have a name.",
            JobError::StockAbove { .. } => "For example 25, for a layer of clay.",
            JobError::RestAbove { .. } => {
                "For example 1, for what stands a millimetre above what the operation leaves."
            }
            JobError::LevelsWithoutStock => {
                "Give the job file operations and a [stock], or --material and --stock."
            }
            JobError::Engagement { .. } => "Usually it is 40 to 90 degrees.",
            JobError::DeadCentre { .. } => {
                "Give the diameter that does not cut; 0 of a tool that may plunge."
            }
            JobError::Ramp { .. } => "Usually it is 1 to 5 degrees in metal, and up to 30 in clay and foam.",
            JobError::StepDown { .. } => "Usually it is one or two diameters of the tool.",
            JobError::StepBelowFlutes { .. } => "Take a lower step_down, or a tool with longer flutes.",
            JobError::Band { .. } => "Usually it is a tenth of the step-down.",
            JobError::NotByLevels { .. } => "Leave that out, or rough by layers: cut = \"layers\".",
            JobError::Operations { .. } => "Add an operation, or split the job.",
            JobError::TwiceNamed { .. } => "Give each operation a name of its own.",
            JobError::OneNumber { .. } => "Give each tool a number of its own: tool_number in the job file.",
            JobError::Allowance { .. } => "Usual allowances are 0.3 to 5 mm.",
            JobError::Setup(_) => {
                "Setups are top, left, right, front, rear, bottom, and NAME:X,Y,Z with a direction."
            }
            JobError::Scallop { .. } => "Usual scallop heights are 0.02 to 0.2 mm.",
            JobError::Feed { .. } => "A clay mill cuts at 6000 mm/min.",
            JobError::RowAngle => "Leave it out to have the cheapest one found.",
            JobError::ToolNumber => "Leave it out for tool 1.",
            JobError::Steep { .. } => "Usually it is 45 degrees.",
            JobError::LinesOfOthers => "Leave it out, or choose Strategy::Isoparametric.",
            JobError::Lines { .. } => "Leave it out for as many as the scallop height takes.",
            JobError::GuidesOfOthers => "Leave them out, or choose Strategy::Flow.",
            JobError::Margin { .. } => "Usually it is 1 mm.",
            JobError::Extension { .. } => "Usually it is 0 mm.",
            JobError::EmptyBox { .. } => "The first corner of a box has the smaller coordinates.",
            JobError::HolderClearance { .. } | JobError::ObstacleClearance { .. } => "Usually it is 1 mm.",
            JobError::RapidClearance { .. } => "Usually it is 5 mm.",
            JobError::StockChanged { .. } => {
                "Plan again, or bring back the file that the job was planned with."
            }
            JobError::Bar { .. } => "Its ends differ in one coordinate; the first one is the lower end.",
        }
    }
}
