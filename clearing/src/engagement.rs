//! The angle about a tool at which it cuts, when its centre runs along a circle: closed forms.
//!
//! ```text
//!                  wall                     α is measured from the wall to where the tool leaves the cut.
//!          ───────────╮                     With the wall outside of the circle of the centre (concave) the
//!      ρ   ╭──────╮   │ ae                  tool cuts at more, with the wall inside (convex) at less:
//!      •───┤ tool ╞═══╡                     cos α = (1 − ae/R) ∓ ae (2R − ae) / (2 ρ R)
//! ```

use crate::error::ClearingError;

/// The largest engagement that a tool is allowed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EngagementLimit {
    radius_mm: f64,
    limit_deg: f64,
}

impl EngagementLimit {
    /// Of a tool with a radius.
    ///
    /// # Errors
    /// The radius is no length, or the limit not between 0° and 180°.
    pub fn new(radius_mm: f64, limit_deg: f64) -> Result<Self, ClearingError> {
        if !(radius_mm.is_finite() && radius_mm > 0.05 && radius_mm <= 200.0) {
            return Err(ClearingError::Radius { radius_mm });
        }
        if !(LEAST_LIMIT_DEG..=LARGEST_LIMIT_DEG).contains(&limit_deg) {
            return Err(ClearingError::Limit { limit_deg });
        }
        Ok(EngagementLimit { radius_mm, limit_deg })
    }

    /// The same tool at a limit that is lower by so much.
    pub(crate) fn reserved(&self, reserve_deg: f64) -> Self {
        EngagementLimit { limit_deg: self.limit_deg - reserve_deg, ..*self }
    }

    /// Radius of the tool, mm.
    #[must_use]
    pub fn radius_mm(&self) -> f64 {
        self.radius_mm
    }

    /// The limit, degrees.
    #[must_use]
    pub fn limit_deg(&self) -> f64 {
        self.limit_deg
    }

    /// The step-over at which a straight pass has the limit, mm.
    #[must_use]
    pub fn straight_step_mm(&self) -> f64 {
        self.radius_mm * (1.0 - self.limit_deg.to_radians().cos())
    }

    /// A disc of this radius around the middle of a circular path may be uncut nowhere, so that the path keeps the limit, mm.
    #[must_use]
    pub fn cleared_radius_mm(&self, path_radius_mm: f64) -> f64 {
        let (r, p) = (self.radius_mm, path_radius_mm);
        (p * p + r * r + 2.0 * p * r * self.limit_deg.to_radians().cos()).sqrt()
    }

    /// The step-over that has the limit on a circular path with the wall outside, mm.
    #[must_use]
    pub fn concave_step_mm(&self, path_radius_mm: f64) -> f64 {
        self.radius_mm + path_radius_mm - self.cleared_radius_mm(path_radius_mm)
    }

    /// The step-over that has the limit on a circular path with the wall inside, mm.
    #[must_use]
    pub fn convex_step_mm(&self, path_radius_mm: f64) -> f64 {
        let (r, p) = (self.radius_mm, path_radius_mm);
        r - p + (p * p + r * r - 2.0 * p * r * self.limit_deg.to_radians().cos()).sqrt()
    }
}

/// Limits below this would never come to an end.
pub const LEAST_LIMIT_DEG: f64 = 5.0;
/// Limits above this are slots.
pub const LARGEST_LIMIT_DEG: f64 = 150.0;

/// Engagement of a straight pass with a step-over, radians.
#[must_use]
pub fn straight_angle(radius_mm: f64, step_mm: f64) -> f64 {
    angle(1.0 - step_mm / radius_mm)
}

/// Engagement on a circular path with the wall outside, radians.
#[must_use]
pub fn concave_angle(radius_mm: f64, step_mm: f64, path_radius_mm: f64) -> f64 {
    angle(1.0 - step_mm / radius_mm - bend(radius_mm, step_mm, path_radius_mm))
}

/// Engagement on a circular path with the wall inside, radians.
#[must_use]
pub fn convex_angle(radius_mm: f64, step_mm: f64, path_radius_mm: f64) -> f64 {
    angle(1.0 - step_mm / radius_mm + bend(radius_mm, step_mm, path_radius_mm))
}

/// Engagement where a straight pass runs into a square inside corner, radians.
#[must_use]
pub fn corner_angle(radius_mm: f64, step_mm: f64) -> f64 {
    (straight_angle(radius_mm, step_mm) + std::f64::consts::FRAC_PI_2).min(std::f64::consts::PI)
}

fn bend(radius_mm: f64, step_mm: f64, path_radius_mm: f64) -> f64 {
    step_mm * (2.0 * radius_mm - step_mm) / (2.0 * path_radius_mm * radius_mm)
}

fn angle(cosine: f64) -> f64 {
    cosine.clamp(-1.0, 1.0).acos()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn near(found: f64, wanted: f64) {
        assert!((found - wanted).abs() < 1e-8, "{found} instead of {wanted}");
    }

    #[test]
    fn straight_passes_corners_and_slots() {
        near(straight_angle(5.0, 1.0).to_degrees(), 36.869_897_646);
        near(straight_angle(3.0, 2.4), 1.369_438_406);
        near(corner_angle(3.0, 2.4), 2.940_234_733);
        near(straight_angle(5.0, 10.0), std::f64::consts::PI);
    }

    #[test]
    fn circular_passes() {
        near(concave_angle(5.0, 1.0, 10.0).to_degrees(), 44.765_084_671);
        near(convex_angle(5.0, 1.0, 10.0).to_degrees(), 27.126_753_117);
        near(concave_angle(5.0, 1.0, 2.5).to_degrees(), 63.896_118_863);
    }

    #[test]
    fn steps_at_a_limit() -> Result<(), ClearingError> {
        let limit = EngagementLimit::new(5.0, 0.8_f64.acos().to_degrees())?;
        near(limit.concave_step_mm(10.0), 0.682_178_937);
        near(limit.concave_step_mm(2.5), 0.341_089_468);
        near(limit.convex_step_mm(10.0), 1.708_203_932);
        near(limit.straight_step_mm(), 1.0);
        Ok(())
    }

    #[test]
    fn limits_that_make_no_sense_are_named() {
        for limit_deg in [0.0, 180.0, -3.0, f64::NAN, f64::INFINITY] {
            let refused = EngagementLimit::new(5.0, limit_deg);
            assert!(matches!(refused, Err(ClearingError::Limit { .. })), "{limit_deg}");
        }
        assert!(matches!(EngagementLimit::new(f64::NAN, 40.0), Err(ClearingError::Radius { .. })));
    }
}
