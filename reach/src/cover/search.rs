//! Branch and bound: the fewest columns, and the proof.

use claymill_toolpath::{Cancelled, Monitor};

use super::Table;
use super::certificate::{Certificate, Child, Proof, SHARE};
use super::packing::shares;
use super::reduce::{deciding, reduce, undominated};
use crate::BitSet;

/// Work that may be spent, in entries of tables that are gone through: some tens of seconds.
const WORK: u64 = 20_000_000_000;
/// Parts of the tree that are looked at, at most.
const PARTS: usize = 20_000;
/// Rounds in which a cover is improved by leaving columns out.
const ROUNDS: usize = 3;

/// A cover and what is proven about it.
#[derive(Debug, Clone, PartialEq)]
pub struct Cover {
    /// Its columns: the forced ones as they were given, then the others from the lowest number.
    pub columns: Vec<usize>,
    /// How many of them are forced.
    pub forced: usize,
    /// That there are no fewer, or how many fewer there might be at most.
    pub certificate: Certificate,
}

impl Cover {
    /// Columns that were chosen, without the forced ones.
    #[must_use]
    pub fn chosen(&self) -> &[usize] {
        &self.columns[self.forced..]
    }

    /// Whether it is proven that fewer columns do not suffice.
    #[must_use]
    pub fn is_optimal(&self) -> bool {
        self.chosen().len() == self.certificate.least
    }
}

/// The fewest columns that, with the forced ones, cover all that can be covered.
///
/// # Errors
/// The monitor ends it.
pub fn cover(table: &Table, forced: &[usize], monitor: &dyn Monitor) -> Result<Cover, Cancelled> {
    let mut left = table.coverable();
    left.take(&table.covered(forced));
    let of_row = table.transposed();
    let allowed = BitSet::full(table.columns.len());
    // What decides for all columns decides for any choice of them.
    let rows: Vec<usize> = left.iter().collect();
    let decides = BitSet::of(table.rows, deciding(&of_row, &rows, &allowed));
    let best = greedy(&table.columns, &decides);
    let mut search =
        Search { columns: &table.columns, of_row: &of_row, best, work: WORK, parts: PARTS, monitor };
    let root = search.bound(&decides, &allowed);
    let proof = search.part(&decides, &allowed, &mut Vec::new())?;
    let (columns, least, proof) = match proof {
        Some(proof) => (search.best.clone(), search.best.len(), proof),
        None => (search.best.clone(), least_of(&root), Proof::Shares(root)),
    };
    let certificate = Certificate { least, rows: decides.iter().collect(), proof };
    let chosen = columns.into_iter();
    let columns = forced.iter().copied().chain(chosen).collect();
    Ok(Cover { columns, forced: forced.len(), certificate })
}

/// How many columns shares ask for.
fn least_of(shares: &[(usize, u64)]) -> usize {
    shares.iter().map(|(_, share)| share).sum::<u64>().div_ceil(SHARE) as usize
}

/// The column that covers most of what is left, again and again; then without those that the others make up for.
pub(super) fn greedy(columns: &[BitSet], rows: &BitSet) -> Vec<usize> {
    let mut best: Option<Vec<usize>> = None;
    let first_of = |left: &BitSet| {
        let most = (0..columns.len()).max_by_key(|&c| (columns[c].common(left), std::cmp::Reverse(c)));
        most.filter(|&c| columns[c].common(left) > 0)
    };
    for round in 0..ROUNDS {
        let mut left = rows.clone();
        let mut chosen = Vec::new();
        // Later rounds begin with what the one before ended with.
        if let Some(&last) = best.as_ref().filter(|_| round > 0).and_then(|b| b.last()) {
            left.take(&columns[last]);
            chosen.push(last);
        }
        while let Some(c) = first_of(&left) {
            left.take(&columns[c]);
            chosen.push(c);
        }
        let chosen = without_spare(columns, rows, chosen);
        if best.as_ref().is_none_or(|b| chosen.len() < b.len()) {
            best = Some(chosen);
        }
    }
    let mut best = best.unwrap_or_default();
    best.sort_unstable();
    best
}

fn without_spare(columns: &[BitSet], rows: &BitSet, mut chosen: Vec<usize>) -> Vec<usize> {
    let mut k = 0;
    while k < chosen.len() {
        let mut left = rows.clone();
        for (j, &c) in chosen.iter().enumerate() {
            if j != k {
                left.take(&columns[c]);
            }
        }
        if left.is_empty() {
            chosen.remove(k);
        } else {
            k += 1;
        }
    }
    chosen
}

struct Search<'a> {
    columns: &'a [BitSet],
    of_row: &'a [BitSet],
    best: Vec<usize>,
    work: u64,
    parts: usize,
    monitor: &'a dyn Monitor,
}

impl Search<'_> {
    /// Shares of what is left.
    fn bound(&mut self, left: &BitSet, allowed: &BitSet) -> Vec<(usize, u64)> {
        let reduced = reduce(self.columns, self.of_row, left, allowed);
        let (rows, columns) = (reduced.rows, reduced.columns);
        // A row without a column: no share is too large for it.
        let bare = rows.iter().find(|&&r| self.of_row[r].common(allowed) == 0);
        if let Some(&row) = bare {
            return vec![(row, SHARE.saturating_mul(self.best.len() as u64))];
        }
        shares(self.columns, &rows, &columns, &mut self.work)
    }

    /// The proof that a part of the tree holds no cover with fewer columns than the best one; `None` where no work is
    /// left. Better covers become the best one.
    fn part(
        &mut self,
        left: &BitSet,
        allowed: &BitSet,
        chosen: &mut Vec<usize>,
    ) -> Result<Option<Proof>, Cancelled> {
        self.monitor.go_on()?;
        if left.is_empty() {
            if chosen.len() < self.best.len() {
                self.best.clone_from(chosen);
                self.best.sort_unstable();
            }
            return Ok(Some(Proof::Shares(Vec::new())));
        }
        if self.parts == 0 || self.work == 0 {
            return Ok(None);
        }
        self.parts -= 1;
        let shares = self.bound(left, allowed);
        if chosen.len() + least_of(&shares) >= self.best.len() {
            return Ok(Some(Proof::Shares(shares)));
        }
        let choices = |row: usize| {
            let mut columns = self.of_row[row].clone();
            columns.keep(allowed);
            undominated(self.columns, left, &columns)
        };
        // The row with the fewest choices; few columns first, for `undominated` takes time.
        let mut rows: Vec<(usize, usize)> =
            left.iter().map(|r| (self.of_row[r].common(allowed), r)).collect();
        rows.sort_unstable();
        rows.truncate(8);
        let Some((_, row)) = rows.iter().map(|&(_, r)| (choices(r).len(), r)).min() else { return Ok(None) };
        let mut order: Vec<usize> = choices(row).iter().collect();
        order.sort_by_key(|&c| (std::cmp::Reverse(self.columns[c].common(left)), c));
        let mut allowed = allowed.clone();
        let mut children = Vec::with_capacity(order.len());
        for column in order {
            let mut rest = left.clone();
            rest.take(&self.columns[column]);
            chosen.push(column);
            let proof = self.part(&rest, &allowed, chosen)?;
            chosen.pop();
            let Some(proof) = proof else { return Ok(None) };
            children.push(Child { column, proof });
            allowed.remove(column);
        }
        Ok(Some(Proof::Branch { row, children }))
    }
}
