//! Which pieces of the model are looked at.

pub(crate) mod tops;
pub(crate) mod tree;
