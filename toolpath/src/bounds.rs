//! Where the tool is kept: boxes, avoided faces, pass extension, and what of the tool stays inside
//! (containment), as `job.json` records them.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Where the tool is kept.
///
/// ```text
///                 ┌───────────────── box, or border of the faces that are cut
///      contact    │╭─╮      seen along the tool axis: what of the tool stays inside;
///        centre ╭─┼╮        along the axis it is the contact point of the box in any case
///          edge ╰╮│╯
///             ╭─╮│
/// ```
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Bounds {
    /// What of the tool stays inside.
    #[serde(default)]
    pub contain: Contain,
    /// Boxes in the model's coordinates, mm: xmin, ymin, zmin, xmax, ymax, zmax. The tool is inside of one of them; without
    /// any it may be anywhere.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub within_mm: Vec<[f64; 6]>,
    /// Box in the model's coordinates that the centre of the ball is in on passes, mm: outside it cuts nothing, as beside the
    /// block that a model is roughed from.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub centre_within_mm: Option<[f64; 6]>,
    /// Faces that are not cut and that no move but rapids comes near to, by index.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub avoid: Vec<usize>,
    /// How far the tool keeps away from these, mm.
    #[serde(default)]
    pub avoid_mm: f64,
    /// How far passes go on straight over open borders of what is cut, mm.
    #[serde(default)]
    pub extend_mm: f64,
}

/// What of the tool stays inside of a boundary, seen along its axis.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Contain {
    /// Where it touches the model. Borders of faces do not hold it back: it touches what is cut.
    #[default]
    Contact,
    /// The centre of its end: it is also over a face that is cut.
    Centre,
    /// The whole end: all of it is over faces that are cut.
    Edge,
}

impl Bounds {
    /// Where a box has no side, from 0, mm.
    pub const FAR_MM: f64 = 1e9;

    /// Whether the tool may go wherever it can.
    #[must_use]
    pub fn is_none(&self) -> bool {
        *self == Bounds::default()
    }

    /// Whether nothing but a box for its centre keeps the tool anywhere.
    #[must_use]
    pub fn is_centre_box_at_most(&self) -> bool {
        Bounds { centre_within_mm: None, ..self.clone() }.is_none()
    }
}
