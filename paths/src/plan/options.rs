//! What to cut and how.

use std::sync::Arc;

use claymill_contact::Frame;
use claymill_nurbs::Point3;
use claymill_stock::Stock;
use claymill_toolpath::{
    Bounds, CHECK_CLEARANCE_MM, FreeSide, HOLDER_CLEARANCE_MM, Holder, Kept, LinkStyle, MachineLimits, Tool,
    swollen_scallop_mm,
};

use crate::pattern::strategy::Strategy;
use crate::plan::error::{EndRefusal, PlanError};
use crate::setup::assignment::MOST_SETUPS;
use crate::setup::orientation::Orientation;
use crate::setup::probe::Rest;

/// By itself, rapids across keep at least this distance above everything within the tool's radius; rapids up and down
/// end this far above the ball's location, mm.
pub const CLEARANCE_MM: f64 = 5.0;

/// Usual limit between shallow and steep, degrees. Rows across a slope of 45° are 1.4 times closer in plan than on the
/// level, those across a steeper one soon half as far apart and less; waterlines come together the same way as the
/// surface flattens. In the middle neither has to be refined.
pub const STEEP_DEG: f64 = 45.0;

/// The stock between two operations, and the tool of the next one.
#[derive(Debug, Clone)]
pub struct InProcess {
    /// What earlier operations left.
    pub stock: Arc<Stock>,
    /// The tool that goes into it.
    pub tool: Tool,
    /// What holds it, if that is to keep out of the stock.
    pub holder: Option<Holder>,
    /// What it leaves on the surface, mm.
    pub allowance_mm: f64,
}

/// What to cut and how.
#[derive(Debug, Clone)]
pub struct PlanOptions {
    /// The tool.
    pub tool: Tool,
    /// What holds the tool, if passes are to keep it clear of the model: what it is in the way of is not cut in that setup.
    pub holder: Option<Holder>,
    /// Distance that the holder keeps from the model, mm.
    pub holder_clearance_mm: f64,
    /// A larger tool that has been over the model: only what it could not cut is cut.
    pub rest_of: Option<Tool>,
    /// What held that one, if its passes kept it clear: what it was in the way of is left, and cut.
    pub rest_holder: Option<Holder>,
    /// Only what has more stock than this above what these passes leave is cut, mm; everything if `None`.
    pub rest_above_mm: Option<f64>,
    /// The stock as earlier operations left it: [`PlanOptions::rest_above_mm`] asks of it, and shank and holder keep
    /// out of it.
    pub in_process: Option<InProcess>,
    /// How much stock may stand above what these passes leave, mm: rapids keep out of it.
    pub stock_above_mm: f64,
    /// What is left on the surface, along its normal, mm: for roughing. Negative below it, by less than the ball's radius.
    pub allowance_mm: f64,
    /// Scallop height, mm.
    pub scallop_mm: f64,
    /// Where passes run.
    pub strategy: Strategy,
    /// Slope above which [`Strategy::SteepShallow`] has waterlines instead of rows, degrees; see [`STEEP_DEG`].
    pub steep_deg: f64,
    /// Parameter lines of every patch for [`Strategy::Isoparametric`]; as many as the scallop height takes if `None`.
    pub lines: Option<usize>,
    /// Places beside sides of regions, mm, in the model's coordinates: where [`Strategy::Flow`] and [`Strategy::Scallop`] sweep
    /// a region from, and with a second place beside the same region, where to. By itself a region has the two of
    /// [`claymill_surface_merge::RegionMesh::guides`].
    pub guides: Vec<Point3>,
    /// Whether passes along the valleys in which the ball touches on both sides come last in every region.
    pub pencil: bool,
    /// Direction of planar rows, degrees from each setup's `x` to its `y`; the cheapest one by region if `None`.
    pub row_angle_deg: Option<f64>,
    /// The side of each face that is free of material, and cut; either one of faces beyond the end of the list.
    pub free_sides: Vec<FreeSide>,
    /// Where the tool is kept.
    pub bounds: Bounds,
    /// Distance that the ball keeps from obstacles, mm.
    pub check_clearance_mm: f64,
    /// Distance that rapids keep from the finished model along the tool axis, mm.
    pub clearance_mm: f64,
    /// How passes are joined.
    pub link: LinkStyle,
    /// How the vehicle lies in its file.
    pub orientation: Orientation,
    /// The setups that it may be cut in, at most eight; the five of the orientation if there are none.
    pub setups: Vec<Frame>,
    /// Feeds.
    pub feeds: Feeds,
    /// What the machine can do, for the times.
    pub machine: MachineLimits,
    /// Where parts of the plan are kept, and taken from if they are known. The plan is the same with them and without.
    pub kept: Kept,
}

impl PlanOptions {
    /// Planar rows with a tool at a scallop height, and everything else as usual.
    #[must_use]
    pub fn new(tool: Tool, scallop_mm: f64, orientation: Orientation) -> Self {
        PlanOptions {
            tool,
            holder: None,
            holder_clearance_mm: HOLDER_CLEARANCE_MM,
            rest_of: None,
            rest_holder: None,
            rest_above_mm: None,
            in_process: None,
            allowance_mm: 0.0,
            stock_above_mm: 0.0,
            scallop_mm,
            strategy: Strategy::Planar,
            steep_deg: STEEP_DEG,
            lines: None,
            guides: Vec::new(),
            pencil: false,
            row_angle_deg: None,
            free_sides: Vec::new(),
            bounds: Bounds::default(),
            check_clearance_mm: CHECK_CLEARANCE_MM,
            clearance_mm: CLEARANCE_MM,
            link: LinkStyle::Zigzag,
            orientation,
            setups: Vec::new(),
            feeds: Feeds::default(),
            machine: MachineLimits::default(),
            kept: Kept::nowhere(),
        }
    }
}

impl PlanOptions {
    /// The same passes as those of the ball that touches the surface where this one leaves the allowance.
    ///
    /// # Errors
    /// Nothing is left of a ball.
    pub(crate) fn on_the_surface(&self) -> Result<Self, PlanError> {
        let allowance_mm = self.allowance_mm;
        let swollen = |tool: &Tool| {
            let too_small = PlanError::Allowance { tool: *tool, allowance_mm };
            tool.swollen(allowance_mm).ok_or(too_small)
        };
        // The tip of a swollen tool is lower, and its holder as much farther from it.
        let raised = |mut holder: Holder| {
            holder.stick_out_mm += allowance_mm;
            holder
        };
        Ok(PlanOptions {
            tool: swollen(&self.tool)?,
            holder: self.holder.clone().map(raised),
            rest_holder: self.rest_holder.clone().map(raised),
            rest_of: self.rest_of.as_ref().map(swollen).transpose()?,
            rest_above_mm: self.rest_above_mm.map(|mm| mm + allowance_mm),
            scallop_mm: swollen_scallop_mm(self.tool.radius_mm(), self.scallop_mm, allowance_mm),
            allowance_mm: 0.0,
            ..self.clone()
        })
    }

    /// Whether only what earlier tools or operations left is cut.
    pub(crate) fn is_rest(&self) -> bool {
        self.rest_of.is_some() || self.rest_above_mm.is_some()
    }

    /// The stock that is asked which places have something left, if some have not.
    ///
    /// # Errors
    /// Nobody knows the stock.
    pub(crate) fn rest(&self) -> Result<Option<Rest<'_>>, PlanError> {
        let Some(above_mm) = self.rest_above_mm else { return Ok(None) };
        let Some(in_process) = &self.in_process else { return Err(PlanError::NoStock { above_mm }) };
        Ok(Some(Rest { stock: &in_process.stock, above_mm }))
    }

    /// The setups asked for, or the five usual ones.
    ///
    /// # Errors
    /// The axes are parallel, there are too many setups, or two have one name.
    pub fn frames(&self) -> Result<Vec<Frame>, PlanError> {
        if self.setups.is_empty() {
            return Ok(self.orientation.five_setups()?.to_vec());
        }
        let is_twice = |(k, frame): (usize, &Frame)| self.setups[..k].iter().any(|f| f.name == frame.name);
        if self.setups.len() > MOST_SETUPS || self.setups.iter().enumerate().any(is_twice) {
            return Err(PlanError::Setups { most: MOST_SETUPS });
        }
        Ok(self.setups.clone())
    }
}

/// Feeds, mm/min.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Feeds {
    /// Along passes and links.
    pub cut_mm_per_min: f64,
    /// Leads.
    pub lead_mm_per_min: f64,
    /// Rapids.
    pub rapid_mm_per_min: f64,
}

impl Default for Feeds {
    /// A clay mill: 6 m/min, leads at 3 m/min, rapids at 20 m/min.
    fn default() -> Self {
        Feeds { cut_mm_per_min: 6000.0, lead_mm_per_min: 3000.0, rapid_mm_per_min: 20_000.0 }
    }
}

/// Whether what is asked for is done with the tool's end: passes of flat and bull-nosed ends are parallel rows over a bare
/// model.
///
/// # Errors
/// It is done with balls only.
pub fn check_end(options: &PlanOptions) -> Result<(), PlanError> {
    let tool = options.tool;
    if tool.is_ball() {
        return Ok(());
    }
    let refused = [
        (options.strategy != Strategy::Planar, EndRefusal::Strategy(options.strategy)),
        (options.pencil, EndRefusal::Pencil),
        (options.is_rest(), EndRefusal::Rest),
        (options.allowance_mm != 0.0, EndRefusal::Allowance),
        (options.stock_above_mm != 0.0, EndRefusal::Stock),
        (!options.bounds.is_none(), EndRefusal::Bounds),
    ];
    let first = refused.into_iter().find(|(asked, _)| *asked);
    first.map_or(Ok(()), |(_, what)| Err(PlanError::EndNotFor { tool, what }))
}

/// Whether passes can be laid for a tool, for the rest of an earlier one if there is one, at a scallop height: all that can be
/// said before the model is known.
///
/// # Errors
/// They cannot.
pub fn check_tools(tool: &Tool, rest_of: Option<&Tool>, scallop_mm: f64) -> Result<(), PlanError> {
    let radius_mm = tool.radius_mm();
    if let Some(&tool) = rest_of.filter(|t| !t.is_ball()) {
        return Err(PlanError::NoBall { tool });
    }
    if !(scallop_mm > 0.0 && scallop_mm < radius_mm) {
        return Err(PlanError::Scallop { scallop_mm, radius_mm });
    }
    match rest_of.map(Tool::radius_mm).filter(|&mm| mm <= radius_mm) {
        Some(earlier_mm) => Err(PlanError::EarlierTool { radius_mm, earlier_mm }),
        None => Ok(()),
    }
}
