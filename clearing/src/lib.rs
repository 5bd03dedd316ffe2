//! Roughing from a block.

mod arcs;
mod area;
mod engagement;
mod error;
mod fronts;
mod leads;
mod offset;
mod order;
mod outline;
mod planar_set;
mod rounds;

pub use arcs::{ArcAbout, PathPiece};
pub use area::{Approach, Area, Cleared, Entry, Stroke, clear};
pub use engagement::{
    EngagementLimit, LARGEST_LIMIT_DEG, LEAST_LIMIT_DEG, concave_angle, convex_angle, corner_angle,
    straight_angle,
};
pub use error::ClearingError;
pub use planar_set::{FARTHEST_MM, PlanarSet};
pub use rounds::MOST_ROUNDS;
