use std::ffi::OsStr;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::sync::LazyLock;

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

/// Runs the command in `folder` as on a machine without a graphics adapter. A software driver draws the pictures of a
/// small job for two thirds of its time; this is for jobs whose pictures nobody looks at, of models that other tests draw.
pub(crate) fn run_without_adapter<S: AsRef<OsStr>>(folder: &Path, args: impl IntoIterator<Item = S>) -> Run {
    let mut command = claymill();
    command.args(args).current_dir(folder).env("WGPU_ADAPTER_NAME", "none");
    command.output().expect("the command starts").into()
}

/// A generated panel in 202 patches, 600 × 400 mm, in `folder`.
pub(crate) fn panel(folder: &Path) -> PathBuf {
    let made = run(folder, ["sample", "panel", "--patches", "200", "-o", "panel.igs"]);
    assert_eq!(made.code, Some(0), "{made:?}");
    folder.join("panel.igs")
}

/// The panel and a coarse job on it with pictures, planned once for all tests.
static PANEL_JOB: LazyLock<PathBuf> = LazyLock::new(|| {
    // Nothing is dropped at the end of a static: a fixed place, so that runs do not pile up.
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("panel_job");
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder).unwrap();
    panel(&folder);
    let made = run(&folder, ["plan", "panel.igs", "--tool", "ball:10", "--scallop", "2", "-o", "job"]);
    assert_eq!(made.code, Some(0), "{made:?}");
    folder
});

/// A copy of the panel and of the folder `job`, a coarse job on it, in `folder`. A job may be moved with its model.
pub(crate) fn panel_job(folder: &Path) {
    let copy_all = |from: &Path, to: &Path| {
        for entry in fs::read_dir(from).unwrap().map(Result::unwrap).filter(|e| e.path().is_file()) {
            fs::copy(entry.path(), to.join(entry.file_name())).unwrap();
        }
    };
    copy_all(&PANEL_JOB, folder);
    fs::create_dir(folder.join("job")).unwrap();
    copy_all(&PANEL_JOB.join("job"), &folder.join("job"));
}
