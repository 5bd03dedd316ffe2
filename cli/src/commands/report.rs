//! `claymill report`: a job verified again and its report written anew.

use std::path::Path;
use std::process::ExitCode;

use claymill::{Finished, seconds_of_moves};
use claymill_toolpath::{Job, REPORT_FILE, Renewal, VERIFY_FILE, read_job, read_moves_judged, read_regions};
use claymill_verify::{CRESTS_FILE, Verification, VerifyOptions, verify_with_crests, write_crests};
use claymill_viewer::{ReportError, ReportInput, write_report};

use super::finished::{quoted, title};
use super::job_file::JOB_TOML;
use super::{Context, orientation, pictures, region_of_face, stages};
use crate::args::{AxisArgs, ReportArgs};
use crate::failure::Failure;
use crate::interrupt;

/// What `claymill report` writes into a job folder.
const MADE_ANEW: [&str; 8] = [
    REPORT_FILE,
    VERIFY_FILE,
    CRESTS_FILE,
    "preview-iso.png",
    "preview-top.png",
    "preview-side.png",
    "regions-iso.png",
    "scallop-iso.png",
];

/// `claymill report`.
pub(crate) fn report(context: &Context, args: &ReportArgs) -> Result<ExitCode, Failure> {
    let folder = &args.folder;
    let (job, regions) = (read_job(folder)?, read_regions(folder)?);
    let renewal = Renewal::begin(folder, &MADE_ANEW)?;
    interrupt::remove_on_interrupt(renewal.leftovers());
    let loaded = context.load_of_job(folder, &job, args.model.as_deref())?;
    let model = &loaded.import.model;
    let axes = AxisArgs { up: Some(job.request.up.clone()), length: Some(job.request.length.clone()) };
    let orientation = orientation(context.console, &axes, &loaded)?;
    let region_of_face = region_of_face(&regions, model.faces.len())?;
    let (program, judged) = read_moves_judged(folder, &job)?;

    context.console.stage("verifying");
    super::verify::expect(context.console, program.moves.len(), job.totals.passes, model.faces.len());
    let options = VerifyOptions { folder: folder.clone(), ..VerifyOptions::default() };
    let (found, crests) = verify_with_crests(model, &job, &program, &options, context.console)?;
    let found = Verification { judged: Some(judged.clone()), ..found };
    write_crests(renewal.path(), &judged, &crests)?;
    super::verify::write(renewal.path(), &found)?;
    context.console.stage("pictures");
    let finished = Finished {
        model,
        job: &job,
        regions: &regions,
        region_of_face: &region_of_face,
        program: &program,
        seconds: &seconds_of_moves(&job, &program),
        found: &found,
        crests: &crests,
        orientation,
    };
    let states = stages::of_job(context.console, finished.model, (finished.job, folder), finished.program)?;
    let renderer = pictures::renderer(context.console);
    let sights = pictures::take(context.console, renderer.as_ref(), &finished, &states, renewal.path())?;
    write(&finished, &sights, renewal.path(), folder)?;
    renewal.finish()?;
    context.console.finish();
    let page = folder.join(REPORT_FILE);
    context.console.say(format!("report    {}", page.display()));
    if context.json {
        context.print_json(
            &serde_json::json!({ "report": page.display().to_string(), "passed": found.verdict.passed }),
        )?;
    }
    Ok(super::verify::exit_code(&found))
}

/// Writes the report of a job that will lie in `out` into `folder`.
pub(crate) fn write(
    finished: &Finished<'_>,
    sights: &pictures::Sights,
    folder: &Path,
    out: &Path,
) -> Result<(), Failure> {
    let input = ReportInput {
        title: &title(finished.job),
        command: &command(finished.job, out),
        job: finished.job,
        regions: finished.regions,
        verification: Some(finished.found),
        region_colours: &sights.colours,
        thumbnails: &sights.thumbnails,
        program: finished.program,
        seconds: finished.seconds,
        sheets: &sights.sheets,
        pictures: &sights.shots,
        space: Some(&sights.space),
    };
    let written = write_report(&folder.join(REPORT_FILE), &input);
    Ok(written.map_err(|ReportError::Write(e)| e)?)
}

/// The command line that makes the job again: its own job file holds every option that was chosen or guessed.
fn command(job: &Job, out: &Path) -> String {
    let (options, out) = (out.join(JOB_TOML).display().to_string(), out.display().to_string());
    ["claymill", "plan", &job.model.path, "--job", &options, "-o", &out].map(quoted).join(" ")
}
