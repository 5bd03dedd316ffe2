//! `claymill prototype`: a part from a bar on a rotary axis, without a decision in between.

use std::fmt::Write as _;
use std::process::ExitCode;

use claymill::reaching::Stiffness;
use claymill::{
    JobFolder, Merging, ModelFile, OperationKind, Prototype, PrototypeAsked, ReachAsked, prototype,
};
use claymill_controller::Dialect;
use claymill_exchange::write_step;
use claymill_paths::Axis;
use claymill_tooling::{Library, ReadOptions, read_library};
use claymill_toolpath::{Holder, Kind, Tool};

use super::operations::{self, Head, OperationOptions, OperationsFile, Source};
use super::post::machine;
use super::reach::rotary;
use super::{Context, request};
use crate::args::{AxisArgs, BoundsArgs, CutName, JobOptions, PrototypeArgs, ReuseArgs, StrategyName};
use crate::console::{counted, outln};
use crate::failure::Failure;
use crate::output;

const USUAL_TOOL: &str = "ball:3";
const ROUGH_NUMBER: u32 = 1;
const FINISH_NUMBER: u32 = 2;
/// Largest engagement of the roughing tool in soft materials and in others, degrees.
const SOFT_DEG: f64 = 110.0;
const HARD_DEG: f64 = 60.0;
/// Left by the roughing for the finish, mm.
const ROUGH_ALLOWANCE_MM: f64 = 0.3;
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
    let loaded = context.load(&args.part, None)?;
    context.console.stage("looking for material");
    let mut merged = claymill::merge(&loaded, &Merging::default())?;
    merged.find_sides(&loaded, Axis { index: 2, negative: false }.vector(), &[])?;
    context.console.stage("looking from all angles");
    let found = prototype(&loaded, &merged, &asked, context.console).map_err(claymill::Error::from)?;
    std::fs::create_dir_all(&args.out).map_err(Failure::at(&args.out))?;
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
        let job = operations(&found, &asked, args);
        exit = operations::run(context, &held, Source::File(job), &job_folder, &ReuseArgs::nowhere())?.exit;
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
    std::fs::write(&path, &sheet).map_err(Failure::at(&path))?;
    context.console.finish();
    if context.json {
        context.print_json(&found.found.record)?;
    } else {
        outln!("{}", sheet.trim_end());
    }
    Ok(exit)
}

/// The job: levels from every angle one after the other, where a tool roughs, then the finish from all of them.
fn operations(found: &Prototype, asked: &PrototypeAsked, args: &PrototypeArgs) -> OperationsFile {
    let setups = found.setups();
    // Beyond its supports the bar goes on: the tool stays between both ends of it.
    let thick_mm = asked.thickest_mm();
    let options = JobOptions {
        scallop: Some(args.scallop),
        strategy: Some(StrategyName::Planar),
        feed: Some(args.feed),
        bounds: BoundsArgs {
            centre_within: Some(format!("{},,:{},,", thick_mm - found.length_mm, -thick_mm)),
            ..BoundsArgs::default()
        },
        axes: AxisArgs { up: Some("+z".to_owned()), length: Some("+x".to_owned()) },
        ..JobOptions::default()
    };
    let rough = |tool: &Tool, setup: &String| {
        let angle = setup.split_once(':').map_or(setup.as_str(), |(name, _)| name);
        OperationOptions {
            head: Head {
                name: format!("rough-{angle}"),
                kind: OperationKind::Rough,
                reason: format!("what stands over the part from {angle}"),
            },
            options: JobOptions {
                tool: Some(tool.to_string()),
                tool_number: Some(ROUGH_NUMBER),
                cut: Some(CutName::Levels),
                step_down: Some(tool.radius_mm()),
                engagement: Some(if is_soft(&args.material) { SOFT_DEG } else { HARD_DEG }),
                // The finish takes the stairs.
                band: Some(0.5 * tool.radius_mm()),
                allowance: Some(ROUGH_ALLOWANCE_MM),
                setup: vec![setup.clone()],
                ..options.clone()
            },
        }
    };
    let finish = OperationOptions {
        head: Head {
            name: "finish".to_owned(),
            kind: OperationKind::Finish,
            reason: "every surface from the angle that faces it best".to_owned(),
        },
        options: JobOptions {
            tool: Some(asked.reach.tool.to_string()),
            tool_number: Some(FINISH_NUMBER),
            holder: asked.reach.holder.as_ref().map(ToString::to_string),
            // What the roughing tool does not get to stands as high as the bar.
            stock_above: asked.rough.map(|_| 0.5 * found.bar_mm),
            setup: setups.clone(),
            ..options.clone()
        },
    };
    let roughed = asked.rough.iter().flat_map(|tool| setups.iter().map(move |setup| rough(tool, setup)));
    let operations = roughed.chain([finish]).collect();
    OperationsFile { stock: asked.rough.map(|_| found.stock()), operations }
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
    let library =
        args.tools.as_deref().map(|path| read_library(path, &ReadOptions::default())).transpose()?;
    let library = library.map(|read| read.library);
    let (tool, holder) = tool(args, library.as_ref())?;
    let rough = args.rough.as_ref().map(|text| text.parse::<Tool>()).transpose();
    let rough = rough.map_err(|e| Failure::usage(e, "For example: --rough flat:5."))?;
    let from = rotary(&args.axis)?;
    for (what, value) in [
        ("the cutting force", args.cutting_force),
        ("the tolerance", args.tolerance),
        ("the length between the chucks", args.between_chucks),
        ("the share", args.share),
        ("the feed", args.feed),
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
        rough,
        stiffness,
        force_n: args.cutting_force,
        tolerance_mm: args.tolerance,
        longest_mm: args.between_chucks,
    })
}

/// Whether a tool may be engaged far around in a material: none of its chips is hot or hard.
fn is_soft(material: &str) -> bool {
    ["delrin", "tooling-board"].contains(&material)
}

/// The tool that finishes, as it was asked for, or the thinnest ball of the library.
fn tool(args: &PrototypeArgs, library: Option<&Library>) -> Result<(Tool, Option<Holder>), Failure> {
    if let Some(library) = library {
        let balls = library.tools.iter().filter(|tool| tool.tool.is_ball());
        let thinnest =
            balls.min_by(|a, b| a.tool.radius_mm().total_cmp(&b.tool.radius_mm()).then(a.id.cmp(&b.id)));
        let found = thinnest.ok_or_else(|| {
            Failure::problem("the library holds no ball", "Add one, or give --tool instead of --tools.")
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
    if let Some(rough) = &asked.rough {
        let _ = writeln!(text, "| tool {ROUGH_NUMBER} | {rough}, roughs by levels from every angle |");
    }
    let _ = writeln!(text, "| tool {FINISH_NUMBER} | {}{holder}, finishes |", asked.reach.tool);
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
