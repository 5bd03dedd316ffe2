//! A real control: LinuxCNC, headless. A program of its own, since one simulator at a time runs on a machine.

mod indexed;
#[path = "../it/job/mod.rs"]
mod job;
mod programs;
mod remote;

use std::sync::{Mutex, MutexGuard, PoisonError};

static ALONE: Mutex<()> = Mutex::new(());

/// The simulator starts in seconds or not at all: nothing else keeps the processor busy meanwhile.
fn alone() -> MutexGuard<'static, ()> {
    ALONE.lock().unwrap_or_else(PoisonError::into_inner)
}
