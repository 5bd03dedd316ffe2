//! `claymill verify`: the written files measured again, and the verdict told and kept.

use std::path::Path;
use std::process::ExitCode;

use claymill_toolpath::{Holder, MoveKind, Renewal, VERIFY_FILE, read_job, write_whole};
use claymill_verify::stock::{StockReport, VolumeEstimate};
use claymill_verify::{
    BallShare, BoundsKept, HolderClearance, LevelsFound, Severity, TooTight, Verification, VerifyOptions,
};

use super::{Context, post, request};
use crate::args::{VerifyArgs, check_clearance};
use crate::console::{Console, Tone};
use crate::failure::{Failure, NOT_PASSED};
use crate::interrupt;

impl From<claymill_verify::VerifyError> for Failure {
    fn from(error: claymill_verify::VerifyError) -> Self {
        Failure::problem(&error, error.advice())
    }
}

/// `claymill verify`.
pub(crate) fn verify(context: &Context, args: &VerifyArgs) -> Result<ExitCode, Failure> {
    let holder = args.holder.as_deref().map(|text| holder(&args.folder, text)).transpose()?;
    let options = VerifyOptions {
        holder,
        holder_clearance_mm: request::holder_clearance(args.holder_clearance)?,
        model: args.model.clone(),
        obstacles: args.check.clone(),
        obstacle_unit_mm: args.mesh_unit,
        check_clearance_mm: check_clearance(args.check_clearance)?,
        ..VerifyOptions::default()
    };
    // A verdict on what the job itself asks for stays with it; one on something else is only told.
    let as_planned = args.program.is_empty()
        && args.check.is_empty()
        && options.holder.is_none()
        && options.holder_clearance_mm.is_none()
        && options.check_clearance_mm.is_none();
    let found = if args.program.is_empty() {
        context.console.stage("verifying");
        claymill_verify::verify(&args.folder, &options, context.console)?
    } else {
        program(context, args, options)?
    };
    context.console.finish();
    if as_planned {
        keep(context, &args.folder, &found);
    }
    if context.json {
        context.print_json(&found)?;
    } else {
        say(context, &found);
    }
    Ok(exit_code(&found))
}

/// Puts the verdict into the folder where another one is there, or none.
fn keep(context: &Context, folder: &Path, found: &Verification) {
    let path = folder.join(VERIFY_FILE);
    let known = std::fs::read(&path).ok().and_then(|text| serde_json::from_slice::<Verification>(&text).ok());
    if known.as_ref() == Some(found) {
        return;
    }
    let kept = Renewal::begin(folder, &[VERIFY_FILE]).map_err(Failure::from).and_then(|renewal| {
        interrupt::remove_on_interrupt(renewal.leftovers());
        write(renewal.path(), found)?;
        Ok(renewal.finish()?)
    });
    if let Err(failure) = kept {
        context.console.say(format!("warning: the verdict is not kept in the folder: {}", failure.message()));
    }
}

/// Writes `verify.json` into a folder.
pub(crate) fn write(folder: &Path, found: &Verification) -> Result<(), Failure> {
    let path = folder.join(VERIFY_FILE);
    let mut text = serde_json::to_vec_pretty(found)
        .map_err(|e| Failure::problem(format!("the verdict cannot be written as JSON: {e}"), ""))?;
    text.push(b'\n');
    write_whole(&path, &text).map_err(Failure::at(&path))
}

/// The holder as written on the command line, for the tool of a job.
fn holder(folder: &Path, text: &str) -> Result<Holder, Failure> {
    request::holder(text, &read_job(folder)?.request.tool)
}

/// The moves as the control will see them. What the post may use up comes on top of what a pass may lie high.
fn program(
    context: &Context,
    args: &VerifyArgs,
    mut options: VerifyOptions,
) -> Result<Verification, Failure> {
    let machine = post::machine(args.machine.as_deref())?;
    let (job, dialect) =
        post::written(context, &args.folder, args.dialect.as_deref(), &args.program, &machine)?;
    let (program, comparison) = claymill_controller::moves_of(&job, &args.program, dialect, &machine)?;
    context.console.say(format!(
        "program   {dialect}: {} moves in {} blocks, {} missing, {} blocks beside the job; largest difference from \
         the job {:.6} mm at line {} (move {})",
        comparison.moves,
        comparison.elements,
        comparison.missing,
        comparison.added,
        comparison.largest_mm,
        comparison.largest_line,
        comparison.largest_seq
    ));
    options.excess_limit_mm += machine.tolerance_mm;
    context.console.stage("verifying");
    Ok(claymill_verify::verify_instead(&args.folder, &program, &options, context.console)?)
}

/// 0 when every bar was met, 3 when a finding is an error.
pub(crate) fn exit_code(found: &Verification) -> ExitCode {
    if found.verdict.passed { ExitCode::SUCCESS } else { ExitCode::from(NOT_PASSED) }
}

/// Findings that are printed; the rest is in `verify.json` and the report.
const FINDINGS_SAID: usize = 4;

/// Tells the console what the parts of a verification have to do.
pub(crate) fn expect(console: &Console, moves: usize, passes: u32, faces: usize) {
    console.expect("gouge and contact", moves as u64, "moves");
    console.expect("scallop crests", u64::from(passes), "passes");
    console.expect("coverage", faces as u64, "faces");
}

/// How near the holder comes, and what it needs.
fn say_holder(holder: &HolderClearance) -> String {
    let clear = match holder.clearance_min_mm {
        Some(mm) if mm > 0.0 => format!("clear by {mm:.2} mm"),
        Some(_) => format!("touches on {} moves", holder.touching),
        None => "nothing comes near".to_owned(),
    };
    let least = |setup: &str| {
        let (needed_mm, given_mm) = (holder.stick_out_needed_mm(Some(setup))?, holder.stick_out_mm(setup)?);
        Some(format!("{setup} {needed_mm:.2} of {given_mm} mm"))
    };
    let least: Vec<String> = holder.setups().into_iter().filter_map(least).collect();
    format!("holder: {clear}; stick-out that keeps {} mm: {}", holder.asked_mm, least.join(", "))
}

/// Whether the tool stays where it was to be kept.
fn say_bounds(bounds: &BoundsKept) -> String {
    let beyond = match bounds.beyond {
        0 => "the tool stays inside".to_owned(),
        moves => format!("left by up to {:.3} mm on {moves} moves", bounds.beyond_max_mm),
    };
    let avoided = match (bounds.avoid_mm, bounds.avoided_min_mm) {
        (Some(asked), Some(least)) => {
            format!("; {least:.3} mm away from what is avoided, asked for were {asked}")
        }
        (Some(_), None) => "; never near to what is avoided".to_owned(),
        (None, _) => String::new(),
    };
    format!("bounds: {beyond}{avoided}")
}

/// What a smaller ball would find.
fn say_tight(tight: &TooTight) -> String {
    let fitting = |ball: &BallShare| format!("{} mm {:.0} %", ball.radius_mm, 100.0 * ball.share);
    let balls: Vec<String> = tight.balls.iter().map(fitting).collect();
    format!(
        "too tight: strips {:.1} mm wide (median; 95 % up to {:.1}); balls that fit: {}",
        tight.width_median_mm,
        tight.width_p95_mm,
        balls.join(", ")
    )
}

/// The measurement on a few lines.
pub(crate) fn say(context: &Context, found: &Verification) {
    let (gouge, contact, crests) = (&found.gouge, &found.contact, &found.scallop.crests);
    let console = context.console;
    // Levels leave stairs: they rest on no face, and have no scallops.
    let has_passes = found.operations.is_empty() || found.operations.iter().any(|o| o.levels.is_none());
    let resting = if has_passes {
        format!(
            "; contact on faces {} (worst +{:.2} µm, on rims +{:.2} µm)",
            contact.within_limits(),
            contact.excess_max_mm * 1e3,
            contact.edge_excess_max_mm * 1e3
        )
    } else {
        String::new()
    };
    let left = if has_passes {
        format!(
            "scallop crests: max {:.4}, p99 {:.4}, mean {:.4} mm; ",
            crests.max_mm, crests.p99_mm, crests.mean_mm
        )
    } else {
        String::new()
    };
    console.say_long(
        "verified",
        &format!("deepest gouge {:.2} µm in {} samples{resting}", gouge.deepest_mm * 1e3, gouge.samples),
    );
    console.say_long(
        "",
        &format!(
            "{left}rapids clear by {} mm of the finished model{}",
            found.rapids.clearance_min_mm.map_or_else(|| "-".to_owned(), |c| format!("{c:.2}")),
            if found.stock.is_some() { "" } else { " (stock is not known)" }
        ),
    );
    if let Some(stock) = &found.stock {
        say_stock(console, stock);
    }
    for (name, levels) in found.operations.iter().filter_map(|o| Some((&o.name, o.levels.as_ref()?))) {
        console.say_long("", &say_levels(name, levels));
    }
    if let Some(near) = &found.obstacles {
        let clearance =
            near.clearance_min_mm.map_or_else(|| "never near".to_owned(), |c| format!("{c:.4} mm"));
        let (files, triangles) = (near.files.len(), near.triangles);
        console.say_long(
            "",
            &format!(
                "obstacles: {files} files, {triangles} triangles; smallest distance {clearance}, asked for were {} mm",
                near.asked_mm
            ),
        );
    }
    if let Some(bounds) = found.bounds.as_ref().filter(|b| b.samples > 0) {
        console.say_long("", &say_bounds(bounds));
    }
    if let Some(holder) = &found.holder {
        console.say_long("", &say_holder(holder));
    }
    if let Some(tight) = &found.coverage.too_tight {
        console.say_long("", &say_tight(tight));
    }
    let findings = &found.verdict.findings;
    for f in findings.iter().take(FINDINGS_SAID) {
        let sign = if f.severity == Severity::Error { "FAILED" } else { "note" };
        console.say_long("", &format!("{sign}: {}", f.message));
    }
    if findings.len() > FINDINGS_SAID {
        console
            .say_long("", &format!("and {} more findings: see verify.json", findings.len() - FINDINGS_SAID));
    }
    let (tone, words) = if found.verdict.passed { (Tone::Good, "PASSED") } else { (Tone::Bad, "NOT PASSED") };
    console.say_verdict(tone, words);
}

/// How far around a tool cuts on levels, and what these leave.
fn say_levels(name: &str, found: &LevelsFound) -> String {
    let largest = found.engagement.largest.as_ref().map_or(0.0, |pose| pose.angle_deg);
    let [low_mm, high_mm] = found.left.band_mm;
    format!(
        "{name}: engagement {largest:.1}° at most, {}° were allowed; of what the levels reach {:.2} % have {low_mm:.3} to \
         {high_mm:.2} mm of stock, {:.2} % more",
        found.asked.engagement_deg,
        100.0 * found.left.within,
        100.0 * found.left.above
    )
}

/// What the whole program does to its stock.
fn say_stock(console: &Console, stock: &StockReport) {
    let litres =
        |volume: &VolumeEstimate| format!("{:.3} ± {:.3} l", volume.mm3 * 1e-6, volume.plus_minus_mm3 * 1e-6);
    let rapids = stock.clear.get(&MoveKind::Rapid).cloned().unwrap_or_default();
    console.say_long(
        "",
        &format!(
            "stock: {} at first, {} removed; {} of {} rapids and {} of {} shanks and holders run through it, {} and {} are undecided",
            litres(&stock.volumes.initial),
            litres(&stock.volumes.removed),
            rapids.touching,
            rapids.moves,
            stock.body.touching,
            stock.body.moves,
            rapids.undecided,
            stock.body.undecided
        ),
    );
}
