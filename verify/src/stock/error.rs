//! Why a stock, a tool or a move cannot be used for the check of stock.

use claymill_toolpath::MoveError;
use thiserror::Error;

/// Why the stock of a program cannot be computed.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum StockError {
    /// A number is not finite, or no size that a workpiece has.
    #[error("{what} of {value} is not between {low} and {high}")]
    Size {
        /// What it is, with its unit.
        what: &'static str,
        /// The number.
        value: f64,
        /// Smallest usable number.
        low: f64,
        /// Largest usable number.
        high: f64,
    },
    /// A direction is not a vector with a length.
    #[error("{0} is not a direction")]
    Direction(&'static str),
    /// A mesh as stock has a border.
    #[error("the mesh of the stock is not closed: {open_edges} of its edges have no counterpart")]
    OpenMesh {
        /// Edges that are not used equally often in both directions.
        open_edges: usize,
    },
    /// A mesh or a model without any triangle.
    #[error("the {0} of the stock has no triangles")]
    Empty(&'static str),
    /// A triangle names a vertex that is not there.
    #[error("triangle {triangle} of the stock names a vertex that is not there")]
    Vertex {
        /// The triangle.
        triangle: usize,
    },
    /// A move is not a curve.
    #[error(transparent)]
    Move(#[from] MoveError),
    /// A move names a tool that was not given.
    #[error("move {seq} names tool `{tool}`, which is not among the tools given")]
    UnknownTool {
        /// The move.
        seq: u64,
        /// The name.
        tool: String,
    },
    /// The axis turns too far within one move.
    #[error(
        "move {seq}: the axis turns by {turn_deg:.1}° within one move; at most {limit_deg}° can be checked"
    )]
    Turn {
        /// The move.
        seq: u64,
        /// How far, degrees.
        turn_deg: f64,
        /// How far it may turn, degrees.
        limit_deg: f64,
    },
    /// The moves need more convex pieces than memory is set aside for.
    #[error("the moves come to more than {limit} pieces; allow a larger chord error")]
    TooManyPieces {
        /// The bound.
        limit: usize,
    },
    /// There is no move or no place of this number.
    #[error("there is no move {0} in the program")]
    NoMove(usize),
    /// The caller asked to stop.
    #[error("stopped before the end")]
    Stopped,
}

/// Asked in long loops whether to go on; `false` ends them with [`StockError::Stopped`].
pub type KeepGoing<'a> = &'a (dyn Fn() -> bool + Sync);

/// The largest coordinate or size of anything, mm.
pub(super) const FARTHEST_MM: f64 = 1e6;

/// A size that is finite and within limits.
pub(super) fn sized(what: &'static str, value: f64, low: f64, high: f64) -> Result<f64, StockError> {
    if (low..=high).contains(&value) { Ok(value) } else { Err(StockError::Size { what, value, low, high }) }
}

/// Coordinates that are finite and within limits.
pub(super) fn placed(what: &'static str, coordinates: &[f64]) -> Result<(), StockError> {
    coordinates.iter().try_for_each(|&x| sized(what, x, -FARTHEST_MM, FARTHEST_MM).map(|_| ()))
}
