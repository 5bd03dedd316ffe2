//! Why a part cannot be made from a bar on a rotary axis.

use claymill_contact::Axis;
use claymill_reach::{ReachError, SupportError};
use thiserror::Error;

/// Why a part cannot be made on a rotary axis.
#[derive(Debug, Error)]
pub enum PrototypeError {
    /// Faces look out from under something, or inwards: no angle sees them.
    #[error(
        "{share_percent:.2} % of the surface is seen from no angle about {axis}: {}",
        faces.iter().take(8).map(|(face, entity)| format!("face {face} ({entity})")).collect::<Vec<_>>().join(", ")
    )]
    Unseen {
        /// The axis.
        axis: Axis,
        /// Their share of the area.
        share_percent: f64,
        /// The faces.
        faces: Vec<(usize, String)>,
    },
    /// The bar is too thin.
    #[error("the part needs a bar of {needed_mm:.2} mm about {axis}, {bar_mm} mm are too thin")]
    Thin {
        /// The axis.
        axis: Axis,
        /// The smallest diameter.
        needed_mm: f64,
        /// As asked for.
        bar_mm: f64,
    },
    /// The part does not fit between the chucks.
    #[error("part and supports are {length_mm:.1} mm long, {longest_mm} mm fit between the chucks")]
    Long {
        /// Their length.
        length_mm: f64,
        /// What fits.
        longest_mm: f64,
    },
    /// There is no place for a support at an end of the part.
    #[error("the end of the part at {at_mm:.2} mm along {axis} has no place for a support")]
    NoPlace {
        /// The axis.
        axis: Axis,
        /// Where the end is.
        at_mm: f64,
    },
    /// Supports for which there is room are too weak.
    #[error(transparent)]
    Support(#[from] SupportError),
    /// What directions reach cannot be found.
    #[error(transparent)]
    Reach(#[from] ReachError),
    /// No such cylinder.
    #[error(transparent)]
    Nurbs(#[from] claymill_nurbs::NurbsError),
}

impl PrototypeError {
    /// What to do about it, in one sentence.
    #[must_use]
    pub fn advice(&self) -> &'static str {
        match self {
            PrototypeError::Unseen { .. } => "Choose another axis, or make the part in several pieces.",
            PrototypeError::Thin { .. } => "Give a thicker bar, or --stock auto.",
            PrototypeError::Long { .. } => "Choose another axis, a thinner tool, or a longer machine.",
            PrototypeError::NoPlace { .. } => "Choose another axis.",
            PrototypeError::Support(_) => "Choose another axis, a smaller force, or a larger tolerance.",
            PrototypeError::Reach(_) => "Look at what is left out, and at the axes.",
            PrototypeError::Nurbs(_) => "Look at the size of the part.",
        }
    }
}
