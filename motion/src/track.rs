//! A path as cells with a highest speed each, from feed, curvature and its change, and the joints
//! between them. It sets limits only; `chain` plans the motion.

use claymill_nurbs::{Curve3, Vector3};

use crate::Rail;

/// What a machine does along its path.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limits {
    /// Acceleration, mm/s².
    pub acceleration_mm_per_s2: f64,
    /// Jerk, mm/s³; infinite for a control without a limit.
    pub jerk_mm_per_s3: f64,
}

/// How a machine passes a joint of two curves that has a corner, or a jump of curvature.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum JointRule {
    /// It rounds corners within this distance, mm, and does not heed curvature; it stops at corners above `stop_deg`.
    Within {
        /// How far from the corner it may run.
        mm: f64,
        /// Corners above this angle are an exact stop.
        stop_deg: f64,
    },
    /// It stays on the path: from one step of the interpolation to the next the jump must be no more than a quarter
    /// of the jerk's limit.
    OnPath {
        /// Time of one interpolation step, s.
        cycle_s: f64,
    },
}

/// A stretch of the way with its bend.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Place {
    /// Length, mm.
    pub length_mm: f64,
    /// Programmed speed, or what the control brings it down to, mm/s.
    pub speed: f64,
    /// Largest curvature, 1/mm.
    pub bend: f64,
    /// Largest change of the curvature vector along the way, 1/mm².
    pub twist: f64,
}

/// Between two places.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Joint {
    /// Fastest speed through it, mm/s; zero is a stop.
    pub speed: f64,
    /// Jerk that passing it takes, mm/s³ per mm/s of speed.
    pub jerk_per_speed: f64,
}

impl Joint {
    /// Nothing happens here.
    pub const SMOOTH: Joint = Joint { speed: f64::INFINITY, jerk_per_speed: 0.0 };
    /// The machine stands still here.
    pub const STOP: Joint = Joint { speed: 0.0, jerk_per_speed: 0.0 };
}

/// Direction and curvature vector at the end of a curve.
#[derive(Debug, Clone, Copy)]
struct Flow {
    direction: Vector3,
    bend: Vector3,
}

/// A way along curves, cut into places.
#[derive(Debug, Clone)]
pub struct Track {
    limits: Limits,
    rule: JointRule,
    /// Every place, and the joint before it.
    places: Vec<(Joint, Place)>,
    /// Number of places before the end of every curve.
    ends: Vec<usize>,
    last: Option<Flow>,
}

/// Part of the acceleration that a bend may take; 0.6 of it is then left along the path.
const BEND_SHARE: f64 = 0.8;
/// Part of the jerk that changing curvature may take.
const TWIST_SHARE: f64 = 0.6;
/// Part of the jerk that a joint may take.
const JOINT_SHARE: f64 = 0.25;
/// Curvature and its change are taken this much larger than found at stations.
const MARGIN: f64 = 1.1;
/// Nothing bends more sharply, 1/mm: beyond it is a cusp, where the machine all but stops.
const SHARPEST_PER_MM: f64 = 1e6;
/// Directions that differ by less than this are no corner to a control that rounds corners, as a sine.
const STRAIGHT_SINE: f64 = 0.01;
/// Slower than this through a joint is a stop, mm/s.
const CRAWL_MM_PER_S: f64 = 0.5;
/// And slower than this part of `a² / j`, the speed below which the full acceleration is not reached: a stop then takes
/// little longer.
const CRAWL_SHARE: f64 = 0.05;
/// Where in a span the curve's derivatives at its ends are taken, as a part of the span.
const INSET: f64 = 1e-9;

impl Track {
    /// A way that begins at rest.
    #[must_use]
    pub fn new(limits: Limits, rule: JointRule) -> Self {
        Track { limits, rule, places: Vec::new(), ends: Vec::new(), last: None }
    }

    /// Joints before the curves that are added from now on are passed by this rule.
    pub fn set_rule(&mut self, rule: JointRule) {
        self.rule = rule;
    }

    /// Goes on along a curve at `feed` mm/min.
    pub fn add(&mut self, rail: &Rail, feed: f64) {
        let curve = rail.curve();
        let degree = curve.knots().degree();
        let speed = feed / 60.0;
        for (i, w) in rail.stations().windows(2).enumerate() {
            let ((t0, s0), (t1, s1)) = (w[0], w[1]);
            let length_mm = s1 - s0;
            if length_mm <= 0.0 {
                continue;
            }
            let inset = INSET * (t1 - t0);
            let straight = degree == 1 && curve.weights().is_none();
            let (Some(from), Some(to)) = (flow(curve, t0 + inset), flow(curve, t1 - inset)) else {
                // A cusp: nobody passes it without a stop.
                let place = Place { length_mm, speed, bend: 0.0, twist: 0.0 };
                self.places.push((Joint::STOP, place));
                self.last = None;
                continue;
            };
            let (mut bend, mut twist) = (0.0, 0.0);
            if !straight && let Some(middle) = flow(curve, 0.5 * (t0 + t1)) {
                bend = MARGIN * from.bend.norm().max(middle.bend.norm()).max(to.bend.norm());
                let change = (middle.bend - from.bend).norm().max((to.bend - middle.bend).norm());
                twist = MARGIN * change / (0.5 * length_mm);
                (bend, twist) = (bend.min(SHARPEST_PER_MM), twist.min(SHARPEST_PER_MM.powi(2)));
            }
            // Within a span, and at a simple knot of a cubic, everything is continuous.
            let smooth = i > 0 && degree > curve.knots().multiplicity(t0) + 1;
            let joint = match self.last {
                None => Joint::STOP,
                Some(_) if smooth => Joint::SMOOTH,
                Some(last) => self.joint(&last, &from),
            };
            self.places.push((joint, Place { length_mm, speed, bend, twist }));
            self.last = Some(to);
        }
        self.ends.push(self.places.len());
    }

    /// Goes on over a place that stands for a whole curve, behind a joint.
    pub fn add_place(&mut self, joint: Joint, place: Place) {
        if place.length_mm > 0.0 {
            let joint = if self.places.is_empty() { Joint::STOP } else { joint };
            self.places.push((joint, place));
        }
        self.ends.push(self.places.len());
    }

    /// The machine stands still at the end of what has been added.
    pub fn stop(&mut self) {
        self.last = None;
    }

    /// Places, each with the joint before it.
    #[must_use]
    pub fn places(&self) -> &[(Joint, Place)] {
        &self.places
    }

    /// Number of places before the end of every curve that was added.
    #[must_use]
    pub fn ends(&self) -> &[usize] {
        &self.ends
    }

    /// What the machine does.
    #[must_use]
    pub fn limits(&self) -> Limits {
        self.limits
    }

    fn joint(&self, before: &Flow, after: &Flow) -> Joint {
        let cosine = before.direction.dot(&after.direction);
        let sine = before.direction.cross(&after.direction).norm();
        let (a, j) = (self.limits.acceleration_mm_per_s2, self.limits.jerk_mm_per_s3);
        let crawl = CRAWL_MM_PER_S.max(CRAWL_SHARE * a * a / j);
        let speed = match self.rule {
            JointRule::Within { stop_deg, .. } if sine.atan2(cosine) > stop_deg.to_radians() => 0.0,
            JointRule::Within { .. } if cosine > 0.0 && sine < STRAIGHT_SINE => f64::INFINITY,
            JointRule::Within { mm, .. } => {
                // geometry of the inscribed arc: θ, the angle between the ways, is 180° for straight on.
                let half = (0.5 * (1.0 + cosine)).max(0.0).sqrt();
                (a * mm * half / (1.0 - half)).sqrt()
            }
            JointRule::OnPath { cycle_s } => {
                let turn = (after.direction - before.direction).norm();
                let jump = (after.bend - before.bend).norm();
                // turn · v / dt² + jump · v² / dt is what the jump takes of the jerk.
                let (linear, square) = (turn / (cycle_s * cycle_s), jump / cycle_s);
                let most = JOINT_SHARE * j;
                let speed = 2.0 * most / (linear + (linear * linear + 4.0 * square * most).sqrt());
                let jerk_per_speed = JOINT_SHARE * j / speed;
                return if speed < crawl { Joint::STOP } else { Joint { speed, jerk_per_speed } };
            }
        };
        if speed < crawl { Joint::STOP } else { Joint { speed, jerk_per_speed: 0.0 } }
    }
}

impl Place {
    /// Fastest speed, mm/s.
    pub(crate) fn cap(&self, limits: &Limits) -> f64 {
        let mut v = self.speed;
        if self.bend > 0.0 {
            v = v.min((BEND_SHARE * limits.acceleration_mm_per_s2 / self.bend).sqrt());
        }
        if self.twist > 0.0 {
            v = v.min((TWIST_SHARE * limits.jerk_mm_per_s3 / self.twist).cbrt());
        }
        v
    }

    /// Largest acceleration along the path at speed `v`, with what a joint beside it takes of the jerk: so that
    /// the accelerations along and across, and the parts `j`, `3·v·a·κ`, `v³·|dK/ds|` of the jerk, together stay
    /// within the limits.
    pub(crate) fn push(&self, v: f64, joint_jerk: f64, a: f64, limits: &Limits) -> f64 {
        let j = limits.jerk_mm_per_s3;
        let across = v * v * self.bend / limits.acceleration_mm_per_s2;
        let by_acceleration = limits.acceleration_mm_per_s2 * (1.0 - across * across).max(0.0).sqrt();
        if !j.is_finite() {
            return by_acceleration.min(a);
        }
        let rest = j - v.powi(3) * self.twist - joint_jerk;
        by_acceleration.min(rest / (j / a + 3.0 * v * self.bend)).min(a)
    }
}

/// Direction and curvature vector; `None` where the curve stands still.
fn flow(curve: &Curve3, t: f64) -> Option<Flow> {
    let [_, d1, d2] = curve.derivatives(t);
    let direction = d1.try_normalize(1e-12)?;
    let bend = (d2 - direction * d2.dot(&direction)) / d1.norm_squared();
    Some(Flow { direction, bend })
}
