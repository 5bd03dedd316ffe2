//! How much of the area a few columns cover, and how much more other ones of the same number could.

use serde::Serialize;

use super::Table;
use crate::BitSet;

/// The best choice that was found for a number of columns.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Gain {
    /// The columns, the forced ones first.
    pub columns: Vec<usize>,
    /// What they cover, in the units of the weights.
    pub covered: f64,
    /// No choice of as many columns covers more than this.
    pub at_most: f64,
}

/// Exchanges of single columns that are tried for a number of columns, at most.
const EXCHANGES: usize = 60;

/// For one column more at a time, up to `most`: which to take, what they cover, and what any choice could at most.
///
/// The bound: what is covered, and the largest gains of as many further columns. It holds for any choice that one starts
/// from, so the best of all is taken.
#[must_use]
pub fn gains(table: &Table, weights: &[f64], forced: &[usize], most: usize) -> Vec<Gain> {
    let weigh = |rows: &BitSet| rows.iter().map(|r| weights[r]).sum::<f64>();
    let all = weigh(&table.coverable());
    let mut greedy = forced.to_vec();
    let mut bounds: Vec<(f64, Vec<f64>)> = vec![margins(table, &weigh, &greedy)];
    let mut found = Vec::new();
    for count in 1..=most {
        let Some(next) = best_next(table, &weigh, &greedy) else { break };
        greedy.push(next);
        bounds.push(margins(table, &weigh, &greedy));
        let (columns, covered) = exchanged(table, &weigh, greedy.clone(), forced.len());
        let bound = |(covered, margins): &(f64, Vec<f64>)| covered + margins.iter().take(count).sum::<f64>();
        let at_most = bounds.iter().map(bound).fold(all, f64::min).max(covered);
        found.push(Gain { columns, covered, at_most });
    }
    found
}

/// What columns cover, and the gains of all others, from the largest.
fn margins(table: &Table, weigh: &impl Fn(&BitSet) -> f64, chosen: &[usize]) -> (f64, Vec<f64>) {
    let covered = table.covered(chosen);
    let mut margins: Vec<f64> = table.columns.iter().map(|c| gain(weigh, c, &covered)).collect();
    margins.sort_by(|a, b| b.total_cmp(a));
    (weigh(&covered), margins)
}

fn gain(weigh: &impl Fn(&BitSet) -> f64, column: &BitSet, covered: &BitSet) -> f64 {
    let mut new = column.clone();
    new.take(covered);
    weigh(&new)
}

/// The column that adds most; of equal ones the lowest.
fn best_next(table: &Table, weigh: &impl Fn(&BitSet) -> f64, chosen: &[usize]) -> Option<usize> {
    let covered = table.covered(chosen);
    let gains = table.columns.iter().map(|c| gain(weigh, c, &covered)).enumerate();
    let best = gains.fold((0.0, None), |best, (c, gain)| if gain > best.0 { (gain, Some(c)) } else { best });
    best.1
}

/// A choice made better by exchanging one column at a time, as long as that helps.
fn exchanged(
    table: &Table,
    weigh: &impl Fn(&BitSet) -> f64,
    mut chosen: Vec<usize>,
    forced: usize,
) -> (Vec<usize>, f64) {
    let mut covered = weigh(&table.covered(&chosen));
    let (mut k, mut tried, mut since) = (forced, 0, 0);
    while tried < EXCHANGES && since < chosen.len() - forced {
        let mut others = chosen.clone();
        others.remove(k);
        if let Some(next) = best_next(table, weigh, &others) {
            others.push(next);
            let now = weigh(&table.covered(&others));
            if now > covered * (1.0 + 1e-12) {
                (chosen[k], covered, since) = (next, now, 0);
            }
        }
        since += 1;
        tried += 1;
        k = if k + 1 < chosen.len() { k + 1 } else { forced };
    }
    (chosen, covered)
}
