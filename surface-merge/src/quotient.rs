//! The quotient graph of regions: which regions border on each other, and how much of each border
//! is smooth. It answers how many regions remain when two are united.

use std::collections::{BTreeMap, BTreeSet};

/// The regions and the borders between them, after growing has come to rest.
pub(crate) struct Quotient {
    regions: usize,
    /// For each region its neighbours, with the length of the border and how much of it is smooth, mm.
    borders: BTreeMap<usize, BTreeMap<usize, [f64; 2]>>,
}

impl Quotient {
    /// `labels` names the region of each face.
    pub(crate) fn new(labels: &[usize]) -> Self {
        let regions: BTreeSet<usize> = labels.iter().copied().collect();
        Quotient { regions: regions.len(), borders: BTreeMap::new() }
    }

    /// Adds a stretch of border; inside a region it is none.
    pub(crate) fn add(&mut self, [a, b]: [usize; 2], length_mm: f64, smooth: bool) {
        if a == b {
            return;
        }
        for (from, to) in [(a, b), (b, a)] {
            let sums = self.borders.entry(from).or_default().entry(to).or_default();
            sums[0] += length_mm;
            sums[1] += if smooth { length_mm } else { 0.0 };
        }
    }

    /// Share of the border between two regions that is smooth.
    pub(crate) fn smooth_share(&self, [a, b]: [usize; 2]) -> f64 {
        let sums = self.borders.get(&a).and_then(|n| n.get(&b));
        sums.map_or(0.0, |[length, smooth]| smooth / length)
    }

    /// Number of regions if two were made one: others whose border with the united region is smooth on
    /// `least` of its length follow, until nothing changes. No other border changes, so no others can.
    pub(crate) fn regions_if_united(&self, pair: [usize; 2], least: f64) -> usize {
        let mut united: BTreeSet<usize> = pair.into_iter().collect();
        let mut fresh: Vec<usize> = pair.to_vec();
        let mut around: BTreeMap<usize, [f64; 2]> = BTreeMap::new();
        while !fresh.is_empty() {
            for region in std::mem::take(&mut fresh) {
                for (&next, border) in self.borders.get(&region).into_iter().flatten() {
                    let sums = around.entry(next).or_default();
                    (0..2).for_each(|k| sums[k] += border[k]);
                }
            }
            around.retain(|next, _| !united.contains(next));
            let follow = around.iter().filter(|(_, [length, smooth])| smooth >= &(least * length));
            fresh = follow.map(|(&next, _)| next).collect();
            united.extend(&fresh);
        }
        self.regions + 1 - united.len()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_follows_when_two_regions_are_united() {
        // 2 borders on 0 (smooth, 8 of 10) and on 1 (smooth, 20 of 20): with 0 and 1 together it is 28 of 30.
        // 3 borders on 1 alone, half of it smooth.
        let mut q = Quotient::new(&[0, 1, 2, 3, 3]);
        q.add([0, 1], 5.0, false);
        q.add([0, 2], 8.0, true);
        q.add([2, 0], 2.0, false);
        q.add([1, 2], 20.0, true);
        q.add([1, 3], 4.0, true);
        q.add([3, 1], 4.0, false);
        q.add([3, 3], 9.0, true);
        assert_eq!(q.regions_if_united([0, 1], 0.9), 2);
        assert_eq!(q.regions_if_united([1, 3], 0.95), 2);
        assert_eq!(q.regions_if_united([0, 3], 0.9), 3);
        assert_eq!(q.smooth_share([2, 0]), 0.8);
    }
}
