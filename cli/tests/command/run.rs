use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

/// What a run gave.
#[derive(Debug)]
pub(crate) struct Run {
    pub(crate) code: Option<i32>,
    pub(crate) stdout: String,
    pub(crate) stderr: String,
}

impl From<Output> for Run {
    fn from(output: Output) -> Self {
        Run {
            code: output.status.code(),
            stdout: String::from_utf8_lossy(&output.stdout).into_owned(),
            stderr: String::from_utf8_lossy(&output.stderr).into_owned(),
        }
    }
}

impl Run {
    /// The result printed with `--json`.
    pub(crate) fn json(&self) -> serde_json::Value {
        serde_json::from_str(&self.stdout).unwrap_or_else(|e| panic!("{e}: {self:?}"))
    }
}

/// The built command.
pub(crate) fn claymill() -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_claymill"));
    command.stdin(Stdio::null());
    command
}

/// Runs the command in `folder`.
pub(crate) fn run<S: AsRef<OsStr>>(folder: &Path, args: impl IntoIterator<Item = S>) -> Run {
    claymill().args(args).current_dir(folder).output().expect("the command starts").into()
}

/// A generated panel in 202 patches, 600 × 400 mm, in `folder`.
pub(crate) fn panel(folder: &Path) -> PathBuf {
    let made = run(folder, ["sample", "panel", "--patches", "200", "-o", "panel.igs"]);
    assert_eq!(made.code, Some(0), "{made:?}");
    folder.join("panel.igs")
}
