//! How commands fail: one message, one line of advice and an exit code. Errors of the libraries get
//! their advice here.

use std::fmt;
use std::io;
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
/// A scheduler should run the command again: nothing is wrong with what it was given.
pub(crate) const TRY_AGAIN: u8 = 75;
/// Again, with more memory.
pub(crate) const MORE_MEMORY: u8 = 76;

impl Failure {
    pub(crate) fn problem(message: impl fmt::Display, advice: impl Into<String>) -> Self {
        Failure { message: message.to_string(), advice: advice.into(), code: PROBLEM }
    }

    /// What is wrong with a file or folder.
    pub(crate) fn at(path: &Path) -> impl Fn(io::Error) -> Self + '_ {
        |error| Failure::problem(format!("{}: {error}", path.display()), advice_on(&error))
    }

    pub(crate) fn usage(message: impl fmt::Display, advice: impl Into<String>) -> Self {
        Failure { message: message.to_string(), advice: advice.into(), code: USAGE }
    }

    pub(crate) fn with_code(code: u8, message: impl fmt::Display, advice: impl Into<String>) -> Self {
        Failure { message: message.to_string(), advice: advice.into(), code }
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

pub(crate) use claymill_toolpath::advice_on;

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
        let advice = error.advice();
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
            E::Limits(_) => "Take one of the remedies above, or another machine with --machine.",
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
            E::EndNotFor { what, .. } => {
                let advice = match what {
                    claymill_paths::EndRefusal::Strategy(_) => {
                        "Flat and bull-nosed ends go along parallel rows: --strategy planar; or choose a ball."
                    }
                    _ => "Choose a ball, for example --tool ball:10, or leave that out.",
                };
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
            E::Allowance { .. } => return Failure::usage(error, "For example: --allowance 3."),
            E::EarlierTool { .. } => {
                return Failure::usage(error, "Give --rest-of the larger tool and --tool the smaller one.");
            }
            E::NoSide { .. } => {
                "Give --guide a place beside a region that is cut, in the model's millimetres: where you click in `claymill view`."
            }
            E::Sides { .. } | E::TooManySides { .. } => {
                "One --guide says where a region is swept from, a second one beside another side where to."
            }
            E::Cancelled(_) => "Plan the job again.",
            E::KeptNowhere => "Name a store with --store.",
            E::NoRest => "There is nothing to do: the operations before left nothing for this tool.",
            E::NoStock { .. } => {
                "Only an operation of a job with stock knows what is left: docs/operations.md describes such jobs."
            }
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

impl From<claymill::JobError> for Failure {
    fn from(error: claymill::JobError) -> Self {
        use claymill::JobError as E;
        let advice = match &error {
            E::Setup(_) => {
                "Setups are top, left, right, front, rear and bottom, for example --setups top,bottom; others have a \
                 direction from tip to holder, for example --setup roof:0,-0.5,1."
            }
            E::TiltedContainment
            | E::Operations { .. }
            | E::TwiceNamed { .. }
            | E::OneNumber { .. }
            | E::Bar { .. }
            | E::StockChanged { .. }
            | E::LevelsWithoutStock
            | E::NotByLevels { .. } => {
                let advice = error.advice();
                return Failure::problem(&error, advice);
            }
            E::RestAbove { .. } => "For example, in the job file: rest_above = 1.0.",
            E::Engagement { .. } => "For example, in the job file: engagement = 50.0.",
            E::StepDown { .. } => "For example, in the job file: step_down = 8.0.",
            E::StepBelowFlutes { .. } => {
                "Take a lower step_down in the job file, or a tool with longer flutes."
            }
            E::Band { .. } => "For example, in the job file: band = 1.0.",
            E::DeadCentre { .. } => "For example, in the job file: dead_centre = 8.0, or 0 if it may plunge.",
            E::Ramp { .. } => "For example, in the job file: ramp = 3.0.",
            E::StockAbove { .. } => "For example: --stock-above 25.",
            E::Allowance { .. } => {
                "For example: --allowance 3 for roughing, or --allowance -0.1 below the surface."
            }
            E::Scallop { .. } => "Usual scallop heights are 0.02 to 0.2 mm, for example --scallop 0.1.",
            E::Feed { .. } => "For example: --feed 6000.",
            E::RowAngle => "For example: --angle 45.",
            E::ToolNumber => "For example: --tool-number 12.",
            E::Steep { .. } => "For example: --steep 45.",
            E::LinesOfOthers | E::Lines { .. } => "For example: --strategy isoparametric --lines 20.",
            E::GuidesOfOthers => "For example: --strategy flow --guide 1200,-300,450.",
            E::Margin { .. } => "For example: --avoid-margin 2.",
            E::Extension { .. } => "For example: --extend 5.",
            E::EmptyBox { .. } => {
                "The first corner has the smaller coordinates, for example: --within 1200,-600,0:2400,600,900."
            }
            E::HolderClearance { .. } => "For example: --holder-clearance 2.",
            E::ObstacleClearance { .. } => "For example: --check-clearance 2.",
            E::RapidClearance { .. } => "For example: --rapid-clearance 10.",
        };
        Failure::usage(error, advice)
    }
}

impl From<claymill::SelectError> for Failure {
    fn from(error: claymill::SelectError) -> Self {
        let advice = error.advice();
        Failure::usage(error, advice)
    }
}

impl From<claymill_tooling::ToolingError> for Failure {
    fn from(error: claymill_tooling::ToolingError) -> Self {
        let advice = error.advice().to_owned();
        Failure::problem(error, advice)
    }
}

impl From<claymill_surface_merge::MergeError> for Failure {
    fn from(error: claymill_surface_merge::MergeError) -> Self {
        use claymill_surface_merge::MergeError as E;
        match error {
            E::NotFinite { .. } => Failure::problem(error, "Mend the face in the CAD system."),
            E::Contradiction { .. } => {
                Failure::usage(error, "Name fewer faces with --keep-together or --keep-apart.")
            }
            error => Failure::usage(error, ""),
        }
    }
}

/// Most steps of the library fail like the crates behind them; where an option can be named, it is.
impl From<claymill::Error> for Failure {
    fn from(error: claymill::Error) -> Self {
        use claymill::{Error as E, MaterialError, Standing, WishError};
        match error {
            E::Read(e) => e.into(),
            E::Obstacle(e) => e.into(),
            E::Job(e) => e.into(),
            E::Axes(e) => Failure::usage(e, "For example: --up +z --length -y."),
            E::Wish(WishError::OneKind { apart }) => Failure::usage(
                format!("--keep-apart {}: all faces are of one kind", apart.join(" --keep-apart ")),
                "`claymill merge` cannot tell them apart by this; name faces, as in face:10-20.",
            ),
            E::Wish(WishError::Select(e)) | E::Select(e) | E::Material(MaterialError::Select(e)) => e.into(),
            E::Material(e) => {
                let advice = e.advice();
                Failure::usage(e, advice)
            }
            E::Merge(e) => e.into(),
            E::Cancelled(e) => Failure::problem(e, "Run the command again."),
            E::Plan(e) => e.into(),
            E::Folder(e) => e.into(),
            E::Verify(e) => e.into(),
            E::NotCleared { ref standing, .. } => {
                let advice = match standing {
                    Standing::NotPassed { .. } => {
                        "Change the job until it passes; --unverified runs it all the same, and its programs say so."
                    }
                    _ => {
                        "Run `claymill verify` on the folder, or plan the job again; --unverified runs it all the same, \
                         and its programs say so."
                    }
                };
                Failure::problem(error, advice)
            }
            E::Post(e) => e.into(),
            E::Tooling(_)
            | E::Clearing(_)
            | E::Stock(_)
            | E::Solid(_)
            | E::Choice { .. }
            | E::Reach(_)
            | E::Prototype(_) => {
                let advice = error.advice();
                Failure::problem(error, advice)
            }
        }
    }
}
