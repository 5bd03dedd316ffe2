//! What all parts of a setup share: the model as one setup sees it, and what is asked for.

use claymill_contact::{BallDrop, Covering};
use claymill_nurbs::{FaceId, Model, Point2};
use claymill_toolpath::LinkStyle;

use crate::containment::Containment;
use crate::follow::profile::{SHORTEST_BESIDE_MM, SHORTEST_PASS_MM, SHORTEST_PASS_RADII};
use crate::pattern::step_over::{come_by_mm, flat_mm};
use crate::plan::options::Feeds;
use crate::setup::assignment::Assignment;
use crate::setup::claims::Claims;
use crate::setup::heights::Heights;
use crate::setup::slopes::Slopes;
use crate::setup::wall_claims::Walls;
use crate::{FitTolerance, Frame, RowsAlong, Strategy};

/// What a turn between two passes costs, as path length, when a direction is chosen.
pub(crate) const TURN_MM: f64 = 60.0;

/// A crest higher than this share of the scallop height is worth a further row. Written passes lie up to
/// [`FitTolerance::fit_mm`] higher than they are laid, which a hundredth of all crests make use of: in a large part those are
/// not the ones that are high already, in a small one a single place counts for a hundredth.
const TOO_HIGH: f64 = 1.08;
const TOO_HIGH_IN_SMALL: f64 = 1.03;
/// A part is small up to this area, in flat step-overs squared.
const SMALL_STEPS2: f64 = 2500.0;
/// Rounds of laying rows between rows: each halves their distance.
pub(crate) const ROUNDS: usize = 6;

/// What all parts of a setup share.
pub(crate) struct SetupContext<'a> {
    pub(crate) model: &'a Model,
    pub(crate) covering: &'a Covering,
    pub(crate) frame: Frame,
    pub(crate) index: usize,
    pub(crate) assignments: &'a [Vec<Assignment>],
    pub(crate) claims: &'a Claims,
    pub(crate) walls: &'a Walls<'a>,
    /// Where the claims are walls, the side of each face that is cut: 1 for that of `Su × Sv`, −1 for the other.
    pub(crate) beside_walls: Option<&'a [f64]>,
    pub(crate) ball: &'a BallDrop<'a>,
    /// The tool whose rest is cut.
    pub(crate) earlier: Option<&'a BallDrop<'a>>,
    /// A ball that is larger by the stock that may stand above what the job leaves, and by how much, mm: rapids keep out of it.
    pub(crate) stock: Option<(&'a BallDrop<'a>, f64)>,
    pub(crate) heights: &'a Heights,
    /// What keeps the tool in its bounds, if it may not be anywhere.
    pub(crate) containment: Option<&'a Containment<'a>>,
    /// What leans further is not cut from above (`n·axis`).
    pub(crate) least_facing: f64,
    /// Distance that it keeps from obstacles, where there are any, mm.
    pub(crate) obstacle_mm: f64,
    /// Distance that rapids keep along the tool axis, mm.
    pub(crate) clearance_mm: f64,
    /// Faces that are not cut.
    pub(crate) excluded: &'a [bool],
    /// How far passes run out over open borders, mm.
    pub(crate) extend_mm: f64,
    pub(crate) strategy: Strategy,
    /// Which slopes of what the setup cuts the passes are for.
    pub(crate) slopes: Slopes,
    /// Slope above which there are waterlines instead of rows (steep-shallow), degrees.
    pub(crate) steep_deg: f64,
    /// How many parameter lines a patch has; as many as it takes by itself.
    pub(crate) lines: Option<usize>,
    /// Whether passes along the valleys come last.
    pub(crate) pencil: bool,
    /// Direction of straight rows; chosen by region when not asked for.
    pub(crate) rows_along: Option<RowsAlong>,
    pub(crate) scallop_mm: f64,
    pub(crate) tolerance: FitTolerance,
    pub(crate) link: LinkStyle,
    pub(crate) feeds: Feeds,
}

impl SetupContext<'_> {
    /// The step-over on a plane, mm.
    pub(crate) fn flat_step_mm(&self) -> f64 {
        flat_mm(self.ball.radius_mm(), self.scallop_mm)
    }

    /// Passes that cut a place run past within two of these, mm.
    pub(crate) fn come_by_mm(&self) -> f64 {
        come_by_mm(&self.ball.end(), self.scallop_mm)
    }

    /// Passes are at least this long, mm.
    pub(crate) fn shortest_pass_mm(&self) -> f64 {
        match self.beside_walls {
            Some(_) => SHORTEST_BESIDE_MM,
            None => SHORTEST_PASS_MM.min(SHORTEST_PASS_RADII * self.ball.radius_mm()),
        }
    }

    /// A crest higher than this is worth a further row in a part of `area_mm2`, mm.
    pub(crate) fn too_high_mm(&self, area_mm2: f64) -> f64 {
        let is_small = area_mm2 < SMALL_STEPS2 * self.flat_step_mm().powi(2);
        self.scallop_mm * if is_small { TOO_HIGH_IN_SMALL } else { TOO_HIGH }
    }

    /// Whether the setup cuts the face at these parameters with these passes.
    pub(crate) fn claims_at(&self, face: FaceId, u: f64, v: f64) -> bool {
        self.claims.holds(face, Point2::new(u, v))
            && (self.slopes == Slopes::All || self.slopes.hold(&self.ball.surface(face).jet(u, v)))
            && self.containment.is_none_or(|containment| self.may_touch(containment, face, u, v))
    }
}
