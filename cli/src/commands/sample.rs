use std::path::{Path, PathBuf};
use std::process::ExitCode;

use claymill_models::{RoadsterOptions, Sample, roadster};

use super::Context;
use crate::args::SampleArgs;
use crate::failure::Failure;

/// `claymill sample`.
pub(crate) fn sample(context: &Context, args: &SampleArgs) -> Result<ExitCode, Failure> {
    if args.name != "roadster" {
        return Err(Failure::usage(format!("there is no sample `{}`", args.name), "There is: roadster."));
    }
    context.console.stage("generating");
    let made = write_roadster(args.patches, args.seed, &args.out)?;
    context.console.finish();
    let totals = &made.answers.totals;
    if context.json {
        context.print_json(totals)?;
    } else {
        context.console.say(format!(
            "{}: {} patches in {} regions; answers in {}",
            args.out.display(),
            totals.faces,
            totals.regions,
            answers_path(&args.out).display()
        ));
    }
    Ok(ExitCode::SUCCESS)
}

/// Where the planted answers of a sample go.
pub(crate) fn answers_path(model: &Path) -> PathBuf {
    model.with_extension("answers.json")
}

/// Writes the built-in vehicle and its answers.
pub(crate) fn write_roadster(patches: usize, seed: u64, path: &Path) -> Result<Sample, Failure> {
    if !(100..=100_000).contains(&patches) {
        let message = format!("{patches} patches: the vehicle can be cut into 100 to 100000");
        return Err(Failure::usage(message, "Choose --patches in that range."));
    }
    let sample = roadster(&RoadsterOptions { patches, seed });
    let advice = "Choose a place that you may write to.";
    if let Some(parent) = path.parent() {
        std::fs::create_dir_all(parent)
            .map_err(|e| Failure::problem(format!("{}: {e}", parent.display()), advice))?;
    }
    claymill_exchange::write_iges(path, &sample.model, &[])
        .map_err(|e| Failure::problem(e, advice))?;
    let answers = answers_path(path);
    let text = serde_json::to_vec_pretty(&sample.answers)
        .map_err(|e| Failure::problem(format!("the answers cannot be written as JSON: {e}"), ""))?;
    std::fs::write(&answers, text)
        .map_err(|e| Failure::problem(format!("{}: {e}", answers.display()), advice))?;
    Ok(sample)
}
