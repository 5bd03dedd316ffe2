//! Output for the user: progress and stage times on standard error, results on standard output,
//! colours, and the form of counts, lengths and numbers.

use std::collections::BTreeMap;
use std::io::IsTerminal;
use std::sync::Mutex;
use std::time::{Duration, Instant};

use claymill_toolpath::{Monitor, Stage, StageTiming};
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
    coloured: bool,
    bar: ProgressBar,
    stages: Mutex<Vec<(String, Instant)>>,
    now: Mutex<Now>,
}

/// The part of a stage that runs, and what it counts.
#[derive(Debug, Default)]
struct Now {
    part: String,
    since: Option<Instant>,
    /// How many of what a part has to do, where that is known.
    totals: BTreeMap<&'static str, (u64, &'static str)>,
    /// When a line of progress was last written where there is no bar.
    line_at: Option<Instant>,
}

/// Where standard error is no terminal, a line of progress is written this often.
const LINE_EVERY: Duration = Duration::from_secs(10);

const STEPS: u64 = 1000;
/// Lines for the user are no longer than the narrowest terminal is wide.
pub(crate) const COLUMNS: usize = 80;
/// Where lines go on.
const INDENT: usize = 10;

/// What a word on the screen means.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Tone {
    Good,
    Bad,
    Warning,
}

/// `1 region`, `2 regions`: a count with its noun.
pub(crate) fn counted(n: usize, noun: &str) -> String {
    format!("{n} {noun}{}", if n == 1 { "" } else { "s" })
}

/// Metres of a length, to the millimetre; what is less is nothing, never a negative nothing.
pub(crate) fn metres(mm: f64) -> String {
    format!("{:.3}", (mm / 1000.0 * 1e3).round() / 1e3 + 0.0)
}

/// A number as people write it: six significant digits, no tail of a conversion.
pub(crate) fn six_digits(value: f64) -> String {
    let rounded = format!("{value:.5e}").parse().unwrap_or(value);
    format!("{rounded}")
}

impl Tone {
    /// The words stay the same without the colour.
    pub(crate) fn paint(self, words: &str, coloured: bool) -> String {
        let code = match self {
            Tone::Good => "1;32",
            Tone::Bad => "1;31",
            Tone::Warning => "1;33",
        };
        if coloured { format!("\x1b[{code}m{words}\x1b[0m") } else { words.to_owned() }
    }
}

/// Whether standard error takes colours: a terminal that is not told otherwise (<https://no-color.org>).
pub(crate) fn takes_colours() -> bool {
    let set = |name: &str| std::env::var_os(name).is_some_and(|v| !v.is_empty());
    let dumb = std::env::var_os("TERM").is_some_and(|t| t == "dumb");
    std::io::stderr().is_terminal() && !set("NO_COLOR") && !dumb
}

impl Console {
    pub(crate) fn new(quiet: bool) -> Self {
        let bar = if quiet || !std::io::stderr().is_terminal() {
            ProgressBar::hidden()
        } else {
            let bar = ProgressBar::new(STEPS);
            let style = ProgressStyle::with_template(
                "{msg:<19} {wide_bar} {percent:>3} % {elapsed:>4}  {prefix:<32}",
            );
            bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
            bar
        };
        let (stages, now) = (Mutex::new(Vec::new()), Mutex::new(Now::default()));
        Console { quiet, coloured: takes_colours(), bar, stages, now }
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
        tracing::info!("{name}");
        if let Ok(mut stages) = self.stages.lock() {
            stages.push((name.to_owned(), Instant::now()));
        }
        if !self.bar.is_hidden() {
            // Only now: a console that starts no stage draws nothing.
            self.bar.enable_steady_tick(Duration::from_millis(200));
        }
        self.at(name, 0.0);
    }

    /// Tells how many of what a part of a stage has to do, so that its rate can be shown.
    pub(crate) fn expect(&self, part: &'static str, total: u64, noun: &'static str) {
        if let Ok(mut now) = self.now.lock() {
            now.totals.insert(part, (total, noun));
        }
    }

    /// Shows how far a part of a stage has come, how fast it goes, and how long it may still take.
    pub(crate) fn at(&self, name: &str, share: f64) {
        let share = share.clamp(0.0, 1.0);
        if let Ok(mut now) = self.now.lock() {
            if now.part != name {
                // The remaining time is this part's.
                self.bar.reset();
                self.bar.set_message(name.to_owned());
                (now.part, now.since) = (name.to_owned(), Some(Instant::now()));
            }
            let seconds = now.since.map_or(0.0, |t| t.elapsed().as_secs_f64());
            let rate = rate(share, seconds, now.totals.get(name).copied());
            let last = *now.line_at.get_or_insert_with(Instant::now);
            if self.bar.is_hidden() && !self.quiet && last.elapsed() >= LINE_EVERY {
                now.line_at = Some(Instant::now());
                let comma = if rate.is_empty() { "" } else { ", " };
                eprintln!("{:<INDENT$}{name}: {:.0} %{comma}{rate}", "progress", 100.0 * share);
            }
            self.bar.set_prefix(rate);
        }
        self.bar.set_position((share * STEPS as f64) as u64);
    }

    /// A line for the user, on standard error; not shown with `--quiet`.
    pub(crate) fn say(&self, line: impl std::fmt::Display) {
        if self.quiet {
            return;
        }
        let line = line.to_string();
        let line = match line.strip_prefix("warning:") {
            Some(rest) => format!("{}{rest}", Tone::Warning.paint("warning:", self.coloured)),
            None => line,
        };
        self.bar.suspend(|| eprintln!("{line}"));
    }

    /// A line that begins with `label` and goes on below, indented, where it would be too long; it breaks between
    /// words only.
    pub(crate) fn say_long(&self, label: &str, text: &str) {
        for line in wrapped(label, text) {
            self.say(line);
        }
    }

    /// The last word on something.
    pub(crate) fn say_verdict(&self, tone: Tone, words: &str) {
        self.say(format!("{:INDENT$}{}", "", tone.paint(words, self.coloured)));
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

/// `3422 moves/s, about 10 s left`; of the whole where there is nothing to count, and nothing before it can be told.
fn rate(share: f64, seconds: f64, total: Option<(u64, &str)>) -> String {
    if share <= 0.0 || seconds < 0.5 {
        return String::new();
    }
    let left_s = seconds * (1.0 - share) / share;
    let left = if left_s < 100.0 { format!("{left_s:.0} s") } else { format!("{:.0} min", left_s / 60.0) };
    let (per_second, noun) = match total {
        Some((total, noun)) => (total as f64 * share / seconds, noun),
        None => (100.0 * share / seconds, "%"),
    };
    let (value, unit) = if per_second < 1.0 { (60.0 * per_second, "min") } else { (per_second, "s") };
    format!("{value:.0} {noun}/{unit}, about {left} left")
}

/// Words after a label, broken into lines of at most [`COLUMNS`] where words allow it.
fn wrapped(label: &str, text: &str) -> Vec<String> {
    let mut lines = vec![format!("{label:<INDENT$}")];
    for word in text.split(' ') {
        let Some(last) = lines.last_mut() else { break };
        let begun = last.len() > INDENT;
        if begun && last.chars().count() + 1 + word.chars().count() > COLUMNS {
            lines.push(format!("{:INDENT$}{word}", ""));
        } else {
            if begun {
                last.push(' ');
            }
            last.push_str(word);
        }
    }
    lines
}

impl Monitor for Console {
    fn at(&self, stage: Stage, share: f64) {
        Console::at(self, &stage.to_string(), share);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_lines_break_between_words_and_lose_none() {
        let text = "4.119 km in 28793 passes, 2031 retracts, links 0.138 km, leads 0.071 km, rapids 0.734 km";
        let lines = wrapped("paths", text);
        assert_eq!(lines.len(), 2);
        assert!(lines.iter().all(|l| l.chars().count() <= COLUMNS), "{lines:?}");
        assert!(lines[0].starts_with("paths     4.119") && lines[1].starts_with("          "), "{lines:?}");
        let words: Vec<&str> = lines.iter().flat_map(|l| l.split_whitespace()).skip(1).collect();
        assert_eq!(words.join(" "), text);
        let long = "x".repeat(200);
        assert_eq!(wrapped("", &long), [format!("{:10}{long}", "")]);
    }

    #[test]
    fn rates_have_the_unit_that_reads_well() {
        assert_eq!(rate(0.5, 10.0, Some((68_432, "moves"))), "3422 moves/s, about 10 s left");
        assert_eq!(rate(0.1, 60.0, Some((60, "faces"))), "6 faces/min, about 9 min left");
        assert_eq!(rate(0.1, 60.0, None), "10 %/min, about 9 min left");
        assert_eq!(rate(0.0, 60.0, None), "");
    }

    #[test]
    fn colours_add_nothing_but_colours() {
        assert_eq!(Tone::Bad.paint("NOT PASSED", false), "NOT PASSED");
        assert_eq!(Tone::Good.paint("PASSED", true), "\x1b[1;32mPASSED\x1b[0m");
    }
}
