//! What reading an object needs to know of its file.

use std::cell::Cell;

use super::fault::Fault;

/// Control points that even the smallest file may unfold to.
const POINTS_OF_ANY_FILE: usize = 200_000;

/// What reading an object needs to know.
#[derive(Debug)]
pub(super) struct Context {
    /// Edges have no domain of their own (toolkits before June 2002).
    pub(super) legacy_edges: bool,
    /// Control points that may still be made out of the file.
    points_left: Cell<usize>,
}

impl Context {
    /// For a file of `size` bytes. Curves and blocks that are used again and again multiply what the file
    /// holds; real models stay far below this.
    pub(super) fn new(legacy_edges: bool, size: usize) -> Self {
        Context { legacy_edges, points_left: Cell::new(size.saturating_add(POINTS_OF_ANY_FILE)) }
    }

    /// Accounts for `points` that are about to be made.
    pub(super) fn spend(&self, points: usize) -> Result<(), Fault> {
        let left = self.points_left.get().checked_sub(points).ok_or(Fault::TooMuch)?;
        self.points_left.set(left);
        Ok(())
    }
}
