//! A job as it is asked for: tool, scallop height, strategy and what else there is to choose, before any model is known.

use std::path::PathBuf;

use claymill_controller::Machine;
use claymill_paths::{Axis, Feeds, Orientation, PlanOptions, Strategy, TOOL_ID, check_end, check_tools};
use claymill_toolpath::{Bounds, Contain, HOLDER_CLEARANCE_MM, Holder, Levels, Tool};

use crate::asked_levels;
use crate::error::Error;
use crate::job_error::JobError;
use crate::limits::{
    LARGEST_CLEARANCE_MM, LARGEST_FEED_MM_PER_MIN, LARGEST_MARGIN_MM, LARGEST_TOOL, LEAST_RAPID_MM,
    LOWEST_SCALLOP_MM, MOST_LINES, STEEP_LIMITS_DEG,
};
use crate::merging::Merging;

/// Written instead of the names of setups: the fewest that reach all that can be reached.
pub const AUTO_SETUPS: &str = "auto";

/// A job as it is asked for. [`Job::new`] fills in what is usual.
///
/// All fields may be set; what none of a machine, a tool or a file can mean is refused before the model is looked at.
#[derive(Debug, Clone)]
pub struct Job {
    /// How passes are laid. `orientation`, `setups`, `free_sides` and `bounds.avoid` follow from the model and the fields below, whatever
    /// is set here.
    pub passes: PlanOptions,
    /// Levels that rough the stock, instead of passes over the surface: in a job of operations, which knows its stock.
    pub levels: Option<Levels>,
    /// How faces become regions. Ball radius and feed are those of the job.
    pub merging: Merging,
    /// Model axis that points up; guessed if `None`.
    pub up: Option<Axis>,
    /// Model axis that points from rear to front; guessed if `None`.
    pub front: Option<Axis>,
    /// Number of the tool in the machine; 1 if `None`.
    pub tool_number: Option<u32>,
    /// What holds the tool. It is verified, not planned around.
    pub holder: Option<Holder>,
    /// Whether the holder lets the tool stick out, in each setup, as far as it has to there, in whole millimetres.
    pub least_stick_out: bool,
    /// Distance that the holder has to keep from model and obstacles, mm.
    pub holder_clearance_mm: f64,
    /// Setups that may be used: `top`, `left`, `right`, `front`, `rear`, `bottom`, or `NAME:X,Y,Z` with the direction from tip to
    /// holder in model coordinates; if there are none, all that have a name but the bottom.
    pub setups: Vec<String>,
    /// Cut only these faces: `region:3`, `layer:NAME`, `colour:#RRGGBB`, `face:10-20`.
    pub only: Vec<String>,
    /// Leave these out; same forms.
    pub skip: Vec<String>,
    /// Keep away from these by `passes.bounds.avoid_mm`, and do not cut them; same forms.
    pub avoid: Vec<String>,
    /// Where the material is: `auto` as found, `inside`, `outside`, `file`, `against-file`, `both`, or a direction, as in `-z`;
    /// for some sheets alone `face:12=outside`. The last one for a face counts.
    pub material_side: Vec<String>,
    /// Obstacles that no move may touch, in the model's place: STL, OBJ or glTF files.
    pub obstacles: Vec<PathBuf>,
    /// Millimetres in one unit of those whose format has no unit.
    pub obstacle_unit_mm: f64,
}

impl Job {
    /// Planar rows over the whole model, merged by the usual preset.
    #[must_use]
    pub fn new(tool: Tool, scallop_mm: f64) -> Self {
        let up_z = Axis { index: 2, negative: false };
        let front_minus_y = Axis { index: 1, negative: true };
        // Replaced when the model is known.
        let orientation = Orientation { up: up_z, front: front_minus_y };
        Job {
            passes: PlanOptions::new(tool, scallop_mm, orientation),
            levels: None,
            merging: Merging::default(),
            up: None,
            front: None,
            tool_number: None,
            holder: None,
            least_stick_out: false,
            holder_clearance_mm: HOLDER_CLEARANCE_MM,
            setups: Vec::new(),
            only: Vec::new(),
            skip: Vec::new(),
            avoid: Vec::new(),
            material_side: Vec::new(),
            obstacles: Vec::new(),
            obstacle_unit_mm: 1.0,
        }
    }

    /// Where passes run.
    #[must_use]
    pub fn strategy(mut self, strategy: Strategy) -> Self {
        self.passes.strategy = strategy;
        self
    }

    /// The model's axes: up, and from rear to front.
    #[must_use]
    pub fn axes(mut self, up: Axis, front: Axis) -> Self {
        (self.up, self.front) = (Some(up), Some(front));
        self
    }

    /// What is left on the surface, along its normal, mm; negative below it.
    #[must_use]
    pub fn allowance_mm(mut self, allowance_mm: f64) -> Self {
        self.passes.allowance_mm = allowance_mm;
        self
    }

    /// Cutting feed, mm/min.
    #[must_use]
    pub fn feed_mm_per_min(mut self, feed_mm_per_min: f64) -> Self {
        self.passes.feeds.cut_mm_per_min = feed_mm_per_min;
        self
    }

    /// Feeds as far as a machine allows them, its rapid rate, and times by its acceleration and jerk.
    #[must_use]
    pub fn machine(mut self, machine: &Machine) -> Self {
        let most = machine.feed.max_mm_per_min;
        let Feeds { cut_mm_per_min, lead_mm_per_min, .. } = self.passes.feeds;
        // What is no number stays so, and is refused.
        let at_most = |mm_per_min: f64| if mm_per_min > most { most } else { mm_per_min };
        self.passes.feeds = Feeds {
            cut_mm_per_min: at_most(cut_mm_per_min),
            lead_mm_per_min: at_most(lead_mm_per_min),
            rapid_mm_per_min: machine.feed.rapid_mm_per_min,
        };
        self.passes.machine = machine.limits();
        self
    }

    /// What holds the tool.
    #[must_use]
    pub fn holder(mut self, holder: Holder) -> Self {
        self.holder = Some(holder);
        self
    }

    /// Setups that may be used; see [`Job::setups`](Job#structfield.setups).
    #[must_use]
    pub fn setups<T: Into<String>>(mut self, names: impl IntoIterator<Item = T>) -> Self {
        self.setups = names.into_iter().map(Into::into).collect();
        self
    }

    /// Cut only these faces; see [`Job::only`](Job#structfield.only).
    #[must_use]
    pub fn only<T: Into<String>>(mut self, faces: impl IntoIterator<Item = T>) -> Self {
        self.only = faces.into_iter().map(Into::into).collect();
        self
    }

    /// Leave faces out; same forms.
    #[must_use]
    pub fn skip<T: Into<String>>(mut self, faces: impl IntoIterator<Item = T>) -> Self {
        self.skip = faces.into_iter().map(Into::into).collect();
        self
    }

    /// Keep away from faces by a margin, and do not cut them; same forms.
    #[must_use]
    pub fn avoid<T: Into<String>>(mut self, faces: impl IntoIterator<Item = T>, margin_mm: f64) -> Self {
        self.avoid = faces.into_iter().map(Into::into).collect();
        self.passes.bounds.avoid_mm = margin_mm;
        self
    }

    /// The tool.
    #[must_use]
    pub fn tool(&self) -> &Tool {
        &self.passes.tool
    }

    /// The holder that passes are planned around: one whose stick-out follows from the passes is in nobody's way.
    pub(crate) fn holder_in_the_way(&self) -> Option<&Holder> {
        self.holder.as_ref().filter(|_| !self.least_stick_out)
    }

    /// Id of the tool in the files of the job: its number in the machine, where that is known.
    #[must_use]
    pub fn tool_id(&self) -> String {
        self.tool_number.map_or_else(|| TOOL_ID.to_owned(), |number| format!("T{number}"))
    }

    /// Whether a strategy has a number of parameter lines.
    #[must_use]
    pub fn has_lines(strategy: Strategy) -> bool {
        strategy == Strategy::Isoparametric
    }

    /// Whether a strategy starts from a side of a region, which may be chosen.
    #[must_use]
    pub fn has_guides(strategy: Strategy) -> bool {
        matches!(strategy, Strategy::Flow | Strategy::Scallop | Strategy::Auto)
    }

    /// Whether the job can be meant: all that can be said before the model is known.
    ///
    /// # Errors
    /// It cannot.
    pub fn check(&self) -> Result<(), Error> {
        let passes = &self.passes;
        check_holder_clearance(self.holder_clearance_mm)?;
        if (0.0..LOWEST_SCALLOP_MM).contains(&passes.scallop_mm) {
            return Err(JobError::Scallop { scallop_mm: passes.scallop_mm }.into());
        }
        // Which setups `auto` means is known when the model is.
        for text in self.setups.iter().filter(|text| *text != AUTO_SETUPS) {
            // Any orientation will do to see whether there is such a setup.
            self.passes.orientation.setup(text).map_err(JobError::Setup)?;
        }
        check_tools(&passes.tool, passes.rest_of.as_ref(), passes.scallop_mm)?;
        match &self.levels {
            Some(asked) => asked_levels::check(asked, passes)?,
            None => check_end(passes)?,
        }
        if self.levels.is_some() && !self.obstacles.is_empty() {
            return Err(JobError::NotByLevels { what: "obstacles" }.into());
        }
        if passes.bounds.contain != Contain::Contact && self.setups.iter().any(|text| text.contains(':')) {
            return Err(JobError::TiltedContainment.into());
        }
        if !(0.0..=LARGEST_CLEARANCE_MM).contains(&passes.stock_above_mm) {
            return Err(JobError::StockAbove { stock_mm: passes.stock_above_mm }.into());
        }
        if let Some(above_mm) = passes.rest_above_mm
            && !(above_mm > 0.0 && above_mm <= LARGEST_CLEARANCE_MM)
        {
            return Err(JobError::RestAbove { above_mm }.into());
        }
        let least_mm = -passes.tool.radius_mm();
        if !(passes.allowance_mm > least_mm && passes.allowance_mm <= LARGEST_CLEARANCE_MM) {
            return Err(JobError::Allowance { allowance_mm: passes.allowance_mm, least_mm }.into());
        }
        let feed_mm_per_min = passes.feeds.cut_mm_per_min;
        if !(feed_mm_per_min > 0.0 && feed_mm_per_min <= LARGEST_FEED_MM_PER_MIN) {
            return Err(JobError::Feed { feed_mm_per_min }.into());
        }
        if passes.row_angle_deg.is_some_and(|angle| !angle.is_finite()) {
            return Err(JobError::RowAngle.into());
        }
        if self.tool_number.is_some_and(|number| !(1..=LARGEST_TOOL).contains(&number)) {
            return Err(JobError::ToolNumber.into());
        }
        let (least, most) = STEEP_LIMITS_DEG;
        if !(least..=most).contains(&passes.steep_deg) {
            return Err(JobError::Steep { steep_deg: passes.steep_deg }.into());
        }
        match passes.lines {
            Some(_) if !Job::has_lines(passes.strategy) => return Err(JobError::LinesOfOthers.into()),
            Some(lines) if !(1..=MOST_LINES).contains(&lines) => return Err(JobError::Lines { lines }.into()),
            _ => {}
        }
        if !passes.guides.is_empty() && !Job::has_guides(passes.strategy) {
            return Err(JobError::GuidesOfOthers.into());
        }
        check_bounds(&passes.bounds)?;
        check_obstacle_clearance(passes.check_clearance_mm)?;
        if !(LEAST_RAPID_MM..=LARGEST_CLEARANCE_MM).contains(&passes.clearance_mm) {
            return Err(JobError::RapidClearance { clearance_mm: passes.clearance_mm }.into());
        }
        Ok(())
    }
}

fn check_bounds(bounds: &Bounds) -> Result<(), JobError> {
    let Bounds { avoid_mm, extend_mm, .. } = *bounds;
    if !(0.0..=LARGEST_MARGIN_MM).contains(&avoid_mm) {
        return Err(JobError::Margin { margin_mm: avoid_mm });
    }
    if !(0.0..=LARGEST_MARGIN_MM).contains(&extend_mm) {
        return Err(JobError::Extension { extension_mm: extend_mm });
    }
    for (index, sides) in bounds.within_mm.iter().enumerate() {
        if let Some(k) =
            (0..3).find(|&k| sides[k] >= sides[k + 3] || sides[k].is_nan() || sides[k + 3].is_nan())
        {
            let (axis, from_mm, to_mm) = (["x", "y", "z"][k], sides[k], sides[k + 3]);
            return Err(JobError::EmptyBox { number: index + 1, axis, from_mm, to_mm });
        }
    }
    Ok(())
}

/// Whether a holder can keep a distance.
///
/// # Errors
/// It cannot.
pub fn check_holder_clearance(clearance_mm: f64) -> Result<(), JobError> {
    match (0.0..=LARGEST_CLEARANCE_MM).contains(&clearance_mm) {
        true => Ok(()),
        false => Err(JobError::HolderClearance { clearance_mm }),
    }
}

/// Whether the ball can keep a distance from obstacles.
///
/// # Errors
/// It cannot.
pub fn check_obstacle_clearance(clearance_mm: f64) -> Result<(), JobError> {
    match (0.0..=LARGEST_CLEARANCE_MM).contains(&clearance_mm) {
        true => Ok(()),
        false => Err(JobError::ObstacleClearance { clearance_mm }),
    }
}
