//! What directions reach.

use std::path::PathBuf;

use clap::Args;

use super::AxisArgs;

#[derive(Debug, Args)]
pub(crate) struct ReachArgs {
    /// IGES, STEP or Rhino 3dm file.
    pub(crate) model: PathBuf,
    /// Axis that the part is turned about: x, y, z, or auto for the one that suits it. Without it the head is tilted.
    #[arg(long, value_name = "x|y|z|auto")]
    pub(crate) axis: Option<String>,
    /// Tool: `ball:R`, `flat:R` or `bull:R:CORNER` with radii in mm, and a taper and a shank of its own as in
    /// `bull:5:1,taper:3,length:30,shank:12`.
    #[arg(long, default_value = "ball:10", value_name = "SHAPE:SIZE")]
    pub(crate) tool: String,
    /// Holder: the stick-out in mm, for example 60, or with its own sections as in 60:27-34x50,63x26.
    #[arg(long, value_name = "MM[:SECTIONS]")]
    pub(crate) holder: Option<String>,
    /// How far the head tilts from the up axis, degrees: 90 for all sides, 180 for the underside as well.
    #[arg(
        long,
        default_value_t = 90.0,
        value_name = "DEG",
        allow_negative_numbers = true,
        conflicts_with = "axis"
    )]
    pub(crate) tilt_limit: f64,
    /// How far the surface may lean from the tool's axis, degrees; upright faces are reached by the tool's side.
    #[arg(long, default_value_t = 80.0, value_name = "DEG", allow_negative_numbers = true)]
    pub(crate) steepest: f64,
    /// A direction that is taken in any case, from the tip to the holder in model coordinates; about an axis an angle in
    /// degrees. May be repeated.
    #[arg(long, value_name = "X,Y,Z|DEG", allow_hyphen_values = true)]
    pub(crate) forced: Vec<String>,
    /// Share of what can be reached that the chosen directions reach at least, percent.
    #[arg(long, default_value_t = 99.0, value_name = "PERCENT", allow_negative_numbers = true)]
    pub(crate) share: f64,
    /// Where the material is, as for `plan`; may be repeated.
    #[arg(long, value_name = "[WHAT=]SIDE", value_delimiter = ',', allow_hyphen_values = true)]
    pub(crate) material_side: Vec<String>,
    /// File for the result with its proof.
    #[arg(short, long, default_value = "reach.json", value_name = "JSON")]
    pub(crate) out: PathBuf,
    /// Picture of the model with marks where no direction reaches.
    #[arg(long, value_name = "PNG")]
    pub(crate) picture: Option<PathBuf>,
    /// View of the picture: iso, top, left, right, front or rear.
    #[arg(long, default_value = "iso", requires = "picture")]
    pub(crate) view: String,
    /// Width and height of the picture in pixels.
    #[arg(long, default_value = "1920x1080", value_name = "WxH", requires = "picture")]
    pub(crate) size: String,
    #[command(flatten)]
    pub(crate) axes: AxisArgs,
}
