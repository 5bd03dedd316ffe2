//! Which side of a face is cut.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The side of a face that is free of material, and cut. The parametrisation names it: `Su × Sv` is the cross product of the
/// surface's derivatives.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum FreeSide {
    /// The side that `Su × Sv` points to.
    Along,
    /// The other one.
    Against,
    /// Either: the face is a sheet without material.
    #[default]
    Both,
}

impl FreeSide {
    /// One side of a face.
    #[must_use]
    pub fn one(along: bool) -> Self {
        if along { FreeSide::Along } else { FreeSide::Against }
    }

    /// Whether a tool may be on the side of `Su × Sv`, or, if not `along`, on the other.
    #[must_use]
    pub fn allows(self, along: bool) -> bool {
        self == FreeSide::Both || self == FreeSide::one(along)
    }

    /// Whether either side may be cut.
    #[must_use]
    pub fn is_both(&self) -> bool {
        *self == FreeSide::Both
    }
}

/// Faces that hang together, and on which side of them the material is.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct SheetRecord {
    /// Its faces (index in file order), ascending.
    pub faces: Vec<usize>,
    /// The free side of each.
    pub free_sides: Vec<FreeSide>,
    /// Area, mm².
    pub area_mm2: f64,
    /// Length of its border without a neighbour of its own, mm.
    pub open_mm: f64,
    /// Length of joints at which its faces turn over, mm: it has no two sides then.
    pub turned_mm: f64,
    /// Shares of all directions in which one sees out of the model from the free side, and from the material's.
    pub sees_out: [f64; 2],
    /// Share of its area whose outside in the file is the free side.
    pub file_agrees: f64,
    /// Mean of the normals on the free side; short where they point all ways.
    pub mean_free_normal: [f64; 3],
    /// What decided: `asked` for, `closed`, `encloses`, `level`, `file`, `assumed` or `face_by_face`.
    pub evidence: String,
    /// Nothing speaks for the other side.
    pub clear: bool,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_allows_either_and_one_only_itself() {
        let allowed = |side: FreeSide| [side.allows(true), side.allows(false)];
        assert_eq!(allowed(FreeSide::Both), [true, true]);
        assert_eq!(allowed(FreeSide::Along), [true, false]);
        assert_eq!(allowed(FreeSide::Against), [false, true]);
        assert_eq!(serde_json::to_string(&FreeSide::Against).unwrap(), "\"against\"");
    }
}
