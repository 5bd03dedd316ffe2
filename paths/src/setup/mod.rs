//! One setup: what it sees of the model, what it cuts of it, and what its parts share.

pub(crate) mod assignment;
pub(crate) mod borders;
pub(crate) mod claimed_mesh;
pub(crate) mod claims;
pub(crate) mod context;
pub(crate) mod cuts;
pub(crate) mod heights;
pub(crate) mod in_triangle;
pub(crate) mod leaning;
pub(crate) mod orientation;
pub(crate) mod probe;
pub(crate) mod rows_along;
pub(crate) mod seen_log;
pub(crate) mod sides;
pub(crate) mod slopes;
pub(crate) mod space;
pub(crate) mod wall_claims;
