//! The stock of a job while it is planned: material as intervals on three families of parallel rays, a *tri-dexel* with integer
//! ends.
//!
//! ```text
//!      z ↑   rays along z       rays along x        A ray keeps the intervals that are inside of the
//!        │  │  │  │  │  │                           stock. A move removes the interval on which the
//!        ├──█──█──┼──█──█──   ──███████████──▶ x    swept tool covers the ray: from both ends towards
//!        │  █  █  █  █  █     ──████╮ ╭████──       the middle, rounded inwards to 0.1 µm.
//!        │  █  █  █  █  █     ──█████─█████──       Where one family runs along a wall, another one
//!        └──┴──┴──┴──┴──┴──   ──███████████──       meets it steeply.
//! ```
//!
//! **Never too little.** On every ray a move removes no more than the tool sweeps (within 0.01 nm, the rounding of
//! coordinates), and stock begins with no less than was given. Between rays nothing is known: questions about collisions are
//! asked with a margin of a pitch.
//!
//! **Same bytes.** Taking intervals with whole ends out of one another is a difference of sets. Moves may come in any order,
//! on any number of threads. No void is filled and no list is cut short: a ray along a finished surface may cross every cusp.
//!
//! **Sweeps.** A [`ToolBody`] is a stack of convex bodies of revolution: a disc swollen by a ball, cones, cylinders. Along a
//! segment with a fixed axis each sweeps a convex body, in which a ray has one interval. Balls and cones have closed forms
//! (`ray/`); a bull nose takes Newton's search on a convex distance. Curves are replaced by [`Chords`] within a deviation `δ`:
//! a body smaller by `δ` removes less, one larger by `δ` touches more ([`ToolBody::offset`]). A ball whose axis turns is a
//! ball along the path of its centre.
//!
//! **Accuracy.** Along a ray, 0.1 µm. Across, a shape is sampled at the middles of cells: borders of a cut are known to a
//! fraction of the pitch. [`Volume::best_mm3`] takes the family that sees most of a cut.
//!
//! | question | call |
//! |---|---|
//! | what is left, what did moves remove | [`Stock::volume`], [`Stock::removed_since`], [`Stock::removed_by`] |
//! | is a move clear of stock | [`Stock::is_clear`] |
//! | where is material at a level | [`Stock::slice`] |
//! | how high does it stand | [`Stock::height_map`], [`Stock::top_mm`] |
//! | how thick is it over the surface | [`Stock::thickness_along`] |
//! | what does it look like | [`Stock::surface`] |
//! | is it the state of then | [`Stock::digest`] |
//!
//! ```
//! use claymill_nurbs::{Aabb, Point3, Vector3};
//! use claymill_stock::{Stock, Sweep, ToolBody};
//! use claymill_toolpath::Tool;
//!
//! // A block of 100 × 60 × 30 mm, and a slot of 50 mm by a ball of 10 mm, 4 mm deep.
//! let bounds = Aabb { min: Point3::new(0.0, 0.0, 0.0), max: Point3::new(100.0, 60.0, 30.0) };
//! let mut stock = Stock::block(&bounds, 0.5)?;
//! let tool: Tool = "ball:10".parse()?;
//! let ball = ToolBody::end(&tool)?;
//! let slot = Sweep::new(&ball, Vector3::z(), Point3::new(25.0, 30.0, 26.0), Point3::new(75.0, 30.0, 26.0))?;
//! let removed = stock.removed_by(&[slot]).best_mm3();
//! assert!((removed / 2672.110 - 1.0).abs() < 1e-3);
//!
//! // A rapid 5 mm above the floor of the slot runs into its ends, one 5 mm above the block into nothing.
//! let before = stock.clone();
//! stock.cut_all(&[slot]);
//! let rapid = |z| Sweep::new(&ball, Vector3::z(), Point3::new(0.0, 30.0, z), Point3::new(100.0, 30.0, z));
//! assert!(!stock.is_clear(&rapid(28.0)?, 1.0)? && stock.is_clear(&rapid(35.0)?, 1.0)?);
//! assert_ne!(stock.digest(), before.digest());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod body;
mod clear;
mod cut;
mod digest;
mod error;
mod grid;
mod heights;
mod intervals;
mod layer;
mod outline;
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
pub use outline::Polygons;
pub use slice::Slice;
pub use stock::{Ray, Stock};
pub use surface::SurfaceMesh;
pub use sweep::{Chords, Sweep};
pub use volume::Volume;
