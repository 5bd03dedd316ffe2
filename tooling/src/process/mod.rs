//! Materials and processes: what is asked of every stage of a job, and where each value is from.
//!
//! ```text
//!   asked on the command line
//!        │ goes before
//!   process ─ inherits ─► process ─ inherits ─► … ─► material ─► general process
//! ```

mod condition;
mod files;
mod profiles;
mod resolve;
mod sense;
mod stage;

pub use condition::{Condition, ConditionError, Fact, Facts, KNOWN_FACTS};
pub use files::{
    CutPattern, Material, PROCESS_FORMAT, ProcessFile, StageKind, StageValues, StrategyName, Way,
    material_schema, process_schema,
};
pub use profiles::Profiles;
pub use stage::{Origin, Process, Resolved, Spacing, Stage, ToolChoice};
