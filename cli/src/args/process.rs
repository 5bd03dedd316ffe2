//! What a whole job is chosen from: material, tools, stock.

use std::path::PathBuf;

use clap::Args;

const PROCESS: &str = "Whole job";

/// What a whole job is chosen from. With a material, `plan` chooses the operations.
#[derive(Debug, Clone, Args)]
pub(crate) struct ProcessArgs {
    /// Choose the operations of a whole job for this material: clay, foam or aluminium, or a profile of your own (TOML). The
    /// choice is printed with its reasons, and written as a job file that can be edited and run again.
    #[arg(help_heading = PROCESS, long, value_name = "NAME|FILE")]
    pub(crate) material: Option<String>,
    /// Tool library: our TOML, Fusion .json or .tools, FreeCAD .fctb, LinuxCNC tool.tbl [default: the shipped one].
    #[arg(help_heading = PROCESS, long, value_name = "FILE", requires = "material")]
    pub(crate) tools: Option<PathBuf>,
    /// Process profile (TOML) of your own; may be repeated [default: the shipped one for the material].
    #[arg(help_heading = PROCESS, long, value_name = "FILE", requires = "material")]
    pub(crate) process: Vec<PathBuf>,
    /// Stock: layer:MM on all faces, block:MM around the model, a block by two corners, X,Y,Z:X,Y,Z, round:DIAMETER[:x|y|z], a bar,
    /// or file:PATH, a body (a solid or a closed mesh) [default: as usual for the material].
    #[arg(help_heading = PROCESS, long, value_name = "STOCK", requires = "material", allow_hyphen_values = true)]
    pub(crate) stock: Option<String>,
}
