//! States of the material kept on the way, so that time can go back.
//!
//! A state is kept after each `apart` samples of the ball. Where they come to hold more than they may, every other one goes
//! and `apart` doubles: at any time of a job they lie evenly over the work that was done.

use super::heights::Heights;
use super::{Cut, Place};

/// Samples from one state to the next, at first.
const APART: u64 = 1 << 13;
/// So many states at most.
const MOST: usize = 256;

#[derive(Debug, Clone)]
pub(super) struct Checkpoints {
    pub(super) most_bytes: usize,
    pub(super) apart: u64,
    /// In the order of time.
    pub(super) kept: Vec<Cut>,
}

impl Checkpoints {
    /// That hold so many bytes at most.
    pub(super) fn of(most_bytes: usize) -> Self {
        Checkpoints { most_bytes, apart: APART, kept: Vec::new() }
    }

    /// The last state at or before a place.
    pub(super) fn before(&self, setup: usize, place: Place) -> Option<&Cut> {
        let after = self.kept.partition_point(|c| (c.setup, c.next) <= (setup, place));
        self.kept[..after].last().filter(|c| c.setup == setup)
    }

    /// Keeps a state where there is none about there; `fresh` is how each setup begins.
    pub(super) fn keep(&mut self, state: &Cut, fresh: &[Heights]) {
        let stretch = |c: &Cut| (c.setup, c.samples / self.apart);
        let here = stretch(state);
        let after = self.kept.partition_point(|c| stretch(c) < here);
        if here.1 == 0 || self.kept.get(after).is_some_and(|c| stretch(c) == here) {
            return;
        }
        self.kept.insert(after, state.clone());
        while self.kept.len() > MOST || self.bytes(fresh) > self.most_bytes {
            self.apart *= 2;
            let apart = self.apart;
            let mut before = None;
            // The first stretch of a setup begins with what is known of it anyway.
            self.kept.retain(|c| {
                let stretch = (c.setup, c.samples / apart);
                before.replace(stretch) != Some(stretch) && stretch.1 > 0
            });
        }
    }

    /// What they hold beside how each setup begins.
    pub(super) fn bytes(&self, fresh: &[Heights]) -> usize {
        let before = |k: usize| match k.checked_sub(1).map(|b| &self.kept[b]) {
            Some(before) if before.setup == self.kept[k].setup => &before.heights,
            _ => &fresh[self.kept[k].setup],
        };
        (0..self.kept.len()).map(|k| self.kept[k].heights.bytes_beside(before(k))).sum()
    }

    pub(super) fn forget(&mut self) {
        (self.apart, self.kept) = (APART, Vec::new());
    }
}
