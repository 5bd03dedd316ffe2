//! Roughing by levels: what is asked of an operation that clears one height after the other.
//!
//! ```text
//!   top ───────────────      Every level is cleared at an engagement that no pass exceeds. Over slopes thinner levels follow,
//!        step-down           so that no more than a band is left above the allowance.
//!   ──────╮
//!         ╰──╮ band
//!            ╰─────
//! ```

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// What is asked of an operation that roughs by levels.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Levels {
    /// Largest depth of a level, mm.
    pub step_down_mm: f64,
    /// Largest engagement: the angle about the tool along which it cuts, degrees. Entries by a helix are apart.
    pub engagement_deg: f64,
    /// Stairs over slopes are no higher than this, mm.
    pub band_mm: f64,
    /// Diameter about the tool's axis that does not cut, mm: 0 of a tool that may go straight down; `None` where it is not known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub dead_centre_mm: Option<f64>,
    /// Steepest way down into a pocket, degrees against the level; `None` for the usual one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ramp_deg: Option<f64>,
}

impl Levels {
    /// The engagement where nothing is known of the material, degrees.
    pub const USUAL_ENGAGEMENT_DEG: f64 = 60.0;
    /// The band as a share of the step-down.
    pub const USUAL_BAND: f64 = 0.1;
    /// The dead centre where nothing is known of it, as a share of the tool's diameter.
    pub const USUAL_DEAD_CENTRE: f64 = 0.25;

    /// The diameter about the axis that does not cut, of a tool of a diameter, mm.
    #[must_use]
    pub fn dead_centre_of_mm(&self, diameter_mm: f64) -> f64 {
        self.dead_centre_mm.unwrap_or(Self::USUAL_DEAD_CENTRE * diameter_mm)
    }
}
