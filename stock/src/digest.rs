//! A name for a state: equal stocks have equal digests, with any number of threads.
//!
//! Rays and moves are computed by sums, products, quotients and square roots alone, which every machine rounds alike. Only the
//! outline of a tapered tool takes a sine.

use rayon::prelude::*;
use sha2::{Digest, Sha256};

use crate::Stock;
use crate::tile::Shared;

/// Begins every digest. Another layout takes another one.
const LAYOUT: &[u8] = b"claymill stock 1\n";

impl Stock {
    /// SHA-256 of grid and intervals, for files that are named by their content.
    #[must_use]
    pub fn digest(&self) -> [u8; 32] {
        let mut all = Sha256::new();
        all.update(LAYOUT);
        self.grid.origin.iter().for_each(|c| all.update(c.to_le_bytes()));
        all.update(self.grid.pitch.to_le_bytes());
        self.grid.counts.iter().for_each(|c| all.update(c.to_le_bytes()));
        for tiles in &self.families {
            let digests: Vec<[u8; 32]> = tiles.par_iter().map(of_tile).collect();
            digests.iter().for_each(|d| all.update(d));
        }
        all.finalize().into()
    }
}

/// Lists are ascending with gaps between neighbours: there is one form for each set.
fn of_tile(tile: &Shared) -> [u8; 32] {
    let Some(tile) = tile else { return [0; 32] };
    let (first, ends) = tile.parts();
    let mut bytes = Vec::with_capacity(4 * first.len() + 8 * ends.len());
    first.iter().for_each(|f| bytes.extend(f.to_le_bytes()));
    ends.iter().flatten().for_each(|e| bytes.extend(e.to_le_bytes()));
    Sha256::digest(&bytes).into()
}
