//! The largest and smallest values that a job can mean.

/// Passes are fitted and written to a few tenths of a micrometre: lower scallops cannot be told from that, mm.
pub(crate) const LOWEST_SCALLOP_MM: f64 = 0.001;
/// No machine cuts faster, mm/min.
pub(crate) const LARGEST_FEED_MM_PER_MIN: f64 = 500_000.0;
/// Largest number of a tool.
pub(crate) const LARGEST_TOOL: u32 = 999_999;
/// More parameter lines than this on one patch are a slip of the keyboard.
pub(crate) const MOST_LINES: usize = 10_000;
/// There are no waterlines on ground shallower than the first, and nothing steeper than the second is cut, degrees.
pub(crate) const STEEP_LIMITS_DEG: (f64, f64) = (15.0, 80.0);
/// No more than this is kept from model and obstacles, by holders, the ball or rapids, mm.
pub(crate) const LARGEST_CLEARANCE_MM: f64 = 1000.0;
/// Rapids keep at least this: their heights are known to some tenths, mm.
pub(crate) const LEAST_RAPID_MM: f64 = 0.5;
/// Longer margins and extensions are a slip of the keyboard, mm.
pub(crate) const LARGEST_MARGIN_MM: f64 = 100.0;
/// Flatter ramps into pockets take hours, degrees.
pub(crate) const LEAST_RAMP_DEG: f64 = 0.1;
/// Steeper ones are plunges, degrees.
pub(crate) const STEEPEST_RAMP_DEG: f64 = 60.0;
