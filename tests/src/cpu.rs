//! CPU time of the thread or the process that asks, so that tests of speed do not depend on what else runs.

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

/// CPU time of all threads of this process, s, to a hundredth; the time since `start` where the system does not tell it.
#[must_use]
pub fn process_cpu_s(start: Instant) -> f64 {
    /// What `/proc` counts in, on every processor that Linux runs on.
    const TICKS_PER_S: f64 = 100.0;
    let text = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    // The name of the command, in brackets, may hold anything. User and system time are the 12th and 13th field after it.
    let fields = text.rsplit_once(')').map_or("", |(_, fields)| fields).split_whitespace().skip(11).take(2);
    let ticks: Vec<f64> = fields.filter_map(|field| field.parse().ok()).collect();
    match ticks[..] {
        [user, system] => (user + system) / TICKS_PER_S,
        _ => start.elapsed().as_secs_f64(),
    }
}
