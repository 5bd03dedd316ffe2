//! `claymill post`: writes a job as a program for a control, with its totals. Dialect, machine
//! definition and placement options are also resolved here for `stream`, `simulate` and others.

use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use claymill_controller::{Dialect, Machine, MachineJob, PlaneBy, PostTotals, Section, Turn};
use claymill_toolpath::{Job, Kind, job_files};

use super::{Context, simulate};
use crate::args::{PlaceArgs, PostArgs};
use crate::clearance::cleared;
use crate::failure::Failure;
use crate::output;

/// `claymill post`.
pub(crate) fn post(context: &Context, args: &PostArgs) -> Result<ExitCode, Failure> {
    let dialect = dialect(&args.to, args.version.as_deref())?;
    let machine = machine(args.machine.as_deref())?;
    let mut inputs = job_files(&args.folder);
    inputs.extend(args.machine.clone());
    output::make_parent(&args.out)?;
    let out = output::begin(context, &args.out, Kind::Program, &inputs)?;
    let totals_name = totals_name(out.name().to_owned());
    if !out.is_stream() {
        out.check_beside(&totals_name, Kind::Json)?;
    }
    context.console.stage("reading");
    let cleared = cleared(context, &args.folder, args.unverified)?;
    let mut machine = placed(machine, &args.place, cleared.job())?;
    if args.tilt {
        machine.tilt.by = PlaneBy::Control;
    }
    let job = cleared.on(&machine)?.placed(dialect, &machine)?;
    if dialect.lacks_plane(&job, &machine) {
        context.console.say(format!(
            "note: {dialect} is told of no tilted planes: setups off the axes have a stop, or a file, each (files = \"setup\")"
        ));
    }
    if job.slowed > 0 {
        context.console.say(format!(
            "note: {} of {} moves ask for more feed than machine {} has, and run at what it has",
            job.slowed,
            job.strokes(),
            machine.name
        ));
    }
    context.console.stage("writing");
    let written = claymill_controller::post_to(&job, dialect, &machine, &out, &args.out);
    let mut totals = written.map_err(|e| Failure::from(e).about(out.folder(), &args.out))?;
    let mut files: Vec<(OsString, Kind)> = if out.is_stream() {
        vec![(out.name().to_owned(), Kind::Program)]
    } else {
        let names = totals.files.iter().filter_map(|f| f.path.file_name());
        names.map(|name| (name.to_owned(), Kind::Program)).collect()
    };
    if args.simulate {
        context.console.stage("running");
        let written: Vec<PathBuf> = files.iter().map(|(name, _)| out.folder().join(name)).collect();
        totals.simulation = Some(claymill_controller::simulate(&job, &written, dialect, &machine)?);
    }
    context.console.finish();
    if !out.is_stream() {
        let text = serde_json::to_string_pretty(&totals)
            .map_err(|e| Failure::problem(format!("the totals cannot be written as JSON: {e}"), ""))?;
        let staged = out.folder().join(&totals_name);
        std::fs::write(&staged, text + "\n").map_err(Failure::at(&staged))?;
        files.push((totals_name, Kind::Json));
    }
    out.finish_all(&files)?;
    if context.json {
        context.print_json(&totals)?;
    } else {
        say(context, &totals, &job, &machine);
        if let Some(simulation) = &totals.simulation {
            simulate::say(context, simulation);
        }
    }
    Ok(ExitCode::SUCCESS)
}

/// `FILE.totals.json`.
fn totals_name(mut program: OsString) -> OsString {
    program.push(".totals.json");
    program
}

/// The machine with what the command line says of the job's tools and setups.
pub(crate) fn placed(mut machine: Machine, args: &PlaceArgs, job: &Job) -> Result<Machine, Failure> {
    let tools: Vec<&str> = job.tools.iter().map(|t| t.id.as_str()).collect();
    let setups: Vec<&str> = job.setups.iter().map(|s| s.name.as_str()).collect();
    for text in &args.tool_number {
        const EXAMPLE: &str = "For example: --tool-number 12, or --tool-number T1=12.";
        let (tool, number) = one_of(text, &tools, "tool", EXAMPLE)?;
        let number = number.trim_start_matches('T').parse().ok().filter(|n| *n > 0);
        let number =
            number.ok_or_else(|| Failure::usage(format!("`{text}` is no number of a tool"), EXAMPLE))?;
        let tools = tool.map_or_else(|| tools.clone(), |tool| vec![tool]);
        if tools.len() > 1 {
            return Err(Failure::usage(format!("`{text}`: the job has {} tools", tools.len()), EXAMPLE));
        }
        for tool in tools {
            machine.tools.entry(tool.to_owned()).or_default().number = Some(number);
        }
    }
    for text in &args.work_offset {
        let (setup, offset) =
            one_of(text, &setups, "setup", "For example: --work-offset G55, or --work-offset left=G55.")?;
        for setup in setup.map_or_else(|| setups.clone(), |setup| vec![setup]) {
            machine.setups.entry(setup.to_owned()).or_default().work_offset = Some(offset.to_owned());
        }
    }
    if let Some(rpm) = args.spindle {
        machine.spindle.speed_rpm = rpm;
        machine.tools.values_mut().for_each(|t| t.speed_rpm = None);
    }
    machine.check()?;
    Ok(machine)
}

/// `NAME=VALUE` with one of these names, or the value alone.
fn one_of<'a>(
    text: &'a str,
    names: &[&'a str],
    what: &str,
    example: &str,
) -> Result<(Option<&'a str>, &'a str), Failure> {
    match text.split_once('=') {
        None => Ok((None, text)),
        Some((name, value)) if names.contains(&name) => Ok((Some(name), value)),
        Some((name, _)) => Err(Failure::usage(
            format!("the job has no {what} `{name}`; it has {}", names.join(", ")),
            example,
        )),
    }
}

/// The dialect of a name and, for LinuxCNC, a version.
pub(crate) fn dialect(name: &str, version: Option<&str>) -> Result<Dialect, Failure> {
    let known = |text: &str| text.parse::<Dialect>().map_err(|e| Failure::usage(e, suggestion(text)));
    match (name, version) {
        ("linuxcnc", Some(version @ ("2.9" | "2.10"))) => known(&format!("linuxcnc-{version}")),
        ("linuxcnc", Some(other)) => {
            Err(Failure::usage(format!("LinuxCNC {other} is not known"), "Give --version 2.9 or 2.10."))
        }
        (_, Some(_)) => Err(Failure::usage("--version is for LinuxCNC only", "Leave it out.")),
        (name, None) => known(name),
    }
}

/// Other names of controls, and what they read.
const ALSO_CALLED: [(&str, &str); 14] = [
    ("sinumerik", "siemens"),
    ("840d", "siemens"),
    ("tnc", "heidenhain"),
    ("twincat", "beckhoff"),
    ("isg", "beckhoff"),
    ("emc", "linuxcnc"),
    ("catia", "apt"),
    ("creo", "apt-creo"),
    ("haas", "g1"),
    ("mazak", "g1"),
    ("okuma", "g1"),
    ("mach", "g1"),
    ("grbl", "g1"),
    ("gcode", "g1"),
];
/// Names no farther apart than this are a slip of the keyboard.
const ALIKE: f64 = 0.75;

/// What somebody may have meant by a name that is no dialect.
fn suggestion(text: &str) -> String {
    let text = text.to_lowercase();
    let names = Dialect::ALL.map(Dialect::name).into_iter().chain(["linuxcnc", "apt"]);
    let likeness = |name: &str| {
        let begins = name.starts_with(&text) || text.starts_with(name);
        if begins { 1.0 } else { strsim::jaro_winkler(&text, name) }
    };
    let near = names.map(|name| (likeness(name), name)).max_by(|a, b| a.0.total_cmp(&b.0));
    let also = ALSO_CALLED.iter().find(|(other, _)| text.contains(other));
    match (also, near) {
        (Some((_, "g1")), _) => "Write plain G-code for it: --to g1.".into(),
        (Some((_, dialect)), _) => format!("It reads {dialect}: --to {dialect}."),
        (None, Some((share, dialect))) if share >= ALIKE => format!("Did you mean --to {dialect}?"),
        _ => "Most controls read plain G-code: --to g1.".into(),
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

fn say(context: &Context, totals: &PostTotals, job: &MachineJob, machine: &Machine) {
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
    for section in &job.sections {
        say(format!("setup     {}: {}", section.setup, where_it_is(section, machine)));
    }
    say(format!("retreat   {} before a stop, a tool change and the end", totals.retreat));
    say_shared_offsets(context, job, machine);
    if job.sections.iter().any(|s| s.speed_rpm == 0.0) {
        say("warning: no spindle speed is known and none is written: start the spindle by hand, or give --spindle".into());
    }
}

/// Tool, work offset and speed of a section.
fn where_it_is(section: &Section, machine: &Machine) -> String {
    let offset = machine.place(&section.place).work_offset.filter(|o| !o.is_empty());
    let mut offset = offset.map_or_else(|| "no work offset".to_owned(), |o| format!("work offset {o}"));
    match section.placed.map(|p| p.by) {
        Some(Turn::Plane { deg: [a, b, c] }) => offset += &format!(", plane tilted by {a}, {b}, {c} degrees"),
        Some(Turn::Index { deg, .. }) => offset += &format!(", A{deg} degrees"),
        None => {}
    }
    let speed =
        if section.speed_rpm > 0.0 { format!(", {} 1/min", section.speed_rpm) } else { String::new() };
    format!("tool T{}, {offset}{speed}", section.tool_number)
}

/// Setups of one program that share a work offset must have it set anew when the part is turned.
fn say_shared_offsets(context: &Context, job: &MachineJob, machine: &Machine) {
    let offset = |s: &Section| machine.place(&s.place).work_offset.unwrap_or_default();
    let zero = |s: &Section| machine.place(&s.place).zero_mm;
    let stays = |a: &Section, b: &Section| a.stands_as(b) && zero(a) == zero(b);
    let turned = job
        .sections
        .windows(2)
        .find(|w| w[0].setup != w[1].setup && offset(&w[0]) == offset(&w[1]) && !stays(&w[0], &w[1]));
    if let Some([before, after]) = turned.map(|w| [&w[0], &w[1]]) {
        context.console.say(format!(
            "note      {} has the work offset of {}: set it anew when the part is turned, or give --work-offset {}=G55",
            after.setup, before.setup, after.setup
        ));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slips_and_other_names_of_controls_are_understood() {
        for (said, meant) in [
            ("fanuk", "Did you mean --to fanuc?"),
            ("Heidenhain", "Did you mean --to heidenhain?"),
            ("linux", "Did you mean --to linuxcnc?"),
            ("iTNC530", "It reads heidenhain: --to heidenhain."),
            ("sinumerik840d", "It reads siemens: --to siemens."),
            ("haas", "Write plain G-code for it: --to g1."),
            ("qqq", "Most controls read plain G-code: --to g1."),
        ] {
            assert_eq!(suggestion(said), meant, "{said}");
        }
    }
}
