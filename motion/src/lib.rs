//! How a machine runs along curves: as fast as feed, bends and joints allow, with acceleration and jerk limited.
//!
//! ```text
//!   curves ─► Track: cells with their bend, joints ─► Schedule: speed by look-ahead ─► filtered: place at any time
//! ```
//!
//! One law serves the planner's times, the reference controller and the virtual controls. Within a *chain*, from
//! rest to rest:
//!
//! 1. every place has a highest speed, from its feed, its curvature κ and the change of its curvature vector;
//! 2. a *base* profile is as fast as a limited acceleration allows, forwards and backwards;
//! 3. the way is the base's, averaged over a window of `T = a / j` in time (a box filter of `s(t)`): what was limited
//!    in acceleration is then limited in jerk, and the place never leaves the curve.
//!
//! That the average stays below the highest speed of the place where it is, and its jerk below `j`, takes two
//! precautions in the base: a low speed `c` is held over `c·T`, half before and half behind, and so is every peak. From
//! rest to rest over `L` that is the textbook's `L/v + v/a + a/j`, and for a speed `v < a²/j` its `L/v + 2√(v/j)`.

// What is to be said is returned: only the command prints.
#![cfg_attr(not(test), warn(clippy::print_stdout, clippy::print_stderr))]

mod chain;
mod rail;
mod schedule;
mod speed;
mod track;

pub use chain::Chain;
pub use rail::{Looks, Rail};
pub use schedule::Schedule;
pub use track::{Joint, JointRule, Limits, Place, Track};
