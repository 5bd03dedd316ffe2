//! The vocabulary of results: tools, moves and the job folder, which is claymill's public file format.
//!
//! ```text
//!   job folder ─┬─ job.json         what was asked, what was done, totals      → Job
//!               ├─ regions.json     regions and joints                        → RegionsFile
//!               ├─ toolpaths.jsonl  one move a line, in machining order       → Program
//!               └─ verify.json, report.html, *.png   (written by other crates)
//! ```
//!
//! Lengths are millimetres in model coordinates; a move's points are positions of the tool *tip*:
//! `p_tip = p_contact + R·n − R·a` for a ball of radius `R`, surface normal `n` and tool axis `a`.
//!
//! ```
//! use claymill_toolpath::{Move, MoveKind, Tool};
//! let tool: Tool = "ball:10".parse()?;
//! assert_eq!(tool, Tool::ball(10.0));
//! let line = r#"{"seq":1,"setup":"top","region":3,"pass":5,"kind":"cut","tool":"T1","degree":1,
//!     "knots":[0,0,5,5],"weights":null,"points":[[0,0,0],[3,4,0]],
//!     "axis_start":[0,0,1],"axis_end":[0,0,1],"feed":6000}"#;
//! let m: Move = serde_json::from_str(line)?;
//! assert_eq!(m.kind, MoveKind::Cut);
//! assert_eq!(m.curve()?.point(2.5), [1.5, 2.0, 0.0].into());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

// What is to be said is returned: only the command prints.
#![cfg_attr(not(test), warn(clippy::print_stdout, clippy::print_stderr))]

mod allowance;
mod bounds;
mod folder;
mod holder;
mod io_advice;
mod job;
mod kept;
mod largest;
mod levels;
mod machine_parts;
mod manifest;
mod mirror;
mod monitor;
mod moves;
mod operation;
mod output;
mod packed;
mod place;
mod plain_file;
mod plausible;
mod regions;
mod renewal;
mod scratch;
mod side;
mod standing;
mod stock;
mod tool;
mod turn;
mod whole;

pub use allowance::{raise_tips, swollen_scallop_mm};
pub use bounds::{Bounds, Contain};
pub use folder::{
    FolderError, FolderWriter, JOB_FILE, REGIONS_FILE, REPORT_FILE, TOOLPATHS_FILE, VERIFY_FILE, read_job,
    read_moves, read_regions, sha256_of,
};
pub use holder::{Holder, HolderError, HolderSection};
pub use io_advice::advice_on;
pub use job::{
    Area, AskedSetup, CHECK_CLEARANCE_MM, Considered, FORMAT_VERSION, FaceAccount, HOLDER_CLEARANCE_MM, Job,
    LATEST_FORMAT_VERSION, LeftOutFace, LengthByKind, LinkStyle, MachineLimits, ModelFacts, Obstacle,
    RegionTotals, Request, Setup, Skipped, StageTiming, ToolRecord, Totals, UncutReason,
};
pub use kept::{Kept, KeyMaker, NoKey, PartCount, PartKey, PartStore};
pub use levels::Levels;
pub use machine_parts::{Changer, RotaryAxis};
pub use manifest::{MANIFEST_FILE, is_whole};
pub use mirror::{Mirror, MirrorError};
pub use monitor::{Cancelled, Monitor, Stage};
pub use moves::{Move, MoveError, MoveKind, Program, WRITTEN_STEP_MM, round_to_written};
pub use operation::{Operation, OperationKind};
pub use output::{Kind, Output, OutputError, job_files};
pub use packed::Packed;
pub use place::{FilePlace, find_file, path_from_text, path_to_text};
pub use plain_file::{LONGEST_MADE, LONGEST_WRITTEN, open_plain, read_plain, read_plain_text};
pub use regions::{
    FailingRecord, JointRecord, LapRecord, RegionQualityRecord, RegionRecord, RegionsFile, SmallRegionRecord,
    WideGapRecord,
};
pub use renewal::Renewal;
pub use scratch::is_own_scratch;
pub use side::{FreeSide, SheetRecord};
pub use standing::{Judged, Standing, read_judged, read_moves_judged};
pub use stock::{Stock, StockFile};
pub use tool::{End, Tool, ToolError};
pub use turn::{LARGEST_ENTRY, axes_of_quaternion};
pub use whole::write_whole;
