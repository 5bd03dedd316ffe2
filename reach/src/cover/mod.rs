//! The fewest columns of a table that cover all its rows, with a proof that fewer do not.
//!
//! ```text
//!            directions          y: a share for each place, so that no direction     the sum of y is what any
//!            a  b  c  d             collects more than 1                              cover needs at least
//!   place 1  ●  ●  .  .          1/2 ┐
//!   place 2  .  ●  ●  .          1/2 ├ every column sums to at most 1; Σy = 1.5 ⇒ two directions at least
//!   place 3  ●  .  ●  .          1/2 ┘
//! ```
//!
//! Reductions keep the table small ([`reduce`](reduce)), a linear program gives the shares ([`packing`](packing)), and
//! branch and bound closes what is left between the shares and the best cover. What it did is kept as a
//! [`Certificate`], a tree that anybody can check without knowing how it was found.

mod certificate;
mod choose;
mod gains;
mod packing;
mod pierce;
mod reduce;
mod search;
#[cfg(test)]
mod tests;

pub use certificate::{Certificate, CertificateError, Child, Proof, SHARE};
pub use choose::choose;
pub use gains::{Gain, gains};
pub use pierce::{Arc, fewest_angles};
pub use search::{Cover, cover};

use crate::BitSet;

/// Which rows each column covers.
#[derive(Debug, Clone)]
pub struct Table {
    /// Of each column, the rows that it covers.
    pub columns: Vec<BitSet>,
    /// How many rows there are.
    pub rows: usize,
}

impl Table {
    /// What some columns cover together.
    #[must_use]
    pub fn covered(&self, columns: &[usize]) -> BitSet {
        let mut all = BitSet::new(self.rows);
        columns.iter().filter_map(|&c| self.columns.get(c)).for_each(|c| all.add(c));
        all
    }

    /// What all columns cover together.
    #[must_use]
    pub fn coverable(&self) -> BitSet {
        let mut all = BitSet::new(self.rows);
        self.columns.iter().for_each(|c| all.add(c));
        all
    }

    /// Of each row, the columns that cover it.
    #[must_use]
    pub fn transposed(&self) -> Vec<BitSet> {
        let mut of_row = vec![BitSet::new(self.columns.len()); self.rows];
        for (c, rows) in self.columns.iter().enumerate() {
            rows.iter().for_each(|r| of_row[r].insert(c));
        }
        of_row
    }
}
