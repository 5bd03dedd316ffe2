use std::path::{Path, PathBuf};
use std::process::ExitCode;

use claymill_controller::{Dialect, Machine, MachineJob, PostTotals};

use super::{Context, simulate};
use crate::args::PostArgs;
use crate::failure::{Failure, advice_on};
use crate::interrupt::remove_on_interrupt;

/// `claymill post`.
pub(crate) fn post(context: &Context, args: &PostArgs) -> Result<ExitCode, Failure> {
    let dialect = dialect(&args.to, args.version.as_deref())?;
    let machine = machine(args.machine.as_deref())?;
    context.console.stage("reading");
    let job = MachineJob::read(&args.folder, &machine)?;
    if job.slowed > 0 {
        context.console.say(format!(
            "note: {} of {} moves ask for more feed than machine {} has, and run at what it has",
            job.slowed,
            job.strokes(),
            machine.name
        ));
    }
    context.console.stage("writing");
    let partial = |path: &Path| remove_on_interrupt(path.to_owned());
    let mut totals = claymill_controller::post(&job, dialect, &machine, &args.out, &partial)?;
    if args.simulate {
        context.console.stage("running");
        let files: Vec<_> = totals.files.iter().map(|f| f.path.clone()).collect();
        totals.simulation = Some(claymill_controller::simulate(&job, &files, dialect, &machine)?);
    }
    context.console.finish();
    write_totals(&args.out, &totals)?;
    if context.json {
        context.print_json(&totals)?;
    } else {
        say(context, &totals);
        if let Some(simulation) = &totals.simulation {
            simulate::say(context, simulation);
        }
    }
    Ok(ExitCode::SUCCESS)
}

/// The dialect of a name and, for LinuxCNC, a version.
pub(crate) fn dialect(name: &str, version: Option<&str>) -> Result<Dialect, Failure> {
    let known = |text: &str| text.parse::<Dialect>().map_err(|e| Failure::usage(e, ""));
    match (name, version) {
        ("linuxcnc", Some(version @ ("2.9" | "2.10"))) => known(&format!("linuxcnc-{version}")),
        ("linuxcnc", Some(other)) => {
            Err(Failure::usage(format!("LinuxCNC {other} is not known"), "Give --version 2.9 or 2.10."))
        }
        (_, Some(_)) => Err(Failure::usage("--version is for LinuxCNC only", "Leave it out.")),
        (name, None) => known(name),
    }
}

/// The machine of a file, or the usual one.
pub(crate) fn machine(path: Option<&Path>) -> Result<Machine, Failure> {
    Ok(path.map(Machine::read).transpose()?.unwrap_or_default())
}

/// The job of a folder, and the dialect that its `program` is written in: as told, or as the first file says.
pub(crate) fn written(
    context: &Context,
    folder: &Path,
    told: Option<&str>,
    program: &[PathBuf],
    machine: &Machine,
) -> Result<(MachineJob, Dialect), Failure> {
    context.console.stage("reading");
    let dialect = match told {
        Some(name) => dialect(name, None)?,
        None => claymill_controller::dialect_of(&program[0])?,
    };
    Ok((MachineJob::read(folder, machine)?, dialect))
}

/// The totals beside the program.
fn write_totals(out: &Path, totals: &PostTotals) -> Result<(), Failure> {
    let mut name = out.file_name().unwrap_or_default().to_owned();
    name.push(".totals.json");
    let text = serde_json::to_string_pretty(totals).unwrap_or_default();
    claymill_toolpath::write_whole(&out.with_file_name(name), (text + "\n").as_bytes())
        .map_err(|e| Failure::problem(format!("{}: {e}", out.display()), advice_on(&e)))
}

fn say(context: &Context, totals: &PostTotals) {
    let say = |line: String| context.console.say(line);
    let bytes: u64 = totals.files.iter().map(|f| f.bytes).sum();
    let lines: u64 = totals.files.iter().map(|f| f.lines).sum();
    for file in &totals.files {
        say(format!("written   {} ({:.1} MB)", file.path.display(), file.bytes as f64 / 1e6));
    }
    let rungs: Vec<String> =
        totals.rungs.iter().map(|(rung, count)| format!("{count} {}", rung.name())).collect();
    say(format!(
        "{:9} {lines} lines, {:.1} MB; moves: {}",
        totals.dialect,
        bytes as f64 / 1e6,
        rungs.join(", ")
    ));
    let back = &totals.read_back;
    say(format!(
        "read back {} moves in {} blocks; largest difference from the job {:.6} mm at move {} (stated {:.6} mm)",
        back.moves, back.elements, back.largest_mm, back.largest_seq, totals.stated_mm
    ));
}
