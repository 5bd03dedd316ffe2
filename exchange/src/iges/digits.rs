//! How finely the coordinates of a file are written.

use super::file::{File, Record};
use super::tokens;

/// Surfaces looked at.
const SURFACES: usize = 500;
/// Coordinates looked at in each.
const COORDINATES: usize = 48;
/// The coarsest step is taken that at least this part of the coordinates has: shorter numbers are mostly those
/// that lost trailing zeros.
const PART: f64 = 0.125;

/// Size of the last digit of the control points of B-spline surfaces, in file units; 0 when unknown.
pub(crate) fn coordinate_step(file: &File) -> f64 {
    let surfaces: Vec<i64> = file.entries().filter(|(_, e)| e.kind == 128).map(|(de, _)| de).collect();
    let stride = surfaces.len().div_ceil(SURFACES).max(1);
    let mut histogram = [0_usize; 24];
    for de in surfaces.iter().step_by(stride) {
        for decimals in file.record(*de).ok().and_then(decimals_of_points).unwrap_or_default() {
            let bin = usize::try_from(decimals).unwrap_or(0).min(histogram.len() - 1);
            histogram[bin] += 1;
        }
    }
    let total: usize = histogram.iter().sum();
    histogram
        .iter()
        .position(|count| total > 0 && *count as f64 >= PART * total as f64)
        .map_or(0.0, |decimals| 10_f64.powi(-(decimals as i32)))
}

fn decimals_of_points(mut record: Record) -> Option<Vec<i32>> {
    let [last_u, last_v, degree_u, degree_v] = [(); 4].map(|()| record.count().ok());
    let (nu, nv) = (last_u? + 1, last_v? + 1);
    let count = nu.checked_mul(nv)?;
    let before = 5 + nu + degree_u? + 1 + nv + degree_v? + 1;
    record.skip(before.checked_add(count)?).ok()?;
    let coordinates = (0..COORDINATES.min(3 * count)).map_while(|_| record.raw().ok());
    Some(coordinates.filter_map(tokens::decimals).collect())
}
