//! The largest shares of rows of which no column collects more than 1: the linear program whose value bounds covers.
//!
//! `max Σy` where the shares that a column covers sum to 1 at most, and none is negative. All zero is a start, so the
//! simplex method needs no first phase. What it returns is rounded to whole millionths and made feasible there, so
//! that no rounding is left in the bound.

use super::SHARE;
use crate::BitSet;

/// Reduced costs and pivots below this are rounding.
const ZERO: f64 = 1e-9;
/// After so many pivots without a larger sum the lowest number is taken, which cannot go in a circle (Bland).
const STALLED: usize = 40;
/// Pivots at most, for each row and column.
const PIVOTS: usize = 8;

/// Shares of `rows`, in millionths; `work` counts down what may be spent.
pub(super) fn shares(
    columns: &[BitSet],
    rows: &[usize],
    of_columns: &[usize],
    work: &mut u64,
) -> Vec<(usize, u64)> {
    let covers: Vec<Vec<usize>> = of_columns
        .iter()
        .map(|&c| (0..rows.len()).filter(|&k| columns[c].contains(rows[k])).collect())
        .collect();
    let of_simplex = simplex(&covers, rows.len(), work);
    let whole = rounded(&covers, &of_simplex);
    rows.iter().copied().zip(whole).filter(|(_, share)| *share > 0).collect()
}

/// Shares as whole numbers, made feasible and then as large as they may be.
fn rounded(covers: &[Vec<usize>], shares: &[f64]) -> Vec<u64> {
    let mut whole: Vec<u64> =
        shares.iter().map(|y| (y.clamp(0.0, 1.0) * SHARE as f64).floor() as u64).collect();
    let mut loads: Vec<u64> = covers.iter().map(|c| c.iter().map(|&k| whole[k]).sum()).collect();
    let mut of_row: Vec<Vec<usize>> = vec![Vec::new(); shares.len()];
    for (c, cover) in covers.iter().enumerate() {
        cover.iter().for_each(|&k| of_row[k].push(c));
    }
    for (c, cover) in covers.iter().enumerate() {
        for &k in cover {
            let over = loads[c].saturating_sub(SHARE).min(whole[k]);
            whole[k] -= over;
            of_row[k].iter().for_each(|&other| loads[other] -= over);
        }
    }
    // Rows of few columns first: they take the least from others.
    let mut order: Vec<usize> = (0..whole.len()).collect();
    order.sort_by_key(|&k| (of_row[k].len(), k));
    for k in order {
        let room = of_row[k].iter().map(|&c| SHARE - loads[c]).min().unwrap_or(0);
        whole[k] += room;
        of_row[k].iter().for_each(|&c| loads[c] += room);
    }
    whole
}

/// The simplex method on the dense table. Where `work` is spent it returns what it has, which is feasible.
fn simplex(covers: &[Vec<usize>], rows: usize, work: &mut u64) -> Vec<f64> {
    let (m, n) = (covers.len(), rows);
    // One line for each column of the cover, with the right side last; the objective below.
    let width = n + 1;
    let mut table = vec![0.0; (m + 1) * width];
    for (i, cover) in covers.iter().enumerate() {
        cover.iter().for_each(|&k| table[i * width + k] = 1.0);
        table[i * width + n] = 1.0;
    }
    table[m * width..m * width + n].fill(-1.0);
    // Variables 0..n are shares, n.. slacks; which is where in the condensed table.
    let mut outside: Vec<usize> = (0..n).collect();
    let mut inside: Vec<usize> = (n..n + m).collect();
    let (mut stalled, mut value) = (0, 0.0);
    for _ in 0..PIVOTS * (m + n) {
        let cost = (m * width) as u64;
        if *work < cost {
            *work = 0;
            break;
        }
        *work -= cost;
        let costs = &table[m * width..m * width + n];
        let candidates = (0..n).filter(|&k| costs[k] < -ZERO);
        let entering = if stalled < STALLED {
            candidates.min_by(|&a, &b| costs[a].total_cmp(&costs[b]).then(outside[a].cmp(&outside[b])))
        } else {
            candidates.min_by_key(|&k| outside[k])
        };
        let Some(k) = entering else { break };
        let ratio = |i: usize| table[i * width + n] / table[i * width + k];
        let leaving = (0..m)
            .filter(|&i| table[i * width + k] > ZERO)
            .min_by(|&a, &b| ratio(a).total_cmp(&ratio(b)).then(inside[a].cmp(&inside[b])));
        let Some(i) = leaving else { break };
        pivot(&mut table, width, i, k);
        std::mem::swap(&mut inside[i], &mut outside[k]);
        let now = table[m * width + n];
        stalled = if now > value + ZERO { 0 } else { stalled + 1 };
        value = now;
    }
    let mut shares = vec![0.0; n];
    for (i, &variable) in inside.iter().enumerate() {
        if variable < n {
            shares[variable] = table[i * width + n].max(0.0);
        }
    }
    shares
}

/// Exchanges the variable of a line with that of a place in the condensed table.
fn pivot(table: &mut [f64], width: usize, line: usize, at: usize) {
    let p = 1.0 / table[line * width + at];
    for j in 0..width {
        if j != at {
            table[line * width + j] *= p;
        }
    }
    let own: Vec<f64> = table[line * width..(line + 1) * width].to_vec();
    for (i, other) in table.chunks_exact_mut(width).enumerate() {
        let factor = other[at];
        if i == line || factor == 0.0 {
            continue;
        }
        for j in 0..width {
            if j != at {
                other[j] -= factor * own[j];
            }
        }
        other[at] = -factor * p;
    }
    table[line * width + at] = p;
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn three_places_of_which_each_direction_reaches_two_share_one_and_a_half() {
        let columns = [[0, 2], [0, 1], [1, 2]].map(|rows| BitSet::of(3, rows));
        let mut work = u64::MAX;
        let all = shares(&columns, &[0, 1, 2], &[0, 1, 2], &mut work);
        let sum: u64 = all.iter().map(|(_, share)| share).sum();
        assert_eq!(sum, 3 * SHARE / 2);
    }

    #[test]
    fn without_work_left_shares_are_still_feasible() {
        let columns = [[0, 2], [0, 1], [1, 2]].map(|rows| BitSet::of(3, rows));
        let all = shares(&columns, &[0, 1, 2], &[0, 1, 2], &mut 0);
        for column in &columns {
            let load: u64 = all.iter().filter(|(r, _)| column.contains(*r)).map(|(_, s)| s).sum();
            assert!(load <= SHARE);
        }
        assert!(all.iter().map(|(_, share)| share).sum::<u64>() >= SHARE);
    }
}
