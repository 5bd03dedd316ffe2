//! What a job is asked for.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use claymill_nurbs::Point3;
use claymill_toolpath::Mirror;
use serde::{Deserialize, Serialize};

use super::process::ProcessArgs;
use super::reuse::REUSE;
use super::{BoundsArgs, CHOICE, JOINING, MACHINE, PASSES, ReuseArgs, SETUP, TOOL};
use crate::failure::Failure;
use crate::merging::MergingArgs;

#[derive(Debug, Clone, Args)]
pub(crate) struct PlanArgs {
    /// IGES, STEP or Rhino 3dm file.
    pub(crate) model: PathBuf,
    /// Job folder to write.
    #[arg(short, long, value_name = "DIR")]
    pub(crate) out: PathBuf,
    /// Take the job from this TOML file (every job folder holds the one it was made with); options on the
    /// command line go before it.
    #[arg(long = "job", value_name = "FILE")]
    pub(crate) job_file: Option<PathBuf>,
    /// Plan again whenever the model, the job file or another file of the job changes, until Ctrl-C. Parts are kept in a
    /// store beside the job folder, so that only what changed is computed.
    #[arg(help_heading = REUSE, long)]
    pub(crate) watch: bool,
    #[command(flatten)]
    pub(crate) process: ProcessArgs,
    #[command(flatten)]
    pub(crate) reuse: ReuseArgs,
    #[command(flatten)]
    pub(crate) job: OneJob,
}

#[derive(Debug, Args)]
pub(crate) struct CompareArgs {
    /// IGES, STEP or Rhino 3dm file.
    pub(crate) model: PathBuf,
    /// Folder for the comparison and one job folder for each combination. Combinations that lie there, whole and planned
    /// by this version from the same model with the same options, are kept.
    #[arg(short, long, value_name = "DIR")]
    pub(crate) out: PathBuf,
    /// Take the jobs from this TOML file, all but the strategy; options on the command line go before it.
    #[arg(long = "job", value_name = "FILE")]
    pub(crate) job_file: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) several: Several,
    #[command(flatten)]
    pub(crate) job: JobOptions,
}

/// What is put side by side.
#[derive(Debug, Args)]
pub(crate) struct Several {
    /// Tools: `ball:R` with the radius in mm; with a taper or a shank of its own above the height `length`,
    /// `ball:5,taper:3,length:30,shank:12` (angle in degrees, diameter in mm) [default: ball:10].
    #[arg(help_heading = TOOL, long, value_delimiter = ',', value_name = "SHAPE:SIZE")]
    pub(crate) tool: Vec<String>,
    /// Scallop heights between passes, mm [default: 0.1].
    #[arg(help_heading = PASSES, long, value_delimiter = ',', value_name = "MM", allow_negative_numbers = true)]
    pub(crate) scallop: Vec<f64>,
    /// Strategies to compare.
    #[arg(help_heading = PASSES, long, visible_alias = "strategy", value_enum, value_delimiter = ',', value_name = "NAMES",
          default_values_t = [StrategyName::Planar, StrategyName::Flow, StrategyName::Scallop, StrategyName::Isoparametric,
                              StrategyName::Auto])]
    pub(crate) strategies: Vec<StrategyName>,
}

/// The options of one job on the command line.
#[derive(Debug, Clone, Args)]
pub(crate) struct OneJob {
    /// Tool: `ball:R` with the radius in mm; with a taper or a shank of its own above the height `length`,
    /// `ball:5,taper:3,length:30,shank:12` (angle in degrees, diameter in mm) [default: ball:10].
    #[arg(help_heading = TOOL, long, value_name = "SHAPE:SIZE")]
    tool: Option<String>,
    /// Scallop height between passes, mm [default: 0.1].
    #[arg(help_heading = PASSES, long, value_name = "MM", allow_negative_numbers = true)]
    scallop: Option<f64>,
    /// Strategy [default: planar].
    #[arg(help_heading = PASSES, long, value_enum)]
    strategy: Option<StrategyName>,
    #[command(flatten)]
    other: JobOptions,
}

impl OneJob {
    /// All of them.
    pub(crate) fn options(&self) -> JobOptions {
        JobOptions {
            tool: self.tool.clone(),
            scallop: self.scallop,
            strategy: self.strategy,
            ..self.other.clone()
        }
    }
}

/// Options of a job; also the content of a job file.
#[derive(Debug, Clone, Default, Args, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub(crate) struct JobOptions {
    /// The tool. A command takes one, or several to compare: see [`OneJob`] and [`Several`].
    #[arg(skip)]
    pub(crate) tool: Option<String>,
    /// Number of the tool in the machine [default: 1].
    #[arg(help_heading = TOOL, long, value_name = "NUMBER", allow_negative_numbers = true)]
    pub(crate) tool_number: Option<u32>,
    /// What holds the tool: how far it sticks out, mm, and sections from the tool up as diameters and length, for
    /// example 60:27-34x50,63x26; without sections a shrink-fit chuck on HSK-A63. auto for the least that does. It is
    /// drawn and verified, not planned around.
    #[arg(help_heading = TOOL, long, value_name = "STICKOUT[:SECTIONS]")]
    pub(crate) holder: Option<String>,
    /// Distance that the holder has to keep from the model, mm [default: 1].
    #[arg(help_heading = TOOL, long, value_name = "MM", allow_negative_numbers = true)]
    pub(crate) holder_clearance: Option<f64>,
    /// Rest passes: cut only what this larger tool could not, for example ball:10.
    #[arg(help_heading = TOOL, long, value_name = "SHAPE:SIZE")]
    pub(crate) rest_of: Option<String>,
    /// Cut only where more stock than this is left above what the operation leaves, mm: in a job of operations, which follows its
    /// stock.
    #[arg(skip)]
    pub(crate) rest_above: Option<f64>,
    /// How an operation that roughs a stock takes it away: in layers over the surface, or by levels [default: layers]. In a job of
    /// operations, like the five below.
    #[arg(skip)]
    pub(crate) cut: Option<CutName>,
    /// Largest depth of a level, mm [default: the tool's diameter].
    #[arg(skip)]
    pub(crate) step_down: Option<f64>,
    /// Largest angle about the tool along which levels cut, degrees [default: 60].
    #[arg(skip)]
    pub(crate) engagement: Option<f64>,
    /// Stairs that levels leave over slopes are no higher than this, mm [default: a tenth of the step-down].
    #[arg(skip)]
    pub(crate) band: Option<f64>,
    /// Diameter about the axis of a tool for levels that does not cut, mm: 0 lets it go straight down [default: a half of the tool's
    /// radius, and no plunging].
    #[arg(skip)]
    pub(crate) dead_centre: Option<f64>,
    /// Steepest way of levels down into a pocket, degrees [default: 3].
    #[arg(skip)]
    pub(crate) ramp: Option<f64>,
    /// Leave this much on the surface, along its normal, mm, as roughing does; negative to cut below it [default: 0].
    #[arg(help_heading = TOOL, long, value_name = "MM", allow_negative_numbers = true)]
    pub(crate) allowance: Option<f64>,
    /// Stock that may stand above what is left, mm: rapids keep out of it [default: 0].
    #[arg(help_heading = TOOL, long, value_name = "MM", allow_negative_numbers = true)]
    pub(crate) stock_above: Option<f64>,
    /// Scallop height between passes, mm; likewise.
    #[arg(skip)]
    pub(crate) scallop: Option<f64>,
    /// Strategy; likewise.
    #[arg(skip)]
    pub(crate) strategy: Option<StrategyName>,
    /// Slope above which steep-shallow has waterlines instead of rows, degrees [default: 45].
    #[arg(help_heading = PASSES, long, value_name = "DEG", allow_negative_numbers = true)]
    pub(crate) steep: Option<f64>,
    /// Parameter lines of every patch for isoparametric, evenly over it, whatever scallop they leave [default: as many as the
    /// scallop height takes].
    #[arg(help_heading = PASSES, long, value_name = "COUNT", allow_negative_numbers = true)]
    pub(crate) lines: Option<usize>,
    /// Place beside the side of a region that flow, scallop or auto start from, mm, in the model's coordinates (where you click in
    /// `claymill view`); a second place beside the same region says which side they run to. May be repeated.
    #[arg(help_heading = PASSES, long, value_name = "X,Y,Z", allow_hyphen_values = true)]
    pub(crate) guide: Vec<String>,
    /// Pencil passes: last in every region along the valleys in which the ball touches on both sides.
    #[arg(help_heading = PASSES, long)]
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub(crate) pencil: bool,
    /// Direction of planar rows in each setup, degrees [default: the cheapest one by region].
    #[arg(help_heading = PASSES, long, value_name = "DEG", allow_negative_numbers = true)]
    pub(crate) angle: Option<f64>,
    /// How passes are joined [default: zigzag].
    #[arg(help_heading = PASSES, long, value_enum)]
    pub(crate) link: Option<LinkName>,
    /// Merge preset [default: clay].
    #[arg(help_heading = JOINING, long, value_enum)]
    pub(crate) preset: Option<PresetName>,
    /// Cut the mirror image of what the file holds, in the plane through the origin that stands on this axis: the right half
    /// of a vehicle from the left one. With y:both the half in the file and its image, as one body.
    #[arg(help_heading = CHOICE, long, value_name = "AXIS[:both]")]
    pub(crate) mirror: Option<Mirror>,
    /// Cut only these: `region:3`, `layer:NAME`, `colour:#RRGGBB`, `face:10-20`; may be repeated.
    #[arg(help_heading = CHOICE, long, value_name = "WHAT", value_delimiter = ',')]
    pub(crate) only: Vec<String>,
    /// Leave these out; same forms as --only.
    #[arg(help_heading = CHOICE, long, value_name = "WHAT", value_delimiter = ',')]
    pub(crate) skip: Vec<String>,
    /// Setups that may be used: `top`, `left`, `right`, `front`, `rear`, `bottom` [default: all but bottom]; or
    /// `auto`: the fewest that reach what a head over the upper half reaches, besides the others that are named.
    #[arg(help_heading = SETUP, long, value_name = "NAME", value_delimiter = ',')]
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(crate) setups: Vec<String>,
    /// A further setup with the direction from the tool's tip to its holder in model coordinates, as in roof:0,-0.5,1; may
    /// be repeated. Without `--setups` only these are used.
    #[arg(help_heading = SETUP, long, value_name = "NAME:X,Y,Z", allow_hyphen_values = true)]
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(crate) setup: Vec<String>,
    /// Where the material is, which is not cut from inside: `auto` as found, `inside` or `outside` of what is closed or
    /// bulges, `file` behind the faces as the file turns them, `against-file`, `both` for sheets that are cut from either
    /// side, or a direction, as in -z; for some sheets alone `face:12=outside`, `region:3=-z`, also layer: and colour:; may be
    /// repeated [default: auto].
    #[arg(help_heading = CHOICE, long, value_name = "[WHAT=]SIDE", value_delimiter = ',', allow_hyphen_values = true)]
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(crate) material_side: Vec<String>,
    #[command(flatten)]
    #[serde(flatten)]
    pub(crate) bounds: BoundsArgs,
    /// Obstacle that no move may touch, as a mesh in the model's place: STL, OBJ or glTF; may be repeated.
    #[arg(help_heading = CHOICE, long, value_name = "FILE")]
    #[serde(with = "super::paths::many")]
    pub(crate) check: Vec<PathBuf>,
    /// Distance that the ball keeps from obstacles, mm [default: 1].
    #[arg(long, value_name = "MM", allow_negative_numbers = true)]
    pub(crate) check_clearance: Option<f64>,
    /// Distance that rapids keep from the finished model along the tool axis, mm: raw material must not stand farther out
    /// than that [default: 5].
    #[arg(long, value_name = "MM", allow_negative_numbers = true)]
    pub(crate) rapid_clearance: Option<f64>,
    /// Millimetres in one unit of obstacles whose format has no unit (STL, OBJ) [default: 1].
    #[arg(help_heading = CHOICE, long, value_name = "MM", requires = "check", allow_negative_numbers = true)]
    pub(crate) mesh_unit: Option<f64>,
    /// Cutting feed, mm/min [default: 6000, or what the machine allows].
    #[arg(help_heading = MACHINE, long, value_name = "MM_PER_MIN", allow_negative_numbers = true)]
    pub(crate) feed: Option<f64>,
    /// Machine definition (TOML): rapids and times are those of its feeds, acceleration and jerk.
    #[arg(help_heading = MACHINE, long, value_name = "FILE")]
    #[serde(with = "super::paths::maybe")]
    pub(crate) machine: Option<PathBuf>,
    #[command(flatten)]
    #[serde(flatten)]
    pub(crate) merging: MergingArgs,
    #[command(flatten)]
    #[serde(flatten)]
    pub(crate) axes: AxisArgs,
}

impl JobOptions {
    /// The places beside the sides of regions that passes run between.
    pub(crate) fn guides(&self) -> Result<Vec<Point3>, Failure> {
        let place = |text: &String| {
            let numbers: Option<Vec<f64>> =
                text.split(',').map(|n| n.trim().parse().ok().filter(|n: &f64| n.is_finite())).collect();
            match numbers.as_deref() {
                Some(&[x, y, z]) => Ok(Point3::new(x, y, z)),
                _ => Err(Failure::usage(
                    format!("guide {text:?} is not three coordinates"),
                    "For example: --strategy flow --guide 1200,-300,450.",
                )),
            }
        };
        self.guide.iter().map(place).collect()
    }
}

#[derive(Debug, Clone, Default, Args, Serialize, Deserialize)]
pub(crate) struct AxisArgs {
    /// Model axis that points up, for example +z [default: guessed and printed].
    #[arg(help_heading = SETUP, long, value_name = "AXIS", allow_hyphen_values = true)]
    pub(crate) up: Option<String>,
    /// Model axis that points from the rear of the vehicle to its front, for example -y [default: guessed].
    #[arg(help_heading = SETUP, long, value_name = "AXIS", allow_hyphen_values = true)]
    pub(crate) length: Option<String>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum PresetName {
    ClassA,
    Clay,
    Tangent,
    Paper,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum StrategyName {
    /// Parallel rows over whole regions.
    Planar,
    /// Lines that sweep a whole region from side to side.
    #[value(alias = "iso")]
    #[serde(alias = "iso")]
    Flow,
    /// Lines at a constant scallop height from one side of a region.
    Scallop,
    /// Lines of constant height of the ball; rows where the surface is too shallow for them.
    Waterline,
    /// Rows where the surface is shallow, waterlines where it is steep, with an overlap.
    SteepShallow,
    /// Parameter lines of every patch by itself.
    #[value(alias = "iso-patch")]
    #[serde(alias = "iso-patch")]
    Isoparametric,
    /// For each region whatever costs least of planar, flow, scallop and isoparametric.
    Auto,
}

/// How a stock is roughed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum CutName {
    /// Offsets of the surface.
    Layers,
    /// Heights, one after the other.
    Levels,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum LinkName {
    /// Zigzag: every second pass runs backwards.
    #[value(alias = "lace")]
    #[serde(alias = "lace")]
    Zigzag,
    /// Every pass starts on the same side.
    #[value(alias = "box")]
    #[serde(alias = "box")]
    OneWay,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_earlier_versions_are_still_read() {
        let strategies = [
            ("iso", "flow", StrategyName::Flow),
            ("iso-patch", "isoparametric", StrategyName::Isoparametric),
        ];
        for (old, now, strategy) in strategies {
            for name in [old, now] {
                assert_eq!(StrategyName::from_str(name, false), Ok(strategy));
                let options: JobOptions = toml::from_str(&format!("strategy = \"{name}\"")).unwrap();
                assert_eq!(options.strategy, Some(strategy));
                assert!(toml::to_string(&options).unwrap().contains(&format!("strategy = \"{now}\"")));
            }
            assert_eq!(claymill_paths::Strategy::from(strategy).to_string(), now);
        }
        for (old, now, link) in [("lace", "zigzag", LinkName::Zigzag), ("box", "one-way", LinkName::OneWay)] {
            for name in [old, now] {
                assert_eq!(LinkName::from_str(name, false), Ok(link));
                let options: JobOptions = toml::from_str(&format!("link = \"{name}\"")).unwrap();
                assert_eq!(options.link, Some(link));
                assert!(toml::to_string(&options).unwrap().contains(&format!("link = \"{now}\"")));
            }
        }
    }
}
