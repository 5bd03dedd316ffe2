//! What a shop has and how it works: tool libraries, limits of machines, materials, processes, and
//! the chain of tools for what the finishing tool leaves.
//!
//! ```text
//!   tools.toml  library.json  .tools  .fctb  tool.tbl ──► Library ── check ──► Finding
//!                                                            │  └─ tool_svg, library_svg, library_table
//!   machine.toml  .fcm ──► MachineShape ──┐                  │
//!   material-*.toml ──► Material ─────────┼─► Conditions ◄───┘   speed and feed
//!   process-*.toml ───► Profiles ─────────┴─► Process            every value with its origin
//!
//!   reach of each tool ──► ReachModel ──► tool_chain             large to small, least time
//! ```
//!
//! Lengths are millimetres. Each file states its format and version. Foreign files are read as far as they describe ball,
//! flat and bull nose end mills; everything else is listed with the reason. `docs/tools.md` describes the forms.
//!
//! ```
//! use std::{collections::BTreeMap, path::Path};
//! use claymill_tooling::{Engagement, Library, MachineShape, Profiles, StageKind};
//!
//! let text = r#"
//!     format = "claymill-tools"
//!     version = 1
//!     [[tools]]
//!     id = "T7"
//!     tool = "ball:5"
//!     flutes = 2
//!     holder = "60"
//!     [tools.cutting.aluminium]
//!     vc_m_per_min = 200
//!     fz_mm = 0.08
//! "#;
//! let library = Library::parse(text, Path::new("tools.toml"))?;
//! let tool = library.get("T7").ok_or("no T7")?;
//!
//! // The process for aluminium, each value with the file that it is from.
//! let profiles = Profiles::shipped();
//! let process = profiles.resolve("aluminium", "aluminium", &BTreeMap::new())?;
//! let rough = process.stage(StageKind::Rough).ok_or("no roughing")?;
//! assert_eq!(rough.allowance_mm.value, 0.4);
//! assert_eq!(
//!     rough.allowance_mm.from.to_string(),
//!     "material aluminium, (shipped)/material-aluminium.toml"
//! );
//!
//! // A ball that cuts 0.3 mm deep cuts on 3.4 mm of its 10 mm: the spindle would have to turn at 18660 1/min.
//! let material = profiles.material("aluminium").ok_or("no aluminium")?;
//! let mode = Engagement { ap_mm: Some(0.3), ..Engagement::default() };
//! let cutting = tool.cutting_for(material)?;
//! let conditions = cutting.conditions(tool, &mode, Some(&MachineShape::shipped()))?;
//! assert_eq!(conditions.rpm, 18000.0);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

// What is to be said is returned: only the command prints.
#![cfg_attr(not(test), warn(clippy::print_stdout, clippy::print_stderr))]

mod chain;
mod check;
mod cutting;
mod drawing;
mod error;
mod form;
mod library;
mod machine;
mod process;
mod read;
mod rest;
mod sheet;
mod shipped;
mod table;

pub use chain::{
    ChainError, ChainStep, ChainTool, MOST_CHAIN_TOOLS, OtherTool, ReachModel, ReachPatch, ToolChain,
    tool_chain,
};
pub use check::{CheckAgainst, Finding, FindingCode, Severity, check_library, check_tool};
pub use cutting::{
    Conditions, CuttingError, Engagement, MachineBound, chip_ratio, edge_speed_m_per_min,
    effective_diameter_mm, engagement_deg, spindle_rpm,
};
pub use drawing::{Silhouette, tool_svg};
pub use error::{Fault, ToolingError};
pub use library::{
    Advance, Cutting, LIBRARY_FORMAT, LIBRARY_VERSION, Library, LibraryTool, Speed, library_schema,
};
pub use machine::{Changer, FeedLimits, MachineShape, RotaryAxis, SpindleLimits};
pub use process::{
    Condition, ConditionError, CutPattern, Fact, Facts, KNOWN_FACTS, Material, Origin, PROCESS_FORMAT,
    Process, ProcessFile, Profiles, Resolved, Spacing, Stage, StageKind, StageValues, StrategyName,
    ToolChoice, Way, material_schema, process_schema,
};
pub use read::{
    LengthUnit, LibraryFormat, LibraryReading, ReadOptions, SkippedTool, machine_from_freecad, parse_library,
    read_library,
};
pub use rest::{groove_rest_mm2, pocket_removed_mm3, pocket_rest_mm3, slot_hang_mm};
pub use sheet::library_svg;
pub use table::library_table;
