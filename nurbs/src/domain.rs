//! Whether parameters belong to a face: the winding number of its repaired trim loops is positive.

use crate::rings::{Ring, rings};
use crate::winding::Winding;
use crate::{Face, Point2};

/// The part of the parameter plane that belongs to a face, ready for fast inside tests.
///
/// Gaps in trim loops are closed by straight lines, loops around a closed surface are joined along its seam,
/// and loops are turned by their nesting (holes against their outer loop), so that neither the direction nor
/// a hole that touches or crosses its outer loop matters. A point is inside where the winding number of the
/// exact curves is positive.
#[derive(Debug, Clone)]
pub struct Domain {
    min: Point2,
    max: Point2,
    /// `None` when the face is its whole surface.
    winding: Option<Winding>,
}

impl Domain {
    /// Prepares the inside test of `face`.
    #[must_use]
    pub fn new(face: &Face) -> Self {
        Domain::of_rings(face, &rings(face))
    }

    pub(crate) fn of_rings(face: &Face, rings: &[Ring]) -> Self {
        let ((u0, u1), (v0, v1)) = face.surface.domain();
        Domain {
            min: Point2::new(u0, v0),
            max: Point2::new(u1, v1),
            winding: (!face.loops.is_empty()).then(|| Winding::new(rings.iter().flat_map(|r| &r.arcs))),
        }
    }

    /// Whether `(u, v)` belongs to the face (exact winding number of the trim loops; docs/theory.md §2.5).
    #[must_use]
    pub fn contains(&self, u: f64, v: f64) -> bool {
        let inside = self.min.x <= u && u <= self.max.x && self.min.y <= v && v <= self.max.y;
        inside && self.winding.as_ref().is_none_or(|w| w.number(Point2::new(u, v)) > 0)
    }
}
