//! The records of `verify.json`, except for findings and verdict: what each field measures, with
//! its unit.

use std::collections::BTreeMap;

use claymill_toolpath::{Judged, OperationKind};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::stock::StockReport;
use crate::{HolderClearance, LevelsFound, ShankContact, Verdict};

/// `verify.json`: what was measured on the written moves and the model, and what follows from it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Verification {
    /// Version of the job folder's format.
    pub format_version: u32,
    /// The very files that it was measured on; of other files nothing is said.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub judged: Option<Judged>,
    /// Scallop height that the job asked for, mm.
    pub scallop_mm: f64,
    /// What the job was to leave on the surface, mm. All measurements are then of the ball that is larger by this much and
    /// touches the surface.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub allowance_mm: f64,
    /// Gouges on every kind of move except rapids.
    pub gouge: Gouge,
    /// How the ball rests on the faces along the passes.
    pub contact: Contact,
    /// Whether the moves follow each other as the job says; `None` of a program, which is held against the job's moves.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sequence: Option<Sequence>,
    /// Rapids.
    pub rapids: Rapids,
    /// Distance from obstacles, where there are any.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub obstacles: Option<Obstacles>,
    /// Whether the tool keeps within its bounds, where it has any.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub bounds: Option<BoundsKept>,
    /// Whether the shank touches the model.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub shank: Option<ShankContact>,
    /// How far holders keep away and how far tools have to stick out, where a tool has a holder.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub holder: Option<HolderClearance>,
    /// Scallop height.
    pub scallop: Scallop,
    /// What is cut and what is not, and why.
    pub coverage: Coverage,
    /// Whether the tool keeps out of the material, where the job says on which side of faces that is.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sides: Option<SidesKept>,
    /// What the program does to its stock, where the job says what that is.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stock: Option<StockReport>,
    /// What was found of each operation, in a job that has operations. All of the above is then of the one that finishes the
    /// surface.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub operations: Vec<OperationFound>,
    /// The conclusion.
    pub verdict: Verdict,
}

/// What was found of one operation.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct OperationFound {
    /// Its name in the job.
    pub name: String,
    /// What it is for.
    pub kind: OperationKind,
    /// What was found, as of a job by itself.
    pub found: Verification,
    /// What was found of levels, where it roughs by these.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub levels: Option<LevelsFound>,
}

/// Cuts from the side of the material.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct SidesKept {
    /// Area of the faces of which the job says on which side the material is, mm².
    pub one_sided_mm2: f64,
    /// Area that is cut from the side of the material, with nothing between it and the ball, mm².
    pub wrong_mm2: f64,
    /// Length of moves along which the ball is nearest to the inside of a face, on the side of its material, mm.
    pub wrong_length_mm: f64,
    /// Where: on such a face.
    pub wrong_at: Option<Place>,
    /// Area that is cut with the ball inside of a body, whatever the job says: every line from there leads out through an odd
    /// number of faces; mm². Not looked for where the material's side was asked for.
    pub inside_mm2: f64,
    /// Where.
    pub inside_at: Option<Place>,
}

/// Whether the moves, one after the other, are what the job says.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Sequence {
    /// Moves.
    pub moves: u64,
    /// Moves that begin elsewhere than where the one before ended.
    pub jump: Fault,
    /// The farthest of them, mm; below the written step where there is none.
    pub largest_jump_mm: f64,
    /// Moves out of their order: of a kind that does not follow the one before, of a setup that was left, or with a number that
    /// is not their place.
    pub order: Fault,
    /// Moves whose feed is not the one that the job has for their kind.
    pub feed: Fault,
    /// Setups that do not begin or do not end with a rapid above everything.
    pub retract: Fault,
    /// Totals of the job, number and lengths, that the moves do not come to.
    pub totals: Fault,
}

/// How often something is wrong, and the first time.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Fault {
    /// How often.
    pub count: u64,
    /// What is wrong the first time.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub first: Option<String>,
    /// Where, if at one place.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub first_at: Option<Place>,
}

/// How near the ball comes to obstacles on any move, rapids too.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Obstacles {
    /// The mesh files.
    pub files: Vec<String>,
    /// Triangles in them.
    pub triangles: u64,
    /// Places where the distance was measured.
    pub samples: u64,
    /// Smallest distance of the ball from an obstacle, negative where it enters, mm; `None` when it never comes near.
    pub clearance_min_mm: Option<f64>,
    /// Where, on the obstacle.
    pub clearance_min_at: Option<Place>,
    /// Moves that enter deeper than the bar for gouges.
    pub touching: u64,
    /// Distance that the ball has to keep, mm.
    #[serde(default)]
    pub asked_mm: f64,
    /// Moves that come nearer than that by more than 0.02 mm, those that touch among them.
    #[serde(default)]
    pub near: u64,
}

/// How far the tool goes beyond its bounds on any move but rapids.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct BoundsKept {
    /// Places where it was measured.
    pub samples: u64,
    /// How far contact, centre or edge of the ball, as the job asks, goes beyond the boxes at most, or beyond the border of what
    /// is cut where that is more than 0.4 mm; 0 when never.
    pub beyond_max_mm: f64,
    /// Where: the contact, or else the ball's centre.
    pub beyond_at: Option<Place>,
    /// Moves that go beyond a box by more than 0.02 mm, or beyond the border.
    pub beyond: u64,
    /// Distance that the ball was to keep from the faces to be avoided, mm; `None` when there are none.
    pub avoid_mm: Option<f64>,
    /// Its smallest distance from them, negative where it enters, mm; `None` when it never comes near.
    pub avoided_min_mm: Option<f64>,
    /// Where, on the face.
    pub avoided_min_at: Option<Place>,
    /// Moves that come nearer than they were to by more than 0.02 mm.
    pub too_near: u64,
}

/// A place on the model or on a path.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Place {
    /// The point, mm.
    pub point_mm: [f64; 3],
    /// The move (`seq`), if it is on a path.
    pub move_seq: Option<u64>,
    /// Curve parameter on that move.
    pub parameter: Option<f64>,
    /// The face (index in file order), if one is concerned.
    pub face: Option<usize>,
    /// The face's entity in the file, `DE 17` or `#4711`.
    pub entity: Option<String>,
}

/// Gouges: how far the ball enters any face, measured along the paths by closest point.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Gouge {
    /// Places that were measured.
    pub samples: u64,
    /// Deepest entry of the ball, mm; 0 when it never enters.
    pub deepest_mm: f64,
    /// Where that is.
    pub deepest_at: Option<Place>,
    /// Places deeper than 1 µm.
    pub deeper_than_1_um: u64,
    /// Places deeper than 2 µm.
    pub deeper_than_2_um: u64,
    /// Places deeper than 5 µm.
    pub deeper_than_5_um: u64,
}

/// Distance of the ball from the faces along the passes: the ball centre's distance minus the radius, where
/// the nearest point lies inside a face. Shares are of the length of all passes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Contact {
    /// Places that were measured.
    pub samples: u64,
    /// Largest distance of the ball from the face it rests on, mm.
    pub excess_max_mm: f64,
    /// Where that is.
    pub excess_max_at: Option<Place>,
    /// The same where the ball rolls over the edge of a face: its largest distance from that.
    #[serde(default)]
    pub edge_excess_max_mm: f64,
    /// Where that is.
    #[serde(default)]
    pub edge_excess_max_at: Option<Place>,
    /// 99th percentile of the distance, mm.
    pub excess_p99_mm: f64,
    /// Mean of the distance, mm.
    pub excess_mean_mm: f64,
    /// Share of the contact on faces within the bar on either side; 1 only where no place is beyond one.
    pub within_limit_share: f64,
    /// Places beyond a bar.
    #[serde(default)]
    pub outside: u64,
    /// The bars: how far the ball may enter its face, and how far off it may run, mm.
    #[serde(default = "usual_limits_mm")]
    pub limits_mm: [f64; 2],
    /// Share of the length where the ball rolls over the edge of a face.
    pub on_edge_share: f64,
    /// Share of the length where no face is within the sampling distance of the ball.
    pub in_air_share: f64,
}

fn usual_limits_mm() -> [f64; 2] {
    let usual = crate::VerifyOptions::default();
    [usual.gouge_limit_mm, usual.excess_limit_mm]
}

impl Contact {
    /// How much of the contact is within which bars, in words: `99.998 % within ±5.0 µm`. All of it only where all of it is.
    #[must_use]
    pub fn within_limits(&self) -> String {
        let [below, above] = self.limits_mm.map(|mm| mm * 1e3);
        let bars = if below == above {
            format!("±{above:.1} µm")
        } else {
            format!("−{below:.1} and +{above:.1} µm")
        };
        let share = 100.0 * self.within_limit_share;
        // Three digits, rounded down.
        let share = if self.outside > 0 { ((share * 1e3).floor() / 1e3).min(99.999) } else { share };
        format!("{share:.3} % within {bars}")
    }
}

/// Clearance of rapids: how far ball and shank could be lowered along the tool axis before they touch.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Rapids {
    /// Rapid moves.
    pub moves: u64,
    /// Smallest clearance, mm; null when no rapid passes over the model.
    pub clearance_min_mm: Option<f64>,
    /// Where that is.
    pub clearance_min_at: Option<Place>,
    /// Rapid moves that touch or enter the model.
    pub touching: u64,
}

/// Scallop height, measured twice.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Scallop {
    /// On the crests between neighbouring passes. The authority for height: maximum, percentile and mean
    /// are those of the crests themselves.
    pub crests: Crests,
    /// On points spread over the cut area. The authority for shares of area; its maximum misses the crests.
    pub surface: SurfaceResidual,
}

/// Heights of scallop crests above the exact surface, weighted by length.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Crests {
    /// Crests that were measured.
    pub samples: u64,
    /// Highest crest where the ball could have cut lower, mm.
    pub max_mm: f64,
    /// Where that is.
    pub max_at: Option<Place>,
    /// 99th percentile, mm.
    pub p99_mm: f64,
    /// 95th percentile, mm.
    #[serde(default)]
    pub p95_mm: f64,
    /// Mean, mm.
    pub mean_mm: f64,
    /// Share that lies between 0.90 and 1.05 of the height asked for: how evenly the passes are spread.
    #[serde(default)]
    pub even_share: f64,
    /// Share that stands inside of regions: between four passes of one region and setup, two on either side. Elsewhere what
    /// lies next is another region's, another setup's, or nobody's, and evenness is not the passes' to choose.
    #[serde(default)]
    pub inside_share: f64,
    /// Share of those that lies between 0.90 and 1.05 of the height asked for.
    #[serde(default)]
    pub even_inside_share: f64,
    /// How the heights are spread: shares of the length with heights in bins of [`HISTOGRAM_BIN`] of the height
    /// asked for, from 0; the last bin holds all that is higher.
    #[serde(default)]
    pub histogram: Vec<f64>,
    /// Crests left out because the ball cannot reach the surface under them.
    pub out_of_reach: u64,
    /// The same by region.
    #[serde(default)]
    pub by_region: Vec<RegionCrests>,
}

/// Width of the bins of [`Crests::histogram`], as a share of the height asked for.
pub const HISTOGRAM_BIN: f64 = 0.05;
/// Number of bins of [`Crests::histogram`].
pub const HISTOGRAM_BINS: usize = 40;

/// Heights of crests beside the passes of one region.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct RegionCrests {
    /// Region id.
    pub region: usize,
    /// Highest crest, mm.
    pub max_mm: f64,
    /// 99th percentile, mm.
    pub p99_mm: f64,
    /// 95th percentile, mm.
    pub p95_mm: f64,
    /// Mean, mm.
    pub mean_mm: f64,
}

/// Material left along the surface normal, weighted by area, on the area that counts as cut.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct SurfaceResidual {
    /// Points that were measured, cut or not.
    pub samples: u64,
    /// 99th percentile, mm.
    pub p99_mm: f64,
    /// Mean, mm.
    pub mean_mm: f64,
    /// Share of the cut area with more than the bar for scallops.
    pub above_limit_share: f64,
}

/// What became of a piece of surface.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum SurfaceState {
    /// Cut down to the scallop.
    Cut,
    /// Left out on request.
    Excluded,
    /// No setup's axis sees it.
    Hidden,
    /// Seen, but the ball or shank does not fit there.
    TooTight,
    /// The tool fits there, and its holder would come too near to the model or into stock: one that sticks out farther gets there.
    HolderInTheWay,
    /// The ball could cut it and did not: a defect of the plan.
    ReachableLeft,
    /// The earlier tool, whose rest this job cuts, fits there.
    EarlierTool,
    /// The tool is kept away from there, as asked.
    OutOfBounds,
    /// The verifier could not put samples on the face.
    NotMeasured,
}

/// Where the model's area went, by the verifier's own judgement. The states' areas sum to the total.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Coverage {
    /// All faces, mm².
    pub total_mm2: f64,
    /// Area by state, mm².
    pub by_state_mm2: BTreeMap<SurfaceState, f64>,
    /// Largest patches of reachable area that was left, by face, largest first.
    pub reachable_left_at: Vec<AreaAt>,
    /// The same, face by face.
    pub faces: Vec<FaceCoverage>,
    /// What is known of where it is too tight for the tool, if it is anywhere.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub too_tight: Option<TooTight>,
    /// The least length of passes that leaves the scallop height on what is cut, mm (see [`FaceCoverage`]).
    #[serde(default)]
    pub least_length_mm: f64,
    /// The planner's account in `job.json` minus this one, mm², by state; `cut` includes what the
    /// planner counts as cut.
    pub planner_difference_mm2: BTreeMap<SurfaceState, f64>,
}

/// Where the surface is seen, and the ball does not fit: what remains there for a smaller one.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct TooTight {
    /// Area, mm².
    pub area_mm2: f64,
    /// Width of the strips that the ball bridges, half of the area in narrower ones, mm.
    pub width_median_mm: f64,
    /// The same for 95 % of the area, mm.
    pub width_p95_mm: f64,
    /// The widest, mm.
    pub width_max_mm: f64,
    /// Where that is.
    pub width_max_at: Option<Place>,
    /// Smaller balls, and the share of the area where they fit.
    pub balls: Vec<BallShare>,
}

/// A ball, and where it fits.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct BallShare {
    /// Its radius, mm.
    pub radius_mm: f64,
    /// Share of the area where it touches without entering another face.
    pub share: f64,
}

/// Some area with one point of it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct AreaAt {
    /// The area, mm².
    pub area_mm2: f64,
    /// A point in it.
    pub at: Place,
}

/// What became of one face.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct FaceCoverage {
    /// Index in file order.
    pub face: usize,
    /// Area, mm².
    pub area_mm2: f64,
    /// Area by state, mm²; states without area are left out.
    pub by_state_mm2: BTreeMap<SurfaceState, f64>,
    /// What is cut of it, divided at each place by how far apart passes of the direction that they have there may be,
    /// mm: the least length of passes that leaves the scallop height.
    #[serde(default)]
    pub least_length_mm: f64,
}

/// A place on a scallop crest: what a scallop map is coloured by.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CrestSample {
    /// The surface under the crest, mm.
    pub foot: claymill_nurbs::Point3,
    /// Height over it, mm.
    pub height_mm: f64,
}

/// A place where the ball enters a face.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GougeSample {
    /// The nearest point of the face, mm.
    pub foot: claymill_nurbs::Point3,
    /// How deep, mm.
    pub depth_mm: f64,
    /// The move (`seq`).
    pub move_seq: u64,
}

/// The material left on one point of the surface: what a residual map is coloured by.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ResidualSample {
    /// The point, mm.
    pub point: claymill_nurbs::Point3,
    /// Unit normal on the side that was cut, or `Su × Sv` where nothing was.
    pub normal: claymill_nurbs::Vector3,
    /// The face.
    pub face: claymill_nurbs::FaceId,
    /// Area that the sample stands for, mm².
    pub area_mm2: f64,
    /// Height of the material left along the normal, mm; `None` when it is beyond measure.
    pub residual_mm: Option<f64>,
    /// How far apart passes may be that run as the one beside it does, by curvature and scallop height, mm.
    pub step_over_mm: Option<f64>,
    /// What became of the surface there.
    pub state: SurfaceState,
    /// A ball cuts it from the side of the material.
    pub cut_from_material: bool,
    /// The ball that cuts it is inside of a body.
    pub cut_from_inside: bool,
}

#[allow(clippy::trivially_copy_pass_by_ref, reason = "serde hands over a reference")]
fn is_zero(mm: &f64) -> bool {
    *mm == 0.0
}
