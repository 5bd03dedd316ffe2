//! Reach on shapes that can be worked out by hand, and on real models.

mod models;
mod record;
mod references;
mod shapes;
mod sight;
