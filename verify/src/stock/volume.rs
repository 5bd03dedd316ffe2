//! Volumes by quasi-random points with exact membership, with an interval from independent sets.
//!
//! The points of a set are the additive sequence of the plastic number's kin in three dimensions (M. Roberts, *The
//! unreasonable effectiveness of quasirandom sequences*, 2018), each set shifted by other numbers (Cranley and Patterson,
//! 1976). Sixteen means of one quantity give its standard error, and Student's t for 15 degrees of freedom the interval.

use claymill_nurbs::{Aabb, Point3};
use rayon::prelude::*;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::error::{KeepGoing, StockError};

/// A volume, with what is known of its error.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
pub struct VolumeEstimate {
    /// The volume, mm³.
    pub mm3: f64,
    /// It is no farther off than this with a probability of 99 %, mm³; 0 where it is exact.
    pub plus_minus_mm3: f64,
}

/// Independent sets of points.
const SETS: u64 = 16;
/// Student's t, two-sided 99 %, 15 degrees of freedom.
const STUDENT: f64 = 2.946_712_883;
/// The root of x⁴ = x + 1.
const PLASTIC: f64 = 1.220_744_084_605_759_6;
/// Points between two questions whether to go on.
const ABREAST: u64 = 4096;

/// Volumes within a box of what a function sorts points into: numbers below `kinds`, and of all of them as the last.
pub(super) fn volumes(
    within: &Aabb,
    points: u64,
    kinds: usize,
    keep_going: KeepGoing<'_>,
    sort: impl Fn(&Point3) -> Option<usize> + Sync,
) -> Result<Vec<VolumeEstimate>, StockError> {
    if within.is_empty() {
        return Ok(vec![VolumeEstimate::default(); kinds + 1]);
    }
    let size = within.max - within.min;
    let a_set = points.div_ceil(SETS);
    let chunks = a_set.div_ceil(ABREAST);
    let steps = [1, 2, 3].map(|k| PLASTIC.powi(-k));
    let counted: Vec<Vec<u64>> = (0..SETS * chunks)
        .into_par_iter()
        .map(|job| {
            let (set, chunk) = (job / chunks, job % chunks);
            let mut counts = vec![0; kinds + 1];
            if !keep_going() {
                return Err(StockError::Stopped);
            }
            let shift = [0, 1, 2].map(|k| unit(set * 3 + k));
            for n in chunk * ABREAST..((chunk + 1) * ABREAST).min(a_set) {
                let place = |k: usize| {
                    let x = (shift[k] + steps[k] * n as f64).fract();
                    within.min[k] + size[k] * x
                };
                if let Some(kind) = sort(&Point3::new(place(0), place(1), place(2))) {
                    counts[kind] += 1;
                    counts[kinds] += 1;
                }
            }
            Ok(counts)
        })
        .collect::<Result<_, _>>()?;
    let whole = size.product();
    let estimate = |kind: usize| {
        let share = |set: u64| {
            let of_set = (set * chunks..(set + 1) * chunks).map(|job| counted[job as usize][kind]);
            of_set.sum::<u64>() as f64 / a_set as f64
        };
        let shares: Vec<f64> = (0..SETS).map(share).collect();
        let mean = shares.iter().sum::<f64>() / SETS as f64;
        let spread = shares.iter().map(|s| (s - mean).powi(2)).sum::<f64>();
        let error = (spread / (SETS * (SETS - 1)) as f64).sqrt();
        // Sets that agree by chance know no better than one point in all of them.
        let error = (STUDENT * error).max(if mean > 0.0 { 1.0 / (SETS * a_set) as f64 } else { 0.0 });
        VolumeEstimate { mm3: whole * mean, plus_minus_mm3: whole * error }
    };
    Ok((0..=kinds).map(estimate).collect())
}

/// A number in [0, 1) that looks random (splitmix64).
fn unit(seed: u64) -> f64 {
    let mut z = seed.wrapping_add(1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
}
