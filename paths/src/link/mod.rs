//! What joins passes: their order, ways down, over and up, and how far they run out.

pub(crate) mod descent;
pub(crate) mod extension;
pub(crate) mod leads;
pub(crate) mod order;
pub(crate) mod tour;
