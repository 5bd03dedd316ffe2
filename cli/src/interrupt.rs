//! Ctrl-C: removes what is half-written, then ends with exit code 130. A command that moves a
//! machine replaces the first Ctrl-C by a stop of its own.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};
use std::time::Duration;

use claymill_toolpath::is_own_scratch;

use crate::failure::TRY_AGAIN;

/// Scratch folders and their locks, which must not survive an interruption. The lock is held while they are removed and until the
/// process has ended.
static UNFINISHED: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

/// The exit code of an interrupted process.
pub(crate) const INTERRUPTED: u8 = 130;

/// What the first Ctrl-C does.
static FIRST: Mutex<Option<Box<dyn FnOnce() + Send>>> = Mutex::new(None);

/// While a folder is removed the job may still be writing files into it: it is tried again this many times.
const ATTEMPTS: usize = 100;

fn unfinished() -> MutexGuard<'static, Vec<PathBuf>> {
    UNFINISHED.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Ends the process on Ctrl-C with exit code 130, after removing what is half-written. Everything is written
/// beside its destination and renamed when whole, so there is nothing else to undo, and nothing to wait for. What a scheduler
/// runs ends with another code on SIGTERM: its time is over, and it is to be run again.
pub(crate) fn install(is_scheduled: bool) {
    // Without a handler Ctrl-C still works, but may leave a .partial folder: not worth refusing to run.
    let _ = ctrlc::set_handler(|| {
        let gently = FIRST.lock().unwrap_or_else(PoisonError::into_inner).take();
        match gently {
            Some(stop) => stop(),
            None => end(code(), || ()),
        }
    });
    if is_scheduled {
        note_termination();
    }
}

/// Whether SIGTERM has come, in a process that a scheduler runs.
static TERMINATED: OnceLock<Arc<AtomicBool>> = OnceLock::new();
/// The signal is noted after the handler of Ctrl-C, which gets it too, has been woken.
const NOTED_BY: Duration = Duration::from_millis(10);

#[cfg(unix)]
fn note_termination() {
    let flag = TERMINATED.get_or_init(Arc::default);
    let _ = signal_hook::flag::register(signal_hook::consts::SIGTERM, flag.clone());
}

#[cfg(not(unix))]
fn note_termination() {}

fn code() -> i32 {
    let is_terminated = TERMINATED.get().is_some_and(|flag| {
        std::thread::sleep(NOTED_BY);
        flag.load(Ordering::Relaxed)
    });
    i32::from(if is_terminated { TRY_AGAIN } else { INTERRUPTED })
}

/// Has the first Ctrl-C do this in place of ending the process: what moves a machine brings it to rest. The second one ends
/// the process all the same.
pub(crate) fn at_first(stop: impl FnOnce() + Send + 'static) {
    *FIRST.lock().unwrap_or_else(PoisonError::into_inner) = Some(Box::new(stop));
}

/// Ends the process after removing what is half-written and saying why.
pub(crate) fn end(code: i32, say: impl FnOnce()) {
    let paths = unfinished();
    for path in paths.iter().filter(|path| is_own_scratch(path)) {
        remove(path);
    }
    say();
    exit_at_once(code);
}

/// Handlers that run at a usual exit take the graphics driver away from under its own threads.
#[cfg(unix)]
fn exit_at_once(code: i32) {
    signal_hook::low_level::exit(code);
}

/// Windows ends all other threads before anything else happens at an exit.
#[cfg(not(unix))]
fn exit_at_once(code: i32) {
    std::process::exit(code);
}

fn remove(folder: &Path) {
    for _ in 0..ATTEMPTS {
        let _ = std::fs::remove_dir_all(folder);
        let _ = std::fs::remove_file(folder);
        if !folder.exists() {
            return;
        }
    }
}

/// Names folders and files that are removed when the process is interrupted: all of these or none, so that no lock stays without
/// its folder.
pub(crate) fn remove_on_interrupt(paths: impl IntoIterator<Item = PathBuf>) {
    unfinished().extend(paths);
}

/// Returns at once, or never when the process is ending because of an interruption: a job that fails because
/// its folder was taken away must not be reported as a failure.
pub(crate) fn wait_if_interrupted() {
    drop(unfinished());
}
