//! How far a surface may lean from the tool axis.

/// A surface that leans further from the tool axis than this is not cut by a ball that comes down on it (`n·axis`, 80°): it
/// is a wall, which the ball passes beside.
pub(crate) const LEAST_FACING: f64 = 0.173_648;
/// What no setup faces better, nor cuts as a wall, a ball that comes down on it still cuts up to here (`n·axis`, 82.5°), where
/// there is enough of it: undersides that slant a little.
pub(crate) const LEAST_SLANT: f64 = 0.130_526;
/// A wall that leans over by no more than this still is one: an upright wall does by rounding.
pub(crate) const OVERHANGING: f64 = -2e-3;
