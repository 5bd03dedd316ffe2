//! Cubes and the moment from which each is known to hold no stock, so that what is far from all stock is known to be clear
//! without a proof.
//!
//! ```text
//!   ┌───────┬───┬───┐   A cube is empty if the initial stock is farther from its middle than its corners are, or from the time
//!   │       │ · │ · │   of the first piece that holds all its corners: pieces are convex. Stock never grows, so that what is
//!   │   ·   ├───┼───┤   empty once stays so. Cubes that are not known to be empty are divided down to the smallest. Each is
//!   │       │ · │ ? │   looked at when it is first asked for.
//!   └───────┴───┴───┘
//! ```

use std::sync::atomic::{AtomicU32, Ordering};

use claymill_nurbs::{Aabb, Point3, Vector3};

use super::initial::{BoxInStock, InitialStock};
use super::piece::Sweep;
use super::sweeps::{Sweeps, Time};

/// Smallest cubes at most.
const MOST_CELLS: f64 = 4e6;
/// Smallest cubes have no smaller side than this, mm.
const SMALLEST_MM: f64 = 0.5;
/// Never empty; and not looked at yet.
const NEVER: Time = Time::MAX;
const UNKNOWN: Time = Time::MAX - 1;

/// The cubes over an initial stock.
#[derive(Debug)]
pub(super) struct Cells {
    low: Point3,
    /// From the smallest cubes to the largest.
    levels: Vec<Level>,
}

#[derive(Debug)]
struct Level {
    side_mm: f64,
    counts: [usize; 3],
    /// A cube is empty for whoever asks of a time that is not less than this.
    empty_from: Vec<AtomicU32>,
}

impl Level {
    fn number(&self, [i, j, k]: [usize; 3]) -> usize {
        (k * self.counts[1] + j) * self.counts[0] + i
    }
}

impl Cells {
    pub(super) fn over(bounds: &Aabb) -> Self {
        let size = bounds.max - bounds.min;
        let mut side_mm = (size.product() / MOST_CELLS).cbrt().max(SMALLEST_MM).max(size.amax() / MOST_CELLS);
        let mut counts = [0, 1, 2].map(|k| ((size[k] / side_mm).ceil() as usize).max(1));
        let mut levels = Vec::new();
        loop {
            let empty_from = (0..counts.iter().product()).map(|_| AtomicU32::new(UNKNOWN)).collect();
            levels.push(Level { side_mm, counts, empty_from });
            if counts == [1; 3] {
                return Cells { low: bounds.min, levels };
            }
            counts = counts.map(|n| n.div_ceil(2));
            side_mm *= 2.0;
        }
    }

    /// Whether a sweep is known to meet no stock that is there before a time.
    pub(super) fn are_clear_of(
        &self,
        sweep: &Sweep,
        before: Time,
        (stock, sweeps): (&InitialStock<'_>, &Sweeps),
    ) -> bool {
        let bounds = sweep.bounds();
        let mut open = vec![(self.levels.len() - 1, [0; 3])];
        while let Some((depth, place)) = open.pop() {
            let level = &self.levels[depth];
            let half = Vector3::repeat(0.5 * level.side_mm);
            let along = Vector3::from(place.map(|i| (2 * i + 1) as f64));
            let middle = self.low + along.component_mul(&half);
            let cube = Aabb { min: middle - half, max: middle + half };
            let apart = (0..3).any(|k| cube.min[k] > bounds.max[k] || cube.max[k] < bounds.min[k]);
            if apart || sweep.signed_mm(&middle) > half.norm() {
                continue;
            }
            let known = &level.empty_from[level.number(place)];
            let mut empty_from = known.load(Ordering::Relaxed);
            if empty_from == UNKNOWN {
                empty_from = if stock.over_box(&cube) == BoxInStock::Outside {
                    0
                } else {
                    sweeps.held_at(&cube).map_or(NEVER, |time| time.saturating_add(1))
                };
                // Whoever else looks at the same time finds the same.
                known.store(empty_from, Ordering::Relaxed);
            }
            if empty_from <= before {
                continue;
            }
            let Some(finer) = depth.checked_sub(1) else { return false };
            let counts = self.levels[finer].counts;
            for corner in 0..8 {
                let child = [0, 1, 2].map(|k| 2 * place[k] + (corner >> k & 1));
                if (0..3).all(|k| child[k] < counts[k]) {
                    open.push((finer, child));
                }
            }
        }
        true
    }
}
