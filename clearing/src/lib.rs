//! Roughing from a block: levels, cleared at an engagement that never exceeds a limit.
//!
//! ```text
//!   model, tool, allowance ─► reach ─► region of a level ─┐         ╭───────────╮
//!   flats, step-down ───────► levels                      ▼         │ ╭───────╮ │   fronts, round after round: each as far
//!   stock ──────────────────────────────► rounds ─► fronts ─► order │ │ ╭───╮ │ │   ahead as the limit allows, with a bend
//!                                                              ▼    │ │ │ ⟲ │ │ │   that the limit allows
//!                                                            moves  ╰─┴─┴───┴─┴─╯
//! ```
//!
//! A tool of radius `R` whose centre runs along a circle of radius `ρ`, around whose middle nothing is uncut within
//! `√(ρ² + R² + 2ρR cos α)`, cuts at an angle of `α` at most ([`EngagementLimit::cleared_radius_mm`]). Everything such circles cover
//! may be cut next ([`clear`]): no step is searched, and nothing is tuned. Sets of the plane are [`PlanarSet`]s.
//!
//! ```
//! use claymill_clearing::{Area, EngagementLimit, Entry, PlanarSet, clear};
//! // A pocket of 20 × 20 mm with a tool of radius 3 mm: where its centre may be, and the stock.
//! let feasible = PlanarSet::rectangle([3.0, 3.0, 17.0, 17.0]);
//! let stock = PlanarSet::rectangle([-5.0, -5.0, 25.0, 25.0]);
//! let limit = EngagementLimit::new(3.0, 60.0)?;
//! let area = Area { feasible: &feasible, stock: &stock, limit, entry: Entry::usual(3.0) };
//! let cleared = clear(&area, &())?;
//! assert!(cleared.left.area_mm2() < 0.002 * cleared.area_mm2);
//! # Ok::<(), claymill_clearing::ClearingError>(())
//! ```

mod above;
mod arcs;
mod area;
mod engagement;
mod entry;
mod error;
mod fronts;
mod holder;
mod leads;
mod levels;
mod moves;
mod offset;
mod order;
mod outline;
mod plan;
mod planar_set;
mod reach;
mod ridges;
mod rounds;
mod stairs;

pub use arcs::{ArcAbout, PathPiece};
pub use area::{Approach, Area, Cleared, Stroke, clear};
pub use engagement::{
    EngagementLimit, LARGEST_LIMIT_DEG, LEAST_LIMIT_DEG, concave_angle, convex_angle, corner_angle,
    straight_angle,
};
pub use entry::Entry;
pub use error::ClearingError;
pub use holder::KeptOut;
pub use levels::{Depths, MOST_LEVELS, between_mm, flats_mm, left_mm3, standing_flats_mm};
pub use moves::{LevelFeeds, level_moves};
pub use plan::{LevelFound, LevelOptions, LevelPlan, Workpiece, plan_levels};
pub use planar_set::{FARTHEST_MM, PlanarSet};
pub use reach::Reach;
pub use rounds::{MOST_ROUNDS, TEETH_MM};
