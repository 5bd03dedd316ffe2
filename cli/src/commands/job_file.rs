//! The job as a TOML file: what `--job` takes and every job folder holds.

use std::path::Path;

use claymill_paths::Orientation;
use claymill_toolpath::{LONGEST_WRITTEN, read_plain_text};

use super::request::{LEAST, Request};
use crate::args::{AxisArgs, JobOptions, StrategyName, first_given};
use crate::failure::Failure;

/// Name of the job file that `plan` writes beside its results.
pub(crate) const JOB_TOML: &str = "job.toml";

/// These options before those of a job file, where one is given.
pub(crate) fn with(options: JobOptions, file: Option<&Path>) -> Result<JobOptions, Failure> {
    Ok(match file {
        Some(file) => over(options, read(file)?),
        None => options,
    })
}

/// The text of a job file.
pub(super) fn read_text(file: &Path) -> Result<String, Failure> {
    read_plain_text(file, LONGEST_WRITTEN).map_err(Failure::at(file))
}

/// The options in a job file.
pub(crate) fn read(file: &Path) -> Result<JobOptions, Failure> {
    let text = read_text(file)?;
    toml::from_str(&text).map_err(|e| {
        Failure::problem(
            format!("{}: {e}", file.display()),
            "`claymill plan --help` lists the options; a job file has the same names.",
        )
    })
}

/// Options of the command line before those of the file.
pub(super) fn over(first: JobOptions, second: JobOptions) -> JobOptions {
    JobOptions {
        tool: first.tool.or(second.tool),
        tool_number: first.tool_number.or(second.tool_number),
        holder: first.holder.or(second.holder),
        holder_clearance: first.holder_clearance.or(second.holder_clearance),
        rest_of: first.rest_of.or(second.rest_of),
        allowance: first.allowance.or(second.allowance),
        rest_above: first.rest_above.or(second.rest_above),
        stock_above: first.stock_above.or(second.stock_above),
        cut: first.cut.or(second.cut),
        step_down: first.step_down.or(second.step_down),
        dead_centre: first.dead_centre.or(second.dead_centre),
        ramp: first.ramp.or(second.ramp),
        engagement: first.engagement.or(second.engagement),
        band: first.band.or(second.band),
        pencil: first.pencil || second.pencil,
        scallop: first.scallop.or(second.scallop),
        strategy: first.strategy.or(second.strategy),
        steep: first.steep.or(second.steep),
        lines: first.lines.or(second.lines),
        guide: first_given(first.guide, second.guide),
        angle: first.angle.or(second.angle),
        link: first.link.or(second.link),
        preset: first.preset.or(second.preset),
        mirror: first.mirror.or(second.mirror),
        only: first_given(first.only, second.only),
        skip: first_given(first.skip, second.skip),
        setups: first_given(first.setups, second.setups),
        setup: first_given(first.setup, second.setup),
        material_side: first_given(first.material_side, second.material_side),
        bounds: first.bounds.over(second.bounds),
        check: first_given(first.check, second.check),
        mesh_unit: first.mesh_unit.or(second.mesh_unit),
        check_clearance: first.check_clearance.or(second.check_clearance),
        rapid_clearance: first.rapid_clearance.or(second.rapid_clearance),
        feed: first.feed.or(second.feed),
        machine: first.machine.or(second.machine),
        merging: first.merging.or(second.merging),
        axes: crate::args::AxisArgs {
            up: first.axes.up.or(second.axes.up),
            length: first.axes.length.or(second.axes.length),
        },
    }
}

/// A job as the text of a job file, with every default filled in. What is found from the paths stays as it was asked for.
pub(crate) fn text(request: &Request, orientation: Orientation) -> Result<String, Failure> {
    let (job, passes) = (&request.job, &request.job.passes);
    let holder = job.holder.as_ref().map(ToString::to_string);
    let least = |text: String| text.split_once(':').map(|(_, sections)| format!("{LEAST}:{sections}"));
    let whole = JobOptions {
        tool: Some(passes.tool.to_string()),
        holder: if job.least_stick_out { holder.and_then(least) } else { holder },
        holder_clearance: job.holder.as_ref().map(|_| job.holder_clearance_mm),
        scallop: Some(passes.scallop_mm),
        strategy: Some(request.strategy),
        steep: (request.strategy == StrategyName::SteepShallow).then_some(passes.steep_deg),
        link: Some(passes.link.into()),
        preset: Some(request.preset),
        check_clearance: (!request.options.check.is_empty()).then_some(passes.check_clearance_mm),
        rapid_clearance: Some(passes.clearance_mm),
        feed: Some(passes.feeds.cut_mm_per_min),
        axes: AxisArgs { up: Some(orientation.up.to_string()), length: Some(orientation.front.to_string()) },
        ..request.options.clone()
    };
    toml_text(&whole)
}

/// Options as the text of a job file.
pub(crate) fn toml_text(options: &JobOptions) -> Result<String, Failure> {
    toml::to_string(options)
        .map_err(|e| Failure::problem(format!("the job cannot be written as TOML: {e}"), ""))
}
