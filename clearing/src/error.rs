//! What is refused, with the figures and what to do instead.

use claymill_toolpath::Cancelled;
use thiserror::Error;

/// Why a clearing was refused, or ended.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum ClearingError {
    /// The tool's radius is no length.
    #[error("a tool radius of {radius_mm} mm is not between 0.05 and 200 mm")]
    Radius {
        /// As asked for, mm.
        radius_mm: f64,
    },
    /// The limit of engagement would be a slot, or nothing.
    #[error(
        "an engagement of {limit_deg}° is not between {low}° and {high}°; for example 50",
        low = crate::LEAST_LIMIT_DEG, high = crate::LARGEST_LIMIT_DEG
    )]
    Limit {
        /// As asked for, degrees.
        limit_deg: f64,
    },
    /// The tool fits nowhere.
    #[error("a tool of radius {radius_mm} mm fits nowhere {place}; take a smaller tool")]
    NoRoom {
        /// Its radius, mm.
        radius_mm: f64,
        /// Where.
        place: String,
    },
    /// The tool neither gets in from outside nor may enter on a helix or straight down.
    #[error(
        "there is no way into the pocket at ({x:.1}, {y:.1}): a helix of {room_mm:.2} mm fits and {least_mm:.2} mm are needed; \
         take a smaller tool, or say with dead_centre what of this one does not cut (0 where it may plunge)",
        x = at_mm[0], y = at_mm[1]
    )]
    NoEntry {
        /// The middle of the largest room.
        at_mm: [f64; 2],
        /// Radius of the largest helix that fits, mm.
        room_mm: f64,
        /// What the tool needs, mm.
        least_mm: f64,
    },
    /// A step down is deeper than the flutes are long.
    #[error(
        "steps of {step_mm} mm are deeper than the flutes are long ({flutes_mm} mm); take a step-down of {flutes_mm} mm or less"
    )]
    StepBelowFlutes {
        /// As asked for, mm.
        step_mm: f64,
        /// Length of the flutes, mm.
        flutes_mm: f64,
    },
    /// A number is not finite or out of range.
    #[error("{what} of {value} is not between {low} and {high}")]
    Number {
        /// What is meant.
        what: &'static str,
        /// As asked for.
        value: f64,
        /// The least that is allowed.
        low: f64,
        /// The most that is allowed.
        high: f64,
    },
    /// The stock does not hold the part.
    #[error("the stock {stock_mm:?} does not hold the part, whose box is {part_mm:?}; take a larger block")]
    StockTooSmall {
        /// Box of the stock, mm.
        stock_mm: [f64; 6],
        /// Box of the part, mm.
        part_mm: [f64; 6],
    },
    /// The area would take too many rounds.
    #[error("more than {rounds} rounds were needed; allow a larger engagement or take a larger tool")]
    Rounds {
        /// The most that are allowed.
        rounds: usize,
    },
    /// A level has too many cells.
    #[error("a level needs more than {most} cells; take a larger tool or a smaller area")]
    Cells {
        /// The most that are allowed.
        most: usize,
    },
    /// Too large for the grid.
    #[error("coordinates reach to {reach_mm} mm, more than {limit} mm from the origin; is the unit right?", limit = crate::FARTHEST_MM)]
    TooFar {
        /// Largest coordinate, mm.
        reach_mm: f64,
    },
    /// A move is no curve.
    #[error("a pass cannot be written: {what}")]
    Curve {
        /// What is wrong.
        what: String,
    },
    /// Stopped by the monitor.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// A number between bounds, both included.
pub(crate) fn within(what: &'static str, value: f64, low: f64, high: f64) -> Result<f64, ClearingError> {
    if (low..=high).contains(&value) {
        Ok(value)
    } else {
        Err(ClearingError::Number { what, value, low, high })
    }
}
