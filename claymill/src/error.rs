//! Why a step of a job failed, with advice.

use std::path::PathBuf;

use claymill_clearing::ClearingError;
use claymill_controller::PostError;
use claymill_exchange::{MeshError, ReadError, SolidError};
use claymill_paths::{EndRefusal, ParallelAxes, PlanError};
use claymill_reach::ReachError;
use claymill_stock::StockError;
use claymill_surface_merge::MergeError;
use claymill_tooling::ToolingError;
use claymill_toolpath::{Cancelled, FolderError, Standing};
use claymill_verify::VerifyError;
use thiserror::Error as ThisError;

use crate::job_error::JobError;
use crate::material::MaterialError;
use crate::merging::WishError;
use crate::prototype_error::PrototypeError;
use crate::select::SelectError;

/// Why a step of a job failed.
#[derive(Debug, ThisError)]
pub enum Error {
    /// The model cannot be read.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// An obstacle cannot be read.
    #[error(transparent)]
    Obstacle(#[from] MeshError),
    /// The file of a stock cannot be read, or encloses nothing.
    #[error("stock: {0}")]
    Solid(#[from] SolidError),
    /// The job cannot be meant as it is asked for.
    #[error(transparent)]
    Job(#[from] JobError),
    /// The axes of the model are parallel.
    #[error(transparent)]
    Axes(#[from] ParallelAxes),
    /// Faces cannot be kept apart or together as asked for.
    #[error(transparent)]
    Wish(#[from] WishError),
    /// A text names no faces.
    #[error(transparent)]
    Select(#[from] SelectError),
    /// A text does not say where the material is.
    #[error(transparent)]
    Material(#[from] MaterialError),
    /// Faces cannot be merged.
    #[error(transparent)]
    Merge(#[from] MergeError),
    /// Tools, machine, material or process cannot be read, or do not go together.
    #[error(transparent)]
    Tooling(#[from] ToolingError),
    /// No operations can be chosen.
    #[error("{what}")]
    Choice {
        /// Why.
        what: String,
        /// What to do about it.
        advice: String,
    },
    /// A step ended without a result because its [`Monitor`](crate::Monitor) wanted it to.
    #[error(transparent)]
    Cancelled(Cancelled),
    /// It cannot be found what directions reach.
    #[error(transparent)]
    Reach(ReachError),
    /// A part cannot be made from a bar on a rotary axis.
    #[error(transparent)]
    Prototype(Box<PrototypeError>),
    /// No plan can be made.
    #[error(transparent)]
    Plan(PlanError),
    /// A stock cannot be roughed by levels.
    #[error("levels: {0}")]
    Clearing(ClearingError),
    /// The stock cannot be followed.
    #[error("the stock: {0}")]
    Stock(#[from] StockError),
    /// A job folder cannot be read or written.
    #[error(transparent)]
    Folder(#[from] FolderError),
    /// A job cannot be verified at all.
    #[error(transparent)]
    Verify(VerifyError),
    /// A job may not be run: its moves did not pass verification.
    #[error("{}: {standing}", folder.display())]
    NotCleared {
        /// The job folder.
        folder: PathBuf,
        /// Why not.
        standing: Standing,
    },
    /// A program cannot be written.
    #[error(transparent)]
    Post(#[from] PostError),
}

/// What was cancelled is [`Error::Cancelled`], whatever it was.
impl From<PlanError> for Error {
    fn from(error: PlanError) -> Self {
        match error {
            PlanError::Cancelled(cancelled) => Error::Cancelled(cancelled),
            error => Error::Plan(error),
        }
    }
}

impl From<ClearingError> for Error {
    fn from(error: ClearingError) -> Self {
        match error {
            ClearingError::Cancelled(cancelled) => Error::Cancelled(cancelled),
            error => Error::Clearing(error),
        }
    }
}

impl From<ReachError> for Error {
    fn from(error: ReachError) -> Self {
        match error {
            ReachError::Cancelled(cancelled) => Error::Cancelled(cancelled),
            error => Error::Reach(error),
        }
    }
}

impl From<PrototypeError> for Error {
    fn from(error: PrototypeError) -> Self {
        match error {
            PrototypeError::Reach(e) => e.into(),
            error => Error::Prototype(Box::new(error)),
        }
    }
}

impl From<VerifyError> for Error {
    fn from(error: VerifyError) -> Self {
        match error {
            VerifyError::Cancelled(cancelled) => Error::Cancelled(cancelled),
            error => Error::Verify(error),
        }
    }
}

impl Error {
    /// What to do about it, in one sentence.
    #[must_use]
    pub fn advice(&self) -> String {
        match self {
            Error::Read(e) => e.advice(),
            Error::Obstacle(e) => e.advice().to_owned(),
            Error::Solid(e) => e.advice(),
            Error::Stock(_) => {
                "Look at the stock of the job: its box, its layer, and the unit of the model.".to_owned()
            }
            Error::Job(e) => e.advice().to_owned(),
            Error::Axes(_) => "Choose two different axes, or leave one to be guessed.".to_owned(),
            Error::Wish(e) => e.advice(),
            Error::Select(e) => e.advice(),
            Error::Material(e) => e.advice(),
            Error::Merge(e) => of_merging(e).to_owned(),
            Error::Tooling(e) => e.advice().to_owned(),
            Error::Choice { advice, .. } => advice.clone(),
            Error::Cancelled(_) => "Nothing was left behind.".to_owned(),
            Error::Reach(e) => of_reach(e).to_owned(),
            Error::Prototype(e) => e.advice().to_owned(),
            Error::Plan(e) => of_planning(e).to_owned(),
            Error::Clearing(ClearingError::StockTooSmall { .. }) => {
                "Take a larger block, or let it follow the model: --stock block:5.".to_owned()
            }
            Error::Clearing(_) => {
                "Change the tool, the step-down or the engagement of the levels.".to_owned()
            }
            Error::Folder(e) => e.advice().to_owned(),
            Error::Verify(e) => e.advice(),
            Error::NotCleared { standing: Standing::NotPassed { .. }, .. } => {
                "Change the job until it passes.".to_owned()
            }
            Error::NotCleared { .. } => "Verify the folder, or plan the job again.".to_owned(),
            Error::Post(e) => of_posting(e),
        }
    }
}

fn of_merging(error: &MergeError) -> &'static str {
    match error {
        MergeError::NotFinite { .. } => "Mend the face in the CAD system.",
        MergeError::Contradiction { .. } => "Name fewer faces to be kept together or apart.",
        MergeError::Option { .. } | MergeError::Classes { .. } | MergeError::NoSuchFace { .. } => {
            "Begin with the options of a preset."
        }
    }
}

fn of_planning(error: &PlanError) -> &'static str {
    match error {
        PlanError::Orientation(_) => "Up and front must be two different axes.",
        PlanError::Setups { .. } => "Name each setup once.",
        PlanError::Scallop { .. } => "Usual scallop heights are 0.02 to 0.2 mm.",
        PlanError::Allowance { .. } => {
            "Take a larger ball, or an allowance that is not as far below the surface."
        }
        PlanError::EarlierTool { .. } => "The earlier tool is the larger one.",
        PlanError::NoBall { .. } => "Choose a ball, for example ball:10; it may have a taper and a shank.",
        PlanError::EndNotFor { what: EndRefusal::Strategy(_), .. } => {
            "Flat and bull-nosed ends go along parallel rows: choose the strategy planar, or a ball."
        }
        PlanError::EndNotFor { .. } => "Choose a ball, for example ball:10, or leave that out.",
        PlanError::ToolTooBig { .. } => "Choose a smaller tool, and check the unit of the model.",
        PlanError::Face { .. } => "Leave the face out, or mend it in the CAD system.",
        PlanError::NoSide { .. } => "Name a place beside a region that is cut, in the model's millimetres.",
        PlanError::Sides { .. } | PlanError::TooManySides { .. } => {
            "One place says where a region is swept from, a second one beside another side where to."
        }
        PlanError::NothingToCut => "Look at what is left out, and at the axes.",
        PlanError::Cancelled(_) => "Plan the job again.",
        PlanError::KeptNowhere => "Give the passes of the job a store.",
        PlanError::NoRest => "There is nothing to do: the operations before left nothing for this tool.",
        PlanError::NoStock { .. } => {
            "Give the job its stock: only an operation of a job with stock knows what is left."
        }
    }
}

fn of_reach(error: &ReachError) -> &'static str {
    match error {
        ReachError::Face { .. } => "Leave the face out, or mend it in the CAD system.",
        ReachError::Nothing => "Look at what is left out, and at the axes.",
        ReachError::Direction(_) => "Give a direction that is not zero, from the tip to the holder.",
        ReachError::NoDirection { .. } => "Let the head tilt farther.",
        ReachError::Number { .. } => "Choose a number in the range.",
        ReachError::Cancelled(_) => "Nothing was left behind.",
    }
}

fn of_posting(error: &PostError) -> String {
    match error {
        PostError::Folder(e) => e.advice().to_owned(),
        PostError::Io { source, .. } => claymill_toolpath::advice_on(source).to_owned(),
        PostError::Output(_) => "Choose another name for the program.".to_owned(),
        PostError::Move(_) | PostError::Job(_) => "Plan the job again.".to_owned(),
        PostError::Limits(_) => "Take one of the remedies, or another machine.".to_owned(),
        PostError::Refused { .. } => "Change the machine definition, or post to another dialect.".to_owned(),
        PostError::ReadBack(_) | PostError::Lost { .. } | PostError::Differs { .. } => {
            "Nothing was written. This is a fault of the post: please report it.".to_owned()
        }
    }
}
