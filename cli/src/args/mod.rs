//! What the command line takes.

mod bounds;
mod clearances;
mod job;
mod machine;
mod model;
mod result;

use clap::{Parser, Subcommand};

pub(crate) use bounds::BoundsArgs;
pub(crate) use clearances::check_clearance;
pub(crate) use job::{AxisArgs, CompareArgs, JobOptions, LinkName, PlanArgs, PresetName, StrategyName};
pub(crate) use machine::{ControlArgs, OrderArgs, PostArgs, SimulateArgs, StreamArgs};
pub(crate) use model::{DemoArgs, DropArgs, InspectArgs, MergeArgs, SampleArgs};
pub(crate) use result::{AnimateArgs, PathColour, RenderArgs, ReportArgs, ShowName, VerifyArgs, ViewArgs};

/// The first of two lists unless nothing was given there.
pub(crate) fn first_given<T>(first: Vec<T>, second: Vec<T>) -> Vec<T> {
    if first.is_empty() { second } else { first }
}

/// Freeform surface machining of whole vehicles: from an IGES, STEP or Rhino file to verified NURBS tool paths.
#[derive(Debug, Parser)]
#[command(name = "claymill", version, arg_required_else_help = true)]
pub(crate) struct Cli {
    #[command(subcommand)]
    pub(crate) command: Command,
    /// Print the result as JSON on standard output.
    #[arg(long, global = true)]
    pub(crate) json: bool,
    /// No progress and no summary.
    #[arg(long, global = true)]
    pub(crate) quiet: bool,
    /// Worker threads; 0 means one for each core.
    #[arg(long, global = true, default_value_t = 0, value_name = "N")]
    pub(crate) threads: usize,
}

#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// The built-in vehicle through the whole pipeline.
    Demo(DemoArgs),
    /// What is in a file: faces, units, area, box, defects.
    Inspect(InspectArgs),
    /// Lower a tool of any kind on a model: where it comes to rest, on what, and what is proven of that.
    Drop(DropArgs),
    /// Find the joints between faces and sew smooth ones into regions.
    Merge(MergeArgs),
    /// The main job: regions, setups, tool paths, verification, pictures, report.
    Plan(PlanArgs),
    /// The same job by several strategies, scallop heights and tools, side by side.
    Compare(CompareArgs),
    /// Check a job folder against its model.
    Verify(VerifyArgs),
    /// Write a job for a machine's control, and read it back.
    Post(PostArgs),
    /// Run a program on a virtual control of its dialect: cut error, feed, time.
    Simulate(SimulateArgs),
    /// Stream a job into a control's queue.
    Stream(StreamArgs),
    /// The reference controller: takes a stream and runs along its curves. Orders come on standard input, or by
    /// `claymill order`: hold, run, step, abort, discard.
    Control(ControlArgs),
    /// Give a running reference controller an order, and say where the machine is.
    Order(OrderArgs),
    /// Pictures of a model or a job folder.
    Render(RenderArgs),
    /// Look at a model or a job folder in a window: turn, pick, measure, cut open, run along the paths.
    View(ViewArgs),
    /// The tool on its way over the model, as an animation true to the time.
    Animate(AnimateArgs),
    /// Pictures and report of a job folder, made anew.
    Report(ReportArgs),
    /// Write a generated model with its planted answers.
    Sample(SampleArgs),
    /// JSON Schemas of the job folder.
    Schema,
}
