//! The exact ball: where it comes to rest when it is dropped along the tool axis on *all* faces.
//!
//! Every face is covered by triangles, each with a bound `δ` on how far the surface is from it. A ball of
//! radius `R` that touches the surface makes a ball of radius `R + δ` touch the triangle, so
//! `drop(R + δ, triangle)` is a proven upper bound of the height at which the surface stops the ball
//! (docs/theory.md §6.2). Only triangles whose bound lies above the best contact found so far are looked at
//! more closely: by Newton on the offset surface, and where that proves nothing by subdivision. The heights
//! returned are those of the NURBS, not of triangles.

mod certificate;
mod covering;
mod cutter;
mod drop;
mod exact;
mod frame;
mod held;
mod march;
mod material;
mod search;

#[cfg(test)]
mod tests;

use claymill_nurbs::{FaceId, Point3, Vector3};

pub use covering::{Covering, distance_from};
pub use cutter::{END_EPSILON_MM, EndDrop, EndLocation, ToolPart};
pub use drop::BallDrop;
pub use frame::{Axis, AxisError, Frame, ParallelAxes};
pub use held::Held;
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
    /// The ball's centre.
    pub centre: Point3,
    /// Unit vector from the contact point to the centre; if taper or shank touch, from there into the tool.
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
