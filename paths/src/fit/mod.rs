//! Fits cubic NURBS to the exact paths, and writes them in digits.

pub(crate) mod breaks;
pub(crate) mod refit;
pub(crate) mod target;
pub(crate) mod tolerance;
pub(crate) mod written;
