//! Why no plan could be made.

use std::fmt;

use claymill_contact::FrameError;
use claymill_nurbs::{FaceId, Model, NurbsError, Point3};
use claymill_surface_merge::FieldError;
use claymill_toolpath::{Cancelled, Tool};
use thiserror::Error;

use crate::Strategy;

/// A place chooses a side of a region this far from it at most, mm.
pub(crate) const FARTHEST_GUIDE_MM: f64 = 50.0;

/// Why no plan could be made.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum PlanError {
    /// The setups have no directions.
    #[error(transparent)]
    Orientation(#[from] FrameError),
    /// There are too many setups, or two of one name.
    #[error("the setups of a job are at most {most}, each with a name of its own")]
    Setups {
        /// How many there may be.
        most: usize,
    },
    /// The scallop height does not suit the tool.
    #[error(
        "scallop height {scallop_mm} mm must be positive and smaller than the ball radius {radius_mm} mm"
    )]
    Scallop {
        /// Scallop height asked for.
        scallop_mm: f64,
        /// Ball radius.
        radius_mm: f64,
    },
    /// The allowance does not suit a tool.
    #[error(
        "an allowance of {allowance_mm} mm leaves nothing of the tool {tool}: it may be below 0 by less than the radius"
    )]
    Allowance {
        /// The tool.
        tool: Tool,
        /// As asked for.
        allowance_mm: f64,
    },
    /// Rest passes are for a smaller tool.
    #[error("a ball of radius {radius_mm} mm leaves no rest for one of {earlier_mm} mm that went before")]
    EarlierTool {
        /// Ball radius.
        radius_mm: f64,
        /// Radius of the earlier one.
        earlier_mm: f64,
    },
    /// The earlier tool has no ball.
    #[error("rest passes are laid behind ball ends only: not behind {tool}")]
    NoBall {
        /// The tool.
        tool: Tool,
    },
    /// Rest by thickness, and nobody knows how thick the stock is.
    #[error("what has more than {above_mm} mm of stock is to be cut, and the stock is not known")]
    NoStock {
        /// As asked for.
        above_mm: f64,
    },
    /// The end is not one that this is done with.
    #[error("{what} for ball ends only: {tool} cannot be planned with that way")]
    EndNotFor {
        /// The tool.
        tool: Tool,
        /// What there is for balls only, as the beginning of a sentence.
        what: EndRefusal,
    },
    /// The tool does not fit the model.
    #[error("a ball of radius {radius_mm} mm is too big for a model of {size_mm:.1} mm")]
    ToolTooBig {
        /// Ball radius.
        radius_mm: f64,
        /// The model's longest side.
        size_mm: f64,
    },
    /// A face cannot be covered with triangles.
    #[error("face {face} ({entity}): {source}")]
    Face {
        /// Index of the face.
        face: FaceId,
        /// Where it came from.
        entity: String,
        /// What is wrong.
        source: NurbsError,
    },
    /// No region's side can be meant by a place.
    #[error("no region that is cut has a border within {FARTHEST_GUIDE_MM} mm of {}, {}, {}{}", at.x, at.y, at.z, nearest(*nearest_mm))]
    NoSide {
        /// The place.
        at: Point3,
        /// Distance of the nearest border, mm, if there is one.
        nearest_mm: Option<f64>,
    },
    /// Places that do not choose sides of a region.
    #[error("the sides chosen for region {region}: {source}")]
    Sides {
        /// The region.
        region: usize,
        /// What is wrong.
        source: FieldError,
    },
    /// More places than a region can be swept between.
    #[error("three places or more choose sides of region {region}: it is swept from one to another")]
    TooManySides {
        /// The region.
        region: usize,
    },
    /// There is nothing to cut.
    #[error("no setup reaches any face that is to be cut")]
    NothingToCut,
    /// Parts are to be laid for others, and are kept nowhere.
    #[error("parts of a plan are laid into a store, and there is none")]
    KeptNowhere,
    /// There is no rest.
    #[error("earlier operations left nothing that this tool reaches")]
    NoRest,
    /// The work was to end without a result.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

impl PlanError {
    /// A face that cannot be covered or evaluated.
    pub(crate) fn of_face(model: &Model, (face, source): (FaceId, NurbsError)) -> Self {
        PlanError::Face { face, entity: model.faces[face].source.entity.clone(), source }
    }
}

/// What there is for ball ends only.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum EndRefusal {
    /// Other strategies than parallel rows.
    Strategy(Strategy),
    /// Passes along valleys.
    Pencil,
    /// Passes over what an earlier tool left.
    Rest,
    /// Material that is left on the surface.
    Allowance,
    /// Stock above what the job leaves.
    Stock,
    /// Bounds, faces to be avoided, and run-outs.
    Bounds,
    /// Obstacles.
    Obstacles,
}

impl fmt::Display for EndRefusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            EndRefusal::Strategy(strategy) => write!(f, "passes of the strategy {strategy} are laid"),
            EndRefusal::Pencil => f.write_str("pencil passes are laid"),
            EndRefusal::Rest => f.write_str("rest passes are laid"),
            EndRefusal::Allowance => f.write_str("an allowance is left"),
            EndRefusal::Stock => f.write_str("rapids over stock are planned"),
            EndRefusal::Bounds => f.write_str("bounds are kept"),
            EndRefusal::Obstacles => f.write_str("obstacles are kept clear of"),
        }
    }
}

fn nearest(mm: Option<f64>) -> String {
    mm.map_or_else(String::new, |mm| format!(": the nearest is {mm:.1} mm away"))
}
