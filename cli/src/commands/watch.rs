//! `claymill plan --watch`: the job again whenever one of its files changes.
//!
//! ```text
//!   plan ─▶ wait until a file differs from what was planned, and has been still for a while ─▶ plan ─▶ …    Ctrl-C ends
//! ```

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::{Duration, SystemTime};

use super::Context;
use crate::args::{PlanArgs, ReuseArgs};
use crate::failure::Failure;
use crate::reuse;

/// Files are looked at this often. A file that changed between two looks is still being written.
const EVERY: Duration = Duration::from_millis(500);

/// When a file was written, and how long it is; nothing where there is none.
type Stamp = Option<(SystemTime, u64)>;

/// Runs `plan` now, and again after every change of the model, the job file or another file that the arguments name. It ends only
/// where the first plan cannot be made: what is asked for is wrong then. Later the user is in the middle of an edit.
pub(super) fn watch(
    context: &Context,
    args: &PlanArgs,
    plan: impl Fn(&Context, &PlanArgs) -> Result<ExitCode, Failure>,
) -> Result<ExitCode, Failure> {
    // Parts that are kept make the second plan quick.
    let store = args.reuse.store.clone().or_else(|| Some(reuse::beside(&args.out)));
    let kept = ReuseArgs { store: store.filter(|_| !args.reuse.no_store), ..args.reuse.clone() };
    let args = &PlanArgs { reuse: kept, ..args.clone() };
    let files = files(args);
    let mut is_first = true;
    loop {
        let planned = stamps(&files);
        let console = context.console.for_job();
        let ended = plan(&Context { console: &console, ..*context }, args);
        console.finish();
        match ended {
            Err(failure) if is_first => return Err(failure),
            Err(failure) => eprintln!("{failure}"),
            Ok(_) => {}
        }
        let names: Vec<String> = files.iter().map(|f| f.display().to_string()).collect();
        context.console.say(format!("watching  {}; Ctrl-C ends", names.join(", ")));
        wait_for_change(&files, &planned);
        is_first = false;
    }
}

/// The files that the job is made from.
fn files(args: &PlanArgs) -> Vec<PathBuf> {
    let options = args.job.options();
    let of_process = args.process.tools.iter().chain(&args.process.process);
    let of_job = options.check.iter().chain(&options.machine);
    let of_stock = args.process.stock.iter().filter_map(|stock| Some(stock.strip_prefix("file:")?.into()));
    std::iter::once(&args.model)
        .chain(&args.job_file)
        .chain(of_process)
        .chain(of_job)
        .cloned()
        .chain(of_stock)
        .collect()
}

fn stamps(files: &[PathBuf]) -> Vec<Stamp> {
    files.iter().map(|file| stamp(file)).collect()
}

fn stamp(path: &Path) -> Stamp {
    let meta = std::fs::metadata(path).ok()?;
    Some((meta.modified().ok()?, meta.len()))
}

/// Waits until some file is not as it was, and all are still.
fn wait_for_change(files: &[PathBuf], planned: &[Stamp]) {
    let mut last = planned.to_vec();
    loop {
        std::thread::sleep(EVERY);
        let now = stamps(files);
        // A file that is away is being replaced.
        if now != planned && now == last && now.iter().all(Option::is_some) {
            return;
        }
        last = now;
    }
}
