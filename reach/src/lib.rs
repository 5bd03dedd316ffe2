//! Which directions reach what of a part, and the fewest that reach all that can be reached.
//!
//! ```text
//!      a   b   c            samples of the exact faces, and directions of the tool:
//!       ╲  │  ╱             a tool that touches a sample comes from a direction if nothing holds it up,
//!     ╭──╲─┴─╱──╮           neither its end nor its shank nor its holder          (`Reach`)
//!     │  1╲ ╱2  │
//!     │    3    │           fewest directions that reach 1, 2 and 3, and a proof  (`choose`, `Certificate`)
//!     ╰─────────╯
//! ```
//!
//! Whether a tool gets to a sample is asked of the exact drop cutter (`claymill-contact`), in a frame of integers. The
//! cover is found by branch and bound; its [`Certificate`] needs only the table of who reaches what to be checked.
//! Around a rotary axis [`Slices`] gives the arcs of angles from which a place is seen, as exactly as rays on the
//! surfaces tell. [`supports`] sizes what holds a part between two chucks.
//!
//! ```
//! use claymill_nurbs::analytic::{Frame as Placement, cylinder};
//! use claymill_nurbs::{Face, Model, Point3, Source, SurfaceKind, Vector3};
//! use claymill_reach::{Part, Reach, Reacher, choose, circle};
//!
//! // A shaft along x is milled from all around: with tools that lean by 60° at most, three angles reach all of it.
//! let at = Placement::new(Point3::origin(), Vector3::x(), Vector3::y()).ok_or("parallel")?;
//! let round = cylinder(&at, 15.0, (0.0, std::f64::consts::TAU), (0.0, 60.0))?;
//! let kind = SurfaceKind::Cylinder;
//! let face = Face { surface: round, loops: Vec::new(), reversed: false, kind, source: Source::default() };
//! let model = Model { faces: vec![face], ..Model::default() };
//! let area_mm2 = [model.faces[0].area_mm2()];
//! let part =
//!     Part { model: &model, face_area_mm2: &area_mm2, free_sides: &[], open: &[], excluded: &[] };
//! let reacher = Reacher { steepest_deg: 60.0, walls: false, ..Reacher::of("ball:3".parse()?) };
//! let angles = circle("+x".parse()?, 15.0, "+z".parse()?, "-y".parse()?)?;
//! let reach = Reach::new(&part, &reacher, &angles, &())?;
//! let found = choose(&reach.table, &reach.weights(), &[], 0.0, &())?;
//! assert_eq!(found.columns.len(), 3);
//! assert!(found.is_optimal());
//! found.certificate.check(&reach.table, &[])?;
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod axes;
mod bar;
mod bits;
mod cover;
mod direction;
mod error;
mod file;
mod found;
mod part;
mod samples;
mod slices;
mod supports;

pub use axes::{AxisView, SEEN_SHARE, axis_views, best_axis};
pub use bits::BitSet;
pub use cover::{
    Arc, Certificate, CertificateError, Child, Cover, Gain, Proof, SHARE, Table, choose, cover,
    fewest_angles, gains,
};
pub use direction::{Direction, Origin, at_angle, circle, sphere};
pub use error::ReachError;
pub use file::{DirectionRecord, GainRecord, PlaceRecord, REACH_FORMAT_VERSION, ReachFile, UnreachedRecord};
pub use found::{Pose, Reach, Seen};
pub use part::{Part, Reacher, USUAL_STEEPEST_DEG};
pub use samples::{MOST_SAMPLES, Sample, samples, spacing_mm};
pub use slices::Slices;
pub use supports::{Load, Shaft, Stiffness, SupportError, supports};
