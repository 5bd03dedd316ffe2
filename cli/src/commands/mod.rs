//! One file a command.

mod animate;
mod areas;
mod compare;
mod compare_jobs;
mod compare_kept;
mod compare_plot;
mod compare_table;
mod completions;
mod control;
mod demo;
mod diagrams;
mod diff;
mod drive;
mod drop;
mod export;
mod finished;
mod inspect;
mod inspect_mesh;
mod inspect_picture;
mod job_file;
mod kept_pictures;
mod layers;
mod left_out;
mod man;
mod merge;
mod operations;
mod order;
mod pictures;
mod plan;
mod plan_summary;
mod post;
mod prototype;
mod reach;
mod render;
mod report;
mod request;
mod sample;
mod shard;
mod simulate;
mod stages;
mod stock;
mod store;
mod stream;
mod subject;
mod sweep;
mod sweep_plot;
mod tools;
mod verify;
mod view;
mod watch;
mod why;

use std::path::Path;
use std::process::ExitCode;

use claymill::ModelFile;
use claymill_exchange::ImportReport;
use claymill_paths::{Axis, Orientation, OrientationGuess};
use claymill_toolpath::{Job, Mirror, RegionsFile};
use claymill_verify::model_of;
use serde::Serialize;

use crate::args::AxisArgs;
use crate::console::Console;
use crate::console::outln;
use crate::failure::Failure;

pub(crate) use animate::animate;
pub(crate) use compare::compare;
pub(crate) use completions::completions;
pub(crate) use control::control;
pub(crate) use demo::demo;
pub(crate) use diff::diff;
pub(crate) use drop::drop;
pub(crate) use inspect::inspect;
pub(crate) use man::man;
pub(crate) use merge::merge;
pub(crate) use order::order;
pub(crate) use plan::plan;
pub(crate) use post::post;
pub(crate) use prototype::prototype_command;
pub(crate) use reach::reach;
pub(crate) use render::render;
pub(crate) use report::report;
pub(crate) use sample::sample;
pub(crate) use shard::shard;
pub(crate) use simulate::simulate;
pub(crate) use stock::stock;
pub(crate) use store::store;
pub(crate) use stream::stream;
pub(crate) use tools::tools;
pub(crate) use verify::verify;
pub(crate) use view::view;

/// What every command gets.
pub(crate) struct Context<'a> {
    pub(crate) console: &'a Console,
    pub(crate) json: bool,
    /// Files that claymill did not write are replaced.
    pub(crate) force: bool,
}

impl Context<'_> {
    /// Reads a model and measures its faces.
    fn load(&self, path: &Path, mirror: Option<Mirror>) -> Result<ModelFile, Failure> {
        self.console.stage("reading");
        let file = claymill::read(path)?;
        let file = match mirror {
            Some(mirror) => {
                say_overlap(self.console, &file, mirror);
                file.mirrored(mirror)
            }
            None => file,
        };
        let report = &file.import.report;
        for warning in &report.warnings {
            self.console.say(format!("warning: {warning}"));
        }
        say_skipped(self.console, report);
        self.console.stage("measuring");
        areas::say_rough(self.console, &report.faces);
        Ok(file)
    }

    /// The model that a job in a folder was planned on, from where it lies now if that is told.
    fn load_of_job(&self, folder: &Path, job: &Job, told: Option<&Path>) -> Result<ModelFile, Failure> {
        self.load(&model_of(folder, job, told)?, job.model.mirror)
    }

    /// Prints a result as JSON on standard output.
    fn print_json(&self, value: &impl Serialize) -> Result<(), Failure> {
        let text = serde_json::to_string_pretty(value)
            .map_err(|e| Failure::problem(format!("the result cannot be written as JSON: {e}"), ""))?;
        outln!("{text}");
        Ok(())
    }
}

/// What a half reaches over its plane, as a share of its width, before it is a whole.
const MOST_OVER: f64 = 0.01;

/// A whole body lies in its own image.
fn say_overlap(console: &Console, file: &ModelFile, Mirror { axis, keeps_model }: Mirror) {
    let (low_mm, high_mm) = (file.bounds.min[axis], file.bounds.max[axis]);
    let over_mm = high_mm.min(-low_mm);
    if keeps_model && over_mm > MOST_OVER * (high_mm - low_mm) {
        console.say(format!(
            "warning: {} lies on both sides of the plane that it is mirrored in, from {low_mm:.1} to {high_mm:.1} mm: \
             faces and images overlap. Leave :both out, or plan without --mirror",
            file.name()
        ));
    }
}

const LISTED: usize = 5;

fn say_skipped(console: &Console, report: &ImportReport) {
    for s in report.skipped.iter().take(LISTED) {
        console.say(format!("skipped {} ({}): {}. {}", s.entity, s.what, s.reason, s.advice));
    }
    if report.skipped.len() > LISTED {
        console
            .say(format!("... and {} more faces skipped; --json lists all", report.skipped.len() - LISTED));
    }
}

/// The vehicle's axes as told, or worked out from the model and printed.
fn orientation(console: &Console, axes: &AxisArgs, loaded: &ModelFile) -> Result<Orientation, Failure> {
    let guess = guess(axes, loaded)?;
    say_axes(console, axes, &guess);
    Ok(guess.orientation)
}

/// Says which axes were not told and are guessed.
fn say_axes(console: &Console, axes: &AxisArgs, guess: &OrientationGuess) {
    let chosen = guess.orientation;
    if axes.up.is_none() || axes.length.is_none() {
        let (label, doubt) =
            if guess.is_likely { ("axes", "") } else { ("warning:", "axes are not certain: ") };
        let text = format!(
            "{doubt}up {}, front {} ({}; --up and --length change them)",
            chosen.up, chosen.front, guess.reason
        );
        console.say_long(label, &text);
    }
}

/// The axes that were told, and what the model says of the others.
pub(crate) fn guess(axes: &AxisArgs, loaded: &ModelFile) -> Result<OrientationGuess, Failure> {
    let (up, front) = told(axes)?;
    Ok(claymill::orientation(loaded, up, front)?)
}

/// The axes that were told.
fn told(axes: &AxisArgs) -> Result<(Option<Axis>, Option<Axis>), Failure> {
    let axis = |text: &Option<String>| text.as_ref().map(|t| t.parse::<Axis>()).transpose();
    Ok((axis(&axes.up)?, axis(&axes.length)?))
}

/// The region of each face of a model of so many faces.
fn region_of_face(regions: &RegionsFile, faces: usize) -> Result<Vec<usize>, Failure> {
    let mut of_face = vec![0; faces];
    for r in &regions.regions {
        for &face in &r.faces {
            *of_face.get_mut(face).ok_or_else(|| {
                Failure::problem(
                    format!("regions.json names face {face}, the model has {faces}"),
                    "The model has changed since: plan the job again.",
                )
            })? = r.id;
        }
    }
    Ok(of_face)
}

/// `claymill schema`.
pub(crate) fn schema() -> Result<ExitCode, Failure> {
    let schemas = serde_json::json!({
        claymill_toolpath::JOB_FILE: schemars::schema_for!(claymill_toolpath::Job),
        claymill_toolpath::REGIONS_FILE: schemars::schema_for!(claymill_toolpath::RegionsFile),
        claymill_toolpath::TOOLPATHS_FILE: schemars::schema_for!(claymill_toolpath::Move),
        "machine.toml": claymill_controller::Machine::schema(),
        claymill_toolpath::VERIFY_FILE: schemars::schema_for!(claymill_verify::Verification),
    });
    outln!("{schemas:#}");
    Ok(ExitCode::SUCCESS)
}
