//! Moves: NURBS curves of the tool tip with kind, feed and axis, each one line of
//! `toolpaths.jsonl`, and the digits that they are written with.

use claymill_nurbs::{Curve3, KnotVector, NurbsError, Point3, Vector3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use thiserror::Error;

/// Coordinates and knots are written to four decimals: one step is 0.1 µm, so that rounding moves a curve
/// by less than 0.09 µm (convex hull property), and Mitsubishi's four-decimal knots are met.
pub const WRITTEN_STEP_MM: f64 = 1e-4;

/// The nearest number that has the digits of the written format.
#[must_use]
pub fn round_to_written(value: f64) -> f64 {
    let rounded = (value * 1e4).round() / 1e4;
    // -0.0 and 0.0 must not differ in the file.
    if rounded == 0.0 { 0.0 } else { rounded }
}

/// What a move is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum MoveKind {
    /// Cutting along a pass.
    Cut,
    /// From the link height to the start of a pass.
    LeadIn,
    /// From the end of a pass to the link height.
    LeadOut,
    /// Between passes, staying down on the model.
    Link,
    /// Fast, above a proven height.
    Rapid,
}

/// One move: a NURBS curve of the tool tip. Serialises to one line of `toolpaths.jsonl`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Move {
    /// Position in machining order, from 0.
    pub seq: u64,
    /// Name of the setup.
    pub setup: String,
    /// Region that is being cut (for links and rapids: the region they lead to).
    pub region: usize,
    /// Pass number within the region and setup (for links and rapids: the pass they lead to).
    pub pass: u32,
    /// Number of the operation, from 0, in a job that has operations.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub op: Option<u32>,
    /// What the move is for.
    pub kind: MoveKind,
    /// Tool id, `T1`.
    pub tool: String,
    /// Polynomial degree; 1 with two points is a straight move.
    pub degree: usize,
    /// Clamped knot vector, `points + degree + 1` entries; the parameter is about arc length in mm.
    pub knots: Vec<f64>,
    /// Weights; null means all 1.
    pub weights: Option<Vec<f64>>,
    /// Control points of the tool tip, mm.
    pub points: Vec<[f64; 3]>,
    /// Tool axis at the start (unit vector from tip to holder).
    pub axis_start: [f64; 3],
    /// Tool axis at the end.
    pub axis_end: [f64; 3],
    /// Feed, mm/min; for rapids the rapid rate.
    pub feed: f64,
}

/// All moves of a job in machining order.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Program {
    /// The moves.
    pub moves: Vec<Move>,
}

/// Why a move from a file is unusable.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum MoveError {
    /// Knots, points or weights do not form a curve.
    #[error("move {seq}: {source}")]
    Curve {
        /// The move.
        seq: u64,
        /// What is wrong with its curve.
        source: NurbsError,
    },
    /// A tool axis is not a unit vector, or the feed is not positive.
    #[error("move {seq}: {what}")]
    Field {
        /// The move.
        seq: u64,
        /// What is wrong.
        what: &'static str,
    },
}

impl Move {
    /// A straight move between two tips.
    #[must_use]
    pub fn straight(kind: MoveKind, from: Point3, to: Point3, axis: Vector3, feed: f64) -> Self {
        let (a, b) = (from.map(round_to_written), to.map(round_to_written));
        let length = round_to_written((b - a).norm()).max(WRITTEN_STEP_MM);
        Move {
            seq: 0,
            setup: String::new(),
            region: 0,
            pass: 0,
            op: None,
            kind,
            tool: String::new(),
            degree: 1,
            knots: vec![0.0, 0.0, length, length],
            weights: None,
            points: vec![a.into(), b.into()],
            axis_start: axis.into(),
            axis_end: axis.into(),
            feed,
        }
    }

    /// A move along `curve`.
    #[must_use]
    pub fn along(kind: MoveKind, curve: &Curve3, axis: Vector3, feed: f64) -> Self {
        Move {
            degree: curve.knots().degree(),
            knots: curve.knots().as_slice().to_vec(),
            weights: curve.weights().map(<[f64]>::to_vec),
            points: curve.points().iter().map(|p| [p.x, p.y, p.z]).collect(),
            ..Move::straight(kind, curve.start(), curve.end(), axis, feed)
        }
    }

    /// The tip's curve.
    ///
    /// # Errors
    /// The parts do not form a curve, or axis or feed are unusable.
    pub fn curve(&self) -> Result<Curve3, MoveError> {
        let seq = self.seq;
        for axis in [self.axis_start, self.axis_end] {
            let size = Vector3::from(axis).norm();
            if !(0.999..1.001).contains(&size) {
                return Err(MoveError::Field { seq, what: "the tool axis is not a unit vector" });
            }
        }
        if !(self.feed.is_finite() && self.feed > 0.0) {
            return Err(MoveError::Field { seq, what: "the feed is not a positive number" });
        }
        let wrap = |source| MoveError::Curve { seq, source };
        let knots = KnotVector::new(self.degree, self.knots.clone()).map_err(wrap)?;
        let points = self.points.iter().map(|&p| Point3::from(p)).collect();
        Curve3::new(knots, points, self.weights.clone()).map_err(wrap)
    }

    /// First control point.
    #[must_use]
    pub fn start(&self) -> Point3 {
        self.points.first().map_or_else(Point3::origin, |&p| Point3::from(p))
    }

    /// Last control point.
    #[must_use]
    pub fn end(&self) -> Point3 {
        self.points.last().map_or_else(Point3::origin, |&p| Point3::from(p))
    }

    /// Length of the move, mm: the knot span, which is about arc length by the format's rule.
    #[must_use]
    pub fn length_mm(&self) -> f64 {
        match (self.knots.first(), self.knots.last()) {
            (Some(a), Some(b)) => b - a,
            _ => 0.0,
        }
    }
}
