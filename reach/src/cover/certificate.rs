//! The proof that fewer columns do not cover a table.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use thiserror::Error;

use super::Table;
use crate::BitSet;

/// Shares are whole numbers of which so many are 1: sums are exact.
pub const SHARE: u64 = 1_000_000;
/// A proof is no deeper.
const DEEPEST: usize = 512;

/// A proof that no cover has fewer columns than `least`.
///
/// It needs nothing but the table to be checked: see [`Certificate::check`].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Certificate {
    /// No cover has fewer columns, the forced ones not counted.
    pub least: usize,
    /// The rows that decide: already these are covered by no fewer.
    pub rows: Vec<usize>,
    /// Why.
    pub proof: Proof,
}

/// Why a cover that has the columns chosen on the way here needs as many as it says.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Proof {
    /// Shares of rows in millionths: no allowed column covers more than 1 in all, so a cover needs as many columns as
    /// the sum says, rounded up.
    Shares(Vec<(usize, u64)>),
    /// One of the columns that cover a row has to be chosen.
    Branch {
        /// The row.
        row: usize,
        /// What follows from each choice. A column may be missing where one that is here covers all that it covers of
        /// what is left.
        children: Vec<Child>,
    },
}

/// A choice: the column is taken, and none of those of the choices before.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Child {
    /// The column.
    pub column: usize,
    /// What that needs.
    pub proof: Proof,
}

/// What is wrong with a certificate.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum CertificateError {
    /// Shares that one column covers sum to more than 1.
    #[error("the shares that column {column} covers sum to {sum}, more than {SHARE}")]
    Overloaded {
        /// The column.
        column: usize,
        /// What it covers, millionths.
        sum: u64,
    },
    /// Shares do not suffice.
    #[error("{chosen} chosen columns and shares of {sum} millionths do not make {least}")]
    Short {
        /// Columns chosen on the way.
        chosen: usize,
        /// Sum of the shares.
        sum: u64,
        /// What has to be proven.
        least: usize,
    },
    /// A choice was left out.
    #[error("row {row} may be covered by column {column}, which is not among the choices")]
    Missing {
        /// The row.
        row: usize,
        /// The column.
        column: usize,
    },
    /// A number that no row or column has, or a row that is covered already.
    #[error("{0} is not a row that is left, or not an allowed column")]
    Number(usize),
    /// The proof is deeper than any that is needed.
    #[error("the proof is too deep")]
    Deep,
}

impl Certificate {
    /// Checks the proof against a table; what the `forced` columns cover is covered already.
    ///
    /// # Errors
    /// It proves nothing.
    pub fn check(&self, table: &Table, forced: &[usize]) -> Result<(), CertificateError> {
        let mut open = table.coverable();
        open.take(&table.covered(forced));
        if let Some(&row) = self.rows.iter().find(|&&row| !open.contains(row)) {
            return Err(CertificateError::Number(row));
        }
        let left = BitSet::of(table.rows, self.rows.iter().copied());
        let allowed = BitSet::full(table.columns.len());
        check(&self.proof, table, (self.least, 0), &left, &allowed)
    }
}

fn check(
    proof: &Proof,
    table: &Table,
    (least, chosen): (usize, usize),
    left: &BitSet,
    allowed: &BitSet,
) -> Result<(), CertificateError> {
    if chosen > DEEPEST {
        return Err(CertificateError::Deep);
    }
    match proof {
        Proof::Shares(shares) => {
            let mut seen = BitSet::new(table.rows);
            for &(row, _) in shares {
                if !left.contains(row) || seen.contains(row) {
                    return Err(CertificateError::Number(row));
                }
                seen.insert(row);
            }
            for column in allowed.iter() {
                let of_column = shares.iter().filter(|(row, _)| table.columns[column].contains(*row));
                let sum = of_column.fold(0_u64, |sum, (_, share)| sum.saturating_add(*share));
                if sum > SHARE {
                    return Err(CertificateError::Overloaded { column, sum });
                }
            }
            let sum = shares.iter().fold(0_u64, |sum, (_, share)| sum.saturating_add(*share));
            if (chosen as u64).saturating_add(sum.div_ceil(SHARE)) < least as u64 {
                return Err(CertificateError::Short { chosen, sum, least });
            }
            Ok(())
        }
        Proof::Branch { row, children } => {
            if !left.contains(*row) {
                return Err(CertificateError::Number(*row));
            }
            let of_left = |column: usize| {
                let mut rows = table.columns[column].clone();
                rows.keep(left);
                rows
            };
            for column in allowed.iter().filter(|&c| table.columns[c].contains(*row)) {
                let is_within = |child: &Child| {
                    allowed.contains(child.column) && of_left(column).is_within(&of_left(child.column))
                };
                if !children.iter().any(|child| child.column == column || is_within(child)) {
                    return Err(CertificateError::Missing { row: *row, column });
                }
            }
            let mut allowed = allowed.clone();
            for child in children {
                if !allowed.contains(child.column) {
                    return Err(CertificateError::Number(child.column));
                }
                let mut rest = left.clone();
                rest.take(&table.columns[child.column]);
                check(&child.proof, table, (least, chosen + 1), &rest, &allowed)?;
                allowed.remove(child.column);
            }
            Ok(())
        }
    }
}
