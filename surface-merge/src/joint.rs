//! Joints and what is measured along them: gap, angle and curvature, each as maximum, 95th
//! percentile, root mean square and value at mid-length.

use claymill_nurbs::{FaceId, Point3};
use serde::{Deserialize, Serialize};

use crate::Verdict;

/// A stretch of a trim edge.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct EdgeStretch {
    /// The face.
    pub face: FaceId,
    /// Index of the loop in [`Face::boundary`](claymill_nurbs::Face::boundary).
    pub loop_index: usize,
    /// Index of the edge in the loop.
    pub edge_index: usize,
    /// Parameter of the pcurve at the start of the stretch.
    pub from: f64,
    /// Parameter at its end; smaller than `from` where the stretch is run backwards.
    pub to: f64,
}

/// A stretch along which two faces (or two sides of one face) meet.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Joint {
    /// The two sides, run in the same direction.
    pub sides: [EdgeStretch; 2],
    /// Length, mm.
    pub length_mm: f64,
    /// How smooth the joint is along its whole length.
    pub continuity: Continuity,
    /// Part of the gap along the normal, mm.
    pub gap_normal_mm: Spread,
    /// Part of the gap in the tangent plane, mm.
    pub gap_lateral_mm: Spread,
    /// Unsigned angle between the normals, degrees.
    pub angle_deg: Spread,
    /// `R·|κA − κB|` for the tool's ball radius `R`.
    pub curvature_machining: Spread,
    /// `|κA − κB| / (|κA| + |κB| + 2κ₀)`.
    pub curvature_relative: Spread,
    /// Jump of acceleration on crossing at the nominal feed `v`: `v²·|κA − κB|`, mm/s².
    pub acceleration_jump: Spread,
    /// `κ₀`: curvature differences below this are noise here, 1/mm.
    pub curvature_floor_per_mm: f64,
    /// `Su × Sv` of the two faces point to the same side of the joined surface.
    pub normals_agree: bool,
    /// More than two edges meet here.
    pub non_manifold: bool,
    /// First and last point on either side, mm.
    pub ends: [[Point3; 2]; 2],
    /// The measurements, in order along the joint.
    pub samples: Vec<JointSample>,
    /// The measurement at mid-length.
    pub mid: JointSample,
    /// What became of the joint.
    pub verdict: Verdict,
    /// The verdict in words, with its figures.
    pub why: String,
    /// Another joint on the same edge is smoother: this one joins nothing.
    pub outdone: bool,
    /// Why the joint is not merged, in figures; `None` where it is, or where a smoother one is in its place.
    pub failing: Option<Failing>,
    /// Number of regions of the model if this joint had been merged: the two regions become one, and others
    /// may follow whose borders with the two together are smooth enough. `None` where it is merged, or where
    /// its faces are in one region anyway.
    pub regions_if_merged: Option<usize>,
}

/// What keeps a joint from being merged.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Failing {
    /// What is measured.
    pub measure: Measure,
    /// Its worst value on the joint.
    pub value: f64,
    /// The largest value allowed; for [`Measure::SmoothBorder`] the least.
    pub limit: f64,
    /// Share of the joint's length on which some limit is exceeded.
    pub share_over: f64,
    /// Where it is worst, mm.
    pub at: Point3,
}

/// What a limit is set for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Measure {
    /// Gap along the normal, mm.
    GapNormal,
    /// Gap in the tangent plane, mm.
    GapLateral,
    /// Angle between the normals, degrees.
    Angle,
    /// `R·|κA − κB|`.
    CurvatureMachining,
    /// `|κA − κB| / (|κA| + |κB| + 2κ₀)`.
    CurvatureRelative,
    /// Share of the border between the two regions that is smooth enough.
    SmoothBorder,
}

/// How smoothly two faces meet, judged along the whole joint.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
pub enum Continuity {
    /// Positions agree; the normals differ by more than 0.5° somewhere.
    C0,
    /// Normals agree; the curvature across the edge differs by more than 10 % somewhere.
    G1,
    /// Normals and curvature agree.
    G2,
}

/// A quantity along a joint, weighted by length.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Spread {
    /// Largest value.
    pub max: f64,
    /// Exceeded on one twentieth of the length.
    pub p95: f64,
    /// Root mean square.
    pub rms: f64,
    /// At mid-length: all that a mid-point rule would see.
    pub mid: f64,
    /// Share of the length above the preset's low limit; 0 where nothing limits it.
    pub share_over: f64,
}

/// One measurement on a joint.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct JointSample {
    /// The point on the first side, mm.
    pub point: Point3,
    /// Length of the joint that it stands for, mm.
    pub length_mm: f64,
    /// Part of the gap along the normal, mm.
    pub gap_normal_mm: f64,
    /// Part of the gap in the tangent plane, mm.
    pub gap_lateral_mm: f64,
    /// Angle between the normals, degrees; positive in a valley, negative on a ridge as seen from the
    /// outside of the first side's face. Near 180° the faces fold back on each other.
    pub angle_deg: f64,
    /// Normal curvature across the edge on both sides, 1/mm, positive in a valley as seen from the outside
    /// of the first side's face; `None` where a parametrisation is singular.
    pub curvature_per_mm: Option<[f64; 2]>,
}

impl JointSample {
    /// `|κA − κB|`, 1/mm; 0 where it cannot be measured.
    #[must_use]
    pub fn curvature_jump_per_mm(&self) -> f64 {
        self.curvature_per_mm.map_or(0.0, |[a, b]| (a - b).abs())
    }

    /// `|κA − κB| / (|κA| + |κB| + 2κ₀)` for the floor `κ₀`.
    #[must_use]
    pub fn curvature_relative(&self, floor_per_mm: f64) -> f64 {
        let Some([a, b]) = self.curvature_per_mm else {
            return 0.0;
        };
        (a - b).abs() / (a.abs() + b.abs() + 2.0 * floor_per_mm)
    }
}

impl Spread {
    /// The spread of `value` over `samples`; `limit` is what [`Spread::share_over`] counts against.
    pub(crate) fn of(
        samples: &[JointSample],
        mid: &JointSample,
        limit: Option<f64>,
        value: impl Fn(&JointSample) -> f64,
    ) -> Self {
        let mut values: Vec<(f64, f64)> = samples.iter().map(|s| (value(s), s.length_mm)).collect();
        values.sort_by(|a, b| b.0.total_cmp(&a.0));
        let total: f64 = values.iter().map(|v| v.1).sum();
        let squares: f64 = values.iter().map(|v| v.0 * v.0 * v.1).sum();
        let over = |x: f64| values.iter().filter(|v| v.0 > x).map(|v| v.1).sum::<f64>() / total;
        let mut passed = 0.0;
        let p95 = values.iter().find(|v| {
            passed += v.1;
            passed >= 0.05 * total
        });
        Spread {
            max: values.first().map_or(0.0, |v| v.0).max(value(mid)),
            p95: p95.map_or(0.0, |v| v.0),
            rms: (squares / total).sqrt(),
            mid: value(mid),
            share_over: limit.map_or(0.0, over),
        }
    }
}
