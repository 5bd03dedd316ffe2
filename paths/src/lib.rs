//! From regions to a program: setups, passes that cannot gouge, refit, links.
//!
//! ```text
//!   model, regions
//!      │  reach      which setup cuts which part of which region
//!      │  raster     where rows run: step-over from scallop height, slope and curvature
//!      │  profile    the exact path of the ball over a row: dropped on ALL faces (contact)
//!      │  refit      one cubic NURBS per smooth stretch, on the safe side, rounded, measured again
//!      │  order      lace or box;  part: links that stay down where that is proven, else over a proven height
//!      ▼
//!   Plan: the program and its totals
//! ```
//!
//! Regions only decide where rows run. Whether a location is safe is decided by the contact with all faces
//! of the model, those of other regions and excluded ones included.
//!
//! ```
//! use claymill_paths::Orientation;
//! let up_z_front_minus_y = Orientation::new("+z".parse()?, "-y".parse()?)?;
//! let names = claymill_paths::Frame::five(up_z_front_minus_y).map(|f| f.name);
//! assert_eq!(names, ["top", "left", "right", "front", "rear"]);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod account;
mod banded;
mod between;
mod breaks;
mod claimed_mesh;
mod claims;
mod contact;
mod contour;
mod crests;
mod crowd;
mod cubics;
mod cuts;
mod error;
mod field_levels;
mod first_levels;
mod fit_tolerance;
mod frame;
mod free_sides;
mod ground;
mod guide;
mod halfway;
mod heights;
mod in_triangle;
mod keep;
mod kept_passes;
mod kinematics;
mod layout;
mod leads;
mod leaning;
mod levels;
mod material;
mod mend;
mod near;
mod obstacles;
mod options;
mod order;
mod orientation;
mod outline;
mod part;
mod patch_levels;
mod pattern;
mod pencil;
mod plan;
mod plan_curve;
mod planned;
mod probe;
mod profile;
mod program;
mod proofs;
mod proven;
mod raster;
mod reach;
mod refit;
mod regions;
mod rims;
mod rows;
mod run_out;
mod setup_context;
mod sides;
mod slopes;
mod space;
mod spines;
mod spiral;
mod spline;
mod step_over;
mod strategy;
mod strokes;
mod sweeps;
mod target;
mod together;
mod tour;
mod wall_claims;
mod walls;
mod waterline;
mod written;

pub use contact::{
    BallDrop, Covering, END_EPSILON_MM, EndDrop, EndLocation, Location, March, Support, ToolPart,
};
pub use crowd::{Covered, LeftOut};
pub use error::PlanError;
pub use fit_tolerance::FitTolerance;
pub use frame::{Axis, AxisError, Frame, RowsAlong};
pub use kinematics::times_s;
pub use obstacles::plan_around;
pub use options::{CLEARANCE_MM, Feeds, PlanOptions, STEEP_DEG, check_tools};
pub use orientation::{Orientation, OrientationGuess, ParallelAxes};
pub use plan::plan;
pub use planned::Plan;
pub use program::TOOL_ID;
pub use regions::Regions;
pub use step_over::flat_mm;
pub use strategy::Strategy;
