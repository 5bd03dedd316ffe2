//! What has been planned: verified, drawn, reported.

use std::path::PathBuf;

use clap::{Args, ValueEnum};

use super::AxisArgs;

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
    #[arg(long, default_value_t = 1.0, value_name = "MM", requires = "check", allow_negative_numbers = true)]
    pub(crate) mesh_unit: f64,
    /// Distance that the ball has to keep from obstacles, mm [default: as planned; 1 where the job was not planned around any].
    #[arg(long, value_name = "MM", allow_negative_numbers = true)]
    pub(crate) check_clearance: Option<f64>,
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
    #[arg(long, default_value_t = 10.0, value_name = "S", allow_negative_numbers = true)]
    pub(crate) seconds: f64,
    /// Frames a second.
    #[arg(long, default_value_t = 12)]
    pub(crate) fps: u16,
    /// Twelve frames on one sheet instead, as a .png.
    #[arg(long)]
    pub(crate) storyboard: bool,
    /// Show the material that is left instead of the paths: at the start of every setup it stands this far above what
    /// was not cut before, along the tool axis, mm.
    #[arg(long, value_name = "MM", num_args = 0..=1, default_missing_value = "3", allow_negative_numbers = true)]
    pub(crate) stock: Option<f64>,
    /// Draw the tool with this holder instead of the job's: see plan.
    #[arg(long, value_name = "STICKOUT[:SECTIONS]")]
    pub(crate) holder: Option<String>,
    /// Look only at a box of this size around the tool, mm.
    #[arg(long, value_name = "MM", allow_negative_numbers = true)]
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
pub(crate) struct StockArgs {
    /// Job folder.
    pub(crate) folder: PathBuf,
    /// The model, where it is no longer at the path that the job names.
    #[arg(long)]
    pub(crate) model: Option<PathBuf>,
    /// Mesh to write, as binary STL in millimetres: what is left after the last operation.
    #[arg(short, long, value_name = "STL")]
    pub(crate) out: Option<PathBuf>,
    /// Write what is left after this operation instead.
    #[arg(long, value_name = "OPERATION", requires = "out")]
    pub(crate) after: Option<String>,
    /// Largest distance of the rays on which the stock is known, mm: sharp edges of the mesh are rounded by about half of it
    /// [default: a 400th of the longest side].
    #[arg(long, value_name = "MM", allow_negative_numbers = true)]
    pub(crate) pitch: Option<f64>,
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
    #[arg(long, default_value_t = 3.0, value_name = "MM", allow_negative_numbers = true)]
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
    /// Where one setup ends and the next goes on.
    Setup,
    /// Cut, link, lead and rapid.
    Kind,
    /// First to last pass of each region.
    Pass,
    /// Slow to fast.
    Feed,
}
