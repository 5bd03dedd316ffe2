//! The end of a tool as a disc swollen by a ball: what a contact tells of the tool's place, and how far a point is from
//! the tool.

use claymill_nurbs::Vector3;
use claymill_toolpath::Tool;

/// A ball, flat or bull-nosed end. Its *middle* is that of the disc, the ball's centre where there is no disc.
///
/// ```text
///      │           │
///      │  middle   │      the middle lies one corner radius above the tip and, of a tool that touches a
///      │ ───●─── ╮ │      surface with the normal n, at  contact + corner·n + flat·n_h,
///       ╲_______╱        n_h the horizontal direction of n
///       flat │ corner
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EndShape {
    /// Radius of the disc, mm; 0 of a ball.
    pub flat_mm: f64,
    /// Radius of the ball that swells it, mm; 0 of a flat end.
    pub corner_mm: f64,
}

/// Normals that lean by less than this (sine) are upright: the disc lies on what it touches.
pub(crate) const UPRIGHT: f64 = 1e-7;

impl EndShape {
    /// The end of a tool.
    #[must_use]
    pub fn of(tool: &Tool) -> Self {
        let corner_mm = tool.corner_radius_mm();
        EndShape { flat_mm: tool.radius_mm() - corner_mm, corner_mm }
    }

    /// A ball.
    #[must_use]
    pub fn ball(radius_mm: f64) -> Self {
        EndShape { flat_mm: 0.0, corner_mm: radius_mm }
    }

    /// Whether it is a ball.
    #[must_use]
    pub fn is_ball(&self) -> bool {
        self.flat_mm == 0.0
    }

    /// Its largest radius, mm.
    #[must_use]
    pub fn radius_mm(&self) -> f64 {
        self.flat_mm + self.corner_mm
    }

    /// The way from a contact to the middle, where the unit normal `n` into the tool is in the setup's coordinates. On
    /// level ground the middle stands right over the contact.
    #[must_use]
    pub fn to_middle(&self, n: &Vector3) -> Vector3 {
        n * self.corner_mm + level(n) * self.flat_mm
    }

    /// Distance of a point from the tool, which has no end upwards, negative inside, and its gradient: `from_middle` is
    /// where the point is, seen from the middle. Convex, and never steeper than 1.
    #[must_use]
    pub fn distance(&self, from_middle: &Vector3) -> (f64, Vector3) {
        let from_axis = from_middle.xy().norm();
        let outward = if from_axis > 0.0 {
            Vector3::new(from_middle.x, from_middle.y, 0.0) / from_axis
        } else {
            Vector3::zeros()
        };
        let (beside, below) = (from_axis - self.flat_mm, -from_middle.z);
        let core = beside.max(0.0).hypot(below.max(0.0));
        let gradient = match () {
            () if core > 0.0 => outward * (beside.max(0.0) / core) - Vector3::z() * (below.max(0.0) / core),
            () if beside > below => outward,
            () => -Vector3::z(),
        };
        (core + beside.max(below).min(0.0) - self.corner_mm, gradient)
    }
}

/// The horizontal direction of a unit vector; none of an upright one.
pub(crate) fn level(n: &Vector3) -> Vector3 {
    let size = n.x.hypot(n.y);
    if size > UPRIGHT { Vector3::new(n.x / size, n.y / size, 0.0) } else { Vector3::zeros() }
}

#[cfg(test)]
mod tests {
    use super::*;

    const BULL: EndShape = EndShape { flat_mm: 8.0, corner_mm: 2.0 };

    #[test]
    fn a_contact_lies_on_the_tool_and_its_gradient_is_the_normal() {
        for (x, y, z) in [(0.3, 0.1, 0.9), (-0.01, 0.0, 1.0), (0.6, -0.7, 0.2)] {
            let n = Vector3::new(x, y, z).normalize();
            for end in [BULL, EndShape::ball(10.0)] {
                let (mm, gradient) = end.distance(&-end.to_middle(&n));
                approx::assert_abs_diff_eq!(mm, 0.0, epsilon = 1e-12);
                approx::assert_abs_diff_eq!((gradient + n).norm(), 0.0, epsilon = 1e-12);
            }
        }
        assert_eq!(BULL.to_middle(&Vector3::z()), Vector3::z() * 2.0);
    }

    #[test]
    fn depth_inside_is_that_of_the_nearest_side() {
        let flat = EndShape { flat_mm: 10.0, corner_mm: 0.0 };
        for (at, mm) in [
            ([3.0, 0.0, 0.5], -0.5),
            ([9.9, 0.0, 4.0], -0.1),
            ([0.0, 12.0, 7.0], 2.0),
            ([0.0, 13.0, -4.0], 5.0),
            ([0.0, 0.0, -2.0], 2.0),
        ] {
            approx::assert_abs_diff_eq!(flat.distance(&at.into()).0, mm, epsilon = 1e-12);
        }
    }
}
