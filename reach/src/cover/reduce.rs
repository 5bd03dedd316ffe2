//! Rows and columns of a table that need not be looked at.
//!
//! A row that every column of another row covers as well is covered when that one is; a column that covers no more of
//! what is left than another one is not needed.

use crate::BitSet;

/// What is left of a table after reductions.
#[derive(Debug, Clone)]
pub(super) struct Reduced {
    /// Numbers of the rows that are left, from the lowest.
    pub(super) rows: Vec<usize>,
    /// Numbers of the columns that are left, from the lowest.
    pub(super) columns: Vec<usize>,
}

/// Rounds of reductions; each makes the table smaller, few suffice.
const ROUNDS: usize = 20;

/// Reduces what is left of a table to allowed columns and rows that decide.
pub(super) fn reduce(columns: &[BitSet], of_row: &[BitSet], left: &BitSet, allowed: &BitSet) -> Reduced {
    let mut rows: Vec<usize> = left.iter().collect();
    let mut kept = allowed.clone();
    for _ in 0..ROUNDS {
        let before = (rows.len(), kept.len());
        rows = deciding(of_row, &rows, &kept);
        kept = undominated(columns, &BitSet::of(of_row.len(), rows.iter().copied()), &kept);
        if (rows.len(), kept.len()) == before {
            break;
        }
    }
    Reduced { rows, columns: kept.iter().collect() }
}

/// The rows of which no other one's columns are a part.
pub(super) fn deciding(of_row: &[BitSet], rows: &[usize], kept: &BitSet) -> Vec<usize> {
    let mut sets: Vec<(usize, BitSet)> = rows
        .iter()
        .map(|&r| {
            let mut set = of_row[r].clone();
            set.keep(kept);
            (r, set)
        })
        .collect();
    sets.sort_by_cached_key(|(r, set)| (set.len(), set.clone(), *r));
    sets.dedup_by(|later, first| later.1 == first.1);
    let mut minimal: Vec<(usize, BitSet)> = Vec::new();
    for (r, set) in sets {
        if !minimal.iter().any(|(_, small)| small.is_within(&set)) {
            minimal.push((r, set));
        }
    }
    let mut rows: Vec<usize> = minimal.into_iter().map(|(r, _)| r).collect();
    rows.sort_unstable();
    rows
}

/// The columns of which no other one covers all that they cover of these rows; of equal ones the lowest.
pub(super) fn undominated(columns: &[BitSet], rows: &BitSet, kept: &BitSet) -> BitSet {
    let mut sets: Vec<(usize, BitSet)> = kept
        .iter()
        .map(|c| {
            let mut set = columns[c].clone();
            set.keep(rows);
            (c, set)
        })
        .filter(|(_, set)| !set.is_empty())
        .collect();
    sets.sort_by_cached_key(|(c, set)| (std::cmp::Reverse(set.len()), *c));
    let mut maximal: Vec<(usize, BitSet)> = Vec::new();
    for (c, set) in sets {
        if !maximal.iter().any(|(_, large)| set.is_within(large)) {
            maximal.push((c, set));
        }
    }
    BitSet::of(columns.len(), maximal.into_iter().map(|(c, _)| c))
}
