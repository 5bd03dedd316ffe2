//! Whether a ball gets to a place of the model at all.

use crate::certificate::support_bound::SupportBound;
use crate::cutter::Effort;
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

/// Whether something keeps a tool off a place at a height.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum KeptOff {
    /// Nothing does.
    No,
    /// A point of the model does.
    Until {
        /// So far along the way that was asked for, at least, that point does, mm.
        along_mm: f64,
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

    /// Whether something keeps the tool off a place (setup coordinates, mm) with its middle at this height; `None` where that is not
    /// found out.
    #[must_use]
    pub fn is_kept_off(&self, at: [f64; 2], height: f64) -> Option<bool> {
        self.is_kept_off_within(at, height, Effort::OF_BORDER)
    }

    /// The same as far as it is found out soon: where the tool all but touches a wall, that takes long.
    #[must_use]
    pub fn is_kept_off_at_a_glance(&self, at: [f64; 2], height: f64) -> Option<bool> {
        self.is_kept_off_within(at, height, Effort::AT_A_GLANCE)
    }

    fn is_kept_off_within(&self, at: [f64; 2], height: f64, effort: Effort) -> Option<bool> {
        match self.end().is_ball() {
            true => Some(self.is_blocked_at(at[0], at[1], height)),
            false => self.is_end_kept_off(at, height, effort),
        }
    }

    /// Whether something keeps the tool off a place, and how far it would have to go along a unit vector.
    #[must_use]
    pub fn kept_off(&self, from: [f64; 2], along: [f64; 2], height: f64) -> KeptOff {
        if !self.end().is_ball() {
            return self.end_kept_off(from, along, height);
        }
        match self.is_blocked_at(from[0], from[1], height) {
            true => KeptOff::Until { along_mm: 0.0 },
            false => KeptOff::No,
        }
    }

    /// Whether something holds a ball up by more than `by_mm` that would touch the model in `touch`.
    #[must_use]
    pub fn is_blocked_from(&self, touch: &Location, by_mm: f64) -> bool {
        self.blocked_from(touch, by_mm, by_mm).is_some()
    }
}
