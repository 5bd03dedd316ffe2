//! `claymill sample`: writes a generated model, with flaws planted on request, and its answers.

use std::path::Path;
use std::process::ExitCode;

use claymill_models::{Flaw, RoadsterOptions, SAMPLES, Sample, SampleError, generate, roadster_edited};
use claymill_toolpath::Kind;

use super::Context;
use crate::args::SampleArgs;
use crate::failure::Failure;
use crate::output;

/// Beyond this the wing would leave the panels around it.
const LARGEST_EDIT_MM: f64 = 20.0;

/// `claymill sample`.
pub(crate) fn sample(context: &Context, args: &SampleArgs) -> Result<ExitCode, Failure> {
    context.console.stage("generating");
    let made = write(context, &Asked::of(args), &args.out)?;
    context.console.finish();
    let totals = &made.answers.totals;
    if context.json {
        context.print_json(totals)?;
    } else {
        let (faces, regions) = (totals.faces, totals.regions);
        context
            .console
            .say(format!("{}: {faces} patches in {regions} regions; answers beside it", args.out.display()));
        for planted in &made.answers.flaws {
            let (joints, metres) = (planted.joints.len(), 1e-3 * planted.length_mm);
            context.console.say(format!("planted {}: {joints} joints, {metres:.3} m", planted.flaw));
        }
    }
    Ok(ExitCode::SUCCESS)
}

/// Which model is generated, and how.
pub(crate) struct Asked<'a> {
    pub(crate) name: &'a str,
    pub(crate) patches: usize,
    pub(crate) seed: u64,
    pub(crate) scale: f64,
    pub(crate) flaws: &'a [Flaw],
    /// How far the roadster's wing is moved, mm.
    pub(crate) edit_mm: Option<f64>,
}

impl<'a> Asked<'a> {
    fn of(args: &'a SampleArgs) -> Self {
        let SampleArgs { name, patches, seed, scale, flaws, edit, .. } = args;
        Asked { name, patches: *patches, seed: *seed, scale: *scale, flaws, edit_mm: *edit }
    }
}

/// Writes a generated model and its answers.
pub(crate) fn write(context: &Context, asked: &Asked, path: &Path) -> Result<Sample, Failure> {
    let &Asked { name, patches, seed, scale, flaws, edit_mm } = asked;
    if !(200..=100_000).contains(&patches) {
        let message = format!("{patches} patches: a sample can be cut into 200 to 100000");
        return Err(Failure::usage(message, "Choose --patches in that range."));
    }
    if !(0.01..=100.0).contains(&scale) {
        let message = format!("a scale of {scale} is out of range");
        return Err(Failure::usage(message, "Choose --scale between 0.01 and 100, for example 0.4."));
    }
    if !SAMPLES.contains(&name) {
        let message = format!("there is no sample `{name}`");
        return Err(Failure::usage(message, format!("There are: {}.", SAMPLES.join(", "))));
    }
    if edit_mm.is_some_and(|mm| !(name == "roadster" && mm.abs() <= LARGEST_EDIT_MM)) {
        let message = format!("--edit moves a wing of the roadster by at most {LARGEST_EDIT_MM} mm");
        return Err(Failure::usage(message, "For example: claymill sample roadster --edit -o edited.igs"));
    }
    let advice = "Choose a place that you may write to.";
    output::make_parent(path)?;
    let out = output::begin(context, path, Kind::Model, &[])?;
    if out.is_stream() {
        return Err(Failure::usage("a sample is two files", "Name a file with -o."));
    }
    let staged = out.staged();
    let answers = staged.with_extension("answers.json").file_name().unwrap_or_default().to_owned();
    out.check_beside(&answers, Kind::Json)?;
    let problem = |e| Failure::problem(e, advice);
    let options = RoadsterOptions { patches, seed };
    let sample = match edit_mm {
        // Of the finished model, whatever its scale.
        Some(mm) => roadster_edited(&options, mm / scale),
        None => generate(name, &options, flaws).map_err(|e| match e {
            SampleError::Flaw(flaw) => Failure::usage(flaw, "See `claymill sample --help`."),
            other => problem(other),
        })?,
    };
    let sample = sample.scaled(scale);
    output::staged(&out, path, |staged| sample.write(staged).map_err(problem))?;
    let model = out.name().to_owned();
    out.finish_all(&[(model, Kind::Model), (answers, Kind::Json)])?;
    Ok(sample)
}
