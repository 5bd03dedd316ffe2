//! A shorter way through all passes.

use crate::link::order::{Ends, Turn};

/// Lifting over costs about as much as this length of path, mm, and
const LIFT_MM: f64 = 60.0;
/// then, rapid, this share of the distance.
const RAPID_SHARE: f64 = 0.3;
/// Ways that cost less are never broken up for their own sake, mm.
const LONG_MM: f64 = 15.0;
/// Segments of so many passes are moved on their own, too.
const SHORT_SEGMENT: usize = 3;
/// Changes that gain less are not made, mm.
const WORTH_MM: f64 = 0.5;
/// Changes looked at, at most: a few seconds.
const LOOKS: u64 = 300_000_000;

/// A change of the order, with what it gains, mm.
#[derive(Debug, Clone, Copy)]
enum Change {
    /// Cuts `from..to` the other way round.
    Reverse { from: usize, to: usize },
    /// Moves `from..to` in front of `before`.
    Move { from: usize, to: usize, before: usize, reversed: bool },
}

/// Improves the order by reversing stretches of it (2-opt; only if passes may be cut from end to start) and by
/// moving stretches elsewhere (Or-opt; Or, "Traveling salesman-type combinatorial problems", 1976), until no long
/// way becomes shorter.
pub(crate) fn shorten(passes: &[Ends], turns: &mut Vec<Turn>, reversible: bool) {
    let mut tour = Tour { passes, turns, reversible, looks: 0 };
    loop {
        let mut better = false;
        let mut at = 1;
        while at < tour.turns.len() && tour.looks < LOOKS {
            while tour.way(at) > LONG_MM
                && let Some(change) = tour.best_at(at)
            {
                tour.make(change);
                better = true;
            }
            at += 1;
        }
        if !better || tour.looks >= LOOKS {
            return;
        }
    }
}

struct Tour<'a> {
    passes: &'a [Ends],
    turns: &'a mut Vec<Turn>,
    reversible: bool,
    looks: u64,
}

impl Tour<'_> {
    fn ends(&self, at: usize) -> Ends {
        self.turns[at].ends(self.passes)
    }

    /// Cost of the way from one place in the order to another; nothing before the first and after the last.
    fn between(&self, from: Option<(usize, bool)>, to: Option<(usize, bool)>) -> f64 {
        let (Some((from, back)), Some((to, forth))) = (from, to) else { return 0.0 };
        let (a, b) = (self.ends(from), self.ends(to));
        let leave = if back { a.start } else { a.end };
        let arrive = if forth { b.end } else { b.start };
        let distance = (arrive - leave).norm();
        distance.min(LIFT_MM + RAPID_SHARE * distance)
    }

    fn place(&self, at: usize) -> Option<(usize, bool)> {
        (at < self.turns.len()).then_some((at, false))
    }

    fn before(&self, at: usize) -> Option<(usize, bool)> {
        at.checked_sub(1).map(|before| (before, false))
    }

    /// Cost of the way to the pass at `at` from the one before.
    fn way(&self, at: usize) -> f64 {
        self.between(self.before(at), self.place(at))
    }

    /// The change that gains most by breaking up the way to the pass at `at`.
    fn best_at(&mut self, at: usize) -> Option<Change> {
        let mut best: (f64, Option<Change>) = (WORTH_MM, None);
        let mut consider = |gain: f64, change: Change| {
            if gain > best.0 {
                best = (gain, Some(change));
            }
        };
        let count = self.turns.len();
        self.looks += count as u64;
        if self.reversible {
            for other in 0..=count {
                let (from, to) = (at.min(other), at.max(other));
                if to > from {
                    let now = self.way(from) + self.way(to);
                    let then = self.between(self.before(from), Some((to - 1, true)))
                        + self.between(Some((from, true)), self.place(to));
                    consider(now - then, Change::Reverse { from, to });
                }
            }
        }
        for (from, to) in self.segments(at) {
            self.looks += 2 * count as u64;
            let taken_out = self.way(from) + self.way(to) - self.between(self.before(from), self.place(to));
            if taken_out <= WORTH_MM {
                continue;
            }
            for before in (0..from).chain(to + 1..=count) {
                for reversed in [false, true].into_iter().take(1 + usize::from(self.reversible)) {
                    let (first, last) = if reversed { (to - 1, from) } else { (from, to - 1) };
                    let put_in = self.between(self.before(before), Some((first, reversed)))
                        + self.between(Some((last, reversed)), self.place(before))
                        - self.way(before);
                    consider(taken_out - put_in, Change::Move { from, to, before, reversed });
                }
            }
        }
        best.1
    }

    /// Segments next to a long way: up to the next long way on either side, and the shortest ones.
    fn segments(&self, at: usize) -> Vec<(usize, usize)> {
        let count = self.turns.len();
        let next = (at + 1..count).find(|&k| self.way(k) > LONG_MM).unwrap_or(count);
        let last = (1..at).rev().find(|&k| self.way(k) > LONG_MM).unwrap_or(0);
        let after = (1..=SHORT_SEGMENT).map(|k| (at, at + k)).filter(|s| s.1 < next);
        let ahead = (1..=SHORT_SEGMENT).filter_map(|k| Some((at.checked_sub(k)?, at))).filter(|s| s.0 > last);
        [(at, next), (last, at)].into_iter().chain(after).chain(ahead).collect()
    }

    fn make(&mut self, change: Change) {
        let turn_round = |turns: &mut [Turn]| {
            turns.reverse();
            turns.iter_mut().for_each(|t| t.reversed = !t.reversed);
        };
        match change {
            Change::Reverse { from, to } => turn_round(&mut self.turns[from..to]),
            Change::Move { from, to, before, reversed } => {
                if reversed {
                    turn_round(&mut self.turns[from..to]);
                }
                if before < from {
                    self.turns[before..to].rotate_right(to - from);
                } else {
                    self.turns[from..before].rotate_left(to - from);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use claymill_nurbs::Point3;
    use proptest::prelude::*;

    use super::*;

    fn ends(start: [f64; 2], end: [f64; 2]) -> Ends {
        let at = |[x, y]: [f64; 2]| Point3::new(x, y, 0.0);
        Ends { start: at(start), end: at(end) }
    }

    fn cost_mm(passes: &[Ends], turns: &[Turn]) -> f64 {
        let mut turns = turns.to_vec();
        let tour = Tour { passes, turns: &mut turns, reversible: true, looks: 0 };
        (1..passes.len()).map(|at| tour.way(at)).sum()
    }

    fn in_given_order(count: usize) -> Vec<Turn> {
        (0..count).map(|pass| Turn { pass, reversed: false }).collect()
    }

    #[test]
    fn two_blocks_that_were_mixed_are_parted() {
        // Rows of 50 mm, 3 mm apart, in two blocks 400 mm apart, taken by turns.
        let passes: Vec<Ends> = (0..42)
            .map(|k| (f64::from(k % 2) * 400.0, f64::from(k / 2) * 3.0))
            .map(|(x, y)| ends([x, y], [x + 50.0, y]))
            .collect();
        let mut turns = in_given_order(42);
        shorten(&passes, &mut turns, true);
        let jumps = turns.windows(2).filter(|w| w[0].pass % 2 != w[1].pass % 2).count();
        assert_eq!(jumps, 1);
        // Zigzag within the blocks, and once from one to the other.
        approx::assert_abs_diff_eq!(
            cost_mm(&passes, &turns),
            40.0 * 3.0 + 60.0 + 0.3 * 350.0,
            epsilon = 1e-9
        );
    }

    proptest! {
        #[test]
        fn every_pass_stays_and_no_order_becomes_longer(
            places in prop::collection::vec(prop::array::uniform4(0.0..500.0f64), 1..40), reversible: bool,
        ) {
            let passes: Vec<Ends> = places.iter().map(|p| ends([p[0], p[1]], [p[2], p[3]])).collect();
            let before = in_given_order(passes.len());
            let mut turns = before.clone();
            shorten(&passes, &mut turns, reversible);
            prop_assert!(cost_mm(&passes, &turns) <= cost_mm(&passes, &before) + 1e-9);
            prop_assert!(reversible || turns.iter().all(|t| !t.reversed));
            let mut seen: Vec<usize> = turns.iter().map(|t| t.pass).collect();
            seen.sort_unstable();
            prop_assert!(seen.into_iter().eq(0..passes.len()));
        }
    }
}
