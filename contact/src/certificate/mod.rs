//! What proves that a contact is the only one, or the highest.

pub(crate) mod adjacency;
pub(crate) mod joint;
pub(crate) mod one_sheet;
pub(crate) mod support_bound;

#[cfg(test)]
mod one_sheet_tests;
