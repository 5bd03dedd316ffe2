//! Sets of small numbers, as bits.

/// A set of numbers below a fixed limit.
///
/// ```
/// let mut set = claymill_reach::BitSet::new(100);
/// set.insert(3);
/// set.insert(70);
/// assert!(set.contains(70) && !set.contains(4));
/// assert_eq!(set.iter().collect::<Vec<_>>(), [3, 70]);
/// ```
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct BitSet(Vec<u64>);

const WORD: usize = u64::BITS as usize;

impl BitSet {
    /// An empty set of numbers below a limit.
    #[must_use]
    pub fn new(limit: usize) -> Self {
        BitSet(vec![0; limit.div_ceil(WORD)])
    }

    /// All numbers below a limit.
    #[must_use]
    pub fn full(limit: usize) -> Self {
        (0..limit).fold(Self::new(limit), |mut set, k| {
            set.insert(k);
            set
        })
    }

    /// The set of some numbers below a limit.
    #[must_use]
    pub fn of(limit: usize, members: impl IntoIterator<Item = usize>) -> Self {
        members.into_iter().fold(Self::new(limit), |mut set, k| {
            set.insert(k);
            set
        })
    }

    /// Adds a number. One beyond the limit is ignored.
    pub fn insert(&mut self, k: usize) {
        if let Some(word) = self.0.get_mut(k / WORD) {
            *word |= 1 << (k % WORD);
        }
    }

    /// Takes a number out.
    pub fn remove(&mut self, k: usize) {
        if let Some(word) = self.0.get_mut(k / WORD) {
            *word &= !(1 << (k % WORD));
        }
    }

    /// Whether a number is in it.
    #[must_use]
    pub fn contains(&self, k: usize) -> bool {
        self.0.get(k / WORD).is_some_and(|word| word >> (k % WORD) & 1 == 1)
    }

    /// How many numbers are in it.
    #[must_use]
    pub fn len(&self) -> usize {
        self.0.iter().map(|word| word.count_ones() as usize).sum()
    }

    /// Whether nothing is in it.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.0.iter().all(|word| *word == 0)
    }

    /// Its numbers, from the lowest.
    pub fn iter(&self) -> impl Iterator<Item = usize> + '_ {
        self.0.iter().enumerate().flat_map(|(k, &word)| {
            std::iter::successors((word != 0).then_some(word), |left| {
                let rest = left & (left - 1);
                (rest != 0).then_some(rest)
            })
            .map(move |left| k * WORD + left.trailing_zeros() as usize)
        })
    }

    /// Adds what is in another one.
    pub fn add(&mut self, other: &BitSet) {
        self.0.iter_mut().zip(&other.0).for_each(|(a, b)| *a |= b);
    }

    /// Takes out what is in another one.
    pub fn take(&mut self, other: &BitSet) {
        self.0.iter_mut().zip(&other.0).for_each(|(a, b)| *a &= !b);
    }

    /// Keeps what is in another one.
    pub fn keep(&mut self, other: &BitSet) {
        self.0.iter_mut().zip(&other.0).for_each(|(a, b)| *a &= b);
    }

    /// How many numbers are in both.
    #[must_use]
    pub fn common(&self, other: &BitSet) -> usize {
        self.0.iter().zip(&other.0).map(|(a, b)| (a & b).count_ones() as usize).sum()
    }

    /// Whether all its numbers are in another one.
    #[must_use]
    pub fn is_within(&self, other: &BitSet) -> bool {
        self.0.iter().zip(&other.0).all(|(a, b)| a & !b == 0)
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn it_is_a_set(a in prop::collection::vec(0..200_usize, 0..40), b in prop::collection::vec(0..200_usize, 0..40)) {
            let (one, two) = (BitSet::of(200, a.iter().copied()), BitSet::of(200, b.iter().copied()));
            let [a, b] = [a, b].map(|members| members.into_iter().collect::<BTreeSet<_>>());
            prop_assert_eq!(one.iter().collect::<BTreeSet<_>>(), a.clone());
            prop_assert_eq!(one.len(), a.len());
            prop_assert_eq!(one.common(&two), a.intersection(&b).count());
            prop_assert_eq!(one.is_within(&two), a.is_subset(&b));
            let (mut sum, mut rest) = (one.clone(), one.clone());
            sum.add(&two);
            rest.take(&two);
            prop_assert_eq!(sum.iter().collect::<BTreeSet<_>>(), a.union(&b).copied().collect());
            prop_assert_eq!(rest.iter().collect::<BTreeSet<_>>(), a.difference(&b).copied().collect());
        }
    }
}
