//! A ball along a segment.
//!
//! ```text
//!     ray ↑                 the ray leaves the capsule through the ball at either end, or through the
//!    ╭────┼────────╮        cylinder between them where the foot on the segment lies within it.
//!    │ •──┼──────• │        All such places are in the capsule, which is convex: the interval goes
//!    ╰────┼────────╯        from the lowest to the highest of them.
//! ```

use super::{Found, Turned};

/// A capsule, in turned coordinates.
pub(crate) struct Capsule {
    from: Turned,
    along: Turned,
    radius: f64,
    /// One by the square of the length; 0 without length.
    per_square: f64,
    /// Square of the length across the rays, times that: how steeply the rays cross the cylinder.
    across: f64,
}

impl Capsule {
    pub(crate) fn new(from: Turned, along: Turned, radius: f64) -> Self {
        let level = along[0] * along[0] + along[1] * along[1];
        let square = level + along[2] * along[2];
        let per_square = if square > 0.0 { 1.0 / square } else { 0.0 };
        Capsule { from, along, radius, per_square, across: level * per_square }
    }

    /// Where the ray at this place is inside.
    #[inline]
    pub(crate) fn interval(&self, u: f64, v: f64) -> Option<[f64; 2]> {
        let (mu, mv) = (u - self.from[0], v - self.from[1]);
        let [du, dv, dw] = self.along;
        let square = self.radius * self.radius;
        let from_axis = mu * mu + mv * mv;
        let mut found = Found::NOTHING;
        let first = square - from_axis;
        if first > 0.0 {
            let half = first.sqrt();
            found.add(half);
            found.add(-half);
        }
        let (eu, ev) = (mu - du, mv - dv);
        let last = square - (eu * eu + ev * ev);
        if last > 0.0 {
            let half = last.sqrt();
            found.add(dw + half);
            found.add(dw - half);
        }
        // Where the squared distance from the line equals the squared radius: a·t² + 2b·t + c = 0.
        if self.across > 1e-18 {
            let forward = (mu * du + mv * dv) * self.per_square;
            let b = -forward * dw;
            let c = from_axis - forward * (mu * du + mv * dv) - square;
            let under = b * b - self.across * c;
            if under > 0.0 {
                let root = under.sqrt();
                for t in [(-b - root) / self.across, (-b + root) / self.across] {
                    let foot = forward + t * dw * self.per_square;
                    if (0.0..=1.0).contains(&foot) {
                        found.add(t);
                    }
                }
            }
        }
        found.interval().map(|[low, high]| [low + self.from[2], high + self.from[2]])
    }
}
