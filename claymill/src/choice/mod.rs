//! The operations of a job, chosen from material, tools and stock: each with its reason, and what was refused.
//!
//! ```text
//!   material ─ process ─► stages ─┐
//!   stock ──────────────► layers ─┤   rough …  the largest ball of its range, in layers down to the allowance
//!   tools ──────────────► balls ──┼─► finish   the largest ball that leaves less than 3 % of what any one reaches
//!   model ─► balls that fit where ┘   rest …   the cheapest chain of smaller balls for what is left
//! ```

mod fits;
mod layers;

use std::collections::BTreeMap;

use claymill_nurbs::{Aabb, Vector3};
use claymill_paths::{PlanError, Strategy};
use claymill_tooling::{
    ChainTool, Engagement, Fact, Facts, Library, LibraryTool, MachineShape, Material, Process, Profiles,
    ReachModel, ReachPatch, Spacing, Stage, StageKind, StrategyName, ToolChoice, ToolingError, Way,
    tool_chain,
};
use claymill_toolpath::{LinkStyle, Monitor, OperationKind, Stock, Tool};

use crate::choice::fits::Sample;
use crate::error::Error;
use crate::prepared::Prepared;

/// The finishing tool leaves no more than this share of the area that any tool reaches.
const LEFT_SHARE: f64 = 0.03;
/// Rests smaller than this share of the area are sampling noise.
const NOISE_SHARE: f64 = 2e-3;
/// A ball fits where one that is larger by this share does not: samples are exact to it.
const FITS: f64 = 1e-3;
/// A roughing step is no wider than this, in radii of the ball.
const WIDEST_STEP: f64 = 1.6;
/// A tool change takes this long where the machine does not say, s.
const CHANGE_S: f64 = 20.0;

/// What a job is chosen from.
#[derive(Debug, Clone)]
pub struct Shop {
    /// Tools.
    pub library: Library,
    /// The machine.
    pub machine: MachineShape,
    /// Materials and processes.
    pub profiles: Profiles,
}

/// What is asked for.
#[derive(Debug, Clone)]
pub struct Wish {
    /// Name of the material.
    pub material: String,
    /// What the model is cut from; as usual for the material if `None`.
    pub stock: Option<StockWish>,
    /// Scallop height of the finish, mm; that of the process if `None`.
    pub scallop_mm: Option<f64>,
}

/// Stock as it is asked for, before the model is known.
#[derive(Debug, Clone, PartialEq)]
pub enum StockWish {
    /// A layer on all faces, mm.
    Layer(f64),
    /// A block around the model, larger than it by this much on every side, mm.
    BlockAround(f64),
    /// A block: xmin, ymin, zmin, xmax, ymax, zmax.
    Block([f64; 6]),
}

/// Operations in order.
#[derive(Debug, Clone)]
pub struct Choice {
    /// What the model is cut from.
    pub stock: Stock,
    /// In machining order.
    pub operations: Vec<ChosenOperation>,
    /// What was not chosen, and why, a sentence each.
    pub refusals: Vec<String>,
    /// The process with every value and its origin.
    pub process: Process,
}

/// An operation with its tool and values.
#[derive(Debug, Clone)]
pub struct ChosenOperation {
    /// Its name in the job.
    pub name: String,
    /// What it is for.
    pub kind: OperationKind,
    /// Why it is there, and what it costs.
    pub reason: String,
    /// Its tool.
    pub tool: LibraryTool,
    /// Its number in the machine.
    pub tool_number: u32,
    /// The tool before it, if it cuts that one's rest.
    pub rest_of: Option<Tool>,
    /// What it leaves, mm.
    pub allowance_mm: f64,
    /// Scallop height, mm.
    pub scallop_mm: f64,
    /// Where passes run.
    pub strategy: Strategy,
    /// How passes are joined.
    pub link: LinkStyle,
    /// Feed, mm/min.
    pub feed_mm_per_min: f64,
    /// Stock that may stand above what it leaves, mm: all that there was at first.
    pub stock_above_mm: f64,
    /// The ball's centre stays in here, where nothing is to be cut outside.
    pub within_mm: Option<[f64; 6]>,
}

impl Shop {
    /// The shipped tools, machine and profiles.
    #[must_use]
    pub fn shipped() -> Self {
        Shop { library: Library::shipped(), machine: MachineShape::shipped(), profiles: Profiles::shipped() }
    }
}

/// Chooses the operations of a job.
///
/// # Errors
/// Material, process or tools do not go together: named, with what to do. Or the monitor ends it.
pub fn choose(
    prepared: &Prepared<'_>,
    shop: &Shop,
    wish: &Wish,
    monitor: &dyn Monitor,
) -> Result<Choice, Error> {
    let mut facts = Facts::new();
    facts.insert("material", Fact::Text(wish.material.clone()));
    facts.insert("machine.axes", Fact::Number(shop.machine.axis_count() as f64));
    facts.insert("machine.name", Fact::Text(shop.machine.name.clone()));
    let failed = |fault| ToolingError::Process { process: wish.material.clone(), fault };
    let material = shop.profiles.material(&wish.material).ok_or_else(|| Error::Choice {
        what: format!("there is no material `{}`", wish.material),
        advice: format!("There are {}.", shop.profiles.material_names().collect::<Vec<_>>().join(", ")),
    })?;
    facts.insert("material", Fact::Text(material.name.clone()));
    let process = shop.profiles.choose(&facts).map_err(failed)?;
    let process = shop.profiles.resolve(process, &material.name, &BTreeMap::new())?;
    let bounds = prepared.file.bounds;
    let stock = stock(wish, material, &bounds)?;
    let thickest_mm = layers::thickest_mm(&stock, prepared.file.model());
    facts.insert("stock.thickness_mm", Fact::Number(thickest_mm));
    facts.insert("part.height_mm", Fact::Number((bounds.max - bounds.min).z));
    let mut chooser = Chooser {
        shop,
        material,
        facts,
        stock: &stock,
        thickest_mm,
        left_mm: thickest_mm,
        operations: Vec::new(),
        refusals: Vec::new(),
    };
    for kind in [StageKind::Rough, StageKind::Semi] {
        if let Some(stage) = process.stage(kind) {
            chooser.clear(stage)?;
        }
    }
    if let Some(finish) = process.stage(StageKind::Finish) {
        let axes: Vec<Vector3> = match prepared.options.setups.as_slice() {
            [] => prepared
                .options
                .orientation
                .five_setups()
                .map_err(PlanError::from)?
                .iter()
                .map(|frame| frame.axis())
                .collect(),
            setups => setups.iter().map(|frame| frame.axis()).collect(),
        };
        let most_mm = shop.library.tools.iter().map(|t| t.tool.radius_mm()).fold(0.0, f64::max);
        let samples = fits::samples(prepared, &axes, most_mm, monitor).map_err(Error::Cancelled)?;
        chooser.surface(finish, process.stage(StageKind::Rest), &samples, wish.scallop_mm)?;
    }
    for (kind, from) in &process.skipped {
        chooser.refusals.push(format!("{} is left out: {from}", kind.name()));
    }
    if process.stage(StageKind::Pencil).is_some() {
        chooser.refusals.push("pencil is left out: rest passes run along valleys".into());
    }
    let Chooser { operations, refusals, .. } = chooser;
    Ok(Choice { stock, operations, refusals, process })
}

fn stock(wish: &Wish, material: &Material, bounds: &Aabb) -> Result<Stock, Error> {
    let layer_mm =
        material.layer_mm.map(|[low, _]| low.max(material.armature_mm.map_or(low, |[low, _]| low)));
    let chosen = match (&wish.stock, layer_mm) {
        (Some(StockWish::Layer(mm)), _) => Stock::Layer { thickness_mm: *mm },
        (Some(StockWish::BlockAround(mm)), _) => layers::block_around(bounds, *mm),
        (Some(StockWish::Block(box_mm)), _) => Stock::Block { box_mm: *box_mm },
        (None, Some(mm)) => Stock::Layer { thickness_mm: mm },
        (None, None) => layers::block_around(bounds, 0.0),
    };
    let wrong = |what: String, advice: &str| Err(Error::Choice { what, advice: advice.to_owned() });
    match &chosen {
        Stock::Layer { thickness_mm } if !(*thickness_mm > 0.0 && *thickness_mm <= 1e3) => wrong(
            format!("a layer of {thickness_mm} mm"),
            "A layer is from 0 to 1000 mm thick: --stock layer:25.",
        ),
        Stock::Block { box_mm } => {
            let slack_mm = 1e-6;
            let holds = (0..3)
                .all(|k| box_mm[k] <= bounds.min[k] + slack_mm && box_mm[k + 3] >= bounds.max[k] - slack_mm);
            let model = bounds.corners();
            if holds {
                return Ok(chosen);
            }
            wrong(
                format!("the block {box_mm:?} does not hold the model, whose box is {model:?}"),
                "Take a larger block, or let it follow the model: --stock block:5.",
            )
        }
        Stock::Layer { .. } => Ok(chosen),
    }
}

struct Chooser<'a> {
    shop: &'a Shop,
    material: &'a Material,
    facts: Facts,
    stock: &'a Stock,
    /// What stands above the surface at first, mm.
    thickest_mm: f64,
    /// The same after the operations so far, where the balls fit.
    left_mm: f64,
    operations: Vec<ChosenOperation>,
    refusals: Vec<String>,
}

impl Chooser<'_> {
    /// Roughing and semi-finishing: layers down to the allowance.
    fn clear(&mut self, stage: &Stage) -> Result<(), Error> {
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
        let tool = self.largest(stage)?;
        let radius_mm = tool.tool.radius_mm();
        let step_mm = stage.spacing.value.step_mm(&tool.tool).min(WIDEST_STEP * radius_mm);
        let scallop_mm = radius_mm - (radius_mm * radius_mm - 0.25 * step_mm * step_mm).sqrt();
        // No deeper than the ball is high: above it the shank would rub.
        let depth_mm = stage.depth_mm.as_ref().map_or(radius_mm, |d| d.value).min(radius_mm);
        let all = layers::allowances_mm(self.left_mm, allowance_mm, depth_mm);
        let (count, feed_mm_per_min) = (all.len(), self.feed(stage, &tool));
        for (index, &left_mm) in all.iter().enumerate() {
            let above_mm = self.left_mm;
            let name = if count == 1 { word.to_owned() } else { format!("{word}-{}", index + 1) };
            self.push(ChosenOperation {
                name,
                kind: match kind {
                    StageKind::Semi => OperationKind::Semi,
                    _ => OperationKind::Rough,
                },
                reason: format!(
                    "{above_mm:.1} mm are above the surface at most: {} takes {:.1} mm with steps of {step_mm:.1} mm, as {} says",
                    tool.name,
                    above_mm - left_mm,
                    stage.spacing.from
                ),
                tool: tool.clone(),
                tool_number: 0,
                rest_of: None,
                allowance_mm: left_mm,
                scallop_mm: round_up(scallop_mm),
                strategy: strategy(stage.strategy.value),
                link: link(stage.way.value),
                feed_mm_per_min,
                stock_above_mm: self.stock_above_mm(left_mm),
                within_mm: self.within(radius_mm),
            });
            self.left_mm = left_mm + scallop_mm;
        }
        self.facts.insert("stock.varies_mm", Fact::Number(scallop_mm));
        Ok(())
    }

    /// The finish and the chain of tools for what it leaves.
    fn surface(
        &mut self,
        finish: &Stage,
        rest: Option<&Stage>,
        samples: &[Sample],
        scallop_mm: Option<f64>,
    ) -> Result<(), Error> {
        let seen_mm2: f64 = samples.iter().map(|s| s.area_mm2).sum();
        let balls = self.balls(None);
        if balls.is_empty() {
            return Err(no_tool(finish, self.material));
        }
        let spacing = scallop_mm.map_or(finish.spacing.value, Spacing::ScallopMm);
        let change_s = self.shop.machine.changer.change_s.unwrap_or(CHANGE_S);
        let rate = |tool: &LibraryTool| spacing.step_mm(&tool.tool) * self.feed(finish, tool) / 60.0;
        let tools = balls.iter().map(|tool| ChainTool {
            id: tool.id.clone(),
            mm2_per_s: rate(tool),
            change_s,
            wear: self.material.wear,
        });
        let fits =
            |tool: &LibraryTool, sample: &Sample| sample.fits_mm >= tool.tool.radius_mm() * (1.0 - FITS);
        let patches: Vec<ReachPatch> = samples
            .iter()
            .map(|sample| ReachPatch {
                area_mm2: sample.area_mm2,
                reached_by: (balls.iter().enumerate())
                    .fold(0, |bits, (k, tool)| bits | u64::from(fits(tool, sample)) << k),
            })
            .collect();
        let wrong = |e: &dyn std::fmt::Display| Error::Choice {
            what: format!("the tools for the surface cannot be chosen: {e}"),
            advice: "Look at the tools' radii and feeds.".into(),
        };
        let model = ReachModel::new(tools.collect(), &patches).map_err(|e| wrong(&e))?;
        let range = radii(finish);
        let in_range =
            |k: &usize| range.is_none_or(|[low, high]| (low..=high).contains(&balls[*k].tool.radius_mm()));
        let reaches = |k: usize| 100.0 * model.reached_mm2(k) / seen_mm2.max(f64::MIN_POSITIVE);
        let union_mm2: f64 = patches.iter().filter(|p| p.reached_by != 0).map(|p| p.area_mm2).sum();
        let enough = |k: &usize| model.reached_mm2(*k) >= (1.0 - LEFT_SHARE) * union_mm2;
        let chosen = (0..balls.len()).filter(in_range).find(enough);
        // Of those in the range the one that reaches most, where none reaches enough.
        let chosen = chosen.or_else(|| (0..balls.len()).rfind(in_range));
        let Some(first) = self.told(finish, &balls).or(chosen) else {
            return Err(no_tool(finish, self.material));
        };
        for k in (0..first).filter(in_range) {
            self.refusals.push(format!(
                "{} is not taken for the finish: it reaches {:.1} % of the surface that the setups see",
                balls[k].name,
                reaches(k)
            ));
        }
        let tool = &balls[first];
        let height_mm = |tool: &LibraryTool| match spacing {
            Spacing::ScallopMm(mm) => mm,
            other => {
                let (radius_mm, step_mm) = (tool.tool.radius_mm(), other.step_mm(&tool.tool));
                round_up(radius_mm - (radius_mm * radius_mm - 0.25 * step_mm * step_mm).max(0.0).sqrt())
            }
        };
        self.push(ChosenOperation {
            name: "finish".into(),
            kind: OperationKind::Finish,
            reason: format!(
                "{} is the largest ball of its range that reaches {:.1} % of the surface that the setups see; all balls \
                 together reach {:.1} %",
                tool.name,
                reaches(first),
                100.0 * union_mm2 / seen_mm2.max(f64::MIN_POSITIVE)
            ),
            tool: tool.clone(),
            tool_number: 0,
            rest_of: None,
            allowance_mm: finish.allowance_mm.value,
            scallop_mm: height_mm(tool),
            strategy: strategy(finish.strategy.value),
            link: link(finish.way.value),
            feed_mm_per_min: self.feed(finish, tool),
            stock_above_mm: self.stock_above_mm(finish.allowance_mm.value),
            within_mm: None,
        });
        let Some(stage) = rest else { return Ok(()) };
        self.rests(stage, &balls[first..], &patches, first, seen_mm2, &height_mm)
    }

    /// Rest operations by the cheapest chain of tools below the finishing one.
    fn rests(
        &mut self,
        stage: &Stage,
        balls: &[LibraryTool],
        patches: &[ReachPatch],
        first: usize,
        seen_mm2: f64,
        height_mm: &dyn Fn(&LibraryTool) -> f64,
    ) -> Result<(), Error> {
        let below = |p: &ReachPatch| ReachPatch { reached_by: p.reached_by >> first, ..*p };
        let left: Vec<ReachPatch> = patches.iter().map(below).filter(|p| p.reached_by & 1 == 0).collect();
        let rest_mm2: f64 = left.iter().filter(|p| p.reached_by != 0).map(|p| p.area_mm2).sum();
        self.facts.insert("rest.area_mm2", Fact::Number(rest_mm2));
        if rest_mm2 <= NOISE_SHARE * seen_mm2 || stage.runs(&self.facts) == Some(false) {
            self.refusals.push(format!(
                "rest is not needed: {rest_mm2:.0} mm² are left for smaller balls, of {seen_mm2:.0} mm²"
            ));
            return Ok(());
        }
        let change_s = self.shop.machine.changer.change_s.unwrap_or(CHANGE_S);
        let smaller: Vec<LibraryTool> = balls.iter().skip(1).cloned().collect();
        let rate = |tool: &LibraryTool| {
            Spacing::ScallopMm(height_mm(tool)).step_mm(&tool.tool) * self.feed(stage, tool) / 60.0
        };
        let tools = smaller.iter().map(|tool| ChainTool {
            id: tool.id.clone(),
            mm2_per_s: rate(tool),
            change_s,
            wear: self.material.wear,
        });
        let patches: Vec<ReachPatch> =
            left.iter().map(|p| ReachPatch { reached_by: p.reached_by >> 1, ..*p }).collect();
        let model = ReachModel::new(tools.collect(), &patches).map_err(|e| Error::Choice {
            what: format!("the tools for the rest cannot be chosen: {e}"),
            advice: "Look at the tools' radii and feeds.".into(),
        })?;
        let chain = tool_chain(&model, NOISE_SHARE * seen_mm2);
        let mut before = balls[0].tool;
        for (index, step) in chain.steps.iter().enumerate() {
            let Some(tool) = smaller.iter().find(|tool| tool.id == model.tools()[step.tool].id) else {
                continue;
            };
            self.push(ChosenOperation {
                name: if chain.steps.len() == 1 { "rest".into() } else { format!("rest-{}", index + 1) },
                kind: OperationKind::Rest,
                reason: format!(
                    "{} cuts {:.0} mm² that {before} does not reach; the chain of {} takes {:.0} s, {:.0} mm² are left to none",
                    tool.name,
                    step.area_mm2,
                    chain.steps.len(),
                    chain.total_s,
                    chain.left_mm2
                ),
                tool: tool.clone(),
                tool_number: 0,
                rest_of: Some(before),
                allowance_mm: stage.allowance_mm.value,
                scallop_mm: height_mm(tool),
                strategy: strategy(stage.strategy.value),
                link: link(stage.way.value),
                feed_mm_per_min: self.feed(stage, tool),
                stock_above_mm: self.stock_above_mm(stage.allowance_mm.value),
                within_mm: None,
            });
            before = tool.tool;
        }
        for other in &chain.others {
            let tool = &model.tools()[other.tool].id;
            self.refusals.push(format!(
                "{tool} is not taken for the rest: the best chain with it takes {:.0} s",
                other.total_s
            ));
        }
        Ok(())
    }

    fn push(&mut self, operation: ChosenOperation) {
        // One number a tool: the shop's, or else its place in the library.
        let place = self.shop.library.tools.iter().position(|t| t.id == operation.tool.id);
        let number = operation.tool.number.unwrap_or(place.unwrap_or(0) as u32 + 1);
        self.operations.push(ChosenOperation { tool_number: number, ..operation });
    }

    /// Balls of the library from large to small, within a range of radii.
    fn balls(&self, range: Option<[f64; 2]>) -> Vec<LibraryTool> {
        let fits = |t: &&LibraryTool| {
            t.tool.is_ball() && range.is_none_or(|[low, high]| (low..=high).contains(&t.tool.radius_mm()))
        };
        let mut balls: Vec<LibraryTool> = self.shop.library.tools.iter().filter(fits).cloned().collect();
        balls.sort_by(|a, b| b.tool.radius_mm().total_cmp(&a.tool.radius_mm()).then(a.id.cmp(&b.id)));
        balls.truncate(claymill_tooling::MOST_CHAIN_TOOLS);
        balls
    }

    /// The tool that a stage names, as its place among these.
    fn told(&self, stage: &Stage, balls: &[LibraryTool]) -> Option<usize> {
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
    fn feed(&self, stage: &Stage, tool: &LibraryTool) -> f64 {
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

    /// Where the ball cuts something of a block: its centre is no farther outside than its radius.
    fn within(&self, radius_mm: f64) -> Option<[f64; 6]> {
        let Stock::Block { box_mm } = self.stock else { return None };
        let mut grown = *box_mm;
        for k in 0..3 {
            grown[k] -= radius_mm;
            grown[k + 3] += radius_mm;
        }
        Some(grown)
    }
}

fn no_tool(stage: &Stage, material: &Material) -> Error {
    let range = radii(stage)
        .map_or_else(String::new, |[low, high]| format!(" with a radius from {low} to {high} mm"));
    Error::Choice {
        what: format!("the tools have no ball{range} for {} in {}", stage.kind.name(), material.name),
        advice: "Add one to the tool library, or name a tool for the stage in a process of your own.".into(),
    }
}

fn radii(stage: &Stage) -> Option<[f64; 2]> {
    match &stage.tool.value {
        ToolChoice::Auto { radius_mm } => *radius_mm,
        ToolChoice::Id(_) => None,
    }
}

/// To the hundredth of a millimetre that people read, and no less.
fn round_up(mm: f64) -> f64 {
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
