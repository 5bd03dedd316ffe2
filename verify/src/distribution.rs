//! Weighted values with mean, share, histogram and percentiles. Values are kept in single
//! precision.

use claymill_toolpath::Packed;
use rayon::prelude::*;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// Weighted values of which mean and percentiles are wanted.
#[derive(Debug, Clone, Default)]
pub(crate) struct Distribution {
    samples: Vec<(f32, f32)>,
}

impl Serialize for Distribution {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        Packed::singles(self.samples.iter().flat_map(|&(v, w)| [v, w])).serialize(serializer)
    }
}

impl<'de> Deserialize<'de> for Distribution {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let packed = Packed::deserialize(deserializer)?;
        Ok(Distribution { samples: packed.rows_of_singles().map(|[v, w]| (v, w)).collect() })
    }
}

impl Distribution {
    /// Adds a value with its weight (length or area).
    pub(crate) fn add(&mut self, value: f64, weight: f64) {
        self.samples.push((value as f32, weight as f32));
    }

    /// Appends all of `other`.
    pub(crate) fn append(&mut self, mut other: Distribution) {
        self.samples.append(&mut other.samples);
    }

    /// Number of values.
    pub(crate) fn count(&self) -> u64 {
        self.samples.len() as u64
    }

    /// Sum of the weights.
    pub(crate) fn weight(&self) -> f64 {
        self.samples.iter().map(|s| f64::from(s.1)).sum()
    }

    /// Mean; 0 without values.
    pub(crate) fn mean(&self) -> f64 {
        let (sum, weight) = self
            .samples
            .iter()
            .fold((0.0, 0.0), |(s, w), &(v, k)| (s + f64::from(v) * f64::from(k), w + f64::from(k)));
        if weight > 0.0 { sum / weight } else { 0.0 }
    }

    /// Share of the weight whose value is `chosen`; 0 without values.
    pub(crate) fn share(&self, chosen: impl Fn(f64) -> bool) -> f64 {
        let (part, weight) = self.samples.iter().fold((0.0, 0.0), |(s, w), &(v, k)| {
            let k = f64::from(k);
            (if chosen(f64::from(v)) { s + k } else { s }, w + k)
        });
        if weight > 0.0 { part / weight } else { 0.0 }
    }

    /// Largest value; 0 without values.
    pub(crate) fn max(&self) -> f64 {
        self.samples.iter().map(|s| f64::from(s.0)).fold(f64::NEG_INFINITY, f64::max).max(0.0)
    }

    /// Shares of the weight by bin; zeros without values.
    pub(crate) fn shares(&self, bins: usize, bin: impl Fn(f64) -> usize) -> Vec<f64> {
        let mut sums = vec![0.0; bins];
        for &(value, weight) in &self.samples {
            sums[bin(f64::from(value))] += f64::from(weight);
        }
        let total: f64 = sums.iter().sum();
        if total > 0.0 {
            sums.iter_mut().for_each(|s| *s /= total);
        }
        sums
    }

    /// The smallest value that at least `share` of the weight does not exceed; 0 without values.
    pub(crate) fn percentile(&self, share: f64) -> f64 {
        let mut sorted = self.samples.clone();
        sorted.par_sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
        let total: f64 = sorted.iter().map(|s| f64::from(s.1)).sum();
        let mut below = 0.0;
        for &(value, weight) in &sorted {
            below += f64::from(weight);
            if below >= share * total {
                return f64::from(value);
            }
        }
        sorted.last().map_or(0.0, |s| f64::from(s.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_count() {
        let mut d = Distribution::default();
        for i in (1..=100).rev() {
            d.add(f64::from(i), 1.0);
        }
        assert_eq!(d.percentile(0.99), 99.0);
        assert_eq!(d.mean(), 50.5);
        assert_eq!(d.share(|v| v > 90.0), 0.1);
        assert_eq!((d.max(), d.weight()), (100.0, 100.0));
        assert_eq!(d.shares(2, |v| usize::from(v > 90.0)), [0.9, 0.1]);
        d.add(1000.0, 100.0);
        assert_eq!(d.percentile(0.99), 1000.0);
        assert_eq!(Distribution::default().percentile(0.5), 0.0);
    }
}
