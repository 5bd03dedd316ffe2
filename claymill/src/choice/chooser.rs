//! Stages of a process made operations, one after the other, while what stands above the surface is followed.

use claymill_nurbs::Aabb;
use claymill_paths::Strategy;
use claymill_tooling::{
    CutPattern, Engagement, Fact, Facts, LibraryTool, Material, Stage, StageKind, StrategyName, ToolChoice,
    Way,
};
use claymill_toolpath::{LinkStyle, OperationKind, Stock};

use crate::choice::{ChosenOperation, Shop, layers, levels};
use crate::error::Error;

/// Balls are no larger than this share of the model's longest side.
const LARGEST_BALL: f64 = 0.4;
/// A roughing step is no wider than this, in radii of the ball.
const WIDEST_STEP: f64 = 1.6;
/// Layers leave alone what stands above them by no more than this share of the last one's allowance, and no less than so much, mm.
const BODY_REST: f64 = 0.5;
const LEAST_REST_MM: f64 = 0.5;

pub(super) struct Chooser<'a> {
    pub(super) shop: &'a Shop,
    pub(super) material: &'a Material,
    pub(super) facts: Facts,
    pub(super) stock: &'a Stock,
    pub(super) part: Aabb,
    /// What stands above the surface at first, mm.
    pub(super) thickest_mm: f64,
    /// The same after the operations so far, where the balls fit.
    pub(super) left_mm: f64,
    pub(super) operations: Vec<ChosenOperation>,
    pub(super) refusals: Vec<String>,
}

impl Chooser<'_> {
    /// Roughing and semi-finishing: layers down to the allowance.
    pub(super) fn clear(&mut self, stage: &Stage) -> Result<(), Error> {
        let kind = stage.kind;
        let word = kind.name();
        if stage.runs(&self.facts) == Some(false) {
            let varies = self.facts.get("stock.varies_mm");
            let varies = match varies {
                Some(Fact::Number(mm)) => format!(", where the thickness varies by {mm:.2} mm"),
                _ => String::new(),
            };
            self.refusals.push(format!("{word} is not needed{varies}"));
            return Ok(());
        }
        let allowance_mm = stage.allowance_mm.value;
        if self.left_mm <= allowance_mm {
            self.refusals.push(format!(
                "{word} is not needed: no more than {:.2} mm are above the surface, it would leave {allowance_mm} mm",
                self.left_mm
            ));
            return Ok(());
        }
        if kind == StageKind::Rough && stage.cut.as_ref().is_some_and(|cut| cut.value == CutPattern::Levels) {
            return self.by_levels(stage);
        }
        let tool = self.largest(stage)?;
        let radius_mm = tool.tool.radius_mm();
        let step_mm = stage.spacing.value.step_mm(&tool.tool).min(WIDEST_STEP * radius_mm);
        let cusp_mm = cusp_mm(radius_mm, step_mm);
        let scallop_mm = round_up(cusp_mm);
        // No deeper than the ball is high: above it the shank would rub.
        let depth_mm = stage.depth_mm.as_ref().map_or(radius_mm, |d| d.value).min(radius_mm);
        let all = layers::allowances_mm(self.left_mm, allowance_mm, depth_mm);
        let count = all.len();
        for (index, &left_mm) in all.iter().enumerate() {
            let above_mm = self.left_mm;
            let name = if count == 1 { word.to_owned() } else { format!("{word}-{}", index + 1) };
            let kind = if kind == StageKind::Semi { OperationKind::Semi } else { OperationKind::Rough };
            let reason = format!(
                "{above_mm:.1} mm are above the surface at most: {} takes {:.1} mm with steps of {step_mm:.1} mm, as {} says",
                tool.name,
                above_mm - left_mm,
                stage.spacing.from
            );
            let whole = self.operation(stage, kind, name, &tool, scallop_mm, reason);
            self.operations.push(ChosenOperation {
                allowance_mm: left_mm,
                stock_above_mm: self.stock_above_mm(left_mm),
                rest_above_mm: self.rest_above_mm(allowance_mm),
                within_mm: self.within(radius_mm),
                ..whole
            });
            self.left_mm = left_mm + cusp_mm;
        }
        self.facts.insert("stock.varies_mm", Fact::Number(cusp_mm));
        Ok(())
    }

    /// Roughing by levels, which leave the allowance and no more than a band above it where the tool gets to.
    fn by_levels(&mut self, stage: &Stage) -> Result<(), Error> {
        let found = levels::tool(&self.shop.library.tools, stage, radii(stage), &self.part);
        let tool = found.ok_or_else(|| no_tool(stage, self.material))?;
        let asked = levels::asked(stage, &tool, self.material);
        let reason = format!(
            "{:.1} mm are above the surface at most: {} takes levels of {} mm at an engagement of {}°, as {} says",
            self.left_mm,
            tool.name,
            asked.step_down_mm,
            asked.engagement_deg,
            stage.cut.as_ref().map_or_else(String::new, |cut| cut.from.to_string())
        );
        let scallop_mm = round_up(asked.band_mm);
        let whole =
            self.operation(stage, OperationKind::Rough, stage.kind.name().into(), &tool, scallop_mm, reason);
        self.operations.push(ChosenOperation { levels: Some(asked), ..whole });
        self.left_mm = stage.allowance_mm.value + asked.band_mm;
        self.facts.insert("stock.varies_mm", Fact::Number(asked.band_mm));
        Ok(())
    }

    /// An operation with the values of its stage.
    pub(super) fn operation(
        &self,
        stage: &Stage,
        kind: OperationKind,
        name: String,
        tool: &LibraryTool,
        scallop_mm: f64,
        reason: String,
    ) -> ChosenOperation {
        // One number a tool: the shop's, or else its place in the library.
        let place = self.shop.library.tools.iter().position(|t| t.id == tool.id);
        let allowance_mm = stage.allowance_mm.value;
        ChosenOperation {
            name,
            kind,
            reason,
            tool: tool.clone(),
            tool_number: tool.number.unwrap_or(place.unwrap_or(0) as u32 + 1),
            rest_of: None,
            levels: None,
            allowance_mm,
            scallop_mm,
            strategy: strategy(stage.strategy.value),
            link: link(stage.way.value),
            feed_mm_per_min: self.feed(stage, tool),
            stock_above_mm: self.stock_above_mm(allowance_mm),
            rest_above_mm: None,
            within_mm: None,
        }
    }

    /// Balls of the library from large to small, within a range of radii.
    pub(super) fn balls(&self, range: Option<[f64; 2]>) -> Vec<LibraryTool> {
        let size_mm = (self.part.max - self.part.min).amax();
        let fits = |t: &&LibraryTool| {
            t.tool.is_ball() && t.tool.radius_mm() <= LARGEST_BALL * size_mm && is_within(range, t)
        };
        let mut balls: Vec<LibraryTool> = self.shop.library.tools.iter().filter(fits).cloned().collect();
        balls.sort_by(|a, b| b.tool.radius_mm().total_cmp(&a.tool.radius_mm()).then(a.id.cmp(&b.id)));
        balls.truncate(claymill_tooling::MOST_CHAIN_TOOLS);
        balls
    }

    /// The tool that a stage names, as its place among these.
    pub(super) fn told(&self, stage: &Stage, balls: &[LibraryTool]) -> Option<usize> {
        let ToolChoice::Id(id) = &stage.tool.value else { return None };
        balls.iter().position(|tool| tool.id == *id)
    }

    fn largest(&self, stage: &Stage) -> Result<LibraryTool, Error> {
        if let ToolChoice::Id(id) = &stage.tool.value {
            let found = self.shop.library.get(id).filter(|tool| tool.tool.is_ball());
            return found.cloned().ok_or_else(|| no_tool(stage, self.material));
        }
        self.balls(radii(stage)).into_iter().next().ok_or_else(|| no_tool(stage, self.material))
    }

    /// Feed of a stage with a tool: as the stage says, or from the tool's cutting data, within the machine's limits.
    pub(super) fn feed(&self, stage: &Stage, tool: &LibraryTool) -> f64 {
        let of_tool = || {
            let cutting = tool.cutting_for(self.material).ok()?;
            let engagement = Engagement { ap_mm: None, ae_mm: None, tilt_deg: 0.0 };
            Some(cutting.conditions(tool, &engagement, Some(&self.shop.machine)).ok()?.feed_mm_per_min)
        };
        let asked = stage.feed_mm_per_min.as_ref().map(|feed| feed.value).or_else(of_tool);
        let usual = claymill_paths::Feeds::default().cut_mm_per_min;
        let most = self.shop.machine.feed.max_mm_per_min.unwrap_or(f64::INFINITY);
        asked.unwrap_or(usual).min(most).round()
    }

    /// Rapids stay outside of all of the stock that there was: where an earlier ball did not fit, all of it is still there.
    fn stock_above_mm(&self, allowance_mm: f64) -> f64 {
        round_up((self.thickest_mm - allowance_mm).max(0.0))
    }

    /// Layers of a body of any shape run where there is some of it: where as much is above them as a part of what the last one
    /// leaves.
    fn rest_above_mm(&self, allowance_mm: f64) -> Option<f64> {
        let is_body = matches!(self.stock, Stock::File(_));
        is_body.then(|| round_up((BODY_REST * allowance_mm).max(LEAST_REST_MM)))
    }

    /// Where the ball cuts something of a block: its centre is no farther outside than its radius.
    fn within(&self, radius_mm: f64) -> Option<[f64; 6]> {
        let mut grown = match self.stock {
            Stock::Block { box_mm } => *box_mm,
            Stock::File(file) => file.box_mm?,
            _ => return None,
        };
        for k in 0..3 {
            grown[k] -= radius_mm;
            grown[k + 3] += radius_mm;
        }
        Some(grown)
    }
}

pub(super) fn no_tool(stage: &Stage, material: &Material) -> Error {
    let range = radii(stage)
        .map_or_else(String::new, |[low, high]| format!(" with a radius from {low} to {high} mm"));
    Error::Choice {
        what: format!(
            "the tools have no ball{range} for {} in {} that is small enough for the model",
            stage.kind.name(),
            material.name
        ),
        advice: "Add one to the tool library, or name a tool for the stage in a process of your own.".into(),
    }
}

pub(super) fn radii(stage: &Stage) -> Option<[f64; 2]> {
    match &stage.tool.value {
        ToolChoice::Auto { radius_mm } => *radius_mm,
        ToolChoice::Id(_) => None,
    }
}

/// Whether a tool's radius is in a range, where there is one.
pub(super) fn is_within(range: Option<[f64; 2]>, tool: &LibraryTool) -> bool {
    range.is_none_or(|[low, high]| (low..=high).contains(&tool.tool.radius_mm()))
}

/// Height of the cusps that a ball leaves between passes on a plane at this step-over, mm: `R − √(R² − s²/4)`.
pub(super) fn cusp_mm(radius_mm: f64, step_mm: f64) -> f64 {
    radius_mm - (radius_mm * radius_mm - 0.25 * step_mm * step_mm).max(0.0).sqrt()
}

/// To the hundredth of a millimetre that people read, and no less.
pub(super) fn round_up(mm: f64) -> f64 {
    (100.0 * mm).ceil() / 100.0
}

fn link(way: Way) -> LinkStyle {
    match way {
        Way::Lace => LinkStyle::Zigzag,
        Way::Climb | Way::Conventional => LinkStyle::OneWay,
    }
}

fn strategy(name: StrategyName) -> Strategy {
    match name {
        StrategyName::Auto => Strategy::Auto,
        StrategyName::Planar => Strategy::Planar,
        StrategyName::Flow => Strategy::Flow,
        StrategyName::Scallop => Strategy::Scallop,
        StrategyName::Waterline => Strategy::Waterline,
        StrategyName::SteepShallow => Strategy::SteepShallow,
        StrategyName::Isoparametric => Strategy::Isoparametric,
    }
}
