//! Engagement: the angles about the tool at which it cuts, at a height above its tip.
//!
//! ```text
//!        feed            A point of the tool's circle, moved ahead by a hair, is engaged if it is in the initial
//!     ↑   ___            stock and no piece before holds it. The ends of the arcs of engaged points are found by
//!     │ .´β /`.          bisection (B1 of the reference cases: cos α = 1 − ae/R).
//!      (  •   )███
//!       `.__.´███
//! ```

use claymill_nurbs::{Point3, Vector3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::initial::InitialStock;
use super::piece::Sweep;
use super::sweeps::{Sweeps, Time};
use crate::across::across;

/// What a tool cuts at one moment and height.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
pub struct Engagement {
    /// Height above the tip, mm.
    pub height_mm: f64,
    /// Radius of the tool there, mm.
    pub radius_mm: f64,
    /// Sum of the engaged angles, degrees: 180 in a full slot, 360 in a plunge.
    pub angle_deg: f64,
    /// Arcs, from and to in degrees from the direction of feed, anticlockwise as seen from the holder. One that runs over ±180° is
    /// two. Ends are exact to 0.01°; arcs narrower than a scanning step may be missed.
    pub arcs_deg: Vec<[f64; 2]>,
}

/// A point of the tool is looked at so far ahead of it, mm.
const AHEAD_MM: f64 = 1e-6;
/// Ends of arcs are bisected to this, degrees.
const END_DEG: f64 = 1e-3;

/// A place of a chord, with what the chord has swept up to there.
pub(super) struct Pose<'a> {
    pub(super) tip: Point3,
    pub(super) way: Vector3,
    pub(super) axis: Vector3,
    /// The cutting bodies on the way from the chord's start.
    pub(super) swept: &'a [Sweep],
    pub(super) time: Time,
}

/// The engagement of a pose; angles are scanned in steps of `scan_deg`. `None` above the tool or beside its narrow end.
pub(super) fn engagement(
    pose: &Pose<'_>,
    height_mm: f64,
    scan_deg: f64,
    sweeps: &Sweeps,
    stock: &InitialStock<'_>,
) -> Option<Engagement> {
    let radii = pose.swept.iter().filter_map(|s| s.shape.radius_at(height_mm));
    let radius_mm = radii.reduce(f64::max).filter(|r| *r > 0.0)?;
    let feed = pose.way.try_normalize(1e-12)?;
    let aside = feed - pose.axis * feed.dot(&pose.axis);
    let forward = aside.try_normalize(1e-6).unwrap_or_else(|| across(&pose.axis));
    let left = pose.axis.cross(&forward);
    let centre = pose.tip + pose.axis * height_mm + feed * AHEAD_MM;
    let is_engaged = |deg: f64| {
        let (sine, cosine) = deg.to_radians().sin_cos();
        let q = centre + (forward * cosine + left * sine) * radius_mm;
        stock.contains(&q)
            && !pose.swept.iter().any(|s| s.holds(&q))
            && sweeps.cut_before(&q, pose.time).is_none()
    };
    let count = (360.0 / scan_deg).ceil() as usize;
    let arcs_deg = arcs_where([-180.0, 180.0], count, END_DEG, is_engaged);
    let angle_deg = arcs_deg.iter().map(|[a, b]| b - a).sum();
    Some(Engagement { height_mm, radius_mm, angle_deg, arcs_deg })
}

/// The parts of an arc in which something holds, degrees: looked at in so many equal steps, and their ends bisected to `end_deg`.
pub(super) fn arcs_where(
    [from, to]: [f64; 2],
    count: usize,
    end_deg: f64,
    holds: impl Fn(f64) -> bool,
) -> Vec<[f64; 2]> {
    let angle = |k: usize| from + (to - from) * k as f64 / count as f64;
    let held: Vec<bool> = (0..=count).map(|k| holds(angle(k))).collect();
    let end = |mut yes: f64, mut no: f64| {
        while (yes - no).abs() > end_deg {
            let middle = 0.5 * (yes + no);
            if holds(middle) { yes = middle } else { no = middle }
        }
        0.5 * (yes + no)
    };
    let (mut arcs, mut begun) = (Vec::new(), held[0].then_some(from));
    for k in 1..=count {
        match (held[k - 1], held[k]) {
            (false, true) => begun = Some(end(angle(k), angle(k - 1))),
            (true, false) => arcs.extend(begun.take().map(|b| [b, end(angle(k - 1), angle(k))])),
            _ => {}
        }
    }
    arcs.extend(begun.map(|b| [b, to]));
    arcs
}
