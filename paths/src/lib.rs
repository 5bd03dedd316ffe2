//! From regions to a program: setups, passes that cannot gouge, refit, links.
//!
//! ```text
//!   model, regions
//!      │  reach      which setup cuts which part of which region
//!      │  raster     where rows run: step-over from scallop height, slope and curvature
//!      │  profile    the exact path of the ball over a row: dropped on ALL faces (contact)
//!      │  refit      one cubic NURBS per smooth stretch, on the safe side, rounded, measured again
//!      │  order      zigzag or one-way;  part: links that stay down where that is proven, else over a proven height
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
//! let names = up_z_front_minus_y.five_setups()?.map(|f| f.name);
//! assert_eq!(names, ["top", "left", "right", "front", "rear"]);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod containment;
mod curve;
mod fit;
mod follow;
mod link;
mod pattern;
mod plan;
mod program;
mod setup;

pub use claymill_contact::{
    Axis, AxisError, BallDrop, CUTTER_EPSILON_MM, Covering, CutterDrop, CutterLocation, EndShape, Frame,
    FrameError, Location, March, ParallelAxes, Support, ToolPart,
};
pub use fit::tolerance::FitTolerance;
pub use pattern::step_over::flat_mm;
pub use pattern::strategy::Strategy;
pub use plan::covered::{Covered, LeftOut};
pub use plan::error::{EndRefusal, PlanError};
pub use plan::obstacles::plan_around;
pub use plan::options::{CLEARANCE_MM, Feeds, InProcess, PlanOptions, STEEP_DEG, check_end, check_tools};
pub use plan::parts::{PlanPart, lay_parts};
pub use plan::plan;
pub use plan::planned::Plan;
pub use plan::regions::{Regions, open_borders};
pub use program::TOOL_ID;
pub use program::kinematics::times_s;
pub use setup::orientation::{Orientation, OrientationGuess, SetupError};
pub use setup::rows_along::RowsAlong;
