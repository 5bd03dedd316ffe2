//! What is refused, with the figures and what to do instead.

use claymill_nurbs::Point3;
use claymill_toolpath::ToolError;
use thiserror::Error;

/// Why a stock, a tool or a question was refused.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum StockError {
    /// A number is missing or infinite.
    #[error("{0} is not a finite number; give every coordinate in mm")]
    NotFinite(&'static str),
    /// The pitch of the rays is out of range.
    #[error("a pitch of {pitch_mm} mm is not between {low} and {high} mm; for example 1", low = crate::PITCHES_MM.0, high = crate::PITCHES_MM.1)]
    Pitch {
        /// As asked for.
        pitch_mm: f64,
    },
    /// The grid would not fit into memory.
    #[error(
        "at a pitch of {pitch_mm} mm the stock has {rays} rays and needs about {bytes} bytes, more than the {limit_bytes} \
         allowed; a pitch of {fitting_mm:.3} mm fits"
    )]
    TooFine {
        /// As asked for.
        pitch_mm: f64,
        /// Rays of the three families.
        rays: u64,
        /// Memory of a stock after roughing, bytes.
        bytes: u64,
        /// What is allowed, bytes.
        limit_bytes: u64,
        /// A pitch that needs less, mm.
        fitting_mm: f64,
    },
    /// The box has no inside.
    #[error("the box of the stock is empty: its largest corner must exceed its smallest in x, y and z")]
    EmptyBox,
    /// The stock is further out than its integers reach.
    #[error("the stock reaches to {reach_mm} mm, more than {limit} mm from the origin; is the unit right?", limit = crate::FARTHEST_MM)]
    TooFar {
        /// Largest coordinate, mm.
        reach_mm: f64,
    },
    /// No ray passes through the material.
    #[error(
        "the stock is empty at this pitch: no ray of {pitch_mm} mm pitch passes through it; is the pitch finer than the part?"
    )]
    Empty {
        /// Distance of the rays, mm.
        pitch_mm: f64,
    },
    /// The mesh does not enclose anything.
    #[error(
        "the mesh of the stock is open: {edges} edges bound an odd number of triangles, the first at ({x:.3}, {y:.3}, {z:.3}); \
         close it, or start from a block",
        x = at_mm.x, y = at_mm.y, z = at_mm.z
    )]
    OpenMesh {
        /// Edges that bound an odd number of triangles.
        edges: usize,
        /// Where the first of them begins.
        at_mm: Point3,
    },
    /// A triangle names a vertex that is not there.
    #[error("triangle {triangle} names vertex {vertex}, and the mesh has {vertices}")]
    NoVertex {
        /// Of the mesh.
        triangle: usize,
        /// Its vertex.
        vertex: u32,
        /// How many there are.
        vertices: usize,
    },
    /// A closure returned an interval that is none.
    #[error("the material on a ray goes from {low} to {high} mm; the ends must be finite and ascending")]
    Interval {
        /// Lower end, mm.
        low: f64,
        /// Upper end, mm.
        high: f64,
    },
    /// The radius is not positive.
    #[error("a radius of {0} mm must be positive")]
    Radius(f64),
    /// The tool makes no sense.
    #[error(transparent)]
    Tool(#[from] ToolError),
    /// A section of a tool or holder makes no sense.
    #[error(
        "a section from height {low:?} to {high:?} (height, radius in mm) is no cone or cylinder; radii must be positive and heights ascend"
    )]
    Section {
        /// Height above the tip and radius at the lower end, mm.
        low: [f64; 2],
        /// The same at the upper end.
        high: [f64; 2],
    },
    /// A direction is not a unit vector.
    #[error("a direction of length {0} is no unit vector; divide it by its length")]
    Direction(f64),
    /// Three directions are not at right angles, or left-handed.
    #[error("the axes of the slice are not at right angles and right-handed")]
    Axes,
    /// The band of a slice is empty.
    #[error("the band from {low_mm} to {high_mm} mm is empty")]
    Band {
        /// Lower end, mm.
        low_mm: f64,
        /// Upper end, mm.
        high_mm: f64,
    },
    /// A tolerance or margin is not allowed.
    #[error("{what} of {mm} mm must be a finite number and at least {least}")]
    Size {
        /// What is meant.
        what: &'static str,
        /// As asked for.
        mm: f64,
        /// The least that is allowed.
        least: f64,
    },
    /// A curve needs more chords than are allowed.
    #[error("a curve needs more than {0} chords; allow a larger deviation")]
    Chords(usize),
    /// A grid of a reading would be too large.
    #[error("{what} of {cells} cells exceeds the {limit} allowed; take larger cells")]
    TooManyCells {
        /// What is read.
        what: &'static str,
        /// Cells asked for.
        cells: u64,
        /// Cells allowed.
        limit: u64,
    },
    /// Two stocks have different rays.
    #[error("the two stocks have different grids; start both from the same one")]
    Grids,
}
