//! What is reported of holder and shank: distances, stick-outs needed, moves that touch.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::report::Place;

/// How holders keep away from model and obstacles on every move.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct HolderClearance {
    /// Clearance that was asked for, mm.
    pub asked_mm: f64,
    /// Moves that were looked along.
    pub moves: u64,
    /// Moves that were not, because the tool does not stand along its setup's axis.
    pub moves_not_checked: u64,
    /// Smallest distance between a holder and the model or an obstacle to 0.01 mm; 0 where they touch. `None` when it is
    /// more than 10 mm, or than what was asked for, everywhere.
    pub clearance_min_mm: Option<f64>,
    /// Where, on the model or obstacle.
    pub clearance_min_at: Option<Place>,
    /// Moves on which a holder touches.
    pub touching: u64,
    /// Moves on which one comes nearer than was asked for, those that touch included.
    pub near: u64,
    /// The smallest stick-out that keeps the clearance, region by region.
    pub regions: Vec<RegionStickOut>,
}

/// The least that a tool has to stick out for one region.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct RegionStickOut {
    /// Region id.
    pub region: usize,
    /// Setup name.
    pub setup: String,
    /// Tool id.
    pub tool: String,
    /// As it sticks out, mm.
    pub stick_out_mm: f64,
    /// Stick-out at which the holder keeps the clearance on all moves of the region, mm; at least the ball's radius.
    pub stick_out_needed_mm: f64,
    /// What asks for it, on the model or obstacle.
    pub at: Option<Place>,
}

/// Whether the shank, as thick as the ball, touches the model on moves other than rapids (those are in `rapids`).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ShankContact {
    /// Moves that were looked along.
    pub moves: u64,
    /// Moves on which the model enters the shank deeper than the bar for gouges.
    pub touching: u64,
    /// How deep on the worst of the places found, one a move, mm.
    pub deepest_mm: f64,
    /// Where that is.
    pub deepest_at: Option<Place>,
}

impl HolderClearance {
    /// How far the tool sticks out in a setup, mm; the least where there are several tools.
    #[must_use]
    pub fn stick_out_mm(&self, setup: &str) -> Option<f64> {
        let mine = self.regions.iter().filter(|r| r.setup == setup);
        mine.map(|r| r.stick_out_mm).reduce(f64::min)
    }

    /// The setups with moves of a tool in a holder, in machining order.
    #[must_use]
    pub fn setups(&self) -> Vec<&str> {
        let mut setups: Vec<&str> = self.regions.iter().map(|r| r.setup.as_str()).collect();
        setups.dedup();
        setups
    }

    /// The smallest stick-out that does for each tool in each setup, mm, by id and name.
    pub(crate) fn needed_mm(&self) -> BTreeMap<(String, String), f64> {
        let mut needed = BTreeMap::new();
        for r in &self.regions {
            let most = needed.entry((r.tool.clone(), r.setup.clone())).or_insert(0.0);
            *most = f64::max(*most, r.stick_out_needed_mm);
        }
        needed
    }

    /// The smallest stick-out that does for all regions of a setup, or of the job, mm.
    #[must_use]
    pub fn stick_out_needed_mm(&self, setup: Option<&str>) -> Option<f64> {
        let mine = self.regions.iter().filter(|r| setup.is_none_or(|s| r.setup == s));
        mine.map(|r| r.stick_out_needed_mm).reduce(f64::max)
    }
}
