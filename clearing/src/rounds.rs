//! Constant engagement: what the tool may reach next, round after round, without cutting at more than a limit.
//!
//! ```text
//!   F  where the tool's centre may be       D  what is uncut       A  what the centre has reached
//!
//!   A circle of radius ρ in F, around whose middle nothing is uncut within √(ρ² + R² + 2ρR cos α), may be run along: the
//!   tool cuts at α at most. Every round takes all such circles, of all radii:
//!
//!        A' = A ∪ ⋃ (F eroded by ρ − D dilated by √(ρ² + R² + 2ρR cos α)) dilated by ρ        D' = D − A' dilated by R
//! ```
//!
//! The border of `A'` that is not one of `A` is the next pass. Each of its points lies on such a circle inside of `A'`, and the
//! pass is nowhere bent away from the wall more sharply than that circle. Large circles make long fronts; where only small
//! ones fit, in channels and corners, the passes are the loops of trochoids and bites that shrink by themselves.

use claymill_toolpath::Monitor;

use crate::engagement::EngagementLimit;
use crate::error::ClearingError;
use crate::fronts::{Front, Ground, Pass, front};
use crate::outline::{Outline, Place};
use crate::planar_set::{CHORD_MM, PlanarSet};

/// Rounds of a clearing at most.
pub const MOST_ROUNDS: usize = 5_000;
/// Circles of this many tool radii are as good as straight lines.
pub(crate) const STRAIGHTEST: f64 = 32.0;
/// Circles become smaller by this from one to the next.
const RATIO: f64 = 0.707;
/// Circles that are looked at after the largest one that gains something: they round its fronts towards corners.
const MORE_CIRCLES: usize = 3;
/// The smallest circle, in tool radii: sharp corners of what the centre reaches are rounded by it.
pub(crate) const SHARPEST: f64 = 1.0 / 160.0;
/// Noise of borders on the grid and the fit of arcs raise the engagement by up to this: fronts are laid for less, degrees.
const RESERVE_DEG: f64 = 1.0;
/// What chords and fitted arcs may cut too much, mm.
const MARGIN_MM: f64 = 0.015;
/// So much of what is beside walls is not looked at, mm: what circles leave there are teeth, which would make the borders of the
/// uncut and of what is not reached longer and longer behind the tool.
pub const TEETH_MM: f64 = 0.005;
/// Parts that are thinner on the mean are noise of the grid, mm.
pub(crate) const THINNEST_MM: f64 = 0.002;
/// What a smaller circle adds to larger ones is wider than this on the mean, mm.
const SLIVER_MM: f64 = 0.004;
/// Middles of circles may be nearer to the uncut than they should by this, mm.
const PINHOLE_MM: f64 = 0.004;
/// Vertices of a part that are looked at.
const LOOKED_AT: usize = 24;
/// Circles that gain nothing are left alone for twice as many rounds each time, up to this.
const MOST_PATIENCE: usize = 16;
/// A part is taken in a round if it clears this share of what the best one clears by length of its pass.
const WORTHWHILE: f64 = 0.6;

/// One circle, with where its middle may be.
struct Circle {
    radius_mm: f64,
    /// The uncut is this far from its middle at least, mm.
    clear_mm: f64,
    middles: PlanarSet,
    /// All that such circles cover.
    covered: PlanarSet,
    is_done: bool,
    /// It is not looked at before this round, having gained nothing; and so long it is left alone the next time.
    next_round: usize,
    patience: usize,
}

/// What rounds start from and what they have come to.
#[derive(Debug, Clone)]
pub(crate) struct State {
    /// What the centre has reached.
    pub(crate) reached: PlanarSet,
    /// What is uncut, without what is nearest to walls.
    pub(crate) uncut: PlanarSet,
    /// What the centre may reach and has not, without what is nearest to walls.
    pub(crate) open: PlanarSet,
    /// Where the passes of the last round end.
    pub(crate) ends: Vec<Place>,
    /// Rounds so far.
    pub(crate) rounds: usize,
}

impl State {
    /// Where the centre has reached some of where it may be, and something is to be cut.
    pub(crate) fn new(feasible: &PlanarSet, reached: PlanarSet, wanted: &PlanarSet) -> Self {
        let (uncut, open) = (wanted.eroded(TEETH_MM), feasible.minus(&reached).eroded(TEETH_MM));
        State { reached, uncut, open, ends: Vec::new(), rounds: 0 }
    }

    /// Takes in that the centre reaches a part, and what is cut then.
    pub(crate) fn take(&mut self, part: &PlanarSet, cleared: &PlanarSet) {
        self.reached = self.reached.union(part);
        self.uncut = self.uncut.minus(cleared);
        self.open = self.open.minus(part);
    }

    fn simplify(&mut self) {
        for set in [&mut self.reached, &mut self.uncut, &mut self.open] {
            *set = set.simplified().without_slivers(THINNEST_MM);
        }
    }
}

fn circles(feasible: &PlanarSet, limit: &EngagementLimit) -> Vec<Circle> {
    let radius_mm = limit.radius_mm();
    let mut circles = Vec::new();
    let mut rho = STRAIGHTEST * radius_mm;
    while rho > 0.99 * SHARPEST * radius_mm {
        // By exactly this: what sticks out by a chord is cut off below.
        let middles = feasible.eroded(rho - CHORD_MM);
        if !middles.is_empty() {
            let clear_mm = limit.reserved(RESERVE_DEG).cleared_radius_mm(rho) + MARGIN_MM + CHORD_MM;
            let covered = middles.dilated(rho).intersection(feasible);
            circles.push(Circle {
                radius_mm: rho,
                clear_mm,
                middles,
                covered,
                is_done: false,
                next_round: 0,
                patience: 1,
            });
        }
        rho *= RATIO;
    }
    circles
}

/// Rounds until nothing is gained.
pub(crate) fn run(
    feasible: &PlanarSet,
    state: &mut State,
    limit: &EngagementLimit,
    monitor: &dyn Monitor,
) -> Result<Vec<Front>, ClearingError> {
    let mut fronts = Vec::new();
    let mut circles = circles(feasible, limit);
    loop {
        monitor.go_on()?;
        if state.rounds >= MOST_ROUNDS {
            return Err(ClearingError::Rounds { rounds: MOST_ROUNDS });
        }
        let is_left_alone = |circle: &Circle| !circle.is_done && circle.next_round > state.rounds;
        let are_left_alone = circles.iter().any(is_left_alone);
        let mut parts = fronts_of_round(feasible, state, &mut circles, limit);
        if parts.is_empty() && are_left_alone {
            circles.iter_mut().for_each(|circle| circle.next_round = 0);
            parts = fronts_of_round(feasible, state, &mut circles, limit);
        }
        if parts.is_empty() {
            return Ok(fronts);
        }
        let best = parts.iter().map(Front::yield_mm).fold(0.0, f64::max);
        state.ends.clear();
        for mut part in parts.into_iter().filter(|p| p.yield_mm() >= WORTHWHILE * best) {
            state.take(&part.part, &part.cleared);
            state.ends.extend(part.passes.iter().map(Pass::end));
            part.round = state.rounds;
            fronts.push(part);
        }
        state.simplify();
        state.rounds += 1;
        // What larger circles cover, smaller ones do.
        for circle in circles.iter_mut().filter(|c| !c.is_done) {
            circle.is_done = !circle.covered.intersection(&state.open).parts().iter().any(is_thick);
            if !circle.is_done {
                break;
            }
        }
    }
}

/// What the next round may take, by the largest circles that gain something; nothing if none does.
fn fronts_of_round(
    feasible: &PlanarSet,
    state: &State,
    circles: &mut [Circle],
    limit: &EngagementLimit,
) -> Vec<Front> {
    let uncut = Outline::new(&state.uncut);
    let is_wanted = |circle: &&mut Circle| !circle.is_done && circle.next_round <= state.rounds;
    let mut left: Vec<&mut Circle> = circles.iter_mut().filter(is_wanted).collect();
    let mut next = PlanarSet::default();
    let mut from = 0;
    while from < left.len() {
        // Up to the first circle that gains something, and a few more.
        let (mut to, mut looked_at) = (from, 0);
        while to < left.len() && looked_at <= MORE_CIRCLES {
            let gained = gained(left[to], &next, feasible, state, &uncut);
            looked_at += usize::from(looked_at > 0 || !gained.is_empty());
            next = next.union(&gained);
            to += 1;
        }
        let parts = next.minus(&state.reached).without_slivers(THINNEST_MM).parts();
        let ground = Ground::new(state, &next, limit);
        let parts: Vec<Front> = parts.into_iter().filter_map(|p| front(p, &ground)).collect();
        let is_enough = parts.iter().any(|part| part.yield_mm() > THINNEST_MM);
        for circle in &mut left[from..to] {
            circle.patience = if is_enough { 1 } else { (2 * circle.patience).min(MOST_PATIENCE) };
            circle.next_round = state.rounds + circle.patience;
        }
        if is_enough {
            return parts;
        }
        // What these gain is noise; smaller ones may gain more.
        from = to;
    }
    Vec::new()
}

/// What a circle reaches besides what others do.
fn gained(
    circle: &Circle,
    next: &PlanarSet,
    feasible: &PlanarSet,
    state: &State,
    uncut: &Outline,
) -> PlanarSet {
    // Most of the circles that may be run along reach nothing new.
    let near = state.open.dilated(circle.radius_mm + TEETH_MM + 2.0 * CHORD_MM);
    let middles = circle.middles.intersection(&near).minus(&state.uncut.dilated(circle.clear_mm));
    let middles = proven(&middles, uncut, circle.clear_mm - PINHOLE_MM);
    if middles.is_empty() {
        return middles;
    }
    // Where a smaller circle reaches as far as a larger one, slivers would be left between them.
    middles
        .dilated(circle.radius_mm)
        .intersection(feasible)
        .minus(&state.reached)
        .without_slivers(SLIVER_MM)
        .minus(next)
        .without_slivers(SLIVER_MM)
}

/// The parts of which looked at vertices are as far from an outline as they should be. Where borders are noisy, what is grown by a
/// large distance has pinholes, each of which would become a whole circle.
fn proven(middles: &PlanarSet, uncut: &Outline, clear_mm: f64) -> PlanarSet {
    let is_clear = |part: &PlanarSet| {
        let contours = part.contours();
        let Some(outline) = contours.first() else { return false };
        let stride = outline.len().div_ceil(LOOKED_AT);
        !outline.iter().step_by(stride).any(|&p| uncut.is_within(p, clear_mm))
    };
    let parts = middles.without_slivers(0.5 * THINNEST_MM).parts();
    parts.iter().filter(|p| is_clear(p)).fold(PlanarSet::default(), PlanarSet::joined)
}

fn is_thick(part: &PlanarSet) -> bool {
    part.mean_width_mm() > THINNEST_MM
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicUsize, Ordering};

    use claymill_toolpath::Stage;

    use super::*;

    /// Ends rounds after so many.
    struct Rounds(AtomicUsize);

    impl Monitor for Rounds {
        fn at(&self, _: Stage, _: f64) {}

        fn is_cancelled(&self) -> bool {
            self.0.fetch_sub(1, Ordering::Relaxed) == 0
        }
    }

    /// Along walls no teeth are left that the borders would run along: with each round they would have more vertices.
    #[test]
    fn borders_do_not_grow_with_the_length_of_a_slot() {
        let (radius_mm, limit) = (6.0, EngagementLimit::new(6.0, 45.0).unwrap());
        let pad = |x: f64| PlanarSet::rectangle([x, -29.0, x + 8.3, 29.0]);
        let pads = pad(-15.0).union(&pad(6.7));
        let room = PlanarSet::rectangle([-40.0, -45.0, 40.0, 45.0]).minus(&pads.dilated(radius_mm + 0.01));
        let stock = PlanarSet::rectangle([-15.0, -31.0, 15.0, 31.0]).minus(&pads);
        let wanted = room.dilated(radius_mm).intersection(&stock);
        let reached = room.minus(&wanted.dilated(radius_mm));
        let mut state = State::new(&room, reached, &wanted);
        let mut vertices_after = |rounds: usize| {
            let ended = run(&room, &mut state, &limit, &Rounds(AtomicUsize::new(rounds)));
            assert!(matches!(ended, Err(ClearingError::Cancelled(_))), "{ended:?}");
            [&state.reached, &state.uncut, &state.open].map(PlanarSet::vertex_count)
        };
        let (early, late) = (vertices_after(20), vertices_after(100));
        for (early, late) in early.into_iter().zip(late) {
            assert!(late <= early + 60, "{early} vertices, then {late}");
        }
    }
}
