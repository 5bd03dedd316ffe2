//! What keeps reach from being found.

use claymill_contact::FrameError;
use claymill_nurbs::{FaceId, NurbsError};
use claymill_toolpath::Cancelled;
use thiserror::Error;

/// Why it is not known what directions reach.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum ReachError {
    /// A face that cannot be covered with triangles.
    #[error("face {face} ({entity}) cannot be covered with triangles: {source}")]
    Face {
        /// The face.
        face: FaceId,
        /// Its entity in the file.
        entity: String,
        /// Why.
        source: NurbsError,
    },
    /// Nothing has an area.
    #[error("the model has no faces with an area that could be reached")]
    Nothing,
    /// A direction that is none.
    #[error(transparent)]
    Direction(#[from] FrameError),
    /// There is no direction to choose from.
    #[error("no direction is within {range_deg}° of the head's axis")]
    NoDirection {
        /// The head's range.
        range_deg: f64,
    },
    /// An angle or a step that cannot be.
    #[error("{what} of {value} must be more than {more_than} and at most {at_most}")]
    Number {
        /// What it is.
        what: &'static str,
        /// As given.
        value: f64,
        /// Its limit below.
        more_than: f64,
        /// Its limit above.
        at_most: f64,
    },
    /// The monitor ended it.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// Checks that a number lies within its limits.
pub(crate) fn check(what: &'static str, value: f64, more_than: f64, at_most: f64) -> Result<(), ReachError> {
    if value > more_than && value <= at_most {
        return Ok(());
    }
    Err(ReachError::Number { what, value, more_than, at_most })
}
