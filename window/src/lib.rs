//! The window: a model or a job, to be turned, picked, measured, cut open and run through.
//!
//! ```text
//!   Exhibit (model, regions, job) ─► Desk: camera, layers, clock, section, what is picked  ◄─ closest points (exact)
//!                                     ▲ │
//!          events ─► Pane (egui: panels, picture, drags)
//!                                     │ ▼
//!                     Easel (wgpu): Stage draws the picture ─► texture ─► panels over it ─► a window, or nothing
//! ```
//!
//! The desk is a state machine that needs neither a display nor a graphics adapter; [`Headless`] feeds it events and
//! draws into a texture, [`show`] does the same with a window around it. What is drawn comes from meshes and polylines;
//! what is said of a place comes from the exact surfaces and curves.
//!
//! While something moves a software driver draws fewer pixels, once and without shade; at rest all of them, four times
//! over. Passes are kept in levels, each with lines twice as far apart as the next, and only those are drawn that the
//! picture's scale can show.

// What is to be said is returned: only the command prints.
#![cfg_attr(not(test), warn(clippy::print_stdout, clippy::print_stderr))]

mod accents;
mod clock;
mod crests;
mod desk;
mod easel;
mod exhibit;
mod facts;
mod findings;
mod frame;
mod headless;
mod inspector;
mod joints;
mod layers;
mod lines;
mod material;
mod pane;
mod panels;
mod pick;
mod pipelines;
mod shell;
mod sight;
mod stage;
mod theme;
mod tracks;
mod viewport;
mod widgets;

pub use clock::Clock;
pub use crests::Crests;
pub use desk::{Cutting, Desk, Picked, Tool};
pub use easel::Easel;
pub use exhibit::{Exhibit, JobToShow};
pub use facts::{Facts, JointFacts, Measured, PathFacts, SurfaceFacts};
pub use findings::Marked;
pub use headless::Headless;
pub use joints::{JointClass, Seam};
pub use layers::{Layers, Paint, PathPaint};
pub use pane::Pane;
pub use pick::{OnLine, Section, Spot};
pub use shell::{WindowError, WindowOptions, show};
pub use sight::{Ray, Sight};
pub use stage::{Care, Stage};
pub use tracks::ToolPlace;
