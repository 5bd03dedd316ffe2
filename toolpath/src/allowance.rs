//! Allowance: what a roughing or semi-finishing operation leaves on the surface, along its normal.
//!
//! ```text
//!        ╭───╮   ball of radius R, an allowance e above the surface
//!       ╭┤ R ├╮      =  ball of radius R + e on the surface, with the same centre;
//!       │╰───╯│         its tip is lower by e
//!     ───╰─┬─╯──── e
//! ━━━━━━━━━┷━━━━━━━ surface
//! ```
//!
//! The larger ball is the sum of the ball and a ball of radius e (Minkowski), so that what holds for it on the faces holds for
//! the tool on the faces' offset: no gouge into the offset is no gouge of the larger ball. A negative allowance cuts below the
//! surface, as for tape and for layers that are put on afterwards.

use claymill_nurbs::Vector3;

use crate::moves::{Move, round_to_written};
use crate::tool::{End, Tool};

impl Tool {
    /// The tool that touches the surface where this one leaves an allowance, along the normal, with the same centre of the ball, or
    /// of the corner: the corner of a flat or bull-nosed end grows with it. `None` where nothing is left of a ball or a corner.
    #[must_use]
    pub fn swollen(&self, allowance_mm: f64) -> Option<Tool> {
        let radius_mm = self.radius_mm() + allowance_mm;
        let corner_radius_mm = self.corner_radius_mm() + allowance_mm;
        let end = match self.end {
            End::Ball { .. } => End::Ball { radius_mm },
            End::Flat { .. } if corner_radius_mm == 0.0 => End::Flat { radius_mm },
            End::Flat { .. } | End::Bull { .. } => End::Bull { radius_mm, corner_radius_mm },
        };
        let is_left = corner_radius_mm > 0.0 || matches!(end, End::Flat { .. });
        (radius_mm.is_finite() && radius_mm > 0.0 && is_left).then(|| Tool {
            end,
            taper_deg: self.taper_deg,
            flute_length_mm: self
                .flute_length_mm
                .map(|mm| (mm + allowance_mm).max(corner_radius_mm * (1.0 + 1e-9))),
            shank_diameter_mm: self.shank_diameter_mm.map(|mm| (mm + 2.0 * allowance_mm).max(radius_mm)),
        })
    }
}

/// The scallop height at which balls of radius `R + e` have the step-over, on a plane, that balls of radius `R` have at the
/// height `h`: `h' = R + e − √((R + e)² − s²/4)` with `s²/4 = 2Rh − h²`.
#[must_use]
pub fn swollen_scallop_mm(radius_mm: f64, scallop_mm: f64, allowance_mm: f64) -> f64 {
    let larger = radius_mm + allowance_mm;
    let half_step_squared = 2.0 * radius_mm * scallop_mm - scallop_mm * scallop_mm;
    // Without the difference of two large numbers.
    half_step_squared / (larger + (larger * larger - half_step_squared).max(0.0).sqrt())
}

/// Moves each tip along the tool axis, as between a tool and the one that is larger by `by_mm`.
pub fn raise_tips(moves: &mut [Move], by_mm: f64) {
    for m in moves {
        let up = Vector3::from(m.axis_start) * by_mm;
        for p in &mut m.points {
            *p = [p[0] + up.x, p[1] + up.y, p[2] + up.z].map(round_to_written);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_larger_ball_has_the_step_over_of_the_smaller_one() {
        for (radius, scallop, allowance) in [(10.0, 0.1, 3.0), (20.0, 2.0, 14.0), (10.0, 0.05, -0.5)] {
            let step = |r: f64, h: f64| 2.0 * (2.0 * r * h - h * h).sqrt();
            let swollen = swollen_scallop_mm(radius, scallop, allowance);
            approx::assert_relative_eq!(
                step(radius + allowance, swollen),
                step(radius, scallop),
                max_relative = 1e-12
            );
        }
        approx::assert_relative_eq!(swollen_scallop_mm(10.0, 0.1, 0.0), 0.1, max_relative = 1e-12);
    }

    #[test]
    fn a_ball_grows_by_the_allowance_with_its_shank() {
        let tool: Tool = "ball:5,taper:3,length:30,shank:16".parse().unwrap();
        let larger = tool.swollen(2.0).unwrap();
        assert_eq!(larger.radius_mm(), 7.0);
        assert_eq!((larger.flute_length_mm, larger.shank_diameter_mm), (Some(32.0), Some(20.0)));
        assert!(tool.swollen(-5.0).is_none());
    }

    #[test]
    fn the_corner_of_another_end_grows_by_the_allowance() {
        let swollen = |text: &str, mm: f64| text.parse::<Tool>().unwrap().swollen(mm).map(|t| t.to_string());
        assert_eq!(swollen("flat:5", 0.5).as_deref(), Some("bull:5.5:0.5"));
        assert_eq!(
            swollen("bull:5:1,length:20,shank:10", 0.5).as_deref(),
            Some("bull:5.5:1.5,length:20.5,shank:11")
        );
        assert_eq!(swollen("flat:5", 0.0).as_deref(), Some("flat:5"));
        assert_eq!((swollen("flat:5", -0.5), swollen("bull:5:1", -1.0)), (None, None));
    }
}
