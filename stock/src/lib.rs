//! x

mod body;
mod clear;
mod cut;
mod error;
mod grid;
mod intervals;
mod ray;
mod stock;
mod sweep;
mod tile;
mod volume;

pub use body::ToolBody;
pub use error::StockError;
pub use grid::{FARTHEST_MM, Family, Grid, PITCHES_MM, QUANTUM_MM, USUAL_BYTES};
pub use stock::{Ray, Stock};
pub use sweep::{Chords, Sweep};
pub use volume::Volume;
