//! What some tests need and a machine may lack. A test whose need is absent says so in a file, or fails where
//! `CLAYMILL_REQUIRE` demands it: no test passes without having run and nobody knowing.

use std::fmt::{self, Display};
use std::fs::{self, File};
use std::io::{self, Write};
use std::panic::Location;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// Something that no test can do without, but a machine can.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Need {
    /// The folder of public models.
    Corpus,
    /// A graphics adapter with a Vulkan driver; a software driver serves.
    Vulkan,
    /// Chromium or Chrome.
    Chromium,
    /// An X server without a screen, and a hand for it: `Xvfb`, `xdotool` and the libraries of a window.
    Xvfb,
    /// The interpreter and the simulator of LinuxCNC.
    LinuxCnc,
    /// A job folder named by `CLAYMILL_JOB`.
    Job,
    /// A processor with AVX2.
    Avx2,
    /// The right to mount a small file system.
    Mount,
    /// `sh` and `mkfifo`, and GNU parallel.
    UnixTools,
    /// `slurmctld`, `slurmd`, `sbatch` and `munged`.
    Slurm,
}

impl Need {
    /// All of them.
    pub const ALL: [Need; 10] = [
        Need::Corpus,
        Need::Vulkan,
        Need::Chromium,
        Need::Xvfb,
        Need::LinuxCnc,
        Need::Job,
        Need::Avx2,
        Need::Mount,
        Need::UnixTools,
        Need::Slurm,
    ];

    /// The name in `CLAYMILL_REQUIRE` (in any case of letters), in the file and in the count.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Need::Corpus => "corpus",
            Need::Vulkan => "Vulkan",
            Need::Chromium => "Chromium",
            Need::Xvfb => "Xvfb",
            Need::LinuxCnc => "LinuxCNC",
            Need::Job => "job",
            Need::Avx2 => "AVX2",
            Need::Mount => "mount",
            Need::UnixTools => "unix-tools",
            Need::Slurm => "Slurm",
        }
    }

    /// Whether a comma-separated list of names demands it; `all` demands everything.
    fn is_demanded_by(self, list: &str) -> Result<bool, UnknownNeed> {
        let mut is_demanded = false;
        for word in list.split(',').map(str::trim).filter(|word| !word.is_empty()) {
            if word.eq_ignore_ascii_case("all") {
                is_demanded = true;
            } else {
                let named = Need::ALL.into_iter().find(|need| word.eq_ignore_ascii_case(need.name()));
                is_demanded |= named.ok_or_else(|| UnknownNeed(word.to_owned()))? == self;
            }
        }
        Ok(is_demanded)
    }
}

impl Display for Need {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// `CLAYMILL_REQUIRE` names something that is no need: a misspelt demand would demand nothing.
#[derive(Debug, PartialEq, Eq)]
struct UnknownNeed(String);

/// Records that the calling test, or a part of it, is left out, and why. The test then returns.
///
/// The line goes to the file `$CLAYMILL_SKIPPED`, else to `target/tests-skipped.txt`, and to standard error.
///
/// # Panics
/// `CLAYMILL_REQUIRE` demands what is absent, or names something unknown; or the file cannot be written.
#[track_caller]
pub fn leave_out(need: Need, reason: impl Display) {
    let place = Location::caller();
    let demanded = std::env::var("CLAYMILL_REQUIRE").unwrap_or_default();
    match need.is_demanded_by(&demanded) {
        Ok(true) => panic!("CLAYMILL_REQUIRE demands {need}, which is absent: {reason}"),
        Ok(false) => {}
        Err(UnknownNeed(word)) => {
            let known = Need::ALL.map(Need::name).join(", ");
            panic!("CLAYMILL_REQUIRE names {word}; known are {known} and all");
        }
    }
    eprintln!("skipped: {need}: {reason}");
    let beside = concat!(env!("CARGO_MANIFEST_DIR"), "/../target/tests-skipped.txt");
    let file = std::env::var_os("CLAYMILL_SKIPPED").map_or_else(|| beside.into(), PathBuf::from);
    // The harness runs each test in a thread of its name, unless it has only one.
    let thread = std::thread::current();
    let test = thread.name().filter(|name| *name != "main").unwrap_or("?");
    record(&file, &line(need, place, test, &reason))
        .unwrap_or_else(|e| panic!("{} cannot be written: {e}", file.display()));
}

/// One line: need, place, test, reason, separated by tabs.
fn line(need: Need, place: &Location<'_>, test: &str, reason: &dyn Display) -> String {
    let reason = reason.to_string().split_whitespace().collect::<Vec<_>>().join(" ");
    format!("{need}\t{}:{}\t{test}\t{reason}\n", place.file(), place.line())
}

/// Appends a line in one piece: tests of several programs write at the same time.
fn record(file: &Path, line: &str) -> io::Result<()> {
    if let Some(folder) = file.parent() {
        fs::create_dir_all(folder)?;
    }
    File::options().create(true).append(true).open(file)?.write_all(line.as_bytes())
}

/// Whether a program is there; where it is not, the calling test is left out.
#[must_use]
#[track_caller]
pub fn is_installed(need: Need, program: &str, package: &str) -> bool {
    let mut which = Command::new("which");
    let is_there = which.arg(program).stdout(Stdio::null()).status().is_ok_and(|s| s.success());
    if !is_there {
        leave_out(need, format_args!("{program} is not installed (Debian package {package})"));
    }
    is_there
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_list_demands_what_it_names_and_nothing_else() {
        let is_demanded = |need: Need, list: &str| need.is_demanded_by(list);
        for need in Need::ALL {
            assert_eq!(is_demanded(need, ""), Ok(false));
            assert_eq!(is_demanded(need, "all"), Ok(true));
            assert_eq!(is_demanded(need, need.name()), Ok(true));
            assert_eq!(
                is_demanded(need, "vulkan, linuxcnc"),
                Ok([Need::Vulkan, Need::LinuxCnc].contains(&need))
            );
        }
        assert_eq!(is_demanded(Need::Vulkan, "vulkan,corpsu"), Err(UnknownNeed("corpsu".to_owned())));
    }

    #[test]
    fn each_test_left_out_has_a_line_of_its_own() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("target/left-out.txt");
        for test in ["first", "second"] {
            let place = Location::caller();
            record(&file, &line(Need::Vulkan, place, test, &"no driver:\n\tnone")).unwrap();
        }
        let text = fs::read_to_string(&file).unwrap();
        let fields: Vec<Vec<&str>> = text.lines().map(|line| line.split('\t').collect()).collect();
        assert_eq!(fields.len(), 2, "{text}");
        for (fields, test) in fields.iter().zip(["first", "second"]) {
            let [need, place, name, reason] = fields[..] else { panic!("{fields:?}") };
            assert_eq!((need, name, reason), ("Vulkan", test, "no driver: none"));
            assert!(place.starts_with(file!()), "{place}");
        }
    }
}
