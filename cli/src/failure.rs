//! How commands fail: one message, one line of advice and an exit code. Errors of the libraries get
//! their advice here.

use std::fmt;
use std::path::Path;

use crate::console::{Tone, takes_colours};

/// Why a command could not do its work: printed with cause and advice, then the process ends with `code`.
#[derive(Debug)]
pub(crate) struct Failure {
    message: String,
    advice: String,
    code: u8,
}

/// The model or the job has a problem.
pub(crate) const PROBLEM: u8 = 1;
/// The command line is wrong.
pub(crate) const USAGE: u8 = 2;
/// The command did its work, and what it judged does not pass.
pub(crate) const NOT_PASSED: u8 = 3;

impl Failure {
    pub(crate) fn problem(message: impl fmt::Display, advice: impl Into<String>) -> Self {
        Failure { message: message.to_string(), advice: advice.into(), code: PROBLEM }
    }

    pub(crate) fn usage(message: impl fmt::Display, advice: impl Into<String>) -> Self {
        Failure { message: message.to_string(), advice: advice.into(), code: USAGE }
    }

    /// The same about other paths: what is written in a scratch folder is told as if it were beside `told`.
    pub(crate) fn about(mut self, scratch: &Path, told: &Path) -> Self {
        // With the separator behind it, which an empty path has not.
        let folder = |path: &Path| path.join("").to_string_lossy().into_owned();
        let beside = told.parent().map(folder).unwrap_or_default();
        self.message = self.message.replace(&folder(scratch), &beside);
        self
    }

    pub(crate) fn message(&self) -> &str {
        &self.message
    }

    pub(crate) fn code(&self) -> u8 {
        self.code
    }
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let error = Tone::Bad.paint("error:", takes_colours());
        write!(f, "{error} {}", self.message)?;
        if !self.advice.is_empty() {
            write!(f, "\n  help: {}", self.advice)?;
        }
        Ok(())
    }
}

/// What to do when the operating system refuses to read or write.
pub(crate) fn advice_on(error: &std::io::Error) -> &'static str {
    use std::io::ErrorKind as Kind;
    match error.kind() {
        Kind::NotFound => "Check the path.",
        Kind::IsADirectory | Kind::InvalidInput => "Name a file.",
        Kind::FileTooLarge | Kind::InvalidData => "Check the path: this is another kind of file.",
        Kind::PermissionDenied | Kind::ReadOnlyFilesystem => "Choose a folder that you may write to.",
        Kind::NotADirectory | Kind::AlreadyExists => {
            "A file is in the way where a folder is needed: choose another folder."
        }
        Kind::StorageFull | Kind::QuotaExceeded | Kind::WriteZero => {
            "The disk is full: free some space or choose another one. Nothing was left behind."
        }
        _ => "Nothing was left behind; correct the cause and run the command again.",
    }
}

impl From<claymill_exchange::ReadError> for Failure {
    fn from(error: claymill_exchange::ReadError) -> Self {
        Failure::problem(&error, error.advice())
    }
}

impl From<claymill_exchange::MeshError> for Failure {
    fn from(error: claymill_exchange::MeshError) -> Self {
        Failure::problem(&error, error.advice())
    }
}

impl From<claymill_toolpath::FolderError> for Failure {
    fn from(error: claymill_toolpath::FolderError) -> Self {
        use claymill_toolpath::FolderError as E;
        let advice = match &error {
            E::Io { source, .. } => advice_on(source),
            E::Format { .. } | E::Implausible { .. } => {
                "The file was changed or made by another version: plan the job again."
            }
            E::NotAJobFolder(_) => {
                "Choose a new folder, or empty this one; other people's files are never replaced."
            }
            E::NotOurs { .. } => {
                "Move them elsewhere, or choose another folder: only what claymill wrote is replaced."
            }
            E::Busy { .. } => "Wait until it has ended, or choose another place.",
        };
        Failure::problem(&error, advice)
    }
}

impl From<claymill_controller::MachineError> for Failure {
    fn from(error: claymill_controller::MachineError) -> Self {
        Failure::usage(&error, "docs/controllers.md has a machine definition with every field.")
    }
}

impl From<claymill_controller::ReadError> for Failure {
    fn from(error: claymill_controller::ReadError) -> Self {
        use claymill_controller::ReadError as E;
        let advice = match &error {
            E::Io { source, .. } => advice_on(source),
            E::Refused { .. } => {
                "The control would not execute this as the job has it: write the program again."
            }
            E::Unrecognised(_) => "Name the control with --dialect.",
            E::Astray { .. } => "Give the job folder and the --machine that the program was written with.",
        };
        Failure::problem(&error, advice)
    }
}

impl From<claymill_controller::PostError> for Failure {
    fn from(error: claymill_controller::PostError) -> Self {
        use claymill_controller::PostError as E;
        let advice = match error {
            E::Folder(e) => return e.into(),
            E::Output(e) => return e.into(),
            E::ReadBack(e) => return e.into(),
            E::Io { ref source, .. } => advice_on(source),
            E::Move(_) | E::Job(_) => "Plan the job again with `claymill plan`.",
            E::Refused { .. } => "Change the machine definition (--machine), or post to another dialect.",
            E::Lost { .. } | E::Differs { .. } => {
                "Nothing was written. This is a fault of the post: please report it."
            }
        };
        Failure::problem(&error, advice)
    }
}

impl From<claymill_paths::PlanError> for Failure {
    fn from(error: claymill_paths::PlanError) -> Self {
        use claymill_paths::PlanError as E;
        let advice = match &error {
            E::Orientation(_) => return Failure::usage(error, "For example: --up +z --length -y."),
            E::Setups { .. } => return Failure::usage(error, "For example: --setups top,left,bottom."),
            E::Scallop { .. } => {
                let advice = "Usual scallop heights are 0.02 to 0.2 mm, for example --scallop 0.1.";
                return Failure::usage(error, advice);
            }
            E::NoBall { .. } => {
                return Failure::usage(
                    error,
                    "Choose a ball, for example --tool ball:10; it may have a taper and a shank.",
                );
            }
            E::ToolTooBig { .. } => {
                "Choose a smaller --tool, and check the units that `claymill inspect` shows."
            }
            E::Face { .. } => "Leave the face out with --skip, or mend it in the CAD system.",
            E::EarlierTool { .. } => {
                return Failure::usage(error, "Give --rest-of the larger tool and --tool the smaller one.");
            }
            E::NoSide { .. } => {
                "Give --guide a place beside a region that is cut, in the model's millimetres: where you click in `claymill view`."
            }
            E::Sides { .. } | E::TooManySides { .. } => {
                "One --guide says where a region is swept from, a second one beside another side where to."
            }
            E::NoRest => "There is nothing to do: no valley is tighter than the earlier tool.",
            E::NothingToCut => "Check --only, --skip, --up and --length.",
        };
        Failure::problem(&error, advice)
    }
}

impl From<claymill_paths::AxisError> for Failure {
    fn from(error: claymill_paths::AxisError) -> Self {
        Failure::usage(error, "For example: --up +z --length -y.")
    }
}
