//! `claymill plan`: the main job, from the model file to the finished folder.

use std::path::Path;
use std::process::ExitCode;

use claymill::{Finished, ObstacleFile, Verified};
use claymill_toolpath::{Area, FolderWriter, Job, PartCount, Program, REPORT_FILE, Totals};
use claymill_verify::{Verdict, Verification};
use claymill_viewer::ReportPicture;
use serde::Serialize;

use super::job_file::{self, JOB_TOML};
use super::request::Request;
use super::stages::StockState;
use super::watch::watch;
use super::{Context, kept_pictures, left_out, operations, plan_summary, report, say_axes, verify};
use crate::args::{PlanArgs, ReuseArgs};
use crate::console::{Console, counted, peak_memory_mb};
use crate::failure::Failure;
use crate::reuse::Reuse;
use crate::{interrupt, material};

/// What is of interest after a job.
pub(crate) struct Done {
    pub(crate) region_of_face: Vec<usize>,
    pub(crate) exit: ExitCode,
    pub(crate) job: Job,
    pub(crate) program: Program,
    pub(crate) found: Verification,
    pub(crate) scallop_map: Option<ReportPicture>,
}

/// What `claymill plan --json` prints: the totals, and what came of them.
#[derive(Serialize)]
struct Summary<'a> {
    folder: &'a Path,
    passed: bool,
    verdict: &'a Verdict,
    area: &'a Area,
    /// Of the plan, where a store keeps them.
    #[serde(skip_serializing_if = "Option::is_none")]
    parts: Option<PartCount>,
    #[serde(flatten)]
    totals: &'a Totals,
}

/// `claymill plan`.
pub(crate) fn plan(context: &Context, args: &PlanArgs) -> Result<ExitCode, Failure> {
    if args.watch { watch(context, args, once) } else { once(context, args) }
}

fn once(context: &Context, args: &PlanArgs) -> Result<ExitCode, Failure> {
    if let Some(job) = operations::asked(args)? {
        return Ok(operations::run(context, &args.model, job, &args.out, &args.reuse)?.exit);
    }
    let options = job_file::with(args.job.options(), args.job_file.as_deref())?;
    let request = Request::new(&args.model, &options)?;
    Ok(run(context, &request, &args.out, &args.reuse)?.exit)
}

/// The main job, from the model file to the finished folder.
pub(crate) fn run(
    context: &Context,
    request: &Request,
    out: &Path,
    reuse: &ReuseArgs,
) -> Result<Done, Failure> {
    let console = context.console;
    let folder = FolderWriter::begin(out)?;
    interrupt::remove_on_interrupt(folder.leftovers());
    let reuse = Reuse::new(reuse, out, console)?;
    let loaded = context.load(&request.model, request.options.mirror)?;
    let faces = loaded.model().faces.len();

    console.stage("merging");
    let mut job = request.job.clone();
    job.passes.kept = reuse.kept.clone();
    let prepared = job.prepare(&loaded)?;
    let orientation = prepared.orientation().orientation;
    say_axes(console, &request.options.axes, prepared.orientation());
    let regions = &prepared.merged().record;
    console.say(format!(
        "regions   {} in {}, {}",
        counted(faces, "face"),
        counted(regions.regions.len(), "region"),
        counted(regions.joints.len(), "joint")
    ));

    console.stage("planning");
    material::say(console, &regions.sheets, prepared.excluded());
    plan_summary::warn_of_much(console, prepared.options(), prepared.excluded(), &loaded.face_area_mm2);
    prepared.obstacles().iter().for_each(|obstacle| say_obstacle(console, obstacle));
    let planned = prepared.plan(console)?;
    left_out::say(console, &planned.left_out());
    plan_summary::say_plan(console, planned.plan());

    console.stage("writing");
    folder.text(JOB_TOML, &job_file::text(request, orientation)?)?;

    console.stage("verifying");
    let plan = planned.plan();
    verify::expect(console, plan.program.moves.len(), plan.totals.passes, faces);
    let verified = planned.verify_into(folder, console)?;
    finish(context, verified, &[], out, &reuse)
}

/// Verdict, pictures and report of a job that was verified; then its folder is put into place.
pub(super) fn finish(
    context: &Context,
    mut verified: Verified<'_>,
    states: &[StockState],
    out: &Path,
    reuse: &Reuse,
) -> Result<Done, Failure> {
    let console = context.console;
    say_stick_outs(console, &verified);
    verify::say(context, &verified.results().verification);

    console.stage("pictures");
    let sights =
        kept_pictures::take_or_know(console, &verified.finished(), states, verified.path(), &reuse.kept)?;
    reuse.say(console);
    verified.measured(console.finish(), peak_memory_mb());
    report::write(&verified.finished(), &sights, verified.path(), out)?;
    let Finished { region_of_face, .. } = verified.finished();
    let region_of_face = region_of_face.to_vec();
    let (results, kept) = verified.write()?;
    if let Some(kept) = kept {
        console.say(format!("kept      what came into the folder meanwhile: {}", kept.display()));
    }
    let (job, found) = (results.job, results.verification);
    let seconds: f64 = job.timings.iter().map(|t| t.seconds).sum();
    console.say(format!("job       {} ({seconds:.1} s, {:.0} MB)", out.display(), job.peak_memory_mb));
    console.say(format!("report    {}", out.join(REPORT_FILE).display()));
    if context.json {
        context.print_json(&Summary {
            folder: out,
            passed: found.verdict.passed,
            verdict: &found.verdict,
            area: &job.area,
            parts: reuse.count(),
            totals: &job.totals,
        })?;
    }
    Ok(Done {
        exit: verify::exit_code(&found),
        region_of_face,
        scallop_map: sights.scallop_map().cloned(),
        job,
        program: results.program,
        found,
    })
}

/// Says how far the tool sticks out in each setup, where that was left to the paths.
fn say_stick_outs(console: &Console, verified: &Verified<'_>) {
    let holder = verified.results().job.tools.iter().find_map(|tool| tool.holder.clone());
    for (stick_out, mut holder) in verified.stick_outs().iter().zip(std::iter::repeat(holder).flatten()) {
        holder.stick_out_mm = stick_out.taken_mm;
        console.say(format!(
            "holder    {}: {holder}, {:.2} mm of stick-out are needed, {} mm are taken",
            stick_out.setup, stick_out.needed_mm, stick_out.taken_mm
        ));
    }
}

/// Says what of an obstacle is guarded.
fn say_obstacle(console: &Console, ObstacleFile { path, mesh, .. }: &ObstacleFile) {
    let name = path.display();
    if mesh.open_edges() > 0 {
        console
            .say(format!("warning: {name} has {} open edges: nothing guards its inside", mesh.open_edges()));
    }
    let size = mesh.bounds().max - mesh.bounds().min;
    console.say(format!(
        "obstacle  {name}: {} triangles, {:.1} x {:.1} x {:.1} mm",
        mesh.triangles.len(),
        size.x,
        size.y,
        size.z
    ));
}
