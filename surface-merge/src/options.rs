//! The options of merging: presets, low and high limits, and where on a joint they are judged.

use serde::{Deserialize, Serialize};

use crate::{Absorption, Constraints, MergeError};

/// Named sets of limits.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Preset {
    /// Visible surfaces: 0.01 mm, 0.1°, relative curvature difference 0.05.
    ClassA,
    /// Clay milling: 0.03 mm, 0.5°; curvature jumps are crossed and recorded.
    #[default]
    Clay,
    /// Tangent continuity alone: 0.05 mm, 1°.
    Tangent,
    /// The rule of the published method, for comparison: 0.02 mm, 0.5° and relative curvature difference
    /// 0.05, judged in the middle of each edge only.
    Paper,
}

/// What [`merge`](crate::merge) goes by.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct MergeOptions {
    /// Name of the set of limits that these options started from.
    pub preset: Preset,
    /// Edges within this distance are neighbours, mm; `None` finds it from the gaps of the model.
    pub tolerance_mm: Option<f64>,
    /// A joint within these limits on nearly all of its length merges its faces.
    pub low: Limits,
    /// A joint within these limits merges when the regions on both sides agree along their whole border.
    pub high: Limits,
    /// Where the limits are judged.
    pub judged: Judged,
    /// Ball radius of the tool, mm: scales curvature jumps to what the machine feels.
    pub ball_radius_mm: f64,
    /// Feed, mm/min: for the jump in acceleration on crossing a joint.
    pub feed_mm_per_min: f64,
    /// Crossing a joint with a larger `R·|Δκ|` is recorded as crossing a curvature jump.
    pub crossing: f64,
    /// What is kept apart or together whatever the limits.
    pub constraints: Constraints,
    /// Which regions are too small to stand alone; `None` leaves all.
    pub absorption: Option<Absorption>,
}

/// The largest values that still count as one surface.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Limits {
    /// Gap along the normal, mm.
    pub gap_normal_mm: f64,
    /// Gap across the edge in the tangent plane, mm.
    pub gap_lateral_mm: f64,
    /// Angle between the normals, degrees.
    pub angle_deg: f64,
    /// Difference of normal curvature across the edge.
    pub curvature: CurvatureLimit,
}

/// The measure of a curvature jump that decides.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum CurvatureLimit {
    /// Curvature does not decide.
    Any,
    /// `R·|κA − κB|`: what the step-over and the feed feel.
    Machining(f64),
    /// `|κA − κB| / (|κA| + |κB| + 2κ₀)`: what the eye sees in highlights.
    Relative(f64),
}

/// Where on a joint the limits are judged.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Judged {
    /// Along its whole length.
    Along,
    /// At its mid-point only.
    MidPoint,
}

impl Default for MergeOptions {
    fn default() -> Self {
        Preset::default().options()
    }
}

impl Preset {
    /// The options of this preset.
    ///
    /// A lateral gap of 0.5 mm lets a ball of 10 mm sink by 3 µm, and a concave crease of 1° costs it
    /// 1.5 µm (geometry of the ball: `g²/(8R)` and `R(1 − cos θ)`).
    #[must_use]
    pub fn options(self) -> MergeOptions {
        let limits = |gap_normal_mm, angle_deg, curvature| Limits {
            gap_normal_mm,
            gap_lateral_mm: 0.5,
            angle_deg,
            curvature,
        };
        use CurvatureLimit::{Any, Relative};
        let (low, high) = match self {
            Preset::ClassA => (limits(0.01, 0.1, Relative(0.05)), limits(0.01, 0.2, Relative(0.10))),
            Preset::Clay => (limits(0.03, 0.5, Any), limits(0.03, 1.0, Any)),
            Preset::Tangent => (limits(0.05, 1.0, Any), limits(0.05, 2.0, Any)),
            Preset::Paper => (limits(0.02, 0.5, Relative(0.05)), limits(0.02, 0.5, Relative(0.05))),
        };
        MergeOptions {
            preset: self,
            tolerance_mm: None,
            low,
            high,
            judged: if self == Preset::Paper { Judged::MidPoint } else { Judged::Along },
            ball_radius_mm: 10.0,
            feed_mm_per_min: 10_000.0,
            crossing: 0.2,
            constraints: Constraints::default(),
            absorption: None,
        }
    }
}

impl MergeOptions {
    pub(crate) fn check(&self, faces: usize) -> Result<(), MergeError> {
        let curvature = |limits: &Limits| match limits.curvature {
            CurvatureLimit::Any => 1.0,
            CurvatureLimit::Machining(limit) | CurvatureLimit::Relative(limit) => limit,
        };
        let positive = [
            ("tolerance_mm", self.tolerance_mm.unwrap_or(1.0)),
            ("ball_radius_mm", self.ball_radius_mm),
            ("feed_mm_per_min", self.feed_mm_per_min),
            ("low.gap_normal_mm", self.low.gap_normal_mm),
            ("high.gap_normal_mm", self.high.gap_normal_mm),
            ("low.gap_lateral_mm", self.low.gap_lateral_mm),
            ("high.gap_lateral_mm", self.high.gap_lateral_mm),
            ("low.angle_deg", self.low.angle_deg),
            ("high.angle_deg", self.high.angle_deg),
            ("low.curvature", curvature(&self.low)),
            ("high.curvature", curvature(&self.high)),
            ("absorption", self.absorption.map_or(1.0, |a| a.area_mm2.max(a.width_mm))),
        ];
        if let Some((option, value)) = positive.into_iter().find(|(_, v)| !(*v > 0.0 && v.is_finite())) {
            return Err(MergeError::Option { option, value });
        }
        self.constraints.check(faces)
    }
}
