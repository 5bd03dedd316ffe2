//! A cover that may leave a little.
//!
//! Samples lie in corners that only odd directions reach, each a fraction of a square millimetre. A cover of all of them
//! would take dozens of setups for nothing. So the rows that cost a column most are left out first, as long as they are
//! no more than an allowed share; of the others the cover is exact.

use claymill_toolpath::{Cancelled, Monitor};

use super::Table;
use super::search::{Cover, cover, greedy};
use crate::BitSet;

/// The fewest columns that, with the forced ones, cover all that can be covered but for rows of at most this share of the
/// weight. The certificate is about the rows that are kept.
///
/// # Errors
/// The monitor ends it.
pub fn choose(
    table: &Table,
    weights: &[f64],
    forced: &[usize],
    left_share: f64,
    monitor: &dyn Monitor,
) -> Result<Cover, Cancelled> {
    let weigh = |rows: &BitSet| rows.iter().map(|r| weights[r]).sum::<f64>();
    let mut budget = left_share * weigh(&table.coverable());
    let mut kept = table.clone();
    // By quick covers as long as they find something to leave, then by exact ones.
    let mut is_exact = false;
    loop {
        monitor.go_on()?;
        let mut open = kept.coverable();
        open.take(&kept.covered(forced));
        let found = is_exact.then(|| cover(&kept, forced, monitor)).transpose()?;
        let columns = match &found {
            Some(found) => found.chosen().to_vec(),
            None => greedy(&kept.columns, &open),
        };
        let own = |k: usize| {
            let mut rows = kept.columns[columns[k]].clone();
            rows.keep(&open);
            columns
                .iter()
                .enumerate()
                .filter(|(j, _)| *j != k)
                .for_each(|(_, &c)| rows.take(&kept.columns[c]));
            rows
        };
        let owns = (0..columns.len()).map(|k| (weigh(&own(k)), k));
        let least = owns.min_by(|a, b| a.0.total_cmp(&b.0)).filter(|(weight, _)| *weight <= budget);
        match (least, found) {
            (Some((weight, k)), _) => {
                budget -= weight;
                let rows = own(k);
                kept.columns.iter_mut().for_each(|column| column.take(&rows));
            }
            (None, Some(found)) => return Ok(found),
            (None, None) => is_exact = true,
        }
    }
}
