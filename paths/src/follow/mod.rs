//! The exact path of the ball along a drive curve, with what proves it.

pub(crate) mod profile;
pub(crate) mod proofs;
pub(crate) mod proven;
