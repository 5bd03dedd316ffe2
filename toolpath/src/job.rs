//! The job record, `job.json`: what was asked for, what was planned, totals and areas.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::{
    Bounds, FilePlace, FreeSide, Holder, Levels, Mirror, MoveKind, Operation, Stock, Tool, find_file,
};

/// Version of the job folder's format; raised when a reader of the old one would misread the new one.
pub const FORMAT_VERSION: u32 = 1;
/// Version of a job with operations.
pub const LATEST_FORMAT_VERSION: u32 = 2;

/// Distance that holders keep where nothing else is asked for, mm.
pub const HOLDER_CLEARANCE_MM: f64 = 1.0;

/// Distance from obstacles where nothing else is asked for, mm: fixtures stand where they are said to stand within some tenths.
pub const CHECK_CLEARANCE_MM: f64 = 1.0;

#[allow(clippy::trivially_copy_pass_by_ref, reason = "serde passes a reference")]
fn is_zero(mm: &f64) -> bool {
    *mm == 0.0
}

fn usual_holder_clearance_mm() -> f64 {
    HOLDER_CLEARANCE_MM
}

/// `job.json`: what was asked, what was done, and the totals.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Job {
    /// Version of the job folder's format.
    pub format_version: u32,
    /// Version of claymill that wrote it.
    pub claymill_version: String,
    /// The model and what was read of it.
    pub model: ModelFacts,
    /// What it is cut from, where that is known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stock: Option<Stock>,
    /// What was asked; in a job with operations, of the one that finishes the surface.
    pub request: Request,
    /// Every tolerance used, by name (units in the names).
    pub tolerances: BTreeMap<String, f64>,
    /// The tools.
    pub tools: Vec<ToolRecord>,
    /// The setups in machining order.
    pub setups: Vec<Setup>,
    /// Totals by region and setup, in machining order.
    pub regions: Vec<RegionTotals>,
    /// Totals of the job.
    pub totals: Totals,
    /// Where the model's area went.
    pub area: Area,
    /// The same, face by face.
    pub faces: Vec<FaceAccount>,
    /// Faces that are not machined since they could not be triangulated.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub left_out: Vec<LeftOutFace>,
    /// Its operations in machining order (version 2). What is said above of areas, regions and tolerances is of the one that
    /// finishes the surface; setups and totals are of all.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub operations: Vec<Operation>,
    /// Seconds by stage. The only part, with `peak_memory_mb`, that differs between two equal runs.
    pub timings: Vec<StageTiming>,
    /// Largest resident memory, MB.
    pub peak_memory_mb: f64,
}

/// The model's file and what was read of it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ModelFacts {
    /// Path as given on the command line.
    pub path: String,
    /// The same, to be found again from the job folder and from anywhere.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub place: Option<FilePlace>,
    /// SHA-256 of the file, hexadecimal.
    pub sha256: String,
    /// Unit declared in the file.
    pub units: String,
    /// Millimetres per file unit.
    pub unit_mm: f64,
    /// Faces in the file: `faces_read + skipped.len()`.
    pub faces_in_file: usize,
    /// Faces read.
    pub faces_read: usize,
    /// What is cut are images of these faces, or the faces and their images. Areas and the box are of what is cut.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mirror: Option<Mirror>,
    /// Faces that were not read, and why.
    pub skipped: Vec<Skipped>,
    /// Area of the faces read, mm².
    pub area_mm2: f64,
    /// Box: xmin, ymin, zmin, xmax, ymax, zmax.
    pub box_mm: [f64; 6],
}

/// Something in the file that was not used.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Skipped {
    /// `DE 17` or `#4711`.
    pub entity: String,
    /// What is wrong with it.
    pub reason: String,
}

/// A setup that the model may be cut in.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct AskedSetup {
    /// Its name, such as `top`.
    pub name: String,
    /// Unit vector from tip to holder, in model coordinates.
    pub axis: [f64; 3],
}

/// What was asked.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Request {
    /// Tool.
    pub tool: Tool,
    /// The earlier tool, where only what it could not cut is asked for.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rest_of: Option<Tool>,
    /// What is left on the surface, along its normal, mm; negative below it.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub allowance_mm: f64,
    /// Only what has more stock than this above what it leaves was to be cut, mm.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rest_above_mm: Option<f64>,
    /// How much stock may stand above what it leaves, mm: rapids keep out of it.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub stock_above_mm: f64,
    /// Levels, where the stock was to be roughed by these instead of passes over the surface.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub levels: Option<Levels>,
    /// Scallop height, mm.
    pub scallop_mm: f64,
    /// Strategy.
    pub strategy: String,
    /// Parameter lines of every patch, where their number was asked for.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lines: Option<usize>,
    /// Places beside the sides that regions are swept between, mm.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub guides: Vec<[f64; 3]>,
    /// Whether valleys have passes of their own.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub pencil: bool,
    /// Link style.
    pub link: LinkStyle,
    /// Merge preset.
    pub preset: String,
    /// Model axis that points up, `+z`.
    pub up: String,
    /// Model axis from rear to front, `-y`.
    pub length: String,
    /// The setups that the model may be cut in, where they were chosen; else from above and from its four sides.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub setups: Vec<AskedSetup>,
    /// Only these regions, layers or faces.
    pub only: Vec<String>,
    /// All but these.
    pub skip: Vec<String>,
    /// On which side of sheets the material is, where that was said.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub material_side: Vec<String>,
    /// Where the tool is kept.
    #[serde(default, skip_serializing_if = "Bounds::is_none")]
    pub bounds: Bounds,
    /// Meshes that no move may touch.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub check: Vec<Obstacle>,
    /// Distance that the ball keeps from these, mm; 0 in jobs of earlier versions.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub check_clearance_mm: f64,
    /// Distance that holders have to keep from model and obstacles, mm.
    #[serde(default = "usual_holder_clearance_mm")]
    pub holder_clearance_mm: f64,
    /// Cutting feed, mm/min.
    pub feed_mm_per_min: f64,
    /// Feed of leads, mm/min; those that go on straight along a pass have its feed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lead_mm_per_min: Option<f64>,
    /// Rapid rate, mm/min.
    pub rapid_mm_per_min: f64,
    /// What the machine can do, as far as the times are concerned.
    #[serde(default)]
    pub machine: MachineLimits,
}

/// How quickly a machine gets on.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct MachineLimits {
    /// Its name; `None` for a clay mill as usual.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// Largest acceleration along the path, mm/s².
    pub acceleration_mm_per_s2: f64,
    /// Largest jerk along the path, mm/s³.
    pub jerk_mm_per_s3: f64,
    /// How far from a corner the control may run, mm.
    pub corner_mm: f64,
}

impl Default for MachineLimits {
    /// A clay mill: 1 m/s², 10 m/s³.
    fn default() -> Self {
        MachineLimits {
            name: None,
            acceleration_mm_per_s2: 1000.0,
            jerk_mm_per_s3: 10_000.0,
            corner_mm: 0.005,
        }
    }
}

/// A mesh file (STL, OBJ, glTF) that no move may touch.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Obstacle {
    /// The file, as given on the command line.
    pub path: String,
    /// The same, to be found again from the job folder and from anywhere.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub place: Option<FilePlace>,
    /// SHA-256 of its bytes.
    pub sha256: String,
    /// Millimetres in one of its units, where its format has none.
    pub unit_mm: f64,
}

impl ModelFacts {
    /// How many faces a job numbers: those that were read, with their images where it cuts both.
    #[must_use]
    pub fn faces(&self) -> usize {
        if self.mirror.is_some_and(|mirror| mirror.keeps_model) {
            2 * self.faces_read
        } else {
            self.faces_read
        }
    }

    /// The model's file, as seen from the job folder `folder`.
    #[must_use]
    pub fn find(&self, folder: &Path) -> PathBuf {
        find_file(folder, &self.path, self.place.as_ref(), &self.sha256)
    }
}

impl Obstacle {
    /// Its file, as seen from the job folder `folder`.
    #[must_use]
    pub fn find(&self, folder: &Path) -> PathBuf {
        find_file(folder, &self.path, self.place.as_ref(), &self.sha256)
    }
}

/// How the ends of neighbouring passes are joined.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum LinkStyle {
    /// Zigzag: every second pass runs backwards.
    #[serde(alias = "lace")]
    Zigzag,
    /// One way: every pass starts on the same side.
    #[serde(alias = "box")]
    OneWay,
}

/// A tool of the job.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ToolRecord {
    /// `T1`.
    pub id: String,
    /// Shape and size.
    #[serde(flatten)]
    pub tool: Tool,
    /// What holds it, if that is known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub holder: Option<Holder>,
    /// How far it sticks out of the holder in the setups named here, mm; in all others as the holder says.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub setup_stick_out_mm: BTreeMap<String, f64>,
}

impl ToolRecord {
    /// The tool as it is in a setup.
    #[must_use]
    pub fn in_setup(&self, setup: &str) -> Self {
        let mut here = ToolRecord { setup_stick_out_mm: BTreeMap::new(), ..self.clone() };
        if let (Some(holder), Some(mm)) = (&mut here.holder, self.setup_stick_out_mm.get(setup)) {
            holder.stick_out_mm = *mm;
        }
        here
    }

    /// The least and the most that it sticks out in any setup, mm.
    #[must_use]
    pub fn stick_out_range_mm(&self) -> Option<(f64, f64)> {
        let held_mm = self.holder.as_ref()?.stick_out_mm;
        let own = || self.setup_stick_out_mm.values().copied();
        Some((own().reduce(f64::min).unwrap_or(held_mm), own().reduce(f64::max).unwrap_or(held_mm)))
    }
}

/// A tool direction.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Setup {
    /// `top`, `left`, `right`, `front`, `rear` or `bottom`, or as it was asked for.
    pub name: String,
    /// Tool axis (unit, from tip to holder) in model coordinates.
    pub axis: [f64; 3],
    /// The turn from the setup's axes to the model's, where they are not parallel: a quaternion of integers (a, b, c, d)
    /// with the real part first. Rows of the matrix times a²+b²+c²+d²: (a²+b²-c²-d², 2bc-2ad, 2bd+2ac), and so on.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub quaternion: Option<[i64; 4]>,
    /// Height along the axis above which nothing of the model lies within the tool, mm: rapids between
    /// regions run here.
    pub clearance_mm: f64,
    /// Area cut from this direction, mm².
    pub area_mm2: f64,
    /// Estimated time, s.
    pub time_s: f64,
}

/// Totals of one region in one setup.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct RegionTotals {
    /// Region id.
    pub region: usize,
    /// Setup name.
    pub setup: String,
    /// Area cut, mm².
    pub area_mm2: f64,
    /// Where its passes run.
    #[serde(default)]
    pub strategy: String,
    /// What else was laid out, to choose from by length and number of passes.
    #[serde(default)]
    pub considered: Vec<Considered>,
    /// Direction of the passes in the setup (unit, model coordinates), where they are parallel.
    pub pass_direction: Option<[f64; 3]>,
    /// Number of passes.
    pub passes: u32,
    /// Retracts between passes.
    pub retracts: u32,
    /// Length by kind of move.
    pub length: LengthByKind,
    /// Control points of all moves.
    pub control_points: u64,
    /// Estimated time, s.
    pub time_s: f64,
}

/// A strategy as it would be on one region in one setup.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Considered {
    /// Its name.
    pub strategy: String,
    /// Length of its passes, mm: of those laid until it was given up, if it was.
    pub length_mm: f64,
    /// Their number.
    pub passes: u32,
    /// It cost more than another one before it was laid to its end.
    #[serde(default)]
    pub given_up: bool,
}

/// Path length by kind, mm.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct LengthByKind {
    /// Cutting.
    pub cut_mm: f64,
    /// Leads in and out.
    pub lead_mm: f64,
    /// Links that stay down.
    pub link_mm: f64,
    /// Rapids.
    pub rapid_mm: f64,
}

/// Totals of the job.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Totals {
    /// Moves.
    pub moves: u64,
    /// Passes.
    pub passes: u32,
    /// Retracts.
    pub retracts: u32,
    /// Length by kind.
    pub length: LengthByKind,
    /// Control points.
    pub control_points: u64,
    /// Estimated time, s.
    pub time_s: f64,
    /// Places where the tool was lowered on the model for the passes.
    #[serde(default)]
    pub locations: u64,
    /// Those of them where the smooth sheet around the contact is proven to be all there is.
    #[serde(default)]
    pub certified_locations: u64,
    /// Locations that could not be proven and were lifted.
    pub lifted_locations: u64,
}

/// Why some area is not cut.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum UncutReason {
    /// No tool direction reaches it: inner skins, under the floor, behind other faces, walls that lean from every free
    /// direction by more than 80°.
    Hidden,
    /// The ball does not fit: too tight a valley, or a neighbour in the way.
    TooTight,
    /// Excluded by `--only` or `--skip`.
    Excluded,
    /// The earlier tool, whose rest is cut, finished it.
    EarlierTool,
    /// The tool is kept away, by boxes, borders or faces to be avoided.
    OutOfBounds,
    /// The face could not be covered with triangles; the box around it is kept clear.
    NotCovered,
    /// Levels rough the stock and cut no surface: what they leave is measured as stock.
    Roughed,
}

/// Where the model's area went: `cut + Σ uncut = total`.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Area {
    /// All faces read, mm².
    pub total_mm2: f64,
    /// Cut, mm².
    pub cut_mm2: f64,
    /// Not cut, mm², by reason.
    pub uncut_mm2: BTreeMap<UncutReason, f64>,
}

/// A face that could not be triangulated. It is not cut, and everything keeps clear of the box around it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct LeftOutFace {
    /// Index in file order.
    pub face: usize,
    /// Its entity in the file.
    pub entity: String,
    /// Its area, mm².
    pub area_mm2: f64,
    /// What is wrong with it.
    pub reason: String,
    /// The box that is kept clear, mm: smallest corner, then largest.
    pub box_mm: [f64; 6],
}

/// What became of one face.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct FaceAccount {
    /// Index in file order.
    pub face: usize,
    /// `DE 17` or `#4711`.
    pub entity: String,
    /// Its region.
    pub region: usize,
    /// The side that is free of material.
    #[serde(default, skip_serializing_if = "FreeSide::is_both")]
    pub free_side: FreeSide,
    /// Its area.
    #[serde(flatten)]
    pub area: Area,
}

/// Time that a stage took.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct StageTiming {
    /// Stage.
    pub stage: String,
    /// Wall-clock seconds.
    pub seconds: f64,
}

impl std::ops::AddAssign for Totals {
    fn add_assign(&mut self, other: Self) {
        self.moves += other.moves;
        self.passes += other.passes;
        self.retracts += other.retracts;
        self.length += other.length;
        self.control_points += other.control_points;
        self.time_s += other.time_s;
        self.locations += other.locations;
        self.certified_locations += other.certified_locations;
        self.lifted_locations += other.lifted_locations;
    }
}

impl std::ops::AddAssign for LengthByKind {
    fn add_assign(&mut self, other: Self) {
        self.cut_mm += other.cut_mm;
        self.lead_mm += other.lead_mm;
        self.link_mm += other.link_mm;
        self.rapid_mm += other.rapid_mm;
    }
}

impl LengthByKind {
    /// Adds `length_mm` to the right kind.
    pub fn add(&mut self, kind: MoveKind, length_mm: f64) {
        *match kind {
            MoveKind::Cut => &mut self.cut_mm,
            MoveKind::LeadIn | MoveKind::LeadOut => &mut self.lead_mm,
            MoveKind::Link => &mut self.link_mm,
            MoveKind::Rapid => &mut self.rapid_mm,
        } += length_mm;
    }

    /// All kinds together, mm.
    #[must_use]
    pub fn total_mm(&self) -> f64 {
        self.cut_mm + self.lead_mm + self.link_mm + self.rapid_mm
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tool_sticks_out_in_each_setup_as_it_says_there_and_a_record_without_says_it_for_all() {
        let old =
            r#"{"id":"T1","shape":"ball","radius_mm":6.0,"holder":{"stick_out_mm":60.0,"sections":[]}}"#;
        let mut tool: ToolRecord = serde_json::from_str(old).unwrap();
        assert_eq!(serde_json::to_string(&tool).unwrap(), old);
        assert_eq!((tool.in_setup("top"), tool.stick_out_range_mm()), (tool.clone(), Some((60.0, 60.0))));
        tool.setup_stick_out_mm = [("left".to_owned(), 60.0), ("top".to_owned(), 42.0)].into();
        let again: ToolRecord = serde_json::from_str(&serde_json::to_string(&tool).unwrap()).unwrap();
        assert_eq!(again, tool);
        let stick_out = |setup| tool.in_setup(setup).holder.unwrap().stick_out_mm;
        assert_eq!((stick_out("top"), stick_out("left"), stick_out("rear")), (42.0, 60.0, 60.0));
        assert_eq!(tool.stick_out_range_mm(), Some((42.0, 60.0)));
        tool.holder = None;
        assert_eq!((tool.in_setup("top").holder, tool.stick_out_range_mm()), (None, None));
    }
}
