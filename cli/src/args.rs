use std::path::PathBuf;

use clap::{Args, Parser, Subcommand, ValueEnum};
use claymill_models::Flaw;
use serde::{Deserialize, Serialize};

use crate::merging::MergingArgs;

/// Freeform surface machining of whole vehicles: from an IGES, STEP or Rhino file to verified NURBS tool paths.
#[derive(Debug, Parser)]
#[command(name = "claymill", version, arg_required_else_help = true)]
pub(crate) struct Cli {
    #[command(subcommand)]
    pub(crate) command: Command,
    /// Print the result as JSON on standard output.
    #[arg(long, global = true)]
    pub(crate) json: bool,
    /// No progress and no summary.
    #[arg(long, global = true)]
    pub(crate) quiet: bool,
    /// Worker threads; 0 means one for each core.
    #[arg(long, global = true, default_value_t = 0, value_name = "N")]
    pub(crate) threads: usize,
}

#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// The built-in vehicle through the whole pipeline.
    Demo(DemoArgs),
    /// What is in a file: faces, units, area, box, defects.
    Inspect(InspectArgs),
    /// Find the joints between faces and sew smooth ones into regions.
    Merge(MergeArgs),
    /// The main job: regions, setups, tool paths, verification, pictures, report.
    Plan(PlanArgs),
    /// The same job by several strategies, scallop heights and tools, side by side.
    Compare(CompareArgs),
    /// Check a job folder against its model.
    Verify(VerifyArgs),
    /// Write a job for a machine's control, and read it back.
    Post(PostArgs),
    /// Run a program on a virtual control of its dialect: cut error, feed, time.
    Simulate(SimulateArgs),
    /// Stream a job into a control's queue.
    Stream(StreamArgs),
    /// The reference controller: takes a stream and runs along its curves. Orders come on standard input, or by
    /// `claymill order`: hold, run, step, abort, discard.
    Control(ControlArgs),
    /// Give a running reference controller an order, and say where the machine is.
    Order(OrderArgs),
    /// Pictures of a model or a job folder.
    Render(RenderArgs),
    /// Look at a model or a job folder in a window: turn, pick, measure, cut open, run along the paths.
    View(ViewArgs),
    /// The tool on its way over the model, as an animation true to the time.
    Animate(AnimateArgs),
    /// Pictures and report of a job folder, made anew.
    Report(ReportArgs),
    /// Write a generated model with its planted answers.
    Sample(SampleArgs),
    /// JSON Schemas of the job folder.
    Schema,
}

#[derive(Debug, Args)]
pub(crate) struct InspectArgs {
    /// IGES, STEP or Rhino 3dm file; or an obstacle mesh: STL, OBJ, glTF.
    pub(crate) model: PathBuf,
    /// Millimetres in one unit of a mesh whose format has no unit (STL, OBJ).
    #[arg(long, default_value_t = 1.0, value_name = "MM")]
    pub(crate) mesh_unit: f64,
    /// Picture of the model with its defects marked.
    #[arg(short, long, value_name = "PNG")]
    pub(crate) out: Option<PathBuf>,
    /// View of the picture: iso, top, left, right, front or rear.
    #[arg(long, default_value = "iso", requires = "out")]
    pub(crate) view: String,
    /// Width and height of the picture in pixels.
    #[arg(long, default_value = "1920x1080", value_name = "WxH", requires = "out")]
    pub(crate) size: String,
    #[command(flatten)]
    pub(crate) axes: AxisArgs,
}

#[derive(Debug, Args)]
pub(crate) struct DemoArgs {
    /// Job folder to write.
    #[arg(short, long, default_value = "out/demo", value_name = "DIR")]
    pub(crate) out: PathBuf,
    /// Number of patches that the vehicle is cut into.
    #[arg(long, default_value_t = 2000, value_name = "N")]
    pub(crate) patches: usize,
    /// Seed of the shuffle of patches.
    #[arg(long, default_value_t = 1)]
    pub(crate) seed: u64,
    /// Scale of the vehicle: 0.4 is the two-fifths model that studios mill first. The tool of the demo is
    /// ball:6 unless --tool names another one.
    #[arg(long, default_value_t = 0.4)]
    pub(crate) scale: f64,
    #[command(flatten)]
    pub(crate) job: JobOptions,
}

#[derive(Debug, Args)]
pub(crate) struct MergeArgs {
    /// IGES, STEP or Rhino 3dm file.
    pub(crate) model: PathBuf,
    /// Folder for regions.json and the picture.
    #[arg(short, long, value_name = "DIR")]
    pub(crate) out: Option<PathBuf>,
    /// Model file to write, with each region as a group in its colour: .igs, .stp or .glb.
    #[arg(long, value_name = "FILE")]
    pub(crate) export: Option<PathBuf>,
    /// Model file to write with one fitted and trimmed surface for each region that can be laid out in the plane
    /// (.igs, .stp or .glb); how far each is off, and why other regions have none, is printed.
    #[arg(long, value_name = "FILE")]
    pub(crate) drive_surfaces: Option<PathBuf>,
    /// Merge preset.
    #[arg(long, value_enum, default_value_t = PresetName::Clay)]
    pub(crate) preset: PresetName,
    /// Say of the N longest joints that were not merged what is missing, and how many regions there would
    /// be if they had been.
    #[arg(long, value_name = "N", num_args = 0..=1, default_missing_value = "20")]
    pub(crate) why: Option<usize>,
    /// Count the regions for a range of limits on angle and curvature; with --out also as sweep.json and
    /// sweep.svg. With --json the merge trees are printed instead of the regions.
    #[arg(long)]
    pub(crate) sweep: bool,
    #[command(flatten)]
    pub(crate) merging: MergingArgs,
    #[command(flatten)]
    pub(crate) axes: AxisArgs,
}

#[derive(Debug, Args)]
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
    #[command(flatten)]
    pub(crate) job: JobOptions,
}

#[derive(Debug, Args)]
pub(crate) struct CompareArgs {
    /// IGES, STEP or Rhino 3dm file.
    pub(crate) model: PathBuf,
    /// Folder for the comparison and one job folder for each combination.
    #[arg(short, long, value_name = "DIR")]
    pub(crate) out: PathBuf,
    /// Strategies to compare.
    #[arg(long, value_enum, value_delimiter = ',', value_name = "NAMES",
          default_values_t = [StrategyName::Planar, StrategyName::Iso, StrategyName::Scallop, StrategyName::IsoPatch,
                              StrategyName::Auto])]
    pub(crate) strategies: Vec<StrategyName>,
    /// Scallop heights, mm.
    #[arg(long, value_delimiter = ',', value_name = "MM", default_values_t = [0.1])]
    pub(crate) scallop: Vec<f64>,
    /// Tools: `ball:R` with the radius in mm.
    #[arg(long, value_delimiter = ',', value_name = "SHAPE:SIZE", default_values_t = ["ball:10".to_owned()])]
    pub(crate) tool: Vec<String>,
    /// How passes are joined.
    #[arg(long, value_enum, default_value_t = LinkName::Lace)]
    pub(crate) link: LinkName,
    /// Merge preset.
    #[arg(long, value_enum, default_value_t = PresetName::Clay)]
    pub(crate) preset: PresetName,
    /// Cut only these: `region:3`, `layer:NAME`, `colour:#RRGGBB`, `face:10-20`; may be repeated.
    #[arg(long, value_name = "WHAT", value_delimiter = ',')]
    pub(crate) only: Vec<String>,
    /// Leave these out; same forms as --only.
    #[arg(long, value_name = "WHAT", value_delimiter = ',')]
    pub(crate) skip: Vec<String>,
    /// Cutting feed, mm/min [default: 6000].
    #[arg(long, value_name = "MM_PER_MIN")]
    pub(crate) feed: Option<f64>,
    #[command(flatten)]
    pub(crate) axes: AxisArgs,
}

/// Options of a job; also the content of a job file.
#[derive(Debug, Clone, Default, Args, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub(crate) struct JobOptions {
    /// Tool: `ball:R` with the radius in mm [default: ball:10].
    #[arg(long, value_name = "SHAPE:SIZE")]
    pub(crate) tool: Option<String>,
    /// What holds the tool: how far it sticks out, mm, and sections from the tool up as diameters and length, for
    /// example 60:27-34x50,63x26; without sections a shrink-fit chuck on HSK-A63. auto for the least that does. It is
    /// drawn and verified, not planned around.
    #[arg(long, value_name = "STICKOUT[:SECTIONS]")]
    pub(crate) holder: Option<String>,
    /// Distance that the holder has to keep from the model, mm [default: 1].
    #[arg(long, value_name = "MM", allow_negative_numbers = true)]
    pub(crate) holder_clearance: Option<f64>,
    /// Rest passes: cut only what this larger tool could not, for example ball:10.
    #[arg(long, value_name = "SHAPE:SIZE")]
    pub(crate) rest_of: Option<String>,
    /// Scallop height between passes, mm [default: 0.1].
    #[arg(long, value_name = "MM", allow_negative_numbers = true)]
    pub(crate) scallop: Option<f64>,
    /// Strategy [default: planar].
    #[arg(long, value_enum)]
    pub(crate) strategy: Option<StrategyName>,
    /// Direction of planar rows in each setup, degrees [default: the cheapest one by region].
    #[arg(long, value_name = "DEG", allow_negative_numbers = true)]
    pub(crate) angle: Option<f64>,
    /// How passes are joined [default: lace].
    #[arg(long, value_enum)]
    pub(crate) link: Option<LinkName>,
    /// Merge preset [default: clay].
    #[arg(long, value_enum)]
    pub(crate) preset: Option<PresetName>,
    /// Cut only these: `region:3`, `layer:NAME`, `colour:#RRGGBB`, `face:10-20`; may be repeated.
    #[arg(long, value_name = "WHAT", value_delimiter = ',')]
    pub(crate) only: Vec<String>,
    /// Leave these out; same forms as --only.
    #[arg(long, value_name = "WHAT", value_delimiter = ',')]
    pub(crate) skip: Vec<String>,
    /// Obstacle that no move may touch, as a mesh in the model's place: STL, OBJ or glTF; may be repeated.
    #[arg(long, value_name = "FILE")]
    pub(crate) check: Vec<PathBuf>,
    /// Millimetres in one unit of obstacles whose format has no unit (STL, OBJ) [default: 1].
    #[arg(long, value_name = "MM", requires = "check")]
    pub(crate) mesh_unit: Option<f64>,
    /// Cutting feed, mm/min [default: 6000].
    #[arg(long, value_name = "MM_PER_MIN")]
    pub(crate) feed: Option<f64>,
    #[command(flatten)]
    #[serde(flatten)]
    pub(crate) merging: MergingArgs,
    #[command(flatten)]
    #[serde(flatten)]
    pub(crate) axes: AxisArgs,
}

#[derive(Debug, Clone, Default, Args, Serialize, Deserialize)]
pub(crate) struct AxisArgs {
    /// Model axis that points up, for example +z [default: guessed and printed].
    #[arg(long, value_name = "AXIS", allow_hyphen_values = true)]
    pub(crate) up: Option<String>,
    /// Model axis that points from the rear of the vehicle to its front, for example -y [default: guessed].
    #[arg(long, value_name = "AXIS", allow_hyphen_values = true)]
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
    Iso,
    /// Lines at a constant scallop height from one side of a region.
    Scallop,
    /// Parameter lines of every patch by itself.
    IsoPatch,
    /// For each region whatever costs least of planar, iso and scallop.
    Auto,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum LinkName {
    Lace,
    Box,
}

#[derive(Debug, Args)]
pub(crate) struct VerifyArgs {
    /// Job folder.
    pub(crate) folder: PathBuf,
    /// The model, where it is no longer at the path that the job names.
    #[arg(long)]
    pub(crate) model: Option<PathBuf>,
    /// Further obstacle that no move may touch: STL, OBJ or glTF; may be repeated. Those that the job was planned
    /// around are checked without asking.
    #[arg(long, value_name = "FILE")]
    pub(crate) check: Vec<PathBuf>,
    /// Millimetres in one unit of obstacles whose format has no unit (STL, OBJ).
    #[arg(long, default_value_t = 1.0, value_name = "MM", requires = "check")]
    pub(crate) mesh_unit: f64,
    /// Look at this holder instead of the job's: see plan.
    #[arg(long, value_name = "STICKOUT[:SECTIONS]")]
    pub(crate) holder: Option<String>,
    /// Distance that the holder has to keep from the model, mm [default: as planned].
    #[arg(long, value_name = "MM", allow_negative_numbers = true)]
    pub(crate) holder_clearance: Option<f64>,
    /// Verify this program instead of the folder's own moves: as its control will see it. May be repeated for
    /// a program of several files, in order.
    #[arg(long, value_name = "FILE")]
    pub(crate) program: Vec<PathBuf>,
    /// The program's dialect, where its header does not name it.
    #[arg(long, value_name = "DIALECT", requires = "program")]
    pub(crate) dialect: Option<String>,
    /// The machine definition (TOML) that the program was written with.
    #[arg(long, value_name = "FILE", requires = "program")]
    pub(crate) machine: Option<PathBuf>,
}

#[derive(Debug, Args)]
pub(crate) struct AnimateArgs {
    /// Job folder.
    pub(crate) folder: PathBuf,
    /// File to write: .png (animated), .gif, or .mp4 and .webm through ffmpeg.
    #[arg(short, long, value_name = "FILE")]
    pub(crate) out: PathBuf,
    /// The model, where it is no longer at the path that the job names.
    #[arg(long)]
    pub(crate) model: Option<PathBuf>,
    /// How long the animation takes, s: the whole job in that time.
    #[arg(long, default_value_t = 10.0, value_name = "S")]
    pub(crate) seconds: f64,
    /// Frames a second.
    #[arg(long, default_value_t = 12)]
    pub(crate) fps: u16,
    /// Twelve frames on one sheet instead, as a .png.
    #[arg(long)]
    pub(crate) storyboard: bool,
    /// Show the material that is left instead of the paths: at the start of every setup it stands this far above what
    /// was not cut before, along the tool axis, mm.
    #[arg(long, value_name = "MM", num_args = 0..=1, default_missing_value = "3")]
    pub(crate) stock: Option<f64>,
    /// Draw the tool with this holder instead of the job's: see plan.
    #[arg(long, value_name = "STICKOUT[:SECTIONS]")]
    pub(crate) holder: Option<String>,
    /// Look only at a box of this size around the tool, mm.
    #[arg(long, value_name = "MM")]
    pub(crate) follow: Option<f64>,
    /// iso, top, left, right, front or rear.
    #[arg(long, default_value = "iso")]
    pub(crate) view: String,
    /// Another camera instead, as in `claymill render`.
    #[arg(long, value_name = "CAMERA", allow_hyphen_values = true, conflicts_with = "view")]
    pub(crate) camera: Option<String>,
    /// Width and height in pixels.
    #[arg(long, default_value = "960x540", value_name = "WxH")]
    pub(crate) size: String,
}

#[derive(Debug, Args)]
pub(crate) struct ReportArgs {
    /// Job folder.
    pub(crate) folder: PathBuf,
    /// The model, where it is no longer at the path that the job names.
    #[arg(long)]
    pub(crate) model: Option<PathBuf>,
}

#[derive(Debug, Args)]
pub(crate) struct StreamArgs {
    /// Job folder.
    pub(crate) folder: PathBuf,
    /// linuxcnc:HOST:PORT, shm:FILE (a queue in memory, for example shm:/dev/shm/mill) or tcp:HOST:PORT.
    #[arg(long, value_name = "TARGET")]
    pub(crate) to: String,
    /// Begin at this move.
    #[arg(long, value_name = "SEQ", default_value_t = 0)]
    pub(crate) from: u64,
    /// First come to rest and drop what the machine was doing; the way to the move leads up to the clearance height,
    /// across and down. For tcp.
    #[arg(long)]
    pub(crate) restart: bool,
    /// Only this region.
    #[arg(long, value_name = "ID")]
    pub(crate) region: Option<usize>,
    /// Machine definition (TOML), for linuxcnc.
    #[arg(long, value_name = "FILE")]
    pub(crate) machine: Option<PathBuf>,
    /// Version of LinuxCNC: 2.9 or 2.10 [default: 2.9].
    #[arg(long, value_name = "VERSION")]
    pub(crate) version: Option<String>,
    /// File with the secret that both sides share, for tcp.
    #[arg(long, value_name = "FILE")]
    pub(crate) secret: Option<PathBuf>,
    /// The target may be another machine.
    #[arg(long)]
    pub(crate) remote: bool,
}

#[derive(Debug, Args)]
pub(crate) struct ControlArgs {
    /// The queue's file, for example /dev/shm/mill.
    #[arg(long, value_name = "FILE")]
    pub(crate) queue: PathBuf,
    /// Take connections at this address into the queue.
    #[arg(long, value_name = "HOST:PORT", requires = "secret")]
    pub(crate) listen: Option<String>,
    /// File with the secret that both sides share.
    #[arg(long, value_name = "FILE")]
    pub(crate) secret: Option<PathBuf>,
    /// Other machines may connect.
    #[arg(long)]
    pub(crate) remote: bool,
    /// Machine definition (TOML): its dynamics count.
    #[arg(long, value_name = "FILE")]
    pub(crate) machine: Option<PathBuf>,
    /// Stop after every path until told to run.
    #[arg(long)]
    pub(crate) step: bool,
    /// Begin at rest, until told to run.
    #[arg(long)]
    pub(crate) hold: bool,
    /// Do not keep to real time.
    #[arg(long)]
    pub(crate) fast: bool,
}

#[derive(Debug, Args)]
pub(crate) struct OrderArgs {
    /// hold: come to rest on the path. run: go on. step: go on to the end of the path. abort: come to rest and leave;
    /// what was not done stays in the queue. discard: come to rest and drop the path and all that waits. status: none.
    pub(crate) order: String,
    /// Address of `claymill control --listen`.
    #[arg(long, value_name = "HOST:PORT")]
    pub(crate) to: String,
    /// File with the secret that both sides share.
    #[arg(long, value_name = "FILE")]
    pub(crate) secret: PathBuf,
    /// The target may be another machine.
    #[arg(long)]
    pub(crate) remote: bool,
}

#[derive(Debug, Args)]
pub(crate) struct PostArgs {
    /// Job folder.
    pub(crate) folder: PathBuf,
    /// fanuc, mitsubishi, siemens, heidenhain, linuxcnc, beckhoff, g1, apt, apt-creo or step-nc.
    #[arg(long, value_name = "DIALECT")]
    pub(crate) to: String,
    /// Program to write.
    #[arg(short, long, value_name = "FILE")]
    pub(crate) out: PathBuf,
    /// Machine definition (TOML).
    #[arg(long, value_name = "FILE")]
    pub(crate) machine: Option<PathBuf>,
    /// Version of LinuxCNC: 2.9 or 2.10 [default: 2.9].
    #[arg(long, value_name = "VERSION")]
    pub(crate) version: Option<String>,
    /// Run the program on a virtual control too: cut error, feed and time go into the totals.
    #[arg(long)]
    pub(crate) simulate: bool,
}

#[derive(Debug, Args)]
pub(crate) struct SimulateArgs {
    /// Job folder that the program was written from.
    pub(crate) folder: PathBuf,
    /// The program. May be repeated for a program of several files, in order.
    #[arg(long, value_name = "FILE", required = true)]
    pub(crate) program: Vec<PathBuf>,
    /// The program's dialect, where its header does not name it.
    #[arg(long, value_name = "DIALECT")]
    pub(crate) dialect: Option<String>,
    /// The machine definition (TOML) that the program was written with.
    #[arg(long, value_name = "FILE")]
    pub(crate) machine: Option<PathBuf>,
}

#[derive(Debug, Args)]
pub(crate) struct RenderArgs {
    /// Job folder or model file.
    pub(crate) what: PathBuf,
    /// PNG file to write; or a model file with the regions, and as .glb with the tool paths too (.igs, .stp, .glb).
    #[arg(short, long, value_name = "PNG")]
    pub(crate) out: PathBuf,
    /// iso, top, left, right, front or rear; several make a file each, NAME-VIEW.png.
    #[arg(long, default_value = "iso", value_delimiter = ',')]
    pub(crate) view: Vec<String>,
    /// Another camera instead: AZIMUTH/ELEVATION in degrees (0/0 in front, 90/0 on the left, 0/90 above), or
    /// eye and target in mm as X,Y,Z,X,Y,Z.
    #[arg(long, value_name = "CAMERA", allow_hyphen_values = true, conflicts_with = "view")]
    pub(crate) camera: Option<String>,
    /// Only a part of the model fills the picture: region:3, face:17, layer:NAME; several with commas.
    #[arg(long, value_name = "WHAT", value_delimiter = ',')]
    pub(crate) focus: Vec<String>,
    /// What is drawn.
    #[arg(long, value_enum, value_delimiter = ',', value_name = "WHAT",
          default_values_t = [ShowName::Regions, ShowName::Joints, ShowName::Trims, ShowName::Cut, ShowName::Link])]
    pub(crate) show: Vec<ShowName>,
    /// What colours the tool paths; with anything but region the model is drawn in clay.
    #[arg(long, value_enum, default_value_t = PathColour::Region, value_name = "WHAT")]
    pub(crate) paths_by: PathColour,
    /// The job at a time: paths until then and the tool where it is. 40%, 90 (seconds), 12:30 or 1:12:30.
    #[arg(long, value_name = "TIME")]
    pub(crate) at: Option<String>,
    /// Material over the model where it is drawn (stock), mm along the tool axis.
    #[arg(long, default_value_t = 3.0, value_name = "MM")]
    pub(crate) allowance: f64,
    /// Draw the tool with this holder instead of the job's: see plan.
    #[arg(long, value_name = "STICKOUT[:SECTIONS]")]
    pub(crate) holder: Option<String>,
    /// Mirror light and dark stripes in the surfaces, to judge their continuity.
    #[arg(long)]
    pub(crate) zebra: bool,
    /// No backdrop, caption, legend and axes: the model on a transparent ground.
    #[arg(long)]
    pub(crate) transparent: bool,
    /// Draw at twice the size and average: finer lines, four times the work.
    #[arg(long)]
    pub(crate) supersample: bool,
    /// Width and height in pixels.
    #[arg(long, default_value = "1920x1080", value_name = "WxH")]
    pub(crate) size: String,
    /// Leave the tool paths out.
    #[arg(long)]
    pub(crate) no_paths: bool,
    /// The model of a job, where it is no longer at the path that the job names.
    #[arg(long)]
    pub(crate) model: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) axes: AxisArgs,
}

#[derive(Debug, Args)]
pub(crate) struct ViewArgs {
    /// Job folder or model file.
    pub(crate) what: PathBuf,
    /// The model, where it is no longer at the path that the job names.
    #[arg(long)]
    pub(crate) model: Option<PathBuf>,
    /// Draw the tool with this holder instead of the job's: see plan.
    #[arg(long, value_name = "STICKOUT[:SECTIONS]")]
    pub(crate) holder: Option<String>,
    /// Dark surroundings.
    #[arg(long)]
    pub(crate) dark: bool,
    /// Width and height of the window.
    #[arg(long, default_value = "1440x900", value_name = "WxH")]
    pub(crate) size: String,
    /// Write a picture of the window as it opens instead of opening it; needs no display.
    #[arg(long, value_name = "PNG")]
    pub(crate) picture: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) axes: AxisArgs,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum ShowName {
    /// The surfaces, in clay.
    Model,
    /// The surfaces, in the colours of their regions.
    Regions,
    /// Outlines of regions.
    Joints,
    /// Outlines of the patches inside regions.
    Trims,
    /// Joints, coloured by their class: C0, G1, G2.
    Classes,
    /// Joints, coloured by what is worst on them against the preset's limits: gap, angle or curvature.
    Worst,
    /// Lines of each region's harmonic field, in two colours by turns.
    IsoLines,
    /// Cutting moves.
    Cut,
    /// Moves between passes, down on the model.
    Link,
    /// Moves onto and off the model.
    Lead,
    /// Rapid moves.
    Rapid,
    /// Numbers of the regions.
    Labels,
    /// Control points of the surfaces.
    ControlNets,
    /// Control polygons of cuts and links, at the ball's middle.
    ControlPolygons,
    /// The tool with its holder, halfway through the job or --at.
    Tool,
    /// The material that is left --at a time, by default at the end.
    Stock,
    /// The model coloured by the scallop height, which is measured for it.
    Scallop,
    /// The model coloured by what is cut and what is not and why, which is measured for it.
    Uncut,
    /// Marks where the ball enters a face by more than 1 µm, which is measured for it.
    Gouges,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum PathColour {
    /// Cuts by their region, all else by its kind.
    Region,
    /// Cut, link, lead and rapid.
    Kind,
    /// First to last pass of each region.
    Pass,
    /// Slow to fast.
    Feed,
}

#[derive(Debug, Args)]
pub(crate) struct SampleArgs {
    /// Which model: roadster, panel or ribbon.
    pub(crate) name: String,
    /// File to write (.igs or .stp); the answers go beside it as NAME.answers.json.
    #[arg(short, long, value_name = "FILE")]
    pub(crate) out: PathBuf,
    /// Number of patches.
    #[arg(long, default_value_t = 2000, value_name = "N")]
    pub(crate) patches: usize,
    /// Seed of the shuffle.
    #[arg(long, default_value_t = 1)]
    pub(crate) seed: u64,
    /// Scale.
    #[arg(long, default_value_t = 1.0)]
    pub(crate) scale: f64,
    /// Plant a flaw of known size; may be repeated. Into any model: duplicate:N, lap:N, flip:N, delete:N,
    /// round:DIGITS. Into the ribbon also: gap:MM, shift:MM, kink:DEG, curvature:PER_MM, t-junctions.
    #[arg(long = "flaw", value_name = "KIND:SIZE")]
    pub(crate) flaws: Vec<Flaw>,
}
