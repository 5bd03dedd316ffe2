//! Parts of a machine that both its posts and the choice of tools must know.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A rotary axis.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RotaryAxis {
    /// Travel, degrees.
    pub travel_deg: [f64; 2],
    /// Direction of the axis in machine coordinates: a positive angle turns what the axis carries to the right about it.
    pub direction: [f64; 3],
    /// A point of the axis in machine coordinates, mm.
    #[serde(default)]
    pub point_mm: [f64; 3],
    /// Whether it turns the table; else it turns the head.
    #[serde(default)]
    pub turns_table: bool,
    /// Fastest turn, degrees/min.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub max_deg_per_min: Option<f64>,
}

/// A tool changer.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Changer {
    /// Time of a change from cut to cut, s.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub change_s: Option<f64>,
    /// Places in the magazine; tools have the numbers from 1 to this.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub places: Option<u32>,
    /// Longest tool from tip to spindle nose, mm.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub longest_mm: Option<f64>,
    /// Thickest tool, mm.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub thickest_mm: Option<f64>,
}

/// No axis travels farther, mm or degrees, and none turns or runs faster, mm/min or degrees/min.
const FARTHEST: f64 = 1e7;
/// Longest tool change, s, and largest magazine.
const SLOWEST_CHANGE_S: f64 = 1e5;
const MOST_PLACES: u32 = 1_000_000;

impl RotaryAxis {
    /// Whether travel, direction, place and rate make sense.
    #[must_use]
    pub fn is_sensible(&self) -> bool {
        let [low, high] = self.travel_deg;
        let length: f64 = self.direction.iter().map(|v| v * v).sum();
        let near = |v: &f64| v.abs() <= FARTHEST;
        low < high
            && self.travel_deg.iter().chain(&self.point_mm).all(near)
            && length > 1e-12
            && length.is_finite()
            && self.max_deg_per_min.is_none_or(|v| v > 0.0 && v <= FARTHEST)
    }

    /// Whether a rotary axis may have a name: one small letter that names no linear axis.
    #[must_use]
    pub fn may_be_named(name: &str) -> bool {
        name.len() == 1 && name.chars().all(|c| c.is_ascii_lowercase() && !"xyz".contains(c))
    }
}

impl Changer {
    /// Whether its sizes and its time make sense.
    #[must_use]
    pub fn is_sensible(&self) -> bool {
        let within = |v: Option<f64>, most: f64| v.is_none_or(|v| v > 0.0 && v <= most);
        within(self.longest_mm, FARTHEST)
            && within(self.thickest_mm, FARTHEST)
            && within(self.change_s, SLOWEST_CHANGE_S)
            && self.places.is_none_or(|n| n > 0 && n <= MOST_PLACES)
    }
}
