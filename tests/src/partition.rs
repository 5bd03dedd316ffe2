//! Compares two numberings of the same things as partitions: labels do not matter.

use std::collections::BTreeMap;

/// Whether two numberings group the same things, whatever the numbers.
#[must_use]
pub fn same_partition(a: &[usize], b: &[usize]) -> bool {
    let forth: BTreeMap<_, _> = a.iter().zip(b).collect();
    let back: BTreeMap<_, _> = b.iter().zip(a).collect();
    a.len() == b.len() && a.iter().zip(b).all(|(x, y)| forth[x] == y && back[y] == x)
}
