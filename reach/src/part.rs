//! What is to be reached, and with what.

use claymill_contact::{Covering, FreeSides, OpenStretch};
use claymill_nurbs::Model;
use claymill_toolpath::{FreeSide, Holder, Tool};

use crate::error::{ReachError, check};

/// A model whose faces are to be reached.
#[derive(Debug, Clone, Copy)]
pub struct Part<'a> {
    /// The faces. All of them stand in the way.
    pub model: &'a Model,
    /// Area of each face, mm².
    pub face_area_mm2: &'a [f64],
    /// On which sides the faces may be cut; either side of those beyond the end.
    pub free_sides: &'a [FreeSide],
    /// Borders that no other face shares: over them a tool may get behind a sheet.
    pub open: &'a [OpenStretch],
    /// Faces that only stand in the way.
    pub excluded: &'a [bool],
}

impl<'a> Part<'a> {
    /// The sides that may be cut.
    #[must_use]
    pub fn free(&self) -> FreeSides<'a> {
        FreeSides::new(self.free_sides)
    }

    /// Covers the faces for tools of a radius.
    ///
    /// # Errors
    /// A face cannot be covered.
    pub fn covering(&self, radius_mm: f64) -> Result<Covering, ReachError> {
        // Nothing is probed triangle by triangle, so they may be as large as the surface allows.
        let coarse = vec![true; self.model.faces.len()];
        let area_mm2 = self.face_area_mm2.iter().sum();
        Covering::new(self.model, &coarse, area_mm2, radius_mm).map_err(|(face, source)| {
            let entity = self.model.faces[face].source.entity.clone();
            ReachError::Face { face, entity, source }
        })
    }
}

/// With what, and when a place counts as reached.
#[derive(Debug, Clone, PartialEq)]
pub struct Reacher {
    /// The tool, with taper and shank.
    pub tool: Tool,
    /// What holds it.
    pub holder: Option<Holder>,
    /// The surface leans no further from the tool's axis, degrees.
    pub steepest_deg: f64,
    /// Faces that lean further, up to upright ones, are reached by the side of the tool.
    pub walls: bool,
    /// So much may hold the tool up, along the normal, mm: what the scallop height hides.
    pub allowed_mm: f64,
}

/// A surface that leans further is not cut by a ball that comes down on it.
pub const USUAL_STEEPEST_DEG: f64 = 80.0;
/// Less than any scallop height hides this, mm.
const USUAL_ALLOWED_MM: f64 = 0.01;

impl Reacher {
    /// A tool without a holder, as the planner cuts with it.
    #[must_use]
    pub fn of(tool: Tool) -> Self {
        let (steepest_deg, allowed_mm) = (USUAL_STEEPEST_DEG, USUAL_ALLOWED_MM);
        Reacher { tool, holder: None, steepest_deg, walls: true, allowed_mm }
    }

    pub(crate) fn check(&self) -> Result<(), ReachError> {
        check("the largest angle between normal and tool", self.steepest_deg, 0.0, 90.0)?;
        check("what may hold the tool up, in mm,", self.allowed_mm, 0.0, self.tool.radius_mm())
    }
}
