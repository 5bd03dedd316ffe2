//! A part from a bar.

use std::path::PathBuf;

use clap::Args;

#[derive(Debug, Args)]
pub(crate) struct PrototypeArgs {
    /// IGES, STEP or Rhino 3dm file of a closed part.
    pub(crate) part: PathBuf,
    /// Bar: `round:DIAMETER` in mm, or `auto` for the thinnest that holds the part.
    #[arg(long, default_value = "auto", value_name = "round:D|auto")]
    pub(crate) stock: String,
    /// What the bar is made of: aluminium, steel, ductile-iron, brass, delrin or tooling-board.
    #[arg(long, default_value = "aluminium", value_name = "NAME")]
    pub(crate) material: String,
    /// Tool library: the thinnest ball that is long enough is taken.
    #[arg(long, value_name = "FILE", conflicts_with = "tool")]
    pub(crate) tools: Option<PathBuf>,
    /// Tool that finishes, as for `plan` [default: ball:3].
    #[arg(long, value_name = "SHAPE:SIZE")]
    pub(crate) tool: Option<String>,
    /// Tool that roughs the bar by levels, as for `plan`: the job is then planned and verified with its stock. Without it the job is
    /// the finish alone.
    #[arg(long, value_name = "SHAPE:SIZE")]
    pub(crate) rough: Option<String>,
    /// Cutting feed, mm/min.
    #[arg(long, default_value_t = 1000.0, value_name = "MM_PER_MIN", allow_negative_numbers = true)]
    pub(crate) feed: f64,
    /// Holder of the tool that finishes, as for `plan`.
    #[arg(long, value_name = "MM[:SECTIONS]", conflicts_with = "tools")]
    pub(crate) holder: Option<String>,
    /// Axis that the part is turned about: x, y, z, or auto for the one that suits it.
    #[arg(long, default_value = "auto", value_name = "x|y|z|auto")]
    pub(crate) axis: String,
    /// An angle that is cut from in any case, degrees; may be repeated.
    #[arg(long, value_name = "DEG", allow_negative_numbers = true)]
    pub(crate) forced: Vec<f64>,
    /// Share of what can be reached that is reached at least, percent.
    #[arg(long, default_value_t = 99.5, value_name = "PERCENT", allow_negative_numbers = true)]
    pub(crate) share: f64,
    /// Force of the cut across the axis, N.
    #[arg(long, default_value_t = 100.0, value_name = "N", allow_negative_numbers = true)]
    pub(crate) cutting_force: f64,
    /// The part's tolerance, mm: supports give way by half of it at most.
    #[arg(long, default_value_t = 0.15, value_name = "MM", allow_negative_numbers = true)]
    pub(crate) tolerance: f64,
    /// Largest height of crests between passes, mm.
    #[arg(long, default_value_t = 0.05, value_name = "MM", allow_negative_numbers = true)]
    pub(crate) scallop: f64,
    /// Machine definition with a rotary axis along x; without it no program is written.
    #[arg(long, value_name = "TOML")]
    pub(crate) machine: Option<PathBuf>,
    /// What fits between the chucks, mm.
    #[arg(long, default_value_t = 1000.0, value_name = "MM", allow_negative_numbers = true)]
    pub(crate) between_chucks: f64,
    /// Find axis, angles and supports only: no passes.
    #[arg(long)]
    pub(crate) no_passes: bool,
    /// Folder for the part with its supports, the setup sheet, the job and the program.
    #[arg(short, long, value_name = "DIR")]
    pub(crate) out: PathBuf,
}
