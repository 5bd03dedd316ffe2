//! On which side of open sheets the material is, and what a ball meets there.

pub(crate) mod behind;
pub(crate) mod free_sides;
pub(crate) mod rims;
mod side;
