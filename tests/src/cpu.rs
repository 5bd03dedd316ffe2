//! CPU time of the thread that asks, so that tests of speed do not depend on what else runs.

use std::time::Instant;

/// CPU time of this thread, s; the time since `start` where the system does not tell it.
#[must_use]
pub fn thread_cpu_s(start: Instant) -> f64 {
    // The system brings its account up to date when a thread gives way.
    std::thread::yield_now();
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").unwrap_or_default();
    let spent = text.split_whitespace().next().and_then(|x| x.parse::<f64>().ok());
    spent.map_or_else(|| start.elapsed().as_secs_f64(), |ns| ns * 1e-9)
}
