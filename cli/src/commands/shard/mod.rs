//! `claymill shard`: a plan in shards that any number of processes lay, on one machine or many.
//!
//! ```text
//!   open ──► work/ ─┬─ shards.json   which parts each shard lays, time and memory that it may take
//!                   ├─ job.toml      the job, every default filled in
//!                   └─ parts/        a store: what setups cut, and what shards have laid
//!
//!   run 0, run 1, … each takes what it needs from the store and puts its parts there; join is `plan` with that store
//! ```

mod list;
mod script;
mod status;

use std::collections::BTreeSet;
use std::path::{Path, absolute};
use std::process::ExitCode;
use std::time::Instant;

use claymill::ModelFile;
use claymill_paths::PlanPart;
use claymill_toolpath::{PartKey, sha256_of, write_whole};

use super::job_file::{self, JOB_TOML};
use super::request::Request;
use super::{Context, plan, say_axes};
use crate::args::{OpenArgs, ReuseArgs, ShardArgs, ShardCommand};
use crate::console::{counted, outln, peak_memory_mb};
use crate::failure::{Failure, TRY_AGAIN};
use crate::reuse::{PROGRAM, Reuse};

use list::{STORE_FOLDER, ShardList, numbers, ranges};
use status::Standings;

/// Where engines tell a process which shard it is to lay.
const TASK_VARIABLES: [&str; 2] = ["SLURM_ARRAY_TASK_ID", "HQ_TASK_ID"];

/// `claymill shard`.
pub(crate) fn shard(context: &Context, args: &ShardArgs) -> Result<ExitCode, Failure> {
    match &args.what {
        ShardCommand::Open(args) => open(context, args)?,
        ShardCommand::Run { folder, shards } => run(context, folder, shards)?,
        ShardCommand::Status { folder, missing, form } => {
            return status::status(context, folder, missing.then_some(*form));
        }
        ShardCommand::Join { folder, out } => return join(context, folder, out),
        ShardCommand::Script { folder, engine, out, cores } => {
            script::script(context, folder, *engine, out.as_deref(), *cores)?;
        }
    }
    Ok(ExitCode::SUCCESS)
}

fn open(context: &Context, args: &OpenArgs) -> Result<(), Failure> {
    if !(args.minutes > 0.0 && args.minutes.is_finite()) {
        return Err(Failure::usage(
            format!("shards of {} minutes", args.minutes),
            "For example --minutes 10.",
        ));
    }
    let begun = Instant::now();
    let whole = |path: &Path| absolute(path).map_err(Failure::at(path));
    // Shards run anywhere.
    let mut options = job_file::with(args.job.options(), args.job_file.as_deref())?;
    for path in options.check.iter_mut().chain(&mut options.machine) {
        *path = whole(path)?;
    }
    let request = Request::new(&whole(&args.model)?, &options)?;
    let model_sha256 = sha256_of(&request.model)?;
    let folder = whole(&args.out)?;
    list::begin(&folder)?;
    let reuse = Reuse::of_shards(&folder.join(STORE_FOLDER))?;
    let loaded = context.load(&request.model, request.options.mirror)?;
    let (parts, orientation) = lay(context, &request, &loaded, &reuse, &BTreeSet::new())?;
    let text = job_file::text(&request, orientation)?;
    let job = folder.join(JOB_TOML);
    write_whole(&job, text.as_bytes()).map_err(Failure::at(&job))?;
    let list = ShardList::new(
        (PROGRAM.to_owned(), request.model.clone(), model_sha256),
        (begun.elapsed().as_secs_f64(), peak_memory_mb()),
        parts,
        &request.job.passes,
        60.0 * args.minutes,
    );
    list.write(&folder)?;
    reuse.check_kept()?;
    if context.json {
        return context.print_json(&list);
    }
    outln!("shards    {} in {}", list.shards.len(), folder.display());
    Ok(())
}

/// All parts of the plan, of which those that are wanted are laid.
fn lay(
    context: &Context,
    request: &Request,
    loaded: &ModelFile,
    reuse: &Reuse,
    wanted: &BTreeSet<PartKey>,
) -> Result<(Vec<PlanPart>, claymill::Orientation), Failure> {
    let console = context.console;
    console.stage("merging");
    let mut job = request.job.clone();
    job.passes.kept = reuse.kept.clone();
    let prepared = job.prepare(loaded)?;
    say_axes(console, &request.options.axes, prepared.orientation());
    console.stage("planning");
    let orientation = prepared.orientation().orientation;
    Ok((prepared.lay_parts(wanted, console)?, orientation))
}

fn run(context: &Context, folder: &Path, asked: &[String]) -> Result<(), Failure> {
    let console = context.console;
    let list = ShardList::read(folder, PROGRAM)?;
    let count = list.shards.len();
    let mut shards = BTreeSet::new();
    let told = TASK_VARIABLES.iter().find_map(|name| std::env::var(name).ok());
    let told = told.filter(|_| asked.is_empty());
    for text in asked.iter().chain(&told) {
        shards.extend(numbers(text, count)?);
    }
    if shards.is_empty() {
        let names = TASK_VARIABLES.join(" or ");
        return Err(Failure::usage(
            format!("no shard is named, and neither is one in {names}"),
            "For example: claymill shard run FOLDER 0.",
        ));
    }
    let wanted: BTreeSet<PartKey> = shards.iter().flat_map(|&k| list.shards[k].keys()).collect();
    let reuse = Reuse::of_shards(&folder.join(STORE_FOLDER))?;
    if wanted.iter().all(|key| reuse.kept.is_whole(key)) {
        console.say("shard     done before".to_owned());
        return Ok(());
    }
    let request = request(folder, &list)?;
    let loaded = context.load(&request.model, request.options.mirror)?;
    let (parts, _) = lay(context, &request, &loaded, &reuse, &wanted)?;
    let found: BTreeSet<PartKey> = parts.iter().map(|part| part.key).collect();
    if !wanted.is_subset(&found) {
        return Err(changed(folder, "an obstacle, the machine definition or the job has"));
    }
    reuse.check_kept()?;
    if let Some(lost) = parts.iter().find(|part| wanted.contains(&part.key) && !part.is_kept) {
        return Err(Failure::with_code(
            TRY_AGAIN,
            format!("region {} in setup {} was laid and is not in the store", lost.region, lost.setup),
            "Has somebody removed files of the work folder? Run the shard again.",
        ));
    }
    console.say(format!(
        "shard     {}: {} laid",
        ranges(&Vec::from_iter(shards)),
        counted(wanted.len(), "part")
    ));
    Ok(())
}

fn join(context: &Context, folder: &Path, out: &Path) -> Result<ExitCode, Failure> {
    let list = ShardList::read(folder, PROGRAM)?;
    let standings = Standings::of(&list, folder)?;
    let missing = standings.missing();
    if !missing.is_empty() {
        let damaged = standings.damaged();
        let lacks =
            format!("{} of {} shards are missing: {}", missing.len(), list.shards.len(), ranges(&missing));
        let why =
            if damaged.is_empty() { String::new() } else { format!(" (damaged: {})", ranges(&damaged)) };
        return Err(Failure::problem(
            format!("{}: {lacks}{why}", folder.display()),
            format!("Run them: claymill shard run {} {}", folder.display(), ranges(&missing)),
        ));
    }
    let request = request(folder, &list)?;
    let store = Some(folder.join(STORE_FOLDER));
    let reuse = ReuseArgs { store, no_store: false, store_limit: Some(u64::MAX) };
    Ok(plan::run(context, &request, out, &reuse)?.exit)
}

/// The job of a work folder, of which the model has to be that which was listed.
fn request(folder: &Path, list: &ShardList) -> Result<Request, Failure> {
    let options = job_file::read(&folder.join(JOB_TOML))?;
    let request = Request::new(&list.model, &options)?;
    if sha256_of(&list.model)? != list.model_sha256 {
        return Err(changed(folder, &format!("{} has", list.model.display())));
    }
    Ok(request)
}

fn changed(folder: &Path, what: &str) -> Failure {
    Failure::problem(
        format!("{what} changed since the shards in {} were listed", folder.display()),
        "List them again: claymill shard open MODEL -o FOLDER; parts that stay the same are kept.",
    )
}
