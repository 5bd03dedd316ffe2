//! `claymill prototype`: a part from a bar on a rotary axis, without a decision in between.

use std::fmt::Write as _;
use std::path::Path;
use std::process::ExitCode;

use claymill::reaching::Stiffness;
use claymill::{Job, JobFolder, Merging, ModelFile, Prototype, PrototypeAsked, ReachAsked, prototype};
use claymill_controller::Dialect;
use claymill_exchange::write_step;
use claymill_paths::{Axis, Strategy};
use claymill_tooling::{ReadOptions, read_library};
use claymill_toolpath::{Bounds, FolderWriter, Holder, Kind, Tool};

use super::post::machine;
use super::reach::rotary;
use super::{Context, left_out, plan, plan_summary, request, verify};
use crate::args::PrototypeArgs;
use crate::console::{counted, outln};
use crate::failure::Failure;
use crate::reuse::Reuse;
use crate::{interrupt, output};

const USUAL_TOOL: &str = "ball:3";
/// Files of the folder.
const HELD: &str = "held.stp";
const REACH: &str = "reach.json";
const SHEET: &str = "setup-sheet.md";
const JOB: &str = "job";
const PROGRAM: &str = "part.ngc";

/// `claymill prototype`.
pub(crate) fn prototype_command(context: &Context, args: &PrototypeArgs) -> Result<ExitCode, Failure> {
    let asked = asked(args)?;
    let machine = args.machine.as_deref().map(|path| machine(Some(path))).transpose()?;
    let loaded = context.load(&args.part)?;
    context.console.stage("looking for material");
    let mut merged = claymill::merge(&loaded, &Merging::default())?;
    merged.find_sides(&loaded, Axis { index: 2, negative: false }.vector(), &[])?;
    context.console.stage("looking from all angles");
    let found = prototype(&loaded, &merged, &asked, context.console).map_err(claymill::Error::from)?;
    std::fs::create_dir_all(&args.out).map_err(|e| {
        Failure::problem(format!("{}: {e}", args.out.display()), crate::failure::advice_on(&e))
    })?;
    let inputs = std::slice::from_ref(&args.part);
    let held = args.out.join(HELD);
    let out = output::begin(context, &held, Kind::Model, inputs)?;
    output::staged(&out, &held, |staged| {
        write_step(staged, &found.model, &[])
            .map_err(|e| Failure::problem(e, "This is a fault: please report it."))
    })?;
    out.finish(Kind::Model)?;
    let text = serde_json::to_string_pretty(&found.found.record)
        .map_err(|e| Failure::problem(format!("the result cannot be written as JSON: {e}"), ""))?;
    output::write(
        output::begin(context, &args.out.join(REACH), Kind::Json, inputs)?,
        Kind::Json,
        text.as_bytes(),
    )?;
    let mut sheet = sheet(&found, &loaded, args, &asked);
    let mut exit = ExitCode::SUCCESS;
    if !args.no_passes {
        let job_folder = args.out.join(JOB);
        exit = passes(context, (&held, &job_folder), &found, &asked, args.scallop)?;
        if let Some(machine) = &machine {
            let program = args.out.join(PROGRAM);
            // The sheet is of use even where the job did not pass: it says why there is no program.
            match JobFolder::open(&job_folder)?.cleared() {
                Ok(cleared) => {
                    let totals = cleared.post(Dialect::LinuxCnc29, machine, &program)?;
                    let files = counted(totals.files.len(), "file");
                    let _ = writeln!(sheet, "\nProgram: `{PROGRAM}`, {files} for {}.", machine.name);
                    context.console.say(program.display());
                }
                Err(refusal) => {
                    let _ = writeln!(sheet, "\nNo program: {refusal}.");
                    context.console.say(format!("no program: {refusal}"));
                }
            }
        }
    }
    let path = args.out.join(SHEET);
    std::fs::write(&path, &sheet)
        .map_err(|e| Failure::problem(format!("{}: {e}", path.display()), crate::failure::advice_on(&e)))?;
    context.console.finish();
    if context.json {
        context.print_json(&found.found.record)?;
    } else {
        outln!("{}", sheet.trim_end());
    }
    Ok(exit)
}

/// Finishing passes from all angles, verified and written.
fn passes(
    context: &Context,
    (held, folder): (&Path, &Path),
    found: &Prototype,
    asked: &PrototypeAsked,
    scallop_mm: f64,
) -> Result<ExitCode, Failure> {
    let console = context.console;
    let writer = FolderWriter::begin(folder)?;
    writer.leftovers().into_iter().for_each(interrupt::remove_on_interrupt);
    let file = claymill::read(held)?;
    let mut job = Job::new(asked.reach.tool, scallop_mm)
        .strategy(Strategy::Planar)
        .axes("+z".parse()?, "+x".parse()?)
        .setups(found.setups());
    job.holder.clone_from(&asked.reach.holder);
    // Beyond its supports the bar goes on: the tool stays between both ends of it.
    let (thick_mm, far_mm) = (asked.reach.tool.widest_mm(), Bounds::FAR_MM);
    let x = [thick_mm - found.length_mm, -thick_mm];
    job.passes.bounds.centre_within_mm = Some([x[0], -far_mm, -far_mm, x[1], far_mm, far_mm]);
    console.stage("planning");
    let prepared = job.prepare(&file)?;
    let planned = prepared.plan(console)?;
    left_out::say(console, &planned.left_out());
    plan_summary::say_plan(console, planned.plan());
    console.stage("verifying");
    let made = planned.plan();
    verify::expect(console, made.program.moves.len(), made.totals.passes, file.model().faces.len());
    let verified = planned.verify_into(writer, console)?;
    Ok(plan::finish(context, verified, &[], folder, &Reuse::default())?.exit)
}

fn asked(args: &PrototypeArgs) -> Result<PrototypeAsked, Failure> {
    let bar_mm = match args.stock.as_str() {
        "auto" => None,
        text => {
            let diameter = text.strip_prefix("round:").and_then(|d| d.parse::<f64>().ok());
            let diameter = diameter.filter(|d| *d > 0.0 && d.is_finite());
            Some(diameter.ok_or_else(|| {
                Failure::usage(
                    format!("`{text}` is not a bar"),
                    "For example: --stock round:60, or --stock auto.",
                )
            })?)
        }
    };
    let stiffness = Stiffness::of_material(&args.material).ok_or_else(|| {
        let advice = "Materials are aluminium, steel, ductile-iron, brass, delrin and tooling-board.";
        Failure::usage(format!("`{}` is not a material whose stiffness is known", args.material), advice)
    })?;
    let (tool, holder) = tool(args)?;
    let from = rotary(&args.axis)?;
    for (what, value) in [
        ("the cutting force", args.cutting_force),
        ("the tolerance", args.tolerance),
        ("the length between the chucks", args.between_chucks),
        ("the share", args.share),
    ] {
        if !(value > 0.0 && value.is_finite()) {
            return Err(Failure::usage(format!("{what} of {value} must be more than 0"), ""));
        }
    }
    let reach = ReachAsked {
        holder,
        from,
        forced_deg: args.forced.clone(),
        share: 0.01 * args.share.min(100.0),
        ..ReachAsked::of(tool)
    };
    Ok(PrototypeAsked {
        reach,
        bar_mm,
        stiffness,
        force_n: args.cutting_force,
        tolerance_mm: args.tolerance,
        longest_mm: args.between_chucks,
    })
}

/// The tool that was asked for, or the thinnest ball of the library.
fn tool(args: &PrototypeArgs) -> Result<(Tool, Option<Holder>), Failure> {
    if let Some(path) = &args.tools {
        let library = read_library(path, &ReadOptions::default())?.library;
        let balls = library.tools.iter().filter(|tool| tool.tool.is_ball());
        let thinnest =
            balls.min_by(|a, b| a.tool.radius_mm().total_cmp(&b.tool.radius_mm()).then(a.id.cmp(&b.id)));
        let found = thinnest.ok_or_else(|| {
            Failure::problem(format!("{} holds no ball", path.display()), "Add one, or give --tool.")
        })?;
        return Ok((found.tool, found.holder.clone()));
    }
    let text = args.tool.as_deref().unwrap_or(USUAL_TOOL);
    let tool: Tool = text.parse().map_err(|e| Failure::usage(e, "For example: --tool ball:3."))?;
    let holder = args.holder.as_deref().map(|text| request::holder(text, &tool)).transpose()?;
    Ok((tool, holder))
}

/// What the one who sets up the machine needs.
fn sheet(found: &Prototype, loaded: &ModelFile, args: &PrototypeArgs, asked: &PrototypeAsked) -> String {
    let mut text = String::new();
    let record = &found.found.record;
    let _ = writeln!(text, "# Setup sheet: {}\n", loaded.name());
    let _ = writeln!(text, "| axis | seen | bar | length |\n|---|---|---|---|");
    for view in &found.axes {
        let chosen = if view.axis == found.axis.axis { ", chosen" } else { "" };
        let _ = writeln!(
            text,
            "| {}{chosen} | {:.2} % | {:.1} mm | {:.1} mm |",
            view.axis,
            100.0 * view.seen_share,
            view.bar_mm,
            view.length_mm
        );
    }
    let _ = writeln!(text, "\n| what | value |\n|---|---|");
    let _ = writeln!(
        text,
        "| stock | {}, round {:.2} mm, {:.1} mm between the chucks |",
        args.material, found.bar_mm, found.length_mm
    );
    let _ = writeln!(text, "| zero | x at the right chuck, y and z on the axis; the part lies at x < 0 |");
    let holder = asked.reach.holder.as_ref().map_or_else(String::new, |h| format!(", holder {h}"));
    let _ = writeln!(text, "| tool | {}{holder} |", asked.reach.tool);
    for (k, place) in found.supports.iter().enumerate() {
        let [a, b] = place.ends_mm;
        let _ = writeln!(
            text,
            "| support {} | radius {:.1} mm about y {:.2}, z {:.2}; x from {:.2} to {:.2} |",
            k + 1,
            place.radius_mm,
            place.middle[0],
            place.middle[1],
            a.min(b),
            a.max(b)
        );
    }
    let torque = asked.force_n * 0.5 * found.axis.bar_mm;
    let _ = writeln!(
        text,
        "| under {} N | twist {:.4}°, bending {:.4} mm, stress {:.1} N/mm² |",
        asked.force_n,
        found.shaft.twist_deg(torque),
        found.shaft.deflection_mm(asked.force_n),
        found.shaft.stress_mpa(asked.force_n, torque)
    );
    let angles: Vec<String> = found.angles_deg().iter().map(|deg| format!("{deg}°")).collect();
    let proof = if record.is_optimal { "no fewer do" } else { "maybe fewer do" };
    let _ = writeln!(text, "| angles | {} ({proof}: `{REACH}`) |", angles.join(", "));
    let percent = |mm2: f64| 100.0 * mm2 / record.area_mm2.max(f64::MIN_POSITIVE);
    let _ = writeln!(
        text,
        "| reached | {:.2} % of the surface; all angles together {:.2} % |",
        percent(record.reached_mm2),
        percent(record.reachable_mm2)
    );
    for (face, mm2, seen) in found.left.iter().filter(|(_, mm2, _)| percent(*mm2) > 0.05) {
        let entity = loaded.model().faces.get(*face).map_or("", |f| f.source.entity.as_str());
        let _ =
            writeln!(text, "| left | face {face} ({entity}): {mm2:.1} mm², {} |", super::reach::why(*seen));
    }
    let _ = writeln!(text, "\nAfter the last angle the part hangs on its supports: saw or mill them off.");
    text
}
