//! `claymill plan` of a job with several operations: from a job file, in the order that it has them.

use std::path::Path;

use claymill::{
    ChosenOperation, OperationJob, OperationKind, PlannedOperations, Prepared, Shop, Stock, StockWish,
    Strategy, Wish, choose,
};
use claymill_tooling::{MachineShape, ReadOptions, read_library};
use claymill_toolpath::{FolderWriter, Holder, Mirror, StockFile};
use serde::{Deserialize, Serialize};
use toml::{Table, Value};

use super::job_file::{self, JOB_TOML};
use super::plan::{Done, finish};
use super::request::Request;
use super::{Context, plan_summary, say_axes, stages};
use crate::args::{CutName, JobOptions, PlanArgs, ProcessArgs, ReuseArgs, StrategyName, sides};
use crate::console::Console;
use crate::failure::Failure;
use crate::reuse::Reuse;
use crate::{interrupt, material};

/// The key of a job file that holds its operations.
const OPERATIONS: &str = "operations";
const ADVICE: &str = "docs/operations.md describes job files with operations.";

/// A job of operations as its file has it.
#[derive(Debug, Clone, Default)]
pub(super) struct OperationsFile {
    /// What the model is cut from.
    pub(super) stock: Option<Stock>,
    /// In machining order.
    pub(super) operations: Vec<OperationOptions>,
}

/// One operation: what it is for, and the options of a job.
#[derive(Debug, Clone)]
pub(super) struct OperationOptions {
    pub(super) head: Head,
    pub(super) options: JobOptions,
}

/// What an operation has beside the options of a job.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Head {
    pub(super) name: String,
    pub(super) kind: OperationKind,
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub(super) reason: String,
}

/// The job of operations that is asked for, if it is one.
pub(super) fn asked(args: &PlanArgs) -> Result<Option<Source>, Failure> {
    if let Some(material) = &args.process.material {
        let options = job_file::with(args.job.options(), args.job_file.as_deref())?;
        return Source::for_material(material, &args.process, options).map(Some);
    }
    let Some(file) = args.job_file.as_deref() else { return Ok(None) };
    let text = job_file::read_text(file)?;
    // What is no TOML is told by whoever reads the options.
    let Ok(table) = text.parse::<Table>() else { return Ok(None) };
    if !table.contains_key(OPERATIONS) {
        return Ok(None);
    }
    let in_file = |what: String| Failure::problem(format!("{}: {what}", file.display()), ADVICE);
    parsed(table, &args.job.options()).map(|job| Some(Source::File(job))).map_err(in_file)
}

/// Options that stand before the operations are those of all of them; those of the command line go before both.
fn parsed(mut table: Table, first: &JobOptions) -> Result<OperationsFile, String> {
    let stock = table.remove("stock").map(Value::try_into::<Stock>).transpose();
    let stock = stock.map_err(|e| format!("stock: {}", e.message()))?;
    let Some(Value::Array(operations)) = table.remove(OPERATIONS) else {
        return Err("operations are tables: [[operations]]".into());
    };
    let mut parsed = OperationsFile { stock, operations: Vec::new() };
    for (index, value) in operations.into_iter().enumerate() {
        let Value::Table(mut own) = value else {
            return Err(format!("operation {} is not a table", index + 1));
        };
        let named =
            own.get("name").and_then(Value::as_str).map_or_else(|| (index + 1).to_string(), str::to_owned);
        let wrong = |e: toml::de::Error| format!("operation {named}: {}", e.message());
        let head: Table =
            ["name", "kind", "reason"].into_iter().filter_map(|key| own.remove_entry(key)).collect();
        let head = Value::Table(head).try_into::<Head>().map_err(wrong)?;
        for (key, value) in &table {
            own.entry(key.clone()).or_insert_with(|| value.clone());
        }
        let options = Value::Table(own).try_into::<JobOptions>().map_err(wrong)?;
        let options = job_file::over(first.clone(), options);
        parsed.operations.push(OperationOptions { head, options });
    }
    Ok(parsed)
}

/// A job file with these operations.
pub(super) fn text(job: &OperationsFile) -> Result<String, Failure> {
    let failed = |e: toml::ser::Error| {
        Failure::problem(format!("the job cannot be written as TOML: {e}"), "Please report it.")
    };
    let mut all = Table::new();
    if let Some(stock) = &job.stock {
        all.insert("stock".into(), Value::try_from(stock).map_err(failed)?);
    }
    let mut tables = Vec::new();
    for operation in &job.operations {
        let mut table = Table::try_from(&operation.head).map_err(failed)?;
        table.extend(Table::try_from(&operation.options).map_err(failed)?);
        tables.push(Value::Table(table));
    }
    all.insert(OPERATIONS.into(), Value::Array(tables));
    toml::to_string(&all).map_err(failed)
}

/// Where the operations of a job are from.
pub(super) enum Source {
    /// A job file.
    File(OperationsFile),
    /// They are chosen for a material.
    Chosen(Box<Chosen>),
}

impl Source {
    /// Operations that are chosen for a material.
    pub(super) fn for_material(
        material: &str,
        asked: &ProcessArgs,
        options: JobOptions,
    ) -> Result<Self, Failure> {
        Ok(Source::Chosen(Box::new(Chosen::new(material, asked, options)?)))
    }
}

/// What operations are chosen from.
pub(super) struct Chosen {
    shop: Shop,
    wish: Wish,
    options: JobOptions,
}

/// Plans all operations, verifies them as one job, and puts its folder into place.
pub(super) fn run(
    context: &Context,
    model: &Path,
    source: Source,
    out: &Path,
    reuse: &ReuseArgs,
) -> Result<Done, Failure> {
    let console = context.console;
    // What can be said before the model is read, which may take a while.
    let (base, mirror) = match &source {
        Source::File(job) => {
            let requests = requests(model, job)?;
            let main = OperationKind::main_of(requests.iter().map(|o| o.kind));
            (main.map(|main| requests[main].job.clone()), mirror_of(job)?)
        }
        Source::Chosen(chosen) => (Some(Request::new(model, &chosen.options)?.job), chosen.options.mirror),
    };
    let base = base.ok_or_else(|| Failure::problem("the job has no operations", ADVICE))?;
    let folder = FolderWriter::begin(out)?;
    interrupt::remove_on_interrupt(folder.leftovers());
    let reuse = Reuse::new(reuse, out, console)?;
    let loaded = context.load(model, mirror)?;

    console.stage("merging");
    let prepared = base.prepare(&loaded)?;
    let record = &prepared.merged().record;
    console.say(format!("regions   {} in {} faces", record.regions.len(), loaded.model().faces.len()));
    material::say(console, &record.sheets, prepared.excluded());

    console.stage("planning");
    let job = match source {
        Source::File(job) => job,
        Source::Chosen(chosen) => chosen.choose(console, &prepared)?,
    };
    if let Some(first) = job.operations.first() {
        say_axes(console, &first.options.axes, prepared.orientation());
    }
    let mut operations = requests(model, &job)?;
    operations.iter_mut().for_each(|operation| operation.job.passes.kept = reuse.kept.clone());
    let told = |operation: &OperationJob, plan: Result<&claymill::Planned<'_>, &claymill::Error>| {
        let passes = &operation.job.passes;
        let how = match operation.job.levels {
            Some(levels) => format!(
                "levels of {} mm at {}°, stairs of {:.2} mm",
                levels.step_down_mm, levels.engagement_deg, levels.band_mm
            ),
            None => format!("scallop {} mm, {}", passes.scallop_mm, passes.strategy),
        };
        console.say(format!(
            "operation {} ({}): {}, allowance {} mm, {how}",
            operation.name, operation.kind, passes.tool, passes.allowance_mm
        ));
        match plan {
            Ok(plan) => plan_summary::say_plan(console, plan.plan()),
            Err(error) => console.say_long("", &format!("left out: {error}")),
        }
    };
    let planned = PlannedOperations::new(&prepared, job.stock.clone(), &operations, console, told)?;

    console.stage("writing");
    folder.text(JOB_TOML, &text(&job)?)?;

    console.stage("verifying");
    let states = stages::of(&planned);
    let verified = planned.verify_into(folder, console)?;
    finish(context, verified, &states, out, &reuse)
}

/// Operations are of one model.
fn mirror_of(job: &OperationsFile) -> Result<Option<Mirror>, Failure> {
    let mut asked = job.operations.iter().map(|operation| operation.options.mirror);
    let first = asked.next().flatten();
    match asked.all(|mirror| mirror == first) {
        true => Ok(first),
        false => Err(Failure::problem(
            "the operations of the job are of different halves",
            "Write `mirror` once, above the first [[operations]].",
        )),
    }
}

/// The operations of a job file as they are planned.
fn requests(model: &Path, job: &OperationsFile) -> Result<Vec<OperationJob>, Failure> {
    let request = |operation: &OperationOptions| {
        let OperationOptions { head, options } = operation;
        let request = Request::new(model, options)?;
        Ok(OperationJob {
            name: head.name.clone(),
            kind: head.kind,
            reason: head.reason.clone(),
            job: request.job,
        })
    };
    job.operations.iter().map(request).collect()
}

impl Chosen {
    /// Reads tools, machine and profiles.
    fn new(material: &str, asked: &ProcessArgs, mut options: JobOptions) -> Result<Self, Failure> {
        let mut shop = Shop::shipped();
        if let Some(file) = &asked.tools {
            shop.library = read_library(file, &ReadOptions::default())?.library;
        }
        if let Some(file) = &options.machine {
            shop.machine = MachineShape::read(file)?.0;
        }
        for file in &asked.process {
            shop.profiles.add_file(file)?;
        }
        let is_file = material.ends_with(".toml");
        let material = match is_file {
            true => shop.profiles.add_file(Path::new(material))?,
            false => material.to_owned(),
        };
        let wish = Wish {
            material,
            stock: asked.stock.as_deref().map(stock).transpose()?,
            scallop_mm: options.scallop.take(),
        };
        if let Some(tool) = options.tool.take() {
            return Err(Failure::usage(
                format!("--tool {tool}: with --material the tools are chosen"),
                "Leave --tool out, or give --tools a library with the tools that may be taken.",
            ));
        }
        for tool in &mut shop.library.tools {
            tool.holder = match &options.holder {
                // A tool that such a holder does not hold is refused if it is taken.
                Some(text) => Holder::parse(text, &tool.tool).ok(),
                // What holds the shipped tools on somebody's machine is not known.
                None => tool.holder.take().filter(|_| asked.tools.is_some()),
            };
        }
        Ok(Chosen { shop, wish, options })
    }

    /// The operations, said with their reasons.
    fn choose(&self, console: &Console, prepared: &Prepared<'_>) -> Result<OperationsFile, Failure> {
        let choice = choose(prepared, &self.shop, &self.wish, console)?;
        for line in choice.process.explain().lines() {
            console.say(line);
        }
        console.say(match &choice.stock {
            Stock::Layer { thickness_mm } => format!("stock     a layer of {thickness_mm} mm on all faces"),
            Stock::Block { box_mm } => format!("stock     a block, {box_mm:.1?} mm"),
            Stock::File(file) => format!("stock     the body in {}", file.path),
            Stock::Bar { from_mm, to_mm, diameter_mm } => {
                format!("stock     a round bar of {diameter_mm} mm, from {from_mm:.1?} to {to_mm:.1?} mm")
            }
        });
        for operation in &choice.operations {
            console.say_long(&operation.name, &operation.reason);
        }
        for refusal in &choice.refusals {
            console.say_long("not", refusal);
        }
        let operation = |o: &ChosenOperation| OperationOptions {
            head: Head { name: o.name.clone(), kind: o.kind, reason: o.reason.clone() },
            options: self.options_of(o),
        };
        Ok(OperationsFile {
            operations: choice.operations.iter().map(operation).collect(),
            stock: Some(choice.stock),
        })
    }

    fn options_of(&self, o: &ChosenOperation) -> JobOptions {
        let mut options = self.options.clone();
        let corner = |b: &[f64]| format!("{},{},{}", b[0], b[1], b[2]);
        options.tool = Some(o.tool.tool.to_string());
        options.tool_number = Some(o.tool_number);
        options.holder = options.holder.or_else(|| o.tool.holder.as_ref().map(ToString::to_string));
        options.rest_of = o.rest_of.map(|tool| tool.to_string());
        options.allowance = Some(o.allowance_mm);
        options.scallop = Some(o.scallop_mm);
        options.strategy = Some(options.strategy.unwrap_or(strategy_name(o.strategy)));
        options.link = Some(o.link.into());
        options.feed = options.feed.or(Some(o.feed_mm_per_min));
        if let Some(levels) = o.levels {
            options.cut = Some(CutName::Levels);
            options.step_down = Some(levels.step_down_mm);
            options.engagement = Some(levels.engagement_deg);
            options.band = Some(levels.band_mm);
            options.dead_centre = levels.dead_centre_mm;
            options.ramp = levels.ramp_deg;
        }
        options.stock_above = Some(o.stock_above_mm);
        options.rest_above = o.rest_above_mm;
        if let Some(chosen) = o.within_mm {
            let asked = options.bounds.centre_within.as_deref().and_then(|text| sides(text).ok());
            let both = asked.map_or(chosen, |asked| common_box(chosen, asked));
            options.bounds.centre_within = Some(format!("{}:{}", corner(&both[..3]), corner(&both[3..])));
        }
        options
    }
}

/// What two boxes have in common.
fn common_box(a: [f64; 6], b: [f64; 6]) -> [f64; 6] {
    std::array::from_fn(|k| if k < 3 { a[k].max(b[k]) } else { a[k].min(b[k]) })
}

/// Stock as the command line has it.
fn stock(text: &str) -> Result<StockWish, Failure> {
    let wrong = || {
        Failure::usage(
            format!("`{text}` is not a stock"),
            "For example: --stock layer:25, --stock block:10, --stock round:60:x, --stock file:casting.stp, or --stock -100,-50,0:100,50,80.",
        )
    };
    let number = |t: &str| t.trim().parse::<f64>().ok().filter(|v| v.is_finite()).ok_or_else(wrong);
    match text.split_once(':') {
        Some(("file", path)) => Ok(StockWish::File(StockFile::at(Path::new(path), 1.0))),
        Some(("layer", mm)) => Ok(StockWish::Layer(number(mm)?)),
        Some(("round", bar)) => {
            let (mm, axis) = bar.split_once(':').map_or((bar, None), |(mm, axis)| (mm, Some(axis)));
            let axis = axis.map(|name| ["x", "y", "z"].iter().position(|a| *a == name).ok_or_else(wrong));
            Ok(StockWish::Round(number(mm)?, axis.transpose()?))
        }
        Some(("block", mm)) => Ok(StockWish::BlockAround(number(mm)?)),
        Some(_) => Ok(StockWish::Block(sides(text).map_err(|_| wrong())?)),
        None if text == "block" => Ok(StockWish::BlockAround(0.0)),
        None => Err(wrong()),
    }
}

fn strategy_name(strategy: Strategy) -> StrategyName {
    match strategy {
        Strategy::Planar => StrategyName::Planar,
        Strategy::Flow => StrategyName::Flow,
        Strategy::Scallop => StrategyName::Scallop,
        Strategy::Waterline => StrategyName::Waterline,
        Strategy::SteepShallow => StrategyName::SteepShallow,
        Strategy::Isoparametric => StrategyName::Isoparametric,
        Strategy::Auto => StrategyName::Auto,
    }
}
