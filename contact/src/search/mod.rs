//! Which pieces of the model are looked at.

pub(crate) mod tree;
pub(crate) mod vertex_bound;
