//! What proves that a contact is the only one, or the highest.

pub(crate) mod beside;
pub(crate) mod floor;
pub(crate) mod joint;
pub(crate) mod sheet;

#[cfg(test)]
mod sheet_tests;
