//! The verdict on a joint and its reason in words and figures: which limit is exceeded, by how much
//! and where.

use serde::{Deserialize, Serialize};

use crate::joint::{Failing, Joint, JointSample, Measure};
use crate::options::{CurvatureLimit, Judged, Limits, MergeOptions};

/// What became of a joint.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// Within the low limits: its faces are one region.
    Merged,
    /// Within the high limits only; the regions on both sides agree along their whole border.
    MergedWeak,
    /// Merged, although the curvature jumps: the feed dips here, which costs less than a broken stroke.
    CrossedCurvatureJump,
    /// Tangent, and one side was too small a region to stand alone.
    Absorbed,
    /// Joined because the user wishes so, smooth or not.
    KeptTogether,
    /// Not smooth by itself, but its faces belong to one region by way of others: it fades out, or the
    /// region goes round it.
    Enclosed,
    /// The gap is too wide.
    SplitGap,
    /// The normals differ too much.
    SplitAngle,
    /// The curvature jumps too much.
    SplitCurvature,
    /// Within the high limits, but the rest of the border between the two regions is not.
    SplitNeighbours,
    /// Three or more faces meet, and another pair of them is the smoothest.
    SplitNonManifold,
    /// Kept apart because the user wishes so, smooth or not.
    KeptApart,
}

impl Verdict {
    /// Whether strokes run across the joint.
    #[must_use]
    pub fn is_merged(self) -> bool {
        use Verdict::{Absorbed, CrossedCurvatureJump, KeptTogether, Merged, MergedWeak};
        matches!(self, Merged | MergedWeak | CrossedCurvatureJump | Absorbed | KeptTogether)
    }
}

/// The first limit that a measurement exceeds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Excess {
    Gap,
    Angle,
    Curvature,
}

impl MergeOptions {
    /// What `sample` exceeds, worst first: a gap makes angles doubtful, an angle makes curvatures so.
    pub(crate) fn excess(&self, limits: &Limits, sample: &JointSample, floor_per_mm: f64) -> Option<Excess> {
        let gap =
            sample.gap_normal_mm > limits.gap_normal_mm || sample.gap_lateral_mm > limits.gap_lateral_mm;
        let jump = sample.curvature_jump_per_mm();
        let curvature = match limits.curvature {
            CurvatureLimit::Any => false,
            CurvatureLimit::Machining(limit) => self.ball_radius_mm * jump > limit && jump > floor_per_mm,
            CurvatureLimit::Relative(limit) => {
                sample.curvature_relative(floor_per_mm) > limit && jump > floor_per_mm
            }
        };
        match (gap, sample.angle_deg.abs() > limits.angle_deg, curvature) {
            (true, ..) => Some(Excess::Gap),
            (_, true, _) => Some(Excess::Angle),
            (_, _, true) => Some(Excess::Curvature),
            _ => None,
        }
    }

    /// Share of a joint's length within `limits`; the paper's rule knows only all or nothing.
    pub(crate) fn share_within(&self, limits: &Limits, joint: &Joint) -> f64 {
        let fine = |s: &JointSample| self.excess(limits, s, joint.curvature_floor_per_mm).is_none();
        match self.judged {
            Judged::MidPoint => f64::from(u8::from(fine(&joint.mid))),
            Judged::Along => {
                let within: f64 = joint.samples.iter().filter(|s| fine(s)).map(|s| s.length_mm).sum();
                within / joint.length_mm
            }
        }
    }

    /// The limit that a joint exceeds on the largest part of its length.
    fn main_excess(&self, joint: &Joint) -> Excess {
        let found = |s: &JointSample| self.excess(&self.high, s, joint.curvature_floor_per_mm);
        if self.judged == Judged::MidPoint {
            return found(&joint.mid).unwrap_or(Excess::Angle);
        }
        let length = |kind: Excess| -> f64 {
            joint.samples.iter().filter(|s| found(s) == Some(kind)).map(|s| s.length_mm).sum()
        };
        let kinds = [Excess::Gap, Excess::Angle, Excess::Curvature].map(|kind| (length(kind), kind));
        let worst = kinds.into_iter().reduce(|x, y| if y.0 > x.0 { y } else { x });
        worst.map_or(Excess::Angle, |(_, kind)| kind)
    }
}

/// What growing found out about a joint.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Standing {
    /// Passed over in favour of a smoother joint on the same edge.
    pub(crate) outdone: bool,
    /// Its faces are to be kept apart.
    pub(crate) apart: bool,
    /// Its faces are in one region.
    pub(crate) together: bool,
    /// They are to be.
    pub(crate) wished: bool,
    /// It is tangent, and they are in one region by absorption only.
    pub(crate) absorbed: bool,
    pub(crate) strong: bool,
    pub(crate) weak: bool,
    /// Share of the border between its regions that is smooth enough, and the least that would do.
    pub(crate) smooth_border: [f64; 2],
    pub(crate) regions_if_merged: Option<usize>,
}

/// Writes the verdict and its reason into the joint.
pub(crate) fn judge(joint: &mut Joint, standing: Standing, options: &MergeOptions) {
    let jump = joint.curvature_machining.max;
    let smooth = standing.strong || standing.weak;
    joint.verdict = match standing {
        Standing { outdone: true, together: false, .. } => Verdict::SplitNonManifold,
        Standing { apart: true, together: false, .. } => Verdict::KeptApart,
        Standing { absorbed: true, .. } => Verdict::Absorbed,
        Standing { together: true, .. } if smooth && jump > options.crossing => Verdict::CrossedCurvatureJump,
        Standing { together: true, strong: true, .. } => Verdict::Merged,
        Standing { together: true, weak: true, .. } => Verdict::MergedWeak,
        Standing { together: true, wished: true, .. } => Verdict::KeptTogether,
        Standing { together: true, .. } => Verdict::Enclosed,
        _ if smooth => Verdict::SplitNeighbours,
        _ => match options.main_excess(joint) {
            Excess::Gap => Verdict::SplitGap,
            Excess::Angle => Verdict::SplitAngle,
            Excess::Curvature => Verdict::SplitCurvature,
        },
    };
    if !joint.verdict.is_merged() {
        joint.failing = failing(joint, standing, options);
        joint.regions_if_merged = standing.regions_if_merged;
    }
    joint.why = reason(joint, options);
}

fn reason(joint: &Joint, options: &MergeOptions) -> String {
    let high = &options.high;
    match joint.verdict {
        Verdict::Merged => format!(
            "{:.3}° at most (limit {}°), gap {:.4} mm",
            joint.angle_deg.p95, options.low.angle_deg, joint.gap_normal_mm.max
        ),
        Verdict::MergedWeak => format!(
            "{:.3}° on all but a twentieth of its length (limit {}°), and the border of the two regions agrees",
            joint.angle_deg.p95, high.angle_deg
        ),
        Verdict::CrossedCurvatureJump => format!(
            "normals agree within {:.3}°; R·|Δκ| = {:.3} costs a dip in feed, a broken stroke would cost a turn",
            joint.angle_deg.p95, joint.curvature_machining.max
        ),
        Verdict::Absorbed => format!(
            "one side was a region too small to stand alone, and the normals agree within {:.3}°",
            joint.angle_deg.max
        ),
        Verdict::KeptTogether => {
            format!("kept together by option ({})", excess(joint, options))
        }
        Verdict::KeptApart => {
            format!(
                "kept apart by option ({:.3}° at most, gap {:.4} mm)",
                joint.angle_deg.max, joint.gap_normal_mm.max
            )
        }
        Verdict::Enclosed => {
            format!("not smooth itself ({}), but its faces are joined around it", excess(joint, options))
        }
        Verdict::SplitNeighbours => {
            format!(
                "smooth itself ({:.3}°), but only {:.0} % of the border of the two regions is",
                joint.angle_deg.p95,
                100.0 * joint.failing.map_or(0.0, |f| f.value)
            )
        }
        Verdict::SplitNonManifold => "three or more faces meet here; a smoother pair was joined".to_owned(),
        Verdict::SplitGap | Verdict::SplitAngle | Verdict::SplitCurvature => excess(joint, options),
    }
}

/// What keeps a joint that is not merged from being so.
fn failing(joint: &Joint, standing: Standing, options: &MergeOptions) -> Option<Failing> {
    match joint.verdict {
        Verdict::SplitNonManifold | Verdict::KeptApart => None,
        Verdict::SplitNeighbours => Some(Failing {
            measure: Measure::SmoothBorder,
            value: standing.smooth_border[0],
            limit: standing.smooth_border[1],
            share_over: 0.0,
            at: joint.mid.point,
        }),
        _ => exceeded(joint, options),
    }
}

/// The limit exceeded, by how much, on how much of the joint, and where it is worst.
fn exceeded(joint: &Joint, options: &MergeOptions) -> Option<Failing> {
    let high = &options.high;
    let gaps = joint.gap_normal_mm.max * high.gap_lateral_mm >= joint.gap_lateral_mm.max * high.gap_normal_mm;
    let (measure, limit) = match (options.main_excess(joint), high.curvature) {
        (Excess::Gap, _) if gaps => (Measure::GapNormal, high.gap_normal_mm),
        (Excess::Gap, _) => (Measure::GapLateral, high.gap_lateral_mm),
        (Excess::Angle, _) => (Measure::Angle, high.angle_deg),
        (Excess::Curvature, CurvatureLimit::Machining(limit)) => (Measure::CurvatureMachining, limit),
        (Excess::Curvature, CurvatureLimit::Relative(limit)) => (Measure::CurvatureRelative, limit),
        (Excess::Curvature, CurvatureLimit::Any) => return None,
    };
    let value = |s: &JointSample| match measure {
        Measure::GapNormal => s.gap_normal_mm,
        Measure::GapLateral => s.gap_lateral_mm,
        Measure::Angle => s.angle_deg.abs(),
        Measure::CurvatureMachining => options.ball_radius_mm * s.curvature_jump_per_mm(),
        Measure::CurvatureRelative => s.curvature_relative(joint.curvature_floor_per_mm),
        Measure::SmoothBorder => 0.0,
    };
    let along = match options.judged {
        Judged::Along => &joint.samples[..],
        Judged::MidPoint => &[],
    };
    let worst = along.iter().fold(&joint.mid, |m, s| if value(s) > value(m) { s } else { m });
    let share_over = 1.0 - options.share_within(high, joint);
    Some(Failing { measure, value: value(worst), limit, share_over, at: worst.point })
}

fn excess(joint: &Joint, options: &MergeOptions) -> String {
    let Some(Failing { measure, value, limit, share_over, at }) = exceeded(joint, options) else {
        return String::new();
    };
    let figure = match measure {
        Measure::GapNormal => format!("gap {value:.4} mm along the normal (limit {limit} mm)"),
        Measure::GapLateral => format!("gap {value:.4} mm in the tangent plane (limit {limit} mm)"),
        Measure::Angle => format!("angle {value:.3}° (limit {limit}°)"),
        Measure::CurvatureMachining => format!("R·|Δκ| = {value:.3} (limit {limit})"),
        Measure::CurvatureRelative => format!("relative curvature difference {value:.3} (limit {limit})"),
        Measure::SmoothBorder => String::new(),
    };
    format!(
        "{figure} on {:.0} % of {:.1} mm, worst at ({:.1}, {:.1}, {:.1})",
        100.0 * share_over,
        joint.length_mm,
        at.x,
        at.y,
        at.z
    )
}
