//! The records of `regions.json`: regions, joints with their verdicts, gaps, laps and copies.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::SheetRecord;

/// `regions.json`.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct RegionsFile {
    /// Version of the job folder's format.
    pub format_version: u32,
    /// The merge preset.
    pub preset: String,
    /// Distance within which edges counted as neighbours, mm.
    pub tolerance_mm: f64,
    /// Regions, largest first.
    pub regions: Vec<RegionRecord>,
    /// Every joint between faces.
    pub joints: Vec<JointRecord>,
    /// Length of all face boundaries, mm.
    pub boundary_total_mm: f64,
    /// Length matched with one other face, mm.
    pub boundary_matched_mm: f64,
    /// Length lying on the inside of another face, mm; the boundaries of copies count here.
    #[serde(default)]
    pub boundary_lapped_mm: f64,
    /// Length with no neighbour, mm.
    pub boundary_naked_mm: f64,
    /// Length where more than two faces meet, mm.
    pub boundary_non_manifold_mm: f64,
    /// Stretches of boundary that lie on the inside of another face.
    #[serde(default)]
    pub laps: Vec<LapRecord>,
    /// Gaps too wide to be joints: parts of the naked boundary that have a neighbour after all.
    #[serde(default)]
    pub gaps: Vec<WideGapRecord>,
    /// Faces that are there twice: the one that counts, and its copy.
    #[serde(default)]
    pub duplicates: Vec<[usize; 2]>,
    /// What was too small a region to stand alone (`--absorb-area`, `--absorb-width`), in the order of
    /// absorption, and what still is.
    #[serde(default)]
    pub small: Vec<SmallRegionRecord>,
    /// Faces that hang together, largest first, and on which side of them the material is.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub sheets: Vec<SheetRecord>,
}

/// A stretch of a face's boundary beside another face, farther away than the tolerance.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct WideGapRecord {
    /// The face.
    pub face: usize,
    /// The face beside it.
    pub beside: usize,
    /// The gap leads to the other face's boundary; if not, to its inside.
    pub to_edge: bool,
    /// Length, mm.
    pub length_mm: f64,
    /// Largest distance between the two, mm.
    pub gap_max_mm: f64,
    /// A place on it, mm; where both have edges the widest one.
    pub at_mm: [f64; 3],
}

/// A region that was small, and what became of it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct SmallRegionRecord {
    /// Its faces.
    pub faces: Vec<usize>,
    /// Area, mm².
    pub area_mm2: f64,
    /// Twice the area by the length of the border, mm; `null` for a closed shell.
    pub width_mm: Option<f64>,
    /// It joined its neighbour; if not, it is a region still.
    pub absorbed: bool,
    /// The region that it is, or belongs to now.
    pub region: usize,
    /// The region that its chosen neighbour belongs to now.
    pub neighbour: Option<usize>,
    /// Length of the border with that neighbour, mm.
    pub border_mm: f64,
    /// Largest angle on it, degrees.
    pub angle_max_deg: f64,
}

/// A stretch of a face's boundary that lies on the inside of another face.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct LapRecord {
    /// The face that ends there.
    pub face: usize,
    /// The face under it.
    pub onto: usize,
    /// Length, mm.
    pub length_mm: f64,
    /// Largest distance between the two, mm.
    pub gap_mm: f64,
    /// First and last point, mm.
    pub ends_mm: [[f64; 3]; 2],
}

/// A region: faces that are cut as one surface.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct RegionRecord {
    /// Region id, from 0, largest area first.
    pub id: usize,
    /// Its faces (index in file order).
    pub faces: Vec<usize>,
    /// Area, mm².
    pub area_mm2: f64,
    /// Number of boundary loops.
    pub boundary_loops: usize,
    /// Mean normal direction (unit).
    pub normal_axis: [f64; 3],
    /// Largest angle between a normal and the axis, degrees.
    pub normal_half_angle_deg: f64,
    /// Box: xmin, ymin, zmin, xmax, ymax, zmax.
    pub box_mm: [f64; 6],
    /// Area that each setup cuts, mm², by setup name.
    pub setup_area_mm2: std::collections::BTreeMap<String, f64>,
    /// How far the tool has to stick out of its holder at least, mm, by setup name; empty without a holder.
    #[serde(default, skip_serializing_if = "std::collections::BTreeMap::is_empty")]
    pub stick_out_needed_mm: std::collections::BTreeMap<String, f64>,
    /// What kind of surface it is, where that could be measured.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub quality: Option<RegionQualityRecord>,
}

/// What kind of surface a region is, and what it asks of a tool.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct RegionQualityRecord {
    /// Euler characteristic: 1 for a disk, 0 for a ring, 2 for a closed shell.
    pub euler: i64,
    /// Number of handles, where that makes sense.
    pub genus: Option<usize>,
    /// Radius of the tightest valley, mm.
    pub tightest_concave_radius_mm: Option<f64>,
    /// The largest ball that curvature alone lets in everywhere, mm.
    pub largest_ball_radius_mm: Option<f64>,
    /// Area in valleys tighter than the ball, mm² (of the job; 10 mm radius for `claymill merge`).
    pub rest_area_mm2: f64,
    /// Integral of the absolute Gaussian curvature, steradians.
    pub total_curvature_sr: f64,
    /// Extent along the direction of largest spread, mm.
    pub length_mm: f64,
    /// Extent along the direction of second largest spread, mm.
    pub width_mm: f64,
    /// Seen along the mean normal, no part lies over another.
    pub single_valued: bool,
}

/// A joint: a stretch of edge shared by two faces.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct JointRecord {
    /// The two faces (equal for a seam).
    pub faces: [usize; 2],
    /// Length, mm.
    pub length_mm: f64,
    /// `C0`, `G1` or `G2`.
    pub class: String,
    /// `merged`, `crossed_curvature_jump`, `split_angle`, …
    pub verdict: String,
    /// The verdict in words with its figures.
    pub why: String,
    /// Largest gap, mm.
    pub gap_max_mm: f64,
    /// Largest part of the gap along the normal, mm.
    pub gap_normal_max_mm: f64,
    /// Largest angle between the normals, degrees.
    pub angle_max_deg: f64,
    /// 95th percentile of the angle by length, degrees.
    pub angle_p95_deg: f64,
    /// Root mean square of the angle, degrees.
    pub angle_rms_deg: f64,
    /// Angle at mid-point, degrees.
    pub angle_mid_deg: f64,
    /// Largest `R·|Δκ|` across the edge (no unit).
    pub curvature_max: f64,
    /// 95th percentile of `R·|Δκ|`.
    pub curvature_p95: f64,
    /// Root mean square of `R·|Δκ|`.
    pub curvature_rms: f64,
    /// `R·|Δκ|` at mid-point.
    pub curvature_mid: f64,
    /// Largest relative curvature difference `|κA−κB| / (|κA|+|κB|+2κ₀)`.
    pub curvature_relative_max: f64,
    /// What keeps the joint from being merged.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub failing: Option<FailingRecord>,
    /// Number of regions of the model if this joint had been merged, borders that would follow included.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub regions_if_merged: Option<usize>,
}

/// What keeps a joint from being merged.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct FailingRecord {
    /// `gap_normal`, `gap_lateral` (mm), `angle` (degrees), `curvature_machining`, `curvature_relative` (no
    /// unit) or `smooth_border` (share of the border between the two regions that is smooth).
    pub measure: String,
    /// Worst value on the joint.
    pub value: f64,
    /// The largest value allowed; of `smooth_border` the least.
    pub limit: f64,
    /// Share of the joint's length on which a limit is exceeded.
    pub share_over: f64,
    /// Where it is worst, mm.
    pub at_mm: [f64; 3],
}
