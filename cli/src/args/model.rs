//! Models: looked at, sewn, made.

use std::path::PathBuf;

use clap::Args;
use claymill_models::Flaw;
use claymill_toolpath::Mirror;

use super::{AxisArgs, OneJob, PresetName, ProcessArgs};
use crate::merging::MergingArgs;

#[derive(Debug, Args)]
pub(crate) struct InspectArgs {
    /// IGES, STEP or Rhino 3dm file; or an obstacle mesh: STL, OBJ, glTF.
    pub(crate) model: PathBuf,
    /// Millimetres in one unit of a mesh whose format has no unit (STL, OBJ).
    #[arg(long, default_value_t = 1.0, value_name = "MM", allow_negative_numbers = true)]
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
    #[arg(long, default_value_t = 2000, value_name = "N", allow_negative_numbers = true)]
    pub(crate) patches: usize,
    /// Seed of the shuffle of patches.
    #[arg(long, default_value_t = 1)]
    pub(crate) seed: u64,
    /// Scale of the vehicle: 0.4 is the two-fifths model that studios mill first. The demo mills it out of a
    /// layer of clay in the operations that suit; --material names another material, --tool makes one
    /// operation with this tool.
    #[arg(long, default_value_t = 0.4)]
    pub(crate) scale: f64,
    #[command(flatten)]
    pub(crate) process: ProcessArgs,
    #[command(flatten)]
    pub(crate) job: OneJob,
}

#[derive(Debug, Args)]
pub(crate) struct DropArgs {
    /// IGES, STEP or Rhino 3dm file.
    pub(crate) model: PathBuf,
    /// Tool: `ball:R`, `flat:R` or `bull:R:CORNER` with radii in mm, and a taper and a shank of its own as in
    /// `bull:5:1,taper:3,length:30,shank:12`.
    #[arg(long, value_name = "SHAPE:SIZE")]
    pub(crate) tool: String,
    /// A point on the line along which the tool comes down, in the model's coordinates; may be repeated.
    #[arg(long, value_name = "X,Y,Z", required = true, allow_hyphen_values = true)]
    pub(crate) at: Vec<String>,
    /// Picture of the model with the tool where it comes to rest.
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
pub(crate) struct MergeArgs {
    /// IGES, STEP or Rhino 3dm file.
    pub(crate) model: PathBuf,
    /// Folder for regions.json and the picture.
    #[arg(short, long, value_name = "DIR")]
    pub(crate) out: Option<PathBuf>,
    /// Model file to write, with each region as a group in its colour: .igs, .stp or .glb.
    #[arg(long, value_name = "FILE")]
    pub(crate) export: Option<PathBuf>,
    /// The mirror image in the plane through the origin that stands on this axis; the half in the file and its image with
    /// y:both.
    #[arg(long, value_name = "AXIS[:both]", requires = "export", conflicts_with = "out")]
    pub(crate) mirror: Option<Mirror>,
    /// Model file to write with one fitted and trimmed surface for each region that can be laid out in the plane
    /// (.igs, .stp or .glb); how far each is off, and why other regions have none, is printed.
    #[arg(long, value_name = "FILE")]
    pub(crate) drive_surfaces: Option<PathBuf>,
    /// Merge preset.
    #[arg(long, value_enum, default_value_t = PresetName::Clay)]
    pub(crate) preset: PresetName,
    /// Say of the N longest joints that were not merged what is missing, and how many regions there would
    /// be if they had been.
    #[arg(long, value_name = "N", num_args = 0..=1, default_missing_value = "20", allow_negative_numbers = true)]
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
pub(crate) struct SampleArgs {
    /// Which model: roadster, panel or ribbon.
    pub(crate) name: String,
    /// File to write (.igs or .stp); the answers go beside it as NAME.answers.json.
    #[arg(short, long, value_name = "FILE")]
    pub(crate) out: PathBuf,
    /// Number of patches.
    #[arg(long, default_value_t = 2000, value_name = "N", allow_negative_numbers = true)]
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
    /// The roadster after a change of its designer's: the middle of a wing lies this much further out, mm.
    #[arg(long, value_name = "MM", num_args = 0..=1, default_missing_value = "2", require_equals = true, conflicts_with = "flaws")]
    pub(crate) edit: Option<f64>,
}
