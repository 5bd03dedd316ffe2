//! The tools for rest machining, from large to small, in the least time.
//!
//! ```text
//!   start ──► 12 ──► 8 ───► 3      edge i → j: area that j reaches and is left, at j's rate,
//!      └───────────► 8 ─────┘                  with wear, and the change to j
//! ```
//!
//! **Model.** Each tool `j` reaches a set `R_j` of the surface. Tools are used in the order of the list, from large to small,
//! each at most once. A tool cuts all that it reaches and that is left. A chain must cut the union of all `R_j`, but for
//! a negligible area, so its last tools reach the most.
//!
//! **Shortest path.** After a chain `c₁ … i` the area left is the complement of `R_c₁ ∪ … ∪ R_i`. It depends on `i` alone
//! for all chains exactly if the sets are nested: `R_i ⊆ R_j`, up to area zero, for all `i` before `j`. (If: the union is
//! `R_i`. Only if: the chains `j` and `i, j` leave the same.) Then the time of a chain is a sum over its edges, and the
//! shortest path in the graph of tools is the cheapest chain. Balls of one make on shanks that reach everywhere are
//! nested. Short stick-outs, thick shanks, and flat ends beside balls are not.
//!
//! **Sets that are not nested.** The sum over edges `i → j` of the area `R_j \ R_i` is then too large: it counts again what
//! an earlier tool has cut. So each tool keeps *labels*: the time so far and what is cut. A label goes out if another one at
//! the same tool took no longer and has cut at least as much, since whatever follows costs the other no more. The
//! cheapest label that has cut enough is the cheapest chain. With nested sets one label remains for each tool, and this is
//! the shortest path again.

mod search;

use thiserror::Error;

use search::{Atoms, cheapest};

use crate::cutting::Conditions;
use crate::library::LibraryTool;

/// Tools of a model at most: one bit each.
pub const MOST_CHAIN_TOOLS: usize = 64;
/// Different sets of tools that reach a patch, at most.
const MOST_ATOMS: usize = 4096;

/// A tool that may be used.
#[derive(Debug, Clone, PartialEq)]
pub struct ChainTool {
    /// Its id in the library.
    pub id: String,
    /// Area that it finishes in a second, mm²/s.
    pub mm2_per_s: f64,
    /// Time to change to it, s.
    pub change_s: f64,
    /// Seconds that its wear costs in each second of cutting.
    pub wear: f64,
}

/// A piece of the surface, and the tools that reach it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ReachPatch {
    /// Area, mm².
    pub area_mm2: f64,
    /// Bit `j` is set where tool `j` of the list reaches it.
    pub reached_by: u64,
}

/// What is to be cut, and what could cut it.
#[derive(Debug, Clone, PartialEq)]
pub struct ReachModel {
    tools: Vec<ChainTool>,
    atoms: Atoms,
}

/// The cheapest chain.
#[derive(Debug, Clone, PartialEq)]
pub struct ToolChain {
    /// Its tools in order.
    pub steps: Vec<ChainStep>,
    /// Time with changes and wear, s.
    pub total_s: f64,
    /// Area that its tools reach but leave as negligible, mm².
    pub left_mm2: f64,
    /// Area that no tool reaches, mm².
    pub unreached_mm2: f64,
    /// Whether the sets were nested, so that this is a shortest path.
    pub is_nested: bool,
    /// Whether no chain is cheaper. False where labels had to be dropped.
    pub is_proven: bool,
    /// What the best chain with each tool that is not in this one would take. In the order of the tools.
    pub others: Vec<OtherTool>,
}

/// A tool of a chain.
#[derive(Debug, Clone, PartialEq)]
pub struct ChainStep {
    /// Index in the model's list.
    pub tool: usize,
    /// Id.
    pub id: String,
    /// Area that it cuts, mm².
    pub area_mm2: f64,
    /// Time of cutting, s.
    pub cut_s: f64,
    /// Time of the change, s.
    pub change_s: f64,
    /// What wear costs, s.
    pub wear_s: f64,
}

/// A tool that is not in the chain.
#[derive(Debug, Clone, PartialEq)]
pub struct OtherTool {
    /// Index in the model's list.
    pub tool: usize,
    /// Id.
    pub id: String,
    /// Time of the cheapest chain with it, s.
    pub total_s: f64,
}

/// Why there is no chain.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum ChainError {
    /// Nothing to choose from.
    #[error("there is no tool to choose from; give a library with a tool that fits")]
    NoTools,
    /// More than a model holds.
    #[error("{count} {what} are more than {most}; leave tools out that hardly differ")]
    TooMany {
        /// How many.
        count: usize,
        /// Of what.
        what: &'static str,
        /// The bound.
        most: usize,
    },
    /// A rate, time or area makes no sense.
    #[error("{entry}: {what} is {value}, which is negative, zero or not finite")]
    Value {
        /// The tool or patch.
        entry: String,
        /// The field.
        what: &'static str,
        /// The value.
        value: f64,
    },
}

impl ChainTool {
    /// A tool that runs passes `step_mm` apart at the feed of these conditions.
    #[must_use]
    pub fn of(tool: &LibraryTool, step_mm: f64, conditions: &Conditions, change_s: f64, wear: f64) -> Self {
        let mm2_per_s = step_mm * conditions.feed_mm_per_min / 60.0;
        ChainTool { id: tool.id.clone(), mm2_per_s, change_s, wear }
    }
}

impl ReachModel {
    /// A model of patches. What is cut already is left out of them. Tools are in the order of use, large ones first.
    ///
    /// # Errors
    /// No tools, too many, or values that make no sense.
    pub fn new(tools: Vec<ChainTool>, patches: &[ReachPatch]) -> Result<Self, ChainError> {
        if tools.is_empty() {
            return Err(ChainError::NoTools);
        }
        if tools.len() > MOST_CHAIN_TOOLS {
            return Err(ChainError::TooMany { count: tools.len(), what: "tools", most: MOST_CHAIN_TOOLS });
        }
        let refuse =
            |entry: &str, what, value| Err(ChainError::Value { entry: entry.to_owned(), what, value });
        for tool in &tools {
            if !(tool.mm2_per_s.is_finite() && tool.mm2_per_s > 0.0) {
                return refuse(&tool.id, "mm2_per_s", tool.mm2_per_s);
            }
            if !(tool.change_s.is_finite() && tool.change_s >= 0.0) {
                return refuse(&tool.id, "change_s", tool.change_s);
            }
            if !(tool.wear.is_finite() && tool.wear >= 0.0) {
                return refuse(&tool.id, "wear", tool.wear);
            }
        }
        let wrong = patches.iter().position(|p| !(p.area_mm2.is_finite() && p.area_mm2 >= 0.0));
        if let Some(index) = wrong {
            return refuse(&format!("patch {index}"), "area_mm2", patches[index].area_mm2);
        }
        let atoms = Atoms::new(patches, tools.len());
        if atoms.len() > MOST_ATOMS {
            let what = "different sets of tools that reach a patch";
            return Err(ChainError::TooMany { count: atoms.len(), what, most: MOST_ATOMS });
        }
        Ok(ReachModel { tools, atoms })
    }

    /// A model of nested sets of which only the areas are known: `reached_mm2[j]` is what tool `j` reaches, and what any
    /// tool before it reaches is part of it. An area below an earlier one counts as that one.
    ///
    /// # Errors
    /// As [`ReachModel::new`]; the lists differ in length.
    pub fn nested(tools: Vec<ChainTool>, reached_mm2: &[f64]) -> Result<Self, ChainError> {
        if tools.len() != reached_mm2.len() {
            return Err(ChainError::Value {
                entry: "areas".into(),
                what: "their number less that of the tools",
                #[expect(clippy::cast_precision_loss, reason = "a few tools")]
                value: reached_mm2.len() as f64 - tools.len() as f64,
            });
        }
        if let Some(j) = reached_mm2.iter().position(|a| !a.is_finite()) {
            return Err(ChainError::Value {
                entry: tools[j].id.clone(),
                what: "area",
                value: reached_mm2[j],
            });
        }
        let mut largest = 0.0;
        let mut patches = Vec::new();
        for (j, area) in reached_mm2.iter().enumerate().take(MOST_CHAIN_TOOLS) {
            let all = u64::MAX >> (MOST_CHAIN_TOOLS - reached_mm2.len().min(MOST_CHAIN_TOOLS));
            patches
                .push(ReachPatch { area_mm2: (area - largest).max(0.0), reached_by: all & (u64::MAX << j) });
            largest = area.max(largest);
        }
        Self::new(tools, &patches)
    }

    /// The tools.
    #[must_use]
    pub fn tools(&self) -> &[ChainTool] {
        &self.tools
    }

    /// The first two tools whose sets are not nested, with the area that the first one reaches and the second does not, mm².
    #[must_use]
    pub fn not_nested(&self) -> Option<(usize, usize, f64)> {
        let count = self.tools.len();
        let pairs = (0..count).flat_map(|i| (i + 1..count).map(move |j| (i, j)));
        let mut over = pairs.map(|(i, j)| (i, j, self.atoms.area(|by| by >> i & 1 == 1 && by >> j & 1 == 0)));
        over.find(|(_, _, area)| *area > 0.0)
    }

    /// Area that a tool reaches, mm².
    #[must_use]
    pub fn reached_mm2(&self, tool: usize) -> f64 {
        self.atoms.area(|by| tool < self.tools.len() && by >> tool & 1 == 1)
    }

    /// The first, largest tool that leaves less than a share of the area that any tool reaches: the finishing tool.
    #[must_use]
    pub fn largest_leaving(&self, share: f64) -> Option<usize> {
        let all = self.atoms.area(|by| by != 0);
        (0..self.tools.len()).find(|tool| all - self.reached_mm2(*tool) <= share * all)
    }
}

/// The cheapest chain of a model that leaves at most `negligible_mm2` of what its tools reach together.
#[must_use]
pub fn tool_chain(model: &ReachModel, negligible_mm2: f64) -> ToolChain {
    let negligible_mm2 = if negligible_mm2.is_finite() { negligible_mm2.max(0.0) } else { 0.0 };
    let best = cheapest(&model.tools, &model.atoms, negligible_mm2, None);
    let others = (0..model.tools.len()).filter(|tool| !best.tools.contains(tool)).map(|tool| {
        let with = cheapest(&model.tools, &model.atoms, negligible_mm2, Some(tool));
        OtherTool { tool, id: model.tools[tool].id.clone(), total_s: with.total_s }
    });
    let mut used = 0_u64;
    let steps = best.tools.iter().map(|&tool| {
        let area_mm2 = model.atoms.area(|by| by >> tool & 1 == 1 && by & used == 0);
        used |= 1 << tool;
        let ChainTool { id, mm2_per_s, change_s, wear } = &model.tools[tool];
        let cut_s = area_mm2 / mm2_per_s;
        ChainStep { tool, id: id.clone(), area_mm2, cut_s, change_s: *change_s, wear_s: cut_s * wear }
    });
    let steps: Vec<ChainStep> = steps.collect();
    ToolChain {
        total_s: steps.iter().map(|s| s.cut_s + s.change_s + s.wear_s).sum(),
        steps,
        left_mm2: model.atoms.area(|by| by != 0 && by & used == 0),
        unreached_mm2: model.atoms.area(|by| by == 0),
        is_nested: model.not_nested().is_none(),
        is_proven: best.is_proven,
        others: others.collect(),
    }
}
