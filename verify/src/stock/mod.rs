//! The verifier's own stock: what is left of the initial stock at any moment of a program, without a
//! grid.
//!
//! ```text
//!   moves ─► chords ─► bodies of the tool along each chord: convex pieces with a time ─► tree ─┐
//!   block, cylinder, mesh, model and layer ─► is this point stock, and how far from its skin ─┤
//!                                                                                              ▼
//!      rapids, links, lead-ins, shank, holder ◄─ boxes divided until proven       point, time ─► stock?
//!      engagement ◄─ bisection      left over the surface ◄─ roots      volumes ◄─ quasi-random points
//! ```
//!
//! A tool is a few convex bodies of revolution. Along a straight chord with a fixed axis each sweeps a convex piece,
//! whose membership has a closed form. The time at which a point was cut is the smallest time of the pieces that hold it.
//! Curved moves become chords within a stated distance, by which the tool is shrunk where it cuts and grown where it must
//! not touch; so stock is never taken for less than it is.
//!
//! Nothing here is shared with what plans: the pieces come from written moves.

mod body;
mod cells;
mod check;
mod columns;
mod discs;
mod engagement;
mod error;
mod flatten;
mod initial;
mod judge;
mod layer_stock;
mod left;
mod level_engagement;
mod mesh_stock;
mod options;
mod piece;
mod plunge;
mod proof;
mod report;
mod retrace;
mod sweeps;
#[cfg(test)]
mod tests;
mod tool_bodies;
mod tree;
mod volume;

pub use check::{Cut, StockCheck};
pub use engagement::Engagement;
pub use error::{KeepGoing, StockError};
pub use initial::{BoxInStock, InitialStock, Table};
pub use judge::LeftBand;
pub use left::{StockSample, Thickness};
pub use level_engagement::{
    ENGAGEMENT_BIN_DEG, ENGAGEMENT_BINS, LevelEngagement, LevelPose, level_engagement,
};
pub(crate) use level_engagement::{Ground, engagement_on};
pub use options::StockOptions;
pub use report::{EngagementAt, StockContact, StockHit, StockLeft, StockProof, StockReport, StockVolumes};
pub use sweeps::Time;
pub use tool_bodies::ToolPart;
pub use volume::VolumeEstimate;
