//! Spindle speed and feed from cutting data, with the effective diameter of a tilted end and the
//! thinning of chips, within what the machine can do.
//!
//! ```text
//!        axis  tilt β
//!          ╲ │
//!           ╲│         effective diameter: twice the distance from the axis
//!       ╭────●───╮     of the highest point that cuts at depth ap
//!        ╲  ╱ ╲ ╱ ap   D_eff = 2·(R − r) + 2·r·sin(β + acos(1 − ap/r))
//!  ───────╰─╯──────
//! ```

use claymill_toolpath::Tool;

use crate::library::{Advance, Cutting, LibraryTool, Speed};
use crate::machine::MachineShape;

/// A mode of cutting: how deep, how wide, how far tilted.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Engagement {
    /// Depth along the surface's normal, mm. `None`: that of the cutting data, else as deep as the end is high.
    pub ap_mm: Option<f64>,
    /// Width of cut, mm. `None`: that of the cutting data, else a full slot.
    pub ae_mm: Option<f64>,
    /// Angle between the tool's axis and the surface's normal, degrees.
    pub tilt_deg: f64,
}

/// Speed and feed, and what bounds them.
#[derive(Debug, Clone, PartialEq)]
pub struct Conditions {
    /// Speed of the spindle, 1/min.
    pub rpm: f64,
    /// Feed, mm/min.
    pub feed_mm_per_min: f64,
    /// Diameter where the edge is fastest, mm.
    pub effective_diameter_mm: f64,
    /// Speed of the edge there, m/min.
    pub vc_m_per_min: f64,
    /// Advance of each edge in each turn, mm; `None` where the number of edges is not known.
    pub fz_mm: Option<f64>,
    /// Thickest chip, mm.
    pub chip_mm: Option<f64>,
    /// What of it the machine bounds.
    pub bounded_by: Vec<MachineBound>,
}

/// A limit of the machine that changes speed or feed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum MachineBound {
    /// The spindle cannot turn as fast; the feed goes down with it, so chips stay as thick.
    SpindleTooSlow {
        /// Speed that the cutting data ask for, 1/min.
        wanted_rpm: f64,
    },
    /// The spindle cannot turn as slowly: the edge is faster than asked for.
    SpindleTooFast {
        /// Speed that the cutting data ask for, 1/min.
        wanted_rpm: f64,
    },
    /// The axes are not as fast; chips get thinner.
    Feed {
        /// Feed that the cutting data ask for, mm/min.
        wanted_mm_per_min: f64,
    },
}

/// Why no speed and feed can be given.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum CuttingError {
    /// Nothing is known of the material.
    #[error("tool {tool} has no cutting data for {material}; give it a table [tools.cutting.{material}]")]
    NoData {
        /// Id of the tool.
        tool: String,
        /// Name of the material.
        material: String,
    },
    /// The feed follows from the number of edges, which is not known.
    #[error("tool {tool} has an advance for each edge, but no number of edges; give it `flutes`")]
    NoFlutes {
        /// Id of the tool.
        tool: String,
    },
    /// The depth, width or tilt is none.
    #[error("a depth of {0}, a width and a tilt must be positive and finite, the tilt below 90°")]
    Engagement(String),
}

/// Speed of the spindle for a speed of the edge on a diameter, 1/min.
#[must_use]
pub fn spindle_rpm(vc_m_per_min: f64, diameter_mm: f64) -> f64 {
    1000.0 * vc_m_per_min / (std::f64::consts::PI * diameter_mm)
}

/// Speed of the edge on a diameter, m/min.
#[must_use]
pub fn edge_speed_m_per_min(rpm: f64, diameter_mm: f64) -> f64 {
    rpm * std::f64::consts::PI * diameter_mm / 1000.0
}

/// Diameter on which the edge is fastest while a tool cuts `ap_mm` deep with its axis tilted against the normal, mm.
///
/// The corner's arc carries the highest point that cuts. Above the corner it is the whole diameter.
#[must_use]
pub fn effective_diameter_mm(tool: &Tool, ap_mm: f64, tilt_deg: f64) -> f64 {
    let (radius, corner) = (tool.radius_mm(), tool.corner_radius_mm());
    if corner <= 0.0 {
        return 2.0 * radius;
    }
    let reached = (1.0 - ap_mm / corner).clamp(-1.0, 1.0).acos() + tilt_deg.to_radians();
    2.0 * (radius - corner) + 2.0 * corner * reached.min(std::f64::consts::FRAC_PI_2).sin()
}

/// Angle over which an edge cuts at width `ae_mm` along a straight wall, degrees.
#[must_use]
pub fn engagement_deg(ae_mm: f64, diameter_mm: f64) -> f64 {
    (1.0 - 2.0 * ae_mm / diameter_mm).clamp(-1.0, 1.0).acos().to_degrees()
}

/// Thickest chip over the advance of an edge, at width `ae_mm` on a diameter: the sine of the engagement up to half the
/// diameter, 1 beyond.
#[must_use]
pub fn chip_ratio(ae_mm: f64, diameter_mm: f64) -> f64 {
    engagement_deg(ae_mm, diameter_mm).min(90.0).to_radians().sin()
}

impl Cutting {
    /// Speed and feed of a tool in this mode of cutting, on a machine.
    ///
    /// `fz_mm` of the cutting data is the advance that is programmed, as makers of tools state it. To keep chips as thick at
    /// a smaller width use [`Cutting::for_chip`] first.
    ///
    /// # Errors
    /// The number of edges is not known; depth, width or tilt make no sense.
    pub fn conditions(
        &self,
        tool: &LibraryTool,
        engagement: &Engagement,
        machine: Option<&MachineShape>,
    ) -> Result<Conditions, CuttingError> {
        let end_mm = tool.tool.corner_radius_mm().max(f64::MIN_POSITIVE);
        let ap_mm = engagement.ap_mm.or(self.ap_mm).unwrap_or(end_mm);
        let ae_mm = engagement.ae_mm.or(self.ae_mm).unwrap_or_else(|| tool.diameter_mm());
        let tilt_deg = engagement.tilt_deg;
        let positive = |v: f64| v.is_finite() && v > 0.0;
        if !(positive(ap_mm) && positive(ae_mm) && (0.0..90.0).contains(&tilt_deg)) {
            return Err(CuttingError::Engagement(format!("{ap_mm} mm")));
        }
        let diameter = effective_diameter_mm(&tool.tool, ap_mm, tilt_deg);
        let wanted_rpm = match self.speed {
            Speed::Edge { vc_m_per_min } => spindle_rpm(vc_m_per_min, diameter),
            Speed::Spindle { rpm } => rpm,
        };
        let mut bounded_by = Vec::new();
        let spindle = machine.map(|m| m.spindle).unwrap_or_default();
        let mut rpm = wanted_rpm;
        if let Some(most) = spindle.max_rpm.filter(|most| wanted_rpm > *most) {
            (rpm, _) = (most, bounded_by.push(MachineBound::SpindleTooSlow { wanted_rpm }));
        }
        if let Some(least) = spindle.min_rpm.filter(|least| wanted_rpm < *least) {
            (rpm, _) = (least, bounded_by.push(MachineBound::SpindleTooFast { wanted_rpm }));
        }
        let edges = tool.flutes.map(f64::from);
        let wanted_mm_per_min = match self.advance {
            Advance::PerEdge { fz_mm } => {
                rpm * fz_mm * edges.ok_or_else(|| CuttingError::NoFlutes { tool: tool.id.clone() })?
            }
            // A slower spindle would make chips thicker. A faster one makes them thinner, which is harmless.
            Advance::PerMinute { feed_mm_per_min } => feed_mm_per_min * (rpm / wanted_rpm).min(1.0),
        };
        let most = machine.and_then(|m| m.feed.max_mm_per_min).unwrap_or(f64::INFINITY);
        if wanted_mm_per_min > most {
            bounded_by.push(MachineBound::Feed { wanted_mm_per_min });
        }
        let feed_mm_per_min = wanted_mm_per_min.min(most);
        let fz_mm = edges.map(|edges| feed_mm_per_min / (rpm * edges));
        Ok(Conditions {
            rpm,
            feed_mm_per_min,
            effective_diameter_mm: diameter,
            vc_m_per_min: edge_speed_m_per_min(rpm, diameter),
            fz_mm,
            chip_mm: fz_mm.map(|fz| fz * chip_ratio(ae_mm, tool.diameter_mm())),
            bounded_by,
        })
    }

    /// The same with the advance of each edge raised, so that the thickest chip at width `ae_mm` is as thick as `fz_mm`. At
    /// most by `largest` times, since the thinnest cuts would ask for endless feeds.
    #[must_use]
    pub fn for_chip(mut self, ae_mm: f64, diameter_mm: f64, largest: f64) -> Self {
        if let Advance::PerEdge { fz_mm } = &mut self.advance {
            *fz_mm *= (1.0 / chip_ratio(ae_mm, diameter_mm)).min(largest.max(1.0));
        }
        self
    }
}

impl LibraryTool {
    /// Cutting data for a material, by its name or by one of the names that it goes under.
    ///
    /// # Errors
    /// There are none.
    pub fn cutting_for(&self, material: &crate::Material) -> Result<&Cutting, CuttingError> {
        let mut names = std::iter::once(&material.name).chain(&material.also);
        names
            .find_map(|name| self.cutting.get(name))
            .ok_or_else(|| CuttingError::NoData { tool: self.id.clone(), material: material.name.clone() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn approx(a: f64, b: f64) {
        approx::assert_relative_eq!(a, b, max_relative = 1e-9);
    }

    /// Values that were computed with 30 digits.
    #[test]
    fn a_ball_cuts_on_a_small_diameter_and_tilting_makes_it_larger() {
        let ball = Tool::ball(5.0);
        approx(effective_diameter_mm(&ball, 0.3, 0.0), 3.411_744_422);
        approx(effective_diameter_mm(&ball, 0.3, 15.0), 5.728_391_074);
        approx(effective_diameter_mm(&ball, 5.0, 0.0), 10.0);
        approx(effective_diameter_mm(&ball, 0.3, 80.0), 10.0);
        let bull: Tool = "bull:10:2".parse().unwrap();
        approx(effective_diameter_mm(&bull, 2.0, 0.0), 20.0);
        // The chord of the corner's circle at half its radius.
        approx(effective_diameter_mm(&bull, 1.0, 0.0), 16.0 + 4.0 * 0.75_f64.sqrt());
        approx(effective_diameter_mm(&"flat:4".parse().unwrap(), 0.1, 10.0), 8.0);
    }

    #[test]
    fn chips_get_thin_at_small_widths() {
        approx(chip_ratio(1.0, 10.0), 0.6);
        approx(chip_ratio(5.0, 10.0), 1.0);
        approx(chip_ratio(8.0, 10.0), 1.0);
        approx(engagement_deg(1.0, 10.0), 36.869_897_645_844_02);
        approx(engagement_deg(10.0, 10.0), 180.0);
        let data = Cutting::new(Speed::Edge { vc_m_per_min: 100.0 }, Advance::PerEdge { fz_mm: 0.06 });
        let Advance::PerEdge { fz_mm } = data.for_chip(1.0, 10.0, 3.0).advance else { panic!() };
        approx(fz_mm, 0.1);
    }

    fn machine(max_rpm: f64, max_mm_per_min: f64) -> MachineShape {
        let mut machine = MachineShape::shipped();
        (machine.spindle.max_rpm, machine.feed.max_mm_per_min) = (Some(max_rpm), Some(max_mm_per_min));
        machine
    }

    #[test]
    fn a_slow_spindle_slows_the_feed_and_keeps_the_chip() {
        let mut tool = LibraryTool::new("T1", "", Tool::ball(5.0));
        tool.flutes = Some(2);
        let data = Cutting::new(Speed::Edge { vc_m_per_min: 300.0 }, Advance::PerEdge { fz_mm: 0.1 });
        let mode = Engagement { ap_mm: Some(0.3), ae_mm: Some(1.0), tilt_deg: 0.0 };
        let free = data.conditions(&tool, &mode, None).unwrap();
        approx(free.rpm, 300_000.0 / (std::f64::consts::PI * 3.411_744_422));
        approx(free.feed_mm_per_min, free.rpm * 0.2);
        approx(free.vc_m_per_min, 300.0);
        approx(free.chip_mm.unwrap(), 0.06);
        let slow = data.conditions(&tool, &mode, Some(&machine(10_000.0, 1e5))).unwrap();
        assert_eq!((slow.rpm, slow.bounded_by.len()), (10_000.0, 1));
        approx(slow.feed_mm_per_min, 2000.0);
        approx(slow.fz_mm.unwrap(), 0.1);
        let crawling = data.conditions(&tool, &mode, Some(&machine(10_000.0, 1000.0))).unwrap();
        approx(crawling.fz_mm.unwrap(), 0.05);
        assert_eq!(crawling.bounded_by[1], MachineBound::Feed { wanted_mm_per_min: 2000.0 });
        tool.flutes = None;
        assert!(matches!(data.conditions(&tool, &mode, None), Err(CuttingError::NoFlutes { .. })));
        let feed =
            Cutting::new(Speed::Spindle { rpm: 8000.0 }, Advance::PerMinute { feed_mm_per_min: 6000.0 });
        let clay = feed.conditions(&tool, &mode, Some(&machine(4000.0, 1e5))).unwrap();
        assert_eq!((clay.rpm, clay.feed_mm_per_min, clay.fz_mm), (4000.0, 3000.0, None));
        let deep = Engagement { ap_mm: Some(-1.0), ..mode };
        assert!(matches!(feed.conditions(&tool, &deep, None), Err(CuttingError::Engagement(_))));
    }
}
