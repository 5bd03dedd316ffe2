//! The exact drop cutter: where a tool comes to rest when it is dropped along the tool axis on *all* faces.
//!
//! ```text
//!      axis ↑            R + δ ╭───╮        every face is covered by triangles; δ bounds how far the
//!         ╭─┴─╮   drop         │ ● │        face is from its triangle
//!         │ ● │    │           ╰─┬─╯ ← upper bound, from the triangle
//!         ╰───╯    ▼        ╭────┴──╮
//!                      ─────╯ face  ╰──── exact, by Newton; proven or subdivided
//! ```
//!
//! A ball of radius `R` that touches the surface makes a ball of radius `R + δ` touch the triangle, so
//! `drop(R + δ, triangle)` is a proven upper bound of the height at which the surface stops the ball
//! (docs/theory.md §6.2). Only triangles whose bound lies above the best contact found so far are looked at
//! more closely: by Newton on the offset surface, and where that proves nothing by subdivision. The heights
//! returned are those of the NURBS, not of triangles.
//!
//! ```
//! use claymill_contact::{BallDrop, Covering, Frame};
//! use claymill_nurbs::analytic::{Frame as Placement, sphere};
//! use claymill_nurbs::{Face, Model, Point3, Source, SurfaceKind, Vector3};
//!
//! // Half a sphere of radius 20 mm, and a ball of 5 mm that comes down beside its middle.
//! let at = Placement::new(Point3::origin(), Vector3::z(), Vector3::x()).ok_or("parallel")?;
//! let dome = sphere(&at, 20.0, (0.0, std::f64::consts::TAU), (0.0, std::f64::consts::FRAC_PI_2))?;
//! let kind = SurfaceKind::Nurbs;
//! let face = Face { surface: dome, loops: Vec::new(), reversed: false, kind, source: Source::default() };
//! let model = Model { faces: vec![face], ..Model::default() };
//! let covering = Covering::new(&model, &[false], model.faces[0].area_mm2(), 5.0).map_err(|(_, e)| e)?;
//! let [top, ..] = Frame::five("+z".parse()?, "+x".parse()?)?;
//! let ball = BallDrop::new(&model, &covering, &top, 5.0);
//! let rest = ball.drop(7.0, 0.0).ok_or("nothing below")?;
//! assert!((rest.centre.z - (25.0_f64.powi(2) - 7.0_f64.powi(2)).sqrt()).abs() < 1e-6);
//! assert!(ball.drop(40.0, 0.0).is_none());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod blocked;
mod boxes;
mod certificate;
mod covering;
mod cutter;
mod drop;
mod exact;
mod frame;
mod march;
mod material;
mod search;

#[cfg(test)]
mod tests;

use claymill_nurbs::{FaceId, Point3, Vector3};

pub use blocked::{Blocked, KeptOff};
pub use covering::{Covering, distance_from};
pub use cutter::{CUTTER_EPSILON_MM, CutterDrop, CutterLocation, EndShape, ToolPart};
pub use drop::BallDrop;
pub use frame::{Axis, AxisError, Frame, FrameError, ParallelAxes, SetupName};
pub use march::March;
pub use material::behind::{Material, near_mm};
pub use material::free_sides::FreeSides;
pub use material::rims::{OpenStretch, Rims};

/// A bound that exceeds the best contact by no more than this is not looked into, mm: the largest amount by
/// which a location can be too low.
pub const CONTACT_EPSILON_MM: f64 = 1e-4;

/// The ball that lengths in mm are chosen for, as long as a larger one does not allow for more, mm.
const USUAL_RADIUS_MM: f64 = 10.0;

/// How many times a ball is as large as the usual one, at least once.
#[must_use]
pub fn larger_than_usual(radius_mm: f64) -> f64 {
    (radius_mm / USUAL_RADIUS_MM).max(1.0)
}

/// What carries the ball.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Support {
    /// The inside of a face, at these surface parameters.
    Face {
        /// Surface parameter.
        u: f64,
        /// Surface parameter.
        v: f64,
    },
    /// The boundary of a face.
    Edge,
    /// Nothing could be proven finer than this height, which is safe.
    Bound,
    /// Taper or shank, which touch something, hold the ball above all of the model.
    Side,
}

impl Support {
    /// Whether the ball itself touches.
    fn is_touched(self) -> bool {
        matches!(self, Support::Face { .. } | Support::Edge)
    }
}

/// A cutter location in the setup's frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Location {
    /// The ball's centre; of another end the middle of its disc.
    pub centre: Point3,
    /// Unit vector from the contact point into the tool, of a ball to its centre; if taper or shank touch, from there into the tool.
    pub normal: Vector3,
    /// The face that is touched.
    pub face: FaceId,
    /// What carries the ball.
    pub support: Support,
    /// Whether it is proven for all contacts around that nothing holds the ball higher; elsewhere all that could was
    /// looked at.
    pub certified: bool,
}

impl Location {
    /// Where a ball with its centre here touches a face at these parameters, whether or not it comes to rest there.
    #[must_use]
    pub fn touching(centre: Point3, normal: Vector3, face: FaceId, [u, v]: [f64; 2]) -> Self {
        Location { centre, normal, face, support: Support::Face { u, v }, certified: false }
    }

    /// Slope `dz/ds` of the surface of all locations in the horizontal unit direction `(ex, ey)`.
    #[must_use]
    pub fn slope(&self, ex: f64, ey: f64) -> f64 {
        -(self.normal.x * ex + self.normal.y * ey) / self.normal.z.max(1e-6)
    }
}
