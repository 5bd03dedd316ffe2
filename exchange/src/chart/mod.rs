//! Faces on surfaces that close on themselves: loops are laid out in the parameter plane, closed across seams
//! and over poles, and only then is the patch cut that carries them.
//!
//! ```text
//!   carrier + edges in space ─ layout ─► laid-out loops ─ closing ─► closed loops ─ fit ─► patch + trim loops
//! ```

mod carrier;
mod closing;
mod fit;
mod layout;
mod patch;
mod spline;

use claymill_nurbs::{Curve2, Curve3, NurbsError};
use thiserror::Error;

pub(crate) use carrier::{Carrier, Quadric, Range};
pub(crate) use patch::{rectangle, trimmed};
pub(crate) use spline::SplineChart;

/// Lengths that decide, in the unit of the geometry.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Limits {
    /// Largest distance between a pcurve and its edge.
    pub(crate) fit: f64,
    /// Points closer than this are one point.
    pub(crate) same: f64,
    /// Edges farther than this from their neighbours or their surface are damaged.
    pub(crate) misfit: f64,
    /// For messages.
    pub(crate) mm_per_unit: f64,
}

/// One edge of a loop, run in the loop's direction.
#[derive(Debug, Clone)]
pub(crate) struct EdgeUse {
    /// Identity of the edge in the file.
    pub(crate) edge: Option<u64>,
    /// The edge in space.
    pub(crate) curve: Curve3,
    /// What the file offers as its pcurve on this surface, in the loop's direction; a seam has two.
    pub(crate) flats: Vec<Curve2>,
}

/// Why the loops of a face cannot be put on its surface.
#[derive(Debug, Clone, PartialEq, Error)]
pub(crate) enum ChartError {
    #[error("{what}")]
    Loops { what: String },
    #[error("{what}")]
    Edge { edge: Option<u64>, what: String },
    #[error("{source}")]
    Kernel {
        #[from]
        source: NurbsError,
    },
}
