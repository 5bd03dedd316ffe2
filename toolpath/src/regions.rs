use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

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
    /// Length with no neighbour, mm.
    pub boundary_naked_mm: f64,
    /// Length where more than two faces meet, mm.
    pub boundary_non_manifold_mm: f64,
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
}
