//! Why a curve, surface or face cannot be made, evaluated or triangulated.

use thiserror::Error;

/// Why a curve, surface or face could not be made or evaluated.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum NurbsError {
    /// The degree is 0 or above [`crate::MAX_DEGREE`].
    #[error("degree {degree} is outside 1..={max}")]
    Degree {
        /// The degree asked for.
        degree: usize,
        /// The largest supported degree.
        max: usize,
    },
    /// Knots and control points do not fit together.
    #[error("{knots} knots do not fit {points} control points of degree {degree} (need points + degree + 1)")]
    KnotCount {
        /// Number of knots.
        knots: usize,
        /// Number of control points.
        points: usize,
        /// Degree.
        degree: usize,
    },
    /// A knot is smaller than the one before it.
    #[error("knot {index} decreases")]
    KnotsDecrease {
        /// Index of the offending knot.
        index: usize,
    },
    /// The knot vector spans no parameter interval, or a knot repeats more than degree + 1 times.
    #[error("the knot vector has an empty domain or a knot of multiplicity above degree + 1")]
    KnotMultiplicity,
    /// Wrong number of control points or weights for the net.
    #[error("the net needs {needed} control points or weights, {given} are given")]
    NetSize {
        /// `n_u × n_v`.
        needed: usize,
        /// What was given.
        given: usize,
    },
    /// A weight is zero, negative or not finite.
    #[error("weight {index} is {value}: weights must be positive and finite")]
    Weight {
        /// Index of the weight in the net.
        index: usize,
        /// Its value.
        value: f64,
    },
    /// A coordinate or knot is NaN, infinite or absurdly large.
    #[error("{what} {index} is not a finite number of sensible size")]
    NotFinite {
        /// "knot" or "control point".
        what: &'static str,
        /// Its index.
        index: usize,
    },
    /// A trim loop does not close.
    #[error("trim loop {loop_index} does not close: gap {gap_mm} mm")]
    OpenLoop {
        /// Index of the loop in the face.
        loop_index: usize,
        /// Largest gap between consecutive edges, mm.
        gap_mm: f64,
    },
    /// The face has no area.
    #[error("the face is degenerate: area {area_mm2} mm²")]
    Degenerate {
        /// Its area, mm².
        area_mm2: f64,
    },
    /// Triangulating the face failed.
    #[error("the face could not be triangulated: {reason}")]
    Mesh {
        /// Why.
        reason: String,
    },
    /// Faces that enclose nothing.
    #[error("the faces are open: {sides} sides of their triangles have no neighbour, the first at ({:.2}, {:.2}, {:.2}) mm", at_mm[0], at_mm[1], at_mm[2])]
    OpenMesh {
        /// How many sides of triangles have no counterpart.
        sides: usize,
        /// Where the first of them is, mm.
        at_mm: [f64; 3],
    },
}
