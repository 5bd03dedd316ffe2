//! Generated models whose answers are known by construction.
//!
//! On request flaws of known size are planted ([`Flaw`]).
//!
//! ```text
//!   feature lines ─► sheets (one for each smooth region) ─► cut into patches ─► shuffled ─► model
//!                                                               └─► joints, regions ─► answers
//! ```
//!
//! A reader of the model has to find again what the answers say: which faces adjoin, how smoothly, and
//! which of them form one smooth region. Nothing in the model itself gives this away.
//!
//! ```
//! use claymill_models::{RoadsterOptions, roadster};
//! let sample = roadster(&RoadsterOptions { patches: 500, seed: 7 });
//! assert_eq!(sample.answers.regions.len(), 37);
//! assert_eq!(sample.answers.region_of_face.len(), sample.model.faces.len());
//! ```

// What is to be said is returned: only the command prints.
#![cfg_attr(not(test), warn(clippy::print_stdout, clippy::print_stderr))]

mod answers;
mod damage;
mod flaw;
mod joints;
mod layout;
mod network;
mod panel;
mod ribbon;
mod roadster;
mod sheet;
mod shuffle;
mod spline;
mod write;

use claymill_nurbs::Model;

pub use answers::{Answers, Continuity, Joint, Region, Totals};
pub use flaw::{Flaw, FlawError, PlantedFlaw};
pub use panel::panel;
pub use ribbon::ribbon;
pub use roadster::{RoadsterOptions, roadster, roadster_edited};
pub use write::{SAMPLES, SampleError, generate, write_sample};

/// A generated model and what is known about it.
#[derive(Debug, Clone)]
pub struct Sample {
    /// The model.
    pub model: Model,
    /// Its answers.
    pub answers: Answers,
}
