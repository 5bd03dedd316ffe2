use std::io::IsTerminal;
use std::sync::Mutex;
use std::time::{Duration, Instant};

use claymill_toolpath::StageTiming;
use indicatif::{ProgressBar, ProgressStyle};

/// Prints a line on standard output. A reader that has seen enough (`| head`) is no error.
macro_rules! outln {
    ($($line:tt)*) => {{
        use std::io::Write as _;
        let _ = writeln!(std::io::stdout(), $($line)*);
    }};
}
pub(crate) use outln;

/// Progress on standard error and the time of each stage.
#[derive(Debug)]
pub(crate) struct Console {
    quiet: bool,
    bar: ProgressBar,
    stages: Mutex<Vec<(String, Instant)>>,
}

const STEPS: u64 = 1000;

impl Console {
    pub(crate) fn new(quiet: bool) -> Self {
        let bar = if quiet || !std::io::stderr().is_terminal() {
            ProgressBar::hidden()
        } else {
            let bar = ProgressBar::new(STEPS);
            let style =
                ProgressStyle::with_template("{msg:14} {bar:40} {percent:>3}% {elapsed} (about {eta} left)");
            bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
            bar.enable_steady_tick(Duration::from_millis(200));
            bar
        };
        Console { quiet, bar, stages: Mutex::new(Vec::new()) }
    }

    /// A console for a job of its own: with its own stages.
    pub(crate) fn for_job(&self) -> Self {
        Console::new(self.quiet)
    }

    pub(crate) fn is_quiet(&self) -> bool {
        self.quiet
    }

    /// Starts a stage; the one before it ends.
    pub(crate) fn stage(&self, name: &str) {
        if let Ok(mut stages) = self.stages.lock() {
            stages.push((name.to_owned(), Instant::now()));
        }
        self.bar.reset_elapsed();
        self.at(name, 0.0);
    }

    /// Shows how far a stage has come.
    pub(crate) fn at(&self, name: &str, share: f64) {
        self.bar.set_message(name.to_owned());
        self.bar.set_position((share.clamp(0.0, 1.0) * STEPS as f64) as u64);
    }

    /// A line for the user, on standard error; not shown with `--quiet`.
    pub(crate) fn say(&self, line: impl std::fmt::Display) {
        if !self.quiet {
            self.bar.suspend(|| eprintln!("{line}"));
        }
    }

    /// Ends the display and returns the time of each stage.
    pub(crate) fn finish(&self) -> Vec<StageTiming> {
        self.bar.finish_and_clear();
        let Ok(stages) = self.stages.lock() else {
            return Vec::new();
        };
        let ends = stages.iter().skip(1).map(|s| s.1).chain([Instant::now()]);
        let seconds = |from: Instant, to: Instant| ((to - from).as_secs_f64() * 1000.0).round() / 1000.0;
        stages
            .iter()
            .zip(ends)
            .map(|((stage, start), end)| StageTiming { stage: stage.clone(), seconds: seconds(*start, end) })
            .collect()
    }
}

/// Largest resident memory of this process so far, MB; 0 where the system does not tell.
pub(crate) fn peak_memory_mb() -> f64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|l| l.strip_prefix("VmHWM:"));
    let kb = line.and_then(|l| l.split_whitespace().next()?.parse::<f64>().ok()).unwrap_or(0.0);
    (kb / 1024.0).round()
}
