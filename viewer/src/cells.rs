//! Hash maps by grid cell with a fast hash that does not resist chosen collisions.

use std::collections::HashMap;
use std::hash::{BuildHasherDefault, Hasher};

/// What lies in the cells of a grid, by the cell's three numbers. It is never walked: its order means nothing.
pub type Cells<T> = HashMap<[i32; 3], T, BuildHasherDefault<CellHasher>>;

/// For [`Cells`], which are asked for by the million, and which nobody chooses to collide.
#[derive(Debug, Default, Clone, Copy)]
pub struct CellHasher(u64);

impl CellHasher {
    fn mix(&mut self, word: u64) {
        self.0 = (self.0.rotate_left(5) ^ word).wrapping_mul(0x517c_c1b7_2722_0a95);
    }
}

impl Hasher for CellHasher {
    fn finish(&self) -> u64 {
        self.0 ^ self.0 >> 29
    }

    fn write(&mut self, bytes: &[u8]) {
        for chunk in bytes.chunks(8) {
            let mut word = [0; 8];
            word[..chunk.len()].copy_from_slice(chunk);
            self.mix(u64::from_le_bytes(word));
        }
    }

    fn write_usize(&mut self, i: usize) {
        self.mix(i as u64);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::hash::BuildHasher;

    #[test]
    fn neighbouring_cells_spread() {
        let hashes = BuildHasherDefault::<CellHasher>::default();
        let cells = (-20..20).flat_map(|x| (-20..20).flat_map(move |y| (-20..20).map(move |z| [x, y, z])));
        let buckets: std::collections::HashSet<u64> =
            cells.map(|c: [i32; 3]| hashes.hash_one(c) & 0xffff).collect();
        // So many of 65 536 buckets are expected to hold one of 64 000 balls that are thrown at them.
        assert!(buckets.len() > 39_000, "{}", buckets.len());
    }
}
