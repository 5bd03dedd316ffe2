//! Parts that are taken in a round, and the passes along their new borders.
//!
//! ```text
//!            ╭────────╮ ← pass, anticlockwise about the part: the uncut is on its right (climb)
//!        A   │  part  │
//!      ──────┴────────┴─── border of A: nothing is cut along it
//! ```

use crate::engagement::EngagementLimit;
use crate::leads::entered;
use crate::outline::{Outline, Place, distance};
use crate::planar_set::PlanarSet;
use crate::rounds::State;

/// What was reached is known to this, mm.
const INSIDE_MM: f64 = 1e-3;
/// A border this near to the one that was reached is no new one, mm.
const BESIDE_MM: f64 = 1.5e-3;
/// Borders shorter than this cut nothing that counts, mm.
const SHORTEST_MM: f64 = 0.01;

/// Points of a pass are this far apart, mm.
const STEP_MM: f64 = 0.012;
/// A part clears this share of the square of the tool's radius at least.
const LEAST_SHARE: f64 = 5e-5;

/// A part that is taken in a round.
#[derive(Debug, Clone)]
pub(crate) struct Front {
    pub(crate) round: usize,
    /// What the centre reaches anew.
    pub(crate) part: PlanarSet,
    /// What is cut.
    pub(crate) cleared: PlanarSet,
    pub(crate) cleared_mm2: f64,
    pub(crate) passes: Vec<Pass>,
}

/// A pass along a new border.
#[derive(Debug, Clone)]
pub(crate) struct Pass {
    pub(crate) points: Vec<Place>,
    /// Of a closed pass the way in and out; an open one starts where nothing is left to cut.
    pub(crate) lead: Option<Lead>,
}

/// A way in and out of a closed pass.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Lead {
    /// Along a circle about a middle, from where nothing is left to cut; and out again.
    Circle { centre: Place, from: Place, to: Place },
    /// Along points up to the start of the pass, whose end cuts what they leave.
    Spiral(Vec<Place>),
}

impl Pass {
    /// Where the tool comes down to it.
    pub(crate) fn start(&self) -> Place {
        match &self.lead {
            Some(Lead::Circle { from, .. }) => *from,
            Some(Lead::Spiral(points)) => points[0],
            None => self.points[0],
        }
    }

    /// Where the tool leaves it.
    pub(crate) fn end(&self) -> Place {
        match self.lead {
            Some(Lead::Circle { to, .. }) => to,
            _ => self.points[self.points.len() - 1],
        }
    }

    /// Whether no circle and no spiral leads into it, and it is closed: the tool goes down along it.
    pub(crate) fn is_ramped(&self) -> bool {
        self.lead.is_none() && self.points.first() == self.points.last()
    }

    pub(crate) fn length_mm(&self) -> f64 {
        self.points.windows(2).map(|w| distance(w[0], w[1])).sum()
    }
}

impl Front {
    /// Area that is cut by length of the passes, mm.
    pub(crate) fn yield_mm(&self) -> f64 {
        let length: f64 = self.passes.iter().map(Pass::length_mm).sum();
        self.cleared_mm2 / length.max(f64::MIN_POSITIVE)
    }
}

/// What is there before a round.
pub(crate) struct Ground<'a> {
    pub(crate) limit: &'a EngagementLimit,
    uncut_set: &'a PlanarSet,
    pub(crate) reached: Outline,
    pub(crate) uncut: Outline,
    /// What the round would reach in all.
    pub(crate) next: Outline,
    /// Where passes of the round before end: the tool may come from there.
    ends: &'a [Place],
}

impl<'a> Ground<'a> {
    pub(crate) fn new(state: &'a State, next: &PlanarSet, limit: &'a EngagementLimit) -> Self {
        Ground {
            limit,
            uncut_set: &state.uncut,
            reached: Outline::new(&state.reached),
            uncut: Outline::new(&state.uncut),
            next: Outline::new(&next.union(&state.reached)),
            ends: &state.ends,
        }
    }

    /// Whether nothing is left to cut where the centre is at a place.
    pub(crate) fn is_reached(&self, p: Place) -> bool {
        self.reached.contains(p) && !self.reached.is_within(p, INSIDE_MM)
    }

    /// The distance from the nearest end of a pass of the round before, mm.
    pub(crate) fn gap_to_ends_mm(&self, p: Place) -> f64 {
        self.ends.iter().map(|end| distance(p, *end)).fold(f64::INFINITY, f64::min)
    }
}

/// The passes of a part; `None` if it has none that cuts.
pub(crate) fn front(part: PlanarSet, ground: &Ground<'_>) -> Option<Front> {
    let cleared = part.dilated(ground.limit.radius_mm()).intersection(ground.uncut_set);
    let passes: Vec<Pass> = part.contours().iter().flat_map(|c| passes(c, ground)).collect();
    let cleared_mm2 = cleared.area_mm2();
    let is_worth = cleared_mm2 > LEAST_SHARE * ground.limit.radius_mm().powi(2);
    (is_worth && !passes.is_empty()).then_some(Front { round: 0, cleared_mm2, part, cleared, passes })
}

/// The stretches of a contour that are not on the border of what was reached.
fn passes(contour: &[Place], ground: &Ground<'_>) -> Vec<Pass> {
    let n = contour.len();
    let is_old = |k: usize| {
        let (a, b) = (contour[k], contour[(k + 1) % n]);
        // A wall that what was reached only touches in the middle is new.
        let middle = [0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1])];
        [middle, a, b].into_iter().all(|p| ground.reached.distance(p, BESIDE_MM) < BESIDE_MM)
    };
    let old: Vec<bool> = (0..n).map(is_old).collect();
    let Some(first) = (0..n).find(|&k| old[k]) else {
        return vec![entered(contour, ground)];
    };
    let mut found = Vec::new();
    let mut points: Vec<Place> = Vec::new();
    for k in (first..first + n).map(|k| k % n) {
        if old[k] {
            if points.len() > 1 {
                found.push(Pass { points: std::mem::take(&mut points), lead: None });
            }
            points.clear();
        } else {
            if points.is_empty() {
                points.push(contour[k]);
            }
            points.push(contour[(k + 1) % n]);
        }
    }
    if points.len() > 1 {
        found.push(Pass { points, lead: None });
    }
    found.retain(|pass| pass.length_mm() >= SHORTEST_MM);
    found
}

/// Without points that are very close to the one before: steps where circles meet turn the tool without moving it.
pub(crate) fn without_steps(points: &[Place]) -> Vec<Place> {
    let mut kept: Vec<Place> = Vec::with_capacity(points.len());
    for (k, &p) in points.iter().enumerate() {
        let is_end = k == 0 || k + 1 == points.len();
        let is_close = kept.last().is_some_and(|&last| distance(last, p) < STEP_MM);
        if is_close && is_end && kept.len() > 1 {
            kept.pop();
        }
        if is_end || !is_close {
            kept.push(p);
        }
    }
    kept
}
