//! `reach.json`: what directions reach, which are chosen, and the proof that fewer do not suffice.

use std::collections::BTreeMap;

use claymill_toolpath::round_to_written;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::cover::{Child, Cover, Gain, Proof};
use crate::direction::{Direction, Origin};
use crate::found::{Reach, Seen};
use crate::part::{Part, Reacher};

/// Version of the form of `reach.json`.
pub const REACH_FORMAT_VERSION: u32 = 1;

/// What `reach.json` holds.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ReachFile {
    /// [`REACH_FORMAT_VERSION`].
    pub format_version: u32,
    /// What wrote the file.
    pub generator: String,
    /// The model's file.
    pub model: String,
    /// The tool, as on the command line.
    pub tool: String,
    /// The surface leans no further from the tool's axis, degrees.
    pub steepest_deg: f64,
    /// Area of all faces that count, mm².
    pub area_mm2: f64,
    /// Samples of it.
    pub samples: usize,
    /// Area that some direction reaches, mm².
    pub reachable_mm2: f64,
    /// Area that the chosen directions reach, mm².
    pub reached_mm2: f64,
    /// The chosen directions, the forced ones first, as numbers of `directions`.
    pub chosen: Vec<usize>,
    /// How many of them are forced.
    pub forced: usize,
    /// No choice has fewer directions, the forced ones not counted, that reaches all `places`.
    pub least: usize,
    /// Whether that is how many were chosen.
    pub is_optimal: bool,
    /// Why: rows are numbers of `places`, columns numbers of `directions`, shares are millionths.
    pub proof: Proof,
    /// The places that decide, each with the directions that reach it.
    pub places: Vec<PlaceRecord>,
    /// The candidates.
    pub directions: Vec<DirectionRecord>,
    /// The most area for one direction more at a time.
    pub gains: Vec<GainRecord>,
    /// Faces with area that no direction reaches.
    pub unreached: Vec<UnreachedRecord>,
}

/// A place that decides.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct PlaceRecord {
    /// The face.
    pub face: usize,
    /// Where it is, mm.
    pub at: [f64; 3],
    /// Numbers of the directions that reach it.
    pub from: Vec<usize>,
}

/// A candidate.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct DirectionRecord {
    /// From the tip to the holder, in model coordinates.
    pub axis: [f64; 3],
    /// Its frame as a quaternion of integers; none of one along axes of the model.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub quaternion: Option<[i64; 4]>,
    /// Its angle about the rotary axis, degrees.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub angle_deg: Option<f64>,
    /// Area that it reaches, mm².
    pub reached_mm2: f64,
}

/// The best choice of a number of directions.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct GainRecord {
    /// The directions, the forced ones first.
    pub directions: Vec<usize>,
    /// Area that they reach, mm².
    pub reached_mm2: f64,
    /// No choice of as many reaches more, mm².
    pub at_most_mm2: f64,
}

/// A face with area that no direction reaches.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct UnreachedRecord {
    /// The face.
    pub face: usize,
    /// Its entity in the model's file.
    pub entity: String,
    /// How much of it, mm².
    pub area_mm2: f64,
    /// The most that any direction sees of it.
    pub seen: Seen,
}

impl ReachFile {
    /// Collects what was found.
    #[must_use]
    pub fn new(
        (name, part, reacher): (&str, &Part, &Reacher),
        directions: &[Direction],
        reach: &Reach,
        cover: &Cover,
        gains: &[Gain],
    ) -> Self {
        let of_row = reach.table.transposed();
        let rows = &cover.certificate.rows;
        let place_of_row: BTreeMap<usize, usize> =
            rows.iter().enumerate().map(|(place, &row)| (row, place)).collect();
        let places = rows.iter().map(|&row| {
            let sample = &reach.samples[row];
            let at = sample.point.coords.map(round_to_written).into();
            PlaceRecord { face: sample.face, at, from: of_row[row].iter().collect() }
        });
        let reached_mm2 = |columns: &[usize]| round_to_written(reach.area_mm2(&reach.table.covered(columns)));
        let direction = |(k, direction): (usize, &Direction)| DirectionRecord {
            axis: direction.frame.axis().map(|c| c + 0.0).into(),
            quaternion: direction.frame.quaternion(),
            angle_deg: match direction.origin {
                Origin::Angle(deg) => Some(deg),
                _ => None,
            },
            reached_mm2: reached_mm2(&[k]),
        };
        let gain = |gain: &Gain| GainRecord {
            directions: gain.columns.clone(),
            reached_mm2: round_to_written(gain.covered),
            at_most_mm2: round_to_written(gain.at_most),
        };
        let unreached = reach.unreached().into_iter().map(|(face, area_mm2, seen)| UnreachedRecord {
            face,
            entity: part.model.faces[face].source.entity.clone(),
            area_mm2: round_to_written(area_mm2),
            seen,
        });
        ReachFile {
            format_version: REACH_FORMAT_VERSION,
            generator: concat!("claymill ", env!("CARGO_PKG_VERSION")).to_owned(),
            model: name.to_owned(),
            tool: reacher.tool.to_string(),
            steepest_deg: reacher.steepest_deg,
            area_mm2: round_to_written(reach.whole_mm2()),
            samples: reach.samples.len(),
            reachable_mm2: round_to_written(reach.area_mm2(&reach.table.coverable())),
            reached_mm2: reached_mm2(&cover.columns),
            chosen: cover.columns.clone(),
            forced: cover.forced,
            least: cover.certificate.least,
            is_optimal: cover.is_optimal(),
            proof: renumbered(&cover.certificate.proof, &place_of_row),
            places: places.collect(),
            directions: directions.iter().enumerate().map(direction).collect(),
            gains: gains.iter().map(gain).collect(),
            unreached: unreached.collect(),
        }
    }
}

/// The proof with numbers of places instead of rows.
fn renumbered(proof: &Proof, place_of_row: &BTreeMap<usize, usize>) -> Proof {
    let place = |row: &usize| place_of_row.get(row).copied().unwrap_or(usize::MAX);
    match proof {
        Proof::Shares(shares) => {
            Proof::Shares(shares.iter().map(|(row, share)| (place(row), *share)).collect())
        }
        Proof::Branch { row, children } => {
            let child =
                |child: &Child| Child { column: child.column, proof: renumbered(&child.proof, place_of_row) };
            Proof::Branch { row: place(row), children: children.iter().map(child).collect() }
        }
    }
}
