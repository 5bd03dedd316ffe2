//! What the check of stock found: the records of a report.

use std::collections::BTreeMap;

use claymill_toolpath::MoveKind;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::engagement::Engagement;
use super::tool_bodies::ToolPart;
use super::volume::VolumeEstimate;
use crate::report::Place;

/// What a program does to its stock.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct StockReport {
    /// Convex pieces that the cutting sweeps come to.
    pub pieces: u64,
    /// Whether the tool, with shank and holder, meets stock on moves that should be clear of it: rapids; and on links and lead-ins,
    /// which may cut.
    pub clear: BTreeMap<MoveKind, StockContact>,
    /// Whether shank and holder meet stock on all moves but rapids.
    pub body: StockContact,
    /// Stock left over the surface, where samples of it were given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub left: Option<StockLeft>,
    /// Volumes.
    pub volumes: StockVolumes,
    /// The largest engagement of the poses looked at.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub engagement: Option<EngagementAt>,
}

/// How often something meets stock.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct StockContact {
    /// Moves looked at.
    pub moves: u64,
    /// Moves that meet stock for sure.
    pub touching: u64,
    /// Moves of which it could not be decided within the bound on boxes.
    pub undecided: u64,
    /// The largest of those that meet stock.
    pub worst: Option<StockHit>,
    /// The largest of those that are undecided.
    pub worst_undecided: Option<StockHit>,
}

/// Stock in the way of a move.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct StockHit {
    /// Diameter of the largest ball of stock found that one body of the tool (end, flutes, a section of the holder) holds at one time
    /// or in one plunge, mm: the thickness of what is in the way. 0 where none was found and some cannot be ruled out. Of links and
    /// lead-ins, which may cut, only some ball is looked for.
    pub size_mm: f64,
    /// No such ball is larger, mm.
    pub size_at_most_mm: f64,
    /// What meets it.
    pub part: ToolPart,
    /// The middle of the ball, with the move and its parameter at the chord concerned.
    pub at: Place,
}

/// Whether a move keeps clear of stock.
#[derive(Debug, Clone, PartialEq)]
pub enum StockProof {
    /// Proven: no body of the tool holds, at any time, a ball of stock as large as asked for.
    Clear,
    /// It meets stock.
    Hit(StockHit),
    /// The bound on boxes was met before either was known.
    Undecided(StockHit),
}

/// Stock left over the surface. Shares are of the area of all samples.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct StockLeft {
    /// Samples.
    pub samples: u64,
    /// Their area, mm².
    pub area_mm2: f64,
    /// The band asked for: from and to, mm along the normal.
    pub band_mm: [f64; 2],
    /// Share within the band.
    pub within: f64,
    /// Share with less.
    pub below: f64,
    /// Share with more.
    pub above: f64,
    /// Least and largest of what is known, mm.
    pub extremes_mm: Option<[f64; 2]>,
    /// Mean, mm, of what is known.
    pub mean_mm: f64,
    /// The thinnest place.
    pub thinnest_at: Option<Place>,
    /// The thickest place.
    pub thickest_at: Option<Place>,
    /// Samples with stock as far as was looked.
    pub beyond: u64,
    /// Samples without any stock as far as was looked.
    pub nothing: u64,
}

/// Volumes before, on the way and after.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct StockVolumes {
    /// Of the initial stock.
    pub initial: VolumeEstimate,
    /// Removed, all together.
    pub removed: VolumeEstimate,
    /// Left at the end.
    pub left: VolumeEstimate,
    /// Removed by the kind of move that was there first.
    pub removed_by_kind: BTreeMap<MoveKind, VolumeEstimate>,
}

/// An engagement and where it is.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct EngagementAt {
    /// The engagement.
    pub engagement: Engagement,
    /// The tip.
    pub at: Place,
    /// Poses looked at.
    pub poses: u64,
}

impl StockContact {
    /// Adds what is known of one more move.
    pub(crate) fn add(&mut self, proof: StockProof) {
        self.moves += 1;
        // Ties go to the earlier move.
        let keep = |worst: &mut Option<StockHit>, hit: StockHit| {
            let size = |h: &StockHit| [h.size_mm, h.size_at_most_mm];
            if worst.as_ref().is_none_or(|w| size(&hit) > size(w)) {
                *worst = Some(hit);
            }
        };
        match proof {
            StockProof::Clear => {}
            StockProof::Hit(hit) => {
                self.touching += 1;
                keep(&mut self.worst, hit);
            }
            StockProof::Undecided(hit) => {
                self.undecided += 1;
                keep(&mut self.worst_undecided, hit);
            }
        }
    }
}
