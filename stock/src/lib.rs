//! x

mod body;
mod clear;
mod cut;
mod digest;
mod error;
mod grid;
mod heights;
mod intervals;
mod ray;
mod slice;
mod solid;
mod stock;
mod surface;
mod sweep;
mod thickness;
mod tile;
mod volume;

pub use body::ToolBody;
pub use error::StockError;
pub use grid::{FARTHEST_MM, Family, Grid, PITCHES_MM, QUANTUM_MM, USUAL_BYTES};
pub use heights::{HeightMap, Upwards};
pub use slice::Slice;
pub use stock::{Ray, Stock};
pub use surface::SurfaceMesh;
pub use sweep::{Chords, Sweep};
pub use volume::Volume;
