//! Operations of a job: what is done one after the other, each with its own tool, allowance and passes.
//!
//! ```text
//!   job.json, version 2      operations  0 rough ── 1 finish ── 2 rest
//!   toolpaths.jsonl          op          0 0 0 0 0  1 1 1 1 1   2 2 2      each begins and ends above everything
//! ```

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::job::{Area, FaceAccount, Job, RegionTotals, Request, Setup, ToolRecord, Totals};
use crate::moves::{Move, Program};

/// What an operation is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum OperationKind {
    /// Takes the stock away, down to an allowance.
    Rough,
    /// Makes what is left even, down to a smaller allowance.
    Semi,
    /// Cuts the surface.
    Finish,
    /// Cuts what an earlier, larger tool could not reach.
    Rest,
    /// Runs along valleys.
    Pencil,
}

impl OperationKind {
    /// Which of these operations cuts most of the surface: the first one that finishes it, or else the last one.
    #[must_use]
    pub fn main_of(kinds: impl IntoIterator<Item = Self>) -> Option<usize> {
        let mut last = None;
        for (index, kind) in kinds.into_iter().enumerate() {
            last = Some(index);
            if kind == OperationKind::Finish {
                break;
            }
        }
        last
    }

    /// Whether the surface itself is cut.
    #[must_use]
    pub fn is_of_surface(self) -> bool {
        matches!(self, OperationKind::Finish | OperationKind::Rest | OperationKind::Pencil)
    }
}

impl std::fmt::Display for OperationKind {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.pad(match self {
            OperationKind::Rough => "rough",
            OperationKind::Semi => "semi",
            OperationKind::Finish => "finish",
            OperationKind::Rest => "rest",
            OperationKind::Pencil => "pencil",
        })
    }
}

/// One operation of a job.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Operation {
    /// Its name in the job, such as `rough-1`.
    pub name: String,
    /// What it is for.
    pub kind: OperationKind,
    /// Why it is there, in one sentence.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub reason: String,
    /// Id of its tool, `T2`.
    pub tool: String,
    /// What was asked of it.
    pub request: Request,
    /// Every tolerance used, by name.
    pub tolerances: BTreeMap<String, f64>,
    /// Its setups in machining order.
    pub setups: Vec<Setup>,
    /// Totals by region and setup.
    pub regions: Vec<RegionTotals>,
    /// Totals.
    pub totals: Totals,
    /// Where the model's area went.
    pub area: Area,
    /// The same, face by face.
    pub faces: Vec<FaceAccount>,
}

impl Job {
    /// The job that one of its operations is by itself; `None` of another number than its operations have.
    #[must_use]
    pub fn of_operation(&self, index: usize) -> Option<Job> {
        let operation = self.operations.get(index)?;
        Some(Job {
            format_version: crate::FORMAT_VERSION,
            claymill_version: self.claymill_version.clone(),
            model: self.model.clone(),
            stock: None,
            request: operation.request.clone(),
            tolerances: operation.tolerances.clone(),
            tools: self.tools_of(operation).cloned().collect(),
            setups: operation.setups.clone(),
            regions: operation.regions.clone(),
            totals: operation.totals,
            area: operation.area.clone(),
            faces: operation.faces.clone(),
            left_out: self.left_out.clone(),
            operations: Vec::new(),
            timings: Vec::new(),
            peak_memory_mb: 0.0,
        })
    }

    /// The tool of an operation, then the one whose rest it cuts, if the job has that.
    fn tools_of(&self, operation: &Operation) -> impl Iterator<Item = &ToolRecord> {
        let own = self.tools.iter().filter(|tool| tool.id == operation.tool);
        let rest_of = operation.request.rest_of;
        let earlier =
            self.tools.iter().find(move |tool| tool.id != operation.tool && Some(tool.tool) == rest_of);
        own.chain(earlier)
    }

    /// The operation that cuts most of the surface.
    #[must_use]
    pub fn main_operation(&self) -> Option<usize> {
        OperationKind::main_of(self.operations.iter().map(|o| o.kind))
    }
}

impl Program {
    /// The moves of an operation, with their numbers in the whole program.
    #[must_use]
    pub fn of_operation(&self, index: usize) -> Program {
        let mine = |m: &&Move| m.op.is_some_and(|op| op as usize == index);
        Program { moves: self.moves.iter().filter(mine).cloned().collect() }
    }
}
