//! What the command line takes.

mod bounds;
mod clearances;
mod diff;
mod examples;
mod job;
mod machine;
mod model;
mod paths;
mod process;
mod prototype;
mod reach;
mod result;
mod reuse;
mod shard;
mod shell;
mod tools;

use std::path::PathBuf;

use clap::{Parser, Subcommand};

pub(crate) use bounds::{BoundsArgs, sides};
pub(crate) use clearances::check_clearance;
pub(crate) use diff::{DiffArgs, StoreArgs, StoreCommand};
pub(crate) use job::{
    AxisArgs, CompareArgs, CutName, JobOptions, LinkName, OneJob, PlanArgs, PresetName, StrategyName,
};
pub(crate) use machine::{ControlArgs, OrderArgs, PlaceArgs, PostArgs, SimulateArgs, StreamArgs};
pub(crate) use model::{DemoArgs, DropArgs, InspectArgs, MergeArgs, SampleArgs};
pub(crate) use process::ProcessArgs;
pub(crate) use prototype::PrototypeArgs;
pub(crate) use reach::ReachArgs;
pub(crate) use result::{
    AnimateArgs, PathColour, RenderArgs, ReportArgs, ShowName, StockArgs, VerifyArgs, ViewArgs,
};
pub(crate) use reuse::ReuseArgs;
pub(crate) use shard::{Engine, ListForm, OpenArgs, ShardArgs, ShardCommand};
pub(crate) use shell::{CompletionsArgs, ManArgs};
pub(crate) use tools::{TableUnit, ToolsArgs};

/// The first of two lists unless nothing was given there.
pub(crate) fn first_given<T>(first: Vec<T>, second: Vec<T>) -> Vec<T> {
    if first.is_empty() { second } else { first }
}

/// Options of every command.
const GENERAL: &str = "General options";
/// What a job is made with, in groups.
const TOOL: &str = "Tool and holder";
const PASSES: &str = "Passes";
const CHOICE: &str = "What is cut";
const MACHINE: &str = "Machine";
const SETUP: &str = "Axes and setups";
pub(crate) const JOINING: &str = "Merging";

/// Freeform surface machining of whole vehicles: from an IGES, STEP or Rhino file to verified NURBS tool paths.
#[derive(Debug, Parser)]
#[command(name = "claymill", version, arg_required_else_help = true, after_help = examples::CLAYMILL)]
pub(crate) struct Cli {
    #[command(subcommand)]
    pub(crate) command: Command,
    /// Print the result as JSON on standard output.
    #[arg(long, global = true, help_heading = GENERAL)]
    pub(crate) json: bool,
    /// Replace files that claymill did not write. An input of the command is never replaced, and a job folder only where
    /// nothing in it would be lost.
    #[arg(long, global = true)]
    pub(crate) force: bool,
    /// No progress and no summary.
    #[arg(long, global = true, help_heading = GENERAL)]
    pub(crate) quiet: bool,
    /// Write where the time goes into this file, as a trace for `ui.perfetto.dev` or Chrome.
    #[arg(long, global = true, value_name = "FILE", help_heading = GENERAL)]
    pub(crate) log: Option<PathBuf>,
    /// Worker threads; 0 means one for each core.
    #[arg(long, global = true, default_value_t = 0, value_name = "N", help_heading = GENERAL, allow_negative_numbers = true)]
    pub(crate) threads: usize,
}

#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// The built-in vehicle through the whole pipeline.
    #[command(after_help = examples::DEMO)]
    Demo(DemoArgs),
    /// What is in a file: faces, units, area, box, defects.
    #[command(after_help = examples::INSPECT)]
    Inspect(InspectArgs),
    /// Lower a tool of any kind on a model: where it comes to rest, on what, and what is proven of that.
    #[command(after_help = examples::DROP)]
    Drop(DropArgs),
    /// What directions of the tool reach of a model, the fewest that reach all that can be reached, and the proof.
    #[command(after_help = examples::REACH)]
    Reach(ReachArgs),
    /// Find the joints between faces and sew smooth ones into regions.
    #[command(after_help = examples::MERGE)]
    Merge(MergeArgs),
    /// The main job: regions, setups, tool paths, verification, pictures, report.
    #[command(after_help = examples::PLAN)]
    Plan(PlanArgs),
    /// What differs between the model of a job and another one: faces added, removed and moved, and what of the job that
    /// touches.
    #[command(after_help = examples::DIFF)]
    Diff(DiffArgs),
    /// What a store of parts of plans holds, and making it smaller.
    #[command(after_help = examples::STORE)]
    Store(StoreArgs),
    /// A plan in shards for many machines: list them, lay them, join them.
    #[command(after_help = examples::SHARD)]
    Shard(ShardArgs),
    /// A part from a bar on a rotary axis: axis, angles, supports, passes and a setup sheet, or why it cannot be made so.
    #[command(after_help = examples::PROTOTYPE)]
    Prototype(PrototypeArgs),
    /// The same job by several strategies, scallop heights and tools, side by side.
    #[command(after_help = examples::COMPARE)]
    Compare(CompareArgs),
    /// Check a job folder against its model.
    #[command(after_help = examples::VERIFY)]
    Verify(VerifyArgs),
    /// Write a job for a machine's control, and read it back.
    #[command(after_help = examples::POST)]
    Post(PostArgs),
    /// Run a program on a virtual control of its dialect: cut error, feed, time.
    #[command(after_help = examples::SIMULATE)]
    Simulate(SimulateArgs),
    /// Stream a job into a control's queue.
    #[command(after_help = examples::STREAM)]
    Stream(StreamArgs),
    /// The reference controller: takes a stream and runs along its curves. Orders come on standard input, or by
    /// `claymill order`: hold, run, step, abort, discard.
    #[command(after_help = examples::CONTROL)]
    Control(ControlArgs),
    /// Give a running reference controller an order, and say where the machine is.
    #[command(after_help = examples::ORDER)]
    Order(OrderArgs),
    /// List the tools of a library, draw them, and check them against a machine and a material.
    #[command(after_help = examples::TOOLS)]
    Tools(ToolsArgs),
    /// Pictures of a model or a job folder.
    #[command(after_help = examples::RENDER)]
    Render(RenderArgs),
    /// Look at a model or a job folder in a window: turn, pick, measure, cut open, run along the paths.
    #[command(after_help = examples::VIEW)]
    View(ViewArgs),
    /// The tool on its way over the model, as an animation true to the time.
    #[command(after_help = examples::ANIMATE)]
    Animate(AnimateArgs),
    /// Pictures and report of a job folder, made anew.
    #[command(after_help = examples::REPORT)]
    Report(ReportArgs),
    /// What each operation of a job leaves of the stock, and the rest as a closed mesh: the stock of the next job.
    #[command(after_help = examples::STOCK)]
    Stock(StockArgs),
    /// Write a generated model with its planted answers.
    #[command(after_help = examples::SAMPLE)]
    Sample(SampleArgs),
    /// JSON Schemas of the job folder and of the machine definition.
    #[command(after_help = examples::SCHEMA)]
    Schema,
    /// The script by which a shell completes commands and options.
    #[command(hide = true, after_help = examples::COMPLETIONS)]
    Completions(CompletionsArgs),
    /// The manual as pages for `man`, one a command.
    #[command(hide = true, after_help = examples::MAN)]
    Man(ManArgs),
}

impl Command {
    /// Whether a scheduler may run it, which has to know what to do when it fails.
    pub(crate) fn is_scheduled(&self) -> bool {
        matches!(self, Command::Shard(ShardArgs { what: ShardCommand::Run { .. } }))
    }

    /// Whether it may make pictures.
    pub(crate) fn draws(&self) -> bool {
        !matches!(
            self,
            Command::Drop(DropArgs { out: None, .. })
                | Command::Reach(ReachArgs { picture: None, .. })
                | Command::Shard(ShardArgs {
                    what: ShardCommand::Open(_)
                        | ShardCommand::Run { .. }
                        | ShardCommand::Status { .. }
                        | ShardCommand::Script { .. }
                })
                | Command::Verify(_)
                | Command::Post(_)
                | Command::Simulate(_)
                | Command::Stream(_)
                | Command::Control(_)
                | Command::Order(_)
                | Command::Tools(_)
                | Command::Sample(_)
                | Command::Schema
                | Command::Completions(_)
                | Command::Man(_)
        )
    }
}
