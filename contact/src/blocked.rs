//! Whether a ball gets to a place of the model at all.

use crate::certificate::support_bound::SupportBound;
use crate::drop::{BallDrop, Search};
use crate::{Location, Support};

/// Corners of triangles are known to this, mm.
const KNOWN_MM: f64 = 1e-3;

/// What keeps a ball from a place where it would touch the model.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Blocked {
    /// It is held up, but by less than is asked for, or the taper or the shank above it is.
    Near,
    /// It is held up by that much and maybe more.
    Far,
}

/// What keeps a tool off a place at a height.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum KeptOff {
    /// Nothing.
    No,
    /// A point of the model over this place in the setup, from which the tool's axis has to be so far away at this height.
    By {
        /// Where the point is, seen along the axis, mm.
        place: [f64; 2],
        /// Distance from there, mm.
        away_mm: f64,
    },
    /// Something, which has not been found, or nothing, which has not been proven.
    Perhaps,
}

impl BallDrop<'_> {
    /// What holds a ball up by more than `by_mm` that would touch the model in `touch`; what holds it up by `far_mm` is not
    /// looked at more closely.
    #[must_use]
    pub fn blocked_from(&self, touch: &Location, by_mm: f64, far_mm: f64) -> Option<Blocked> {
        if !self.end().is_ball() {
            return self.end_blocked_from(touch, by_mm, far_mm);
        }
        let Location { centre, normal, .. } = touch;
        if self.vertex_bound().hold(
            centre.x,
            centre.y,
            self.radius_mm(),
            centre.z + by_mm.max(far_mm) + KNOWN_MM,
        ) {
            return Some(Blocked::Far);
        }
        let mut search = Search::new(self, centre.x, centre.y);
        search.best = Some(*touch);
        search.floor = SupportBound::under(centre, normal, self.radius_mm(), by_mm);
        search.enough_z = centre.z + far_mm;
        search.descend();
        let rest = search.finish()?;
        if rest.centre.z <= centre.z + by_mm {
            return None;
        }
        let is_far = rest.support != Support::Side && rest.centre.z >= search.enough_z;
        Some(if is_far { Blocked::Far } else { Blocked::Near })
    }

    /// Whether something holds a ball over `(x, y)` up with its centre above this height.
    #[must_use]
    pub fn is_blocked_at(&self, x: f64, y: f64, height: f64) -> bool {
        if !self.end().is_ball() {
            return self.is_end_blocked_at([x, y], height);
        }
        self.vertex_bound().hold(x, y, self.radius_mm(), height + KNOWN_MM)
            || self.drop_between(x, y, [height, height]).is_some()
    }

    /// What keeps the tool off `(x, y)` with its middle at this height, as far as it is found; [`BallDrop::is_blocked_at`] says
    /// whether anything does.
    #[must_use]
    pub fn kept_off_at(&self, x: f64, y: f64, height: f64) -> KeptOff {
        if !self.end().is_ball() {
            return self.kept_off([x, y], height);
        }
        if self.is_blocked_at(x, y, height) { KeptOff::Perhaps } else { KeptOff::No }
    }

    /// Whether something holds a ball up by more than `by_mm` that would touch the model in `touch`.
    #[must_use]
    pub fn is_blocked_from(&self, touch: &Location, by_mm: f64) -> bool {
        self.blocked_from(touch, by_mm, by_mm).is_some()
    }
}
