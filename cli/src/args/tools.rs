//! Tool libraries.

use std::path::PathBuf;

use clap::{Args, ValueEnum};

#[derive(Debug, Args)]
pub(crate) struct ToolsArgs {
    /// Tool library: claymill's TOML, Fusion (.json, .tools), FreeCAD (.fctb) or LinuxCNC (tool.tbl) [default: the
    /// shipped one].
    pub(crate) library: Option<PathBuf>,
    /// Draw all tools to one scale into this file.
    #[arg(long, value_name = "FILE")]
    pub(crate) svg: Option<PathBuf>,
    /// Check the tools against a machine definition (TOML, or FreeCAD's .fcm).
    #[arg(long, value_name = "FILE")]
    pub(crate) machine: Option<PathBuf>,
    /// Check their cutting data for a material: clay, foam, aluminium, or a material file.
    #[arg(long, value_name = "NAME")]
    pub(crate) material: Option<String>,
    /// Unit of a LinuxCNC tool table, which has none of its own.
    #[arg(long, value_name = "UNIT", default_value = "mm")]
    pub(crate) table_unit: TableUnit,
}

/// Unit of a tool table.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum TableUnit {
    Mm,
    Inch,
}
