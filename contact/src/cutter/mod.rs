//! Any end of a tool: where it comes to rest when it is dropped along the tool axis on all faces.
//!
//! Ball, flat and bull-nosed end, a taper and a shank are all one kind of convex [`Body`](body::Body), a disc swollen
//! by a ball with a cone above. Dropped on a triangle it has a closed form but for one angle; swollen by the proven
//! distance of a surface from its triangles it stops no lower than on the surface. So every piece of the model has a
//! height that it cannot hold the tool above, every point of it one that it does, and cutting the pieces that matter,
//! the highest first, brings both together ([`search`]).

mod body;
pub(crate) mod end;
#[cfg(test)]
mod kept_off_tests;
mod offset;
mod rest;
mod rim;
mod search;
#[cfg(test)]
mod tests;

use claymill_nurbs::{FaceId, Model, Point3, Vector3};
use claymill_toolpath::Tool;

pub(crate) use body::Body;
pub use end::EndShape;
pub(crate) use search::{Effort, held_above};

use crate::Frame;
use crate::{BallDrop, Covering};

/// Locations are proven to be no higher than this above where the tool touches, mm, unless they say otherwise.
pub const CUTTER_EPSILON_MM: f64 = 1e-5;

/// The whole model as seen from one setup, ready for dropping any end of a tool on it.
#[derive(Debug)]
pub struct CutterDrop<'a> {
    sheets: BallDrop<'a>,
    bodies: Vec<Body>,
}

/// Where the end of a tool comes to rest, in the setup's frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CutterLocation {
    /// The tool's tip, the lowest point on its axis: nothing of the model enters the tool there.
    pub tip: Point3,
    /// It is proven to be higher than it would have to be by no more than this, mm: [`CUTTER_EPSILON_MM`], but more where
    /// the search was ended early, beside walls above all.
    pub gap_mm: f64,
    /// What is touched, within the gap.
    pub contact: Point3,
    /// Unit vector from there into the tool.
    pub normal: Vector3,
    /// The face that is touched.
    pub face: FaceId,
    /// Which part of the tool touches: the end, or what stands above it.
    pub part: ToolPart,
}

/// Part of a tool.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ToolPart {
    /// Ball, or disc with its corner.
    End,
    /// The taper or the shank above it.
    Side,
}

impl<'a> CutterDrop<'a> {
    /// Looks at a covered model from a setup.
    #[must_use]
    pub fn new(model: &Model, covering: &'a Covering, frame: &Frame, tool: &Tool) -> Self {
        let sheets = BallDrop::new(model, covering, frame, tool.radius_mm());
        CutterDrop { sheets, bodies: [Body::end(tool)].into_iter().chain(Body::sides(tool)).collect() }
    }

    /// Drops the tool at `(x, y)` on everything (setup coordinates, mm). `None` where nothing is below.
    #[must_use]
    pub fn drop(&self, x: f64, y: f64) -> Option<CutterLocation> {
        let held = held_above(&self.sheets, &self.bodies, [x, y], f64::NEG_INFINITY, Effort::FULL)?;
        Some(CutterLocation {
            tip: Point3::new(x, y, held.tip),
            gap_mm: held.gap_mm,
            contact: held.contact,
            normal: held.normal,
            face: held.face,
            part: held.part(),
        })
    }
}
