//! Machine definitions (TOML): units, digits, travel, feeds, own blocks and dynamics, their
//! defaults and the values that are refused.

use std::collections::BTreeMap;
use std::ops::RangeInclusive;
use std::path::Path;

use claymill_toolpath::{Changer, LONGEST_WRITTEN, MachineLimits, MoveKind, RotaryAxis, read_plain_text};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::MachineError;
use crate::dialects::tool_number;

/// Feeds and rapid rates that a machine may have, mm/min.
const RATES: RangeInclusive<f64> = 1e-3..=1e7;
/// Accelerations, mm/s², and jerks, mm/s³.
const DYNAMICS: RangeInclusive<f64> = 1e-3..=1e9;
/// Times of one interpolation step, s.
const CYCLES_S: RangeInclusive<f64> = 1e-6..=1.0;
/// Blocks that a control may look ahead, the time it may take to read one, s, and how far it may cut a corner, mm.
const MOST_BLOCKS: usize = 1_000_000;
const SLOWEST_BLOCK_S: f64 = 1.0;
const WIDEST_CORNER_MM: f64 = 100.0;
/// Axes travel no farther than this, mm.
const FARTHEST_MM: f64 = 1e7;

/// A machine as its TOML file describes it; everything may be left out.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Machine {
    /// Name, for the program's header.
    pub name: String,
    /// Unit of the program.
    pub units: Units,
    /// Decimals of coordinates; by default those of the dialect.
    pub digits: Option<u8>,
    /// How far the program may be from the job before rounding, mm: what arcs and straight moves may use up.
    pub tolerance_mm: f64,
    /// LinuxCNC's path tolerance `G64 P`, mm.
    pub blend_mm: f64,
    /// Work offset selected before the first move, for example `G54`.
    pub work_offset: String,
    /// Line numbers; none when absent. Heidenhain always has them.
    pub line_numbers: Option<LineNumbers>,
    /// Comments that name setup, region and pass.
    pub comments: bool,
    /// One file for the job, for each setup or for each tool.
    pub files: Files,
    /// A new file is begun at the next rapid when a file has this size.
    pub max_bytes: Option<u64>,
    /// Circular arcs, where a plane of two axes holds the curve and the control takes no better.
    pub arcs: bool,
    /// NURBS, where the control takes them.
    pub nurbs: bool,
    /// Largest number of control points in one curve; longer ones are cut at a knot.
    pub max_points: Option<usize>,
    /// Travel of the axes, mm in machine coordinates of the program.
    pub axes: BTreeMap<AxisName, [f64; 2]>,
    /// Feeds.
    pub feed: Feed,
    /// Spindle.
    pub spindle: Spindle,
    /// Coolant.
    pub coolant: Coolant,
    /// Blocks for a tool change; `{tool}` stands for its number. By default those of the dialect.
    pub tool_change: Option<Vec<String>>,
    /// Blocks that take the tool out of the way: before the first tool change, before the part is turned, before the tool is
    /// changed and at the end. By default those of the dialect.
    pub home: Option<Vec<String>>,
    /// How far above the clearance height the tool goes there, mm, where nothing is said of `home` and the control has no way
    /// up of its own.
    pub retreat_mm: f64,
    /// Blocks after the header, before the first tool change.
    pub start: Vec<String>,
    /// Blocks before the end of the program.
    pub end: Vec<String>,
    /// What differs between setups, by setup name.
    pub setups: BTreeMap<String, SetupPlace>,
    /// What the machine knows of the job's tools, by their ids.
    pub tools: BTreeMap<String, ToolPlace>,
    /// Velocity, acceleration and jerk of the axes.
    pub dynamics: Dynamics,
    /// What is known of the control, for its simulation.
    pub control: ControlFacts,
    /// How the machine comes to setups off the axes.
    pub tilt: Tilting,
    /// Rotary axes by name.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub rotary: BTreeMap<String, RotaryAxis>,
    /// Tool changer.
    pub changer: Changer,
}

/// How a machine comes to setups off the axes of the part.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Tilting {
    /// What writes such a setup.
    pub by: PlaneBy,
    /// Name of Siemens' swivel data set; empty where there is one only.
    pub swivel_data: String,
    /// Siemens' preferred direction of the first rotary axis: 1 or -1.
    pub direction: i8,
}

impl Default for Tilting {
    fn default() -> Self {
        Tilting { by: PlaneBy::Program, swivel_data: String::new(), direction: -1 }
    }
}

/// What writes a setup off the axes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum PlaneBy {
    /// A program, or a part of it behind a stop, for each setup; the part is turned by hand.
    Program,
    /// The control's tilted plane, where the dialect has one.
    Control,
}

/// What is known of a control; what is left out is taken as usual for the dialect.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct ControlFacts {
    /// Blocks that it looks ahead.
    pub look_ahead_blocks: Option<usize>,
    /// Time that it takes to read a block, s.
    pub block_s: Option<f64>,
    /// How far from a corner it may run, mm.
    pub corner_mm: Option<f64>,
}

/// Unit of a program.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Units {
    /// Millimetres.
    Mm,
    /// Inches.
    Inch,
}

impl Units {
    /// Millimetres in one unit.
    #[must_use]
    pub fn mm(self) -> f64 {
        match self {
            Units::Mm => 1.0,
            Units::Inch => 25.4,
        }
    }
}

/// An axis of the machine.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum AxisName {
    /// X.
    X,
    /// Y.
    Y,
    /// Z.
    Z,
}

/// First number and step.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LineNumbers {
    /// Number of the first block.
    pub first: u64,
    /// Step.
    pub step: u64,
}

/// How a job is spread over files.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Files {
    /// All in one; the program stops between setups.
    One,
    /// One for each setup.
    Setup,
    /// One for each tool of each setup.
    Tool,
}

/// Feeds, mm/min.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Feed {
    /// Faster feeds of the job are brought down to this.
    pub max_mm_per_min: f64,
    /// Rapid rate.
    pub rapid_mm_per_min: f64,
}

impl Feed {
    /// Fastest feed of a kind of move, mm/min.
    #[must_use]
    pub fn of(&self, kind: MoveKind) -> f64 {
        if kind == MoveKind::Rapid { self.rapid_mm_per_min } else { self.max_mm_per_min }
    }
}

/// Spindle.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Spindle {
    /// Speed, 1/min; 0, as usual, where none is known: the spindle is then left alone.
    pub speed_rpm: f64,
    /// Counterclockwise (M4).
    pub counterclockwise: bool,
    /// Slowest speed, 1/min.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub min_rpm: Option<f64>,
    /// Fastest speed, 1/min.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub max_rpm: Option<f64>,
    /// Power, kW.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub power_kw: Option<f64>,
}

impl Spindle {
    /// Slowest and fastest speed, 1/min.
    #[must_use]
    pub fn range_rpm(&self) -> [f64; 2] {
        [self.min_rpm.unwrap_or(0.0), self.max_rpm.unwrap_or(LARGEST_SPEED_RPM)]
    }
}

/// Coolant.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Coolant {
    /// None.
    Off,
    /// M7.
    Mist,
    /// M8.
    Flood,
}

/// Where a setup stands on the machine.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct SetupPlace {
    /// Its own work offset.
    pub work_offset: Option<String>,
    /// The work's zero in model coordinates, mm.
    pub zero_mm: [f64; 3],
}

/// A tool of a job on the machine.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct ToolPlace {
    /// Its number in the machine, where that is not the one of its id.
    pub number: Option<u32>,
    /// Its speed, 1/min, where that is not the spindle's.
    pub speed_rpm: Option<f64>,
}

/// What the axes can do.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Dynamics {
    /// Along the path, mm/s².
    pub acceleration_mm_per_s2: f64,
    /// Along the path, mm/s³.
    pub jerk_mm_per_s3: f64,
    /// Time of one interpolation step, s.
    pub cycle_s: f64,
}

/// Hands and holders are out of reach of a tool that is this far above the clearance height, mm.
const RETREAT_MM: f64 = 100.0;
/// Tolerance of programs in inches where none is given, mm: four decimals of an inch are 2.54 µm, and rounding to them takes
/// up to 2.2 µm.
const INCH_TOLERANCE_MM: f64 = 0.003;
/// No spindle is faster, 1/min.
const LARGEST_SPEED_RPM: f64 = 1e6;
/// No spindle is stronger, kW.
const LARGEST_KW: f64 = 1e4;
/// A machine has no more tools than this.
const LARGEST_TOOL: u32 = 99_999_999;

impl Default for Machine {
    fn default() -> Self {
        Machine {
            name: "three axes".into(),
            units: Units::Mm,
            digits: None,
            tolerance_mm: 0.002,
            blend_mm: 0.002,
            work_offset: "G54".into(),
            line_numbers: None,
            comments: true,
            files: Files::One,
            max_bytes: None,
            arcs: true,
            nurbs: true,
            max_points: None,
            axes: BTreeMap::new(),
            feed: Feed::default(),
            spindle: Spindle::default(),
            coolant: Coolant::Off,
            tool_change: None,
            home: None,
            retreat_mm: RETREAT_MM,
            start: Vec::new(),
            end: Vec::new(),
            setups: BTreeMap::new(),
            tools: BTreeMap::new(),
            dynamics: Dynamics::default(),
            control: ControlFacts::default(),
            tilt: Tilting::default(),
            rotary: BTreeMap::new(),
            changer: Changer::default(),
        }
    }
}

impl Default for Feed {
    fn default() -> Self {
        Feed { max_mm_per_min: 60_000.0, rapid_mm_per_min: 60_000.0 }
    }
}

impl Default for Dynamics {
    fn default() -> Self {
        Dynamics { acceleration_mm_per_s2: 1000.0, jerk_mm_per_s3: 10_000.0, cycle_s: 0.001 }
    }
}

impl Machine {
    /// Reads a machine definition.
    ///
    /// # Errors
    /// The file cannot be read, is no TOML of the documented form, or has values that make no sense.
    pub fn read(path: &Path) -> Result<Self, MachineError> {
        let io = |source| MachineError::Io { path: path.to_owned(), source };
        Self::parse(&read_plain_text(path, LONGEST_WRITTEN).map_err(io)?, path)
    }

    /// Reads a machine definition from a text; `path` is for messages.
    ///
    /// # Errors
    /// As [`Machine::read`].
    pub fn parse(text: &str, path: &Path) -> Result<Self, MachineError> {
        let syntax = |e| MachineError::Syntax { path: path.to_owned(), source: Box::new(e) };
        let mut machine: Machine = toml::from_str(text).map_err(syntax)?;
        let given: toml::Table = toml::from_str(text).map_err(syntax)?;
        if machine.units == Units::Inch && !given.contains_key("tolerance_mm") {
            machine.tolerance_mm = INCH_TOLERANCE_MM;
        }
        machine.check()?;
        Ok(machine)
    }

    /// Blocks of the shop's own that are written as they stand.
    pub(crate) fn own_blocks(&self) -> impl Iterator<Item = &String> {
        self.start.iter().chain(&self.end).chain(self.home.iter().flatten())
    }

    /// Refuses values that make no sense.
    ///
    /// # Errors
    /// The first such value.
    pub fn check(&self) -> Result<(), MachineError> {
        let value = |field, what: &str| Err(MachineError::Value { field, what: what.to_owned() });
        let positive = |v: f64| v.is_finite() && v > 0.0;
        if !(positive(self.tolerance_mm) && self.tolerance_mm <= 1.0) {
            return value("tolerance_mm", "must be above 0 and no more than 1");
        }
        if !(self.blend_mm.is_finite() && (0.0..=1.0).contains(&self.blend_mm)) {
            return value("blend_mm", "must be from 0 to 1");
        }
        if self.digits.is_some_and(|d| !(1..=8).contains(&d)) {
            return value("digits", "must be from 1 to 8");
        }
        if self.max_bytes.is_some_and(|b| b < 4096) {
            return value("max_bytes", "must be at least 4096");
        }
        if self.max_points.is_some_and(|n| n < 4) {
            return value("max_points", "must be at least 4");
        }
        if self.line_numbers.is_some_and(|n| n.step == 0 || n.step > 1000 || n.first > 1_000_000) {
            return value("line_numbers", "must have a step from 1 to 1000 and begin below 1000000");
        }
        if [self.feed.max_mm_per_min, self.feed.rapid_mm_per_min].iter().any(|v| !RATES.contains(v)) {
            return value("feed", "must have positive rates, up to 1e7 mm/min");
        }
        let [slow, fast] = self.spindle.range_rpm();
        if !((0.0..=fast).contains(&slow) && fast > 0.0 && fast <= LARGEST_SPEED_RPM) {
            return value("spindle", "must have min_rpm below max_rpm, both from 0 to 1000000");
        }
        if self.spindle.power_kw.is_some_and(|kw| !(kw > 0.0 && kw <= LARGEST_KW)) {
            return value("spindle", "must have a power above 0 and up to 10000 kW");
        }
        if !self.changer.is_sensible() {
            return value("changer", "must have sizes, places and a time above 0 and within reason");
        }
        if self.rotary.iter().any(|(name, axis)| !(RotaryAxis::may_be_named(name) && axis.is_sensible())) {
            return value(
                "rotary",
                "must have axes a, b or c with a travel from low to high and a direction",
            );
        }
        if ![1, -1].contains(&self.tilt.direction)
            || self.tilt.swivel_data.chars().any(|c| !(c.is_ascii_alphanumeric() || c == '_'))
        {
            return value("tilt", "must have direction 1 or -1 and a name of letters, digits and _");
        }
        let mut speeds = self.tools.values().filter_map(|t| t.speed_rpm).chain([self.spindle.speed_rpm]);
        if !speeds.all(|rpm| rpm.is_finite() && (0.0..=LARGEST_SPEED_RPM).contains(&rpm)) {
            return value("spindle, tools", "must have a speed from 0 to 1000000");
        }
        if self.tools.values().filter_map(|t| t.number).any(|n| !(1..=LARGEST_TOOL).contains(&n)) {
            return value("tools", "must have a number from 1 to 99999999");
        }
        if !(0.0..=10_000.0).contains(&self.retreat_mm) {
            return value("retreat_mm", "must be from 0 to 10000");
        }
        let d = &self.dynamics;
        let quick = [d.acceleration_mm_per_s2, d.jerk_mm_per_s3];
        if !(quick.iter().all(|v| DYNAMICS.contains(v)) && CYCLES_S.contains(&d.cycle_s)) {
            return value(
                "dynamics",
                "must be positive, up to 1e9 mm/s² and mm/s³, the cycle from 1e-6 to 1 s",
            );
        }
        let c = &self.control;
        let known = |v: Option<f64>, most: f64| v.is_none_or(|v| positive(v) && v <= most);
        if c.look_ahead_blocks.is_some_and(|n| !(1..=MOST_BLOCKS).contains(&n))
            || !(known(c.block_s, SLOWEST_BLOCK_S) && known(c.corner_mm, WIDEST_CORNER_MM))
        {
            return value(
                "control",
                "must be positive, up to 1000000 blocks, 1 s a block and 100 mm at a corner",
            );
        }
        let travel = |[a, b]: &[f64; 2]| a < b && a.abs() <= FARTHEST_MM && b.abs() <= FARTHEST_MM;
        if !self.axes.values().all(travel) {
            return value("axes", "must have a lower limit below the upper one, both within 1e7 mm");
        }
        if self.setups.values().any(|s| s.zero_mm.iter().any(|z| !z.is_finite() || z.abs() > 1e6)) {
            return value("setups", "must have zeros that are finite");
        }
        let lines = self.own_blocks().chain(self.tool_change.iter().flatten());
        let names = [&self.name, &self.work_offset];
        let offsets = self.setups.values().filter_map(|s| s.work_offset.as_ref());
        if lines.chain(names).chain(offsets).any(|l| l.chars().any(char::is_control)) {
            return value("start, end, home, tool_change, work_offset, name", "must be single lines");
        }
        Ok(())
    }

    /// The form of a machine definition as JSON Schema.
    #[must_use]
    pub fn schema() -> schemars::Schema {
        schemars::schema_for!(Machine)
    }

    /// What it can do, as far as the time of a job is concerned.
    #[must_use]
    pub fn limits(&self) -> MachineLimits {
        MachineLimits {
            name: Some(self.name.clone()),
            acceleration_mm_per_s2: self.dynamics.acceleration_mm_per_s2,
            jerk_mm_per_s3: self.dynamics.jerk_mm_per_s3,
            corner_mm: self.control.corner_mm.unwrap_or(MachineLimits::default().corner_mm),
        }
    }

    /// Number of a tool in the machine.
    #[must_use]
    pub fn tool_number(&self, id: &str) -> u32 {
        self.tools.get(id).and_then(|t| t.number).unwrap_or_else(|| tool_number(id))
    }

    /// Speed of a tool, 1/min; 0 where none is known.
    #[must_use]
    pub fn speed_rpm(&self, id: &str) -> f64 {
        self.tools.get(id).and_then(|t| t.speed_rpm).unwrap_or(self.spindle.speed_rpm)
    }

    /// Work offset and zero of a setup.
    #[must_use]
    pub fn place(&self, setup: &str) -> SetupPlace {
        let mut place = self.setups.get(setup).cloned().unwrap_or_default();
        place.work_offset.get_or_insert_with(|| self.work_offset.clone());
        place
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_machine_survives_its_own_file() {
        let mut machine =
            Machine { line_numbers: Some(LineNumbers { first: 10, step: 10 }), ..Machine::default() };
        machine.axes.insert(AxisName::X, [-100.0, 3000.0]);
        machine.setups.insert("top".into(), SetupPlace { work_offset: None, zero_mm: [1.0, 2.0, 3.0] });
        machine.tools.insert("T1".into(), ToolPlace { number: Some(12), speed_rpm: None });
        let text = toml::to_string(&machine).unwrap();
        assert_eq!(toml::from_str::<Machine>(&text).unwrap(), machine);
        assert_eq!((machine.tool_number("T1"), machine.tool_number("T7")), (12, 7));
        assert_eq!(toml::from_str::<Machine>("").unwrap(), Machine::default());
    }

    #[test]
    fn senseless_values_are_refused() {
        for text in [
            "tolerance_mm = 0",
            "tolerance_mm = nan",
            "digits = 12",
            "max_bytes = 1",
            "line_numbers = { first = 1, step = 0 }",
            "feed = { max_mm_per_min = -1 }",
            "axes = { x = [3, 1] }",
            "start = [\"G0\\nG1\"]",
            "dynamics = { jerk_mm_per_s3 = 0 }",
            "control = { look_ahead_blocks = 0 }",
            "control = { block_s = -1 }",
            "retreat_mm = -1",
            "retreat_mm = nan",
            "tools = { T1 = { number = 0 } }",
            "tools = { T1 = { speed_rpm = -5 } }",
            "control = { block_s = 1e300 }",
            "control = { corner_mm = inf }",
            "control = { look_ahead_blocks = 1000000000 }",
            "feed = { rapid_mm_per_min = 1e300 }",
            "spindle = { speed_rpm = 1e300 }",
            "dynamics = { acceleration_mm_per_s2 = 1e-300 }",
            "dynamics = { cycle_s = 1e300 }",
            "axes = { x = [-1e300, 1] }",
            "spindle = { min_rpm = 9000, max_rpm = 600 }",
            "spindle = { power_kw = -1 }",
            "changer = { places = 0 }",
            "tilt = { direction = 2 }",
            "tilt = { swivel_data = \"a,b\" }",
            "rotary = { x = { travel_deg = [0, 1], direction = [1, 0, 0] } }",
            "rotary = { a = { travel_deg = [1, 0], direction = [1, 0, 0] } }",
            "rotary = { a = { travel_deg = [0, 1], direction = [0, 0, 0] } }",
        ] {
            let machine: Machine = toml::from_str(text).unwrap();
            assert!(machine.check().is_err(), "{text}");
        }
        assert!(toml::from_str::<Machine>("tolerence_mm = 1").is_err());
    }

    /// The file that tools are chosen for is one that programs are written with.
    #[test]
    fn one_file_serves_posts_and_tools() {
        let read = |path: &str| Machine::read(&Path::new(env!("CARGO_MANIFEST_DIR")).join(path)).unwrap();
        let gantry = read("../tooling/data/gantry.toml");
        assert_eq!((gantry.spindle.max_rpm, gantry.changer.places), (Some(18_000.0), Some(24)));
        let indexed = read("../docs/machines/linuxcnc-a-axis.toml");
        assert!(indexed.rotary["a"].turns_table);
        let text = toml::to_string(&indexed).unwrap();
        assert_eq!(toml::from_str::<Machine>(&text).unwrap(), indexed);
    }

    #[test]
    fn a_machine_in_inches_has_a_tolerance_that_its_digits_can_keep() {
        let parse = |text: &str| Machine::parse(text, Path::new("mill.toml")).unwrap().tolerance_mm;
        assert_eq!(parse("units = \"inch\""), 0.003);
        assert_eq!(parse("units = \"inch\"\ntolerance_mm = 0.01"), 0.01);
        assert_eq!(parse(""), 0.002);
    }
}
