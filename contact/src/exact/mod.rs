//! Contacts with the exact surfaces: what rests on a face, an edge, a plane; by Newton, and by subdivision where that proves nothing.

pub(crate) mod edge;
pub(crate) mod face;
pub(crate) mod flat;
pub(crate) mod shape;
mod subdivide;
