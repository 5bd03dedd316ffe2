//! How many regions a limit makes, for every value of it.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::Merge;
use crate::absorption::Surroundings;
use crate::constraints::Wishes;
use crate::disjoint_sets::DisjointSets;
use crate::growing::{self, STRONG_SHARE, may_join, ordered};
use crate::joint::{Joint, JointSample};
use crate::options::{CurvatureLimit, Judged, Limits, MergeOptions};

/// The limit that is varied; all others stay as the options have them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum SweptLimit {
    /// The angle between the normals, degrees.
    Angle,
    /// `R·|κA − κB|`.
    CurvatureMachining,
    /// `|κA − κB| / (|κA| + |κB| + 2κ₀)`.
    CurvatureRelative,
}

/// Which faces are one region at which value of a limit: a tree whose leaves are faces.
///
/// It knows the strong rule only: two faces join where 98 % of their joints by length are within the limit.
/// Then a larger limit never takes a region apart, and one pass over the joints in the order of the limit
/// that each pair of faces needs gives the regions for all limits. What the nearly smooth borders add, which
/// is not monotone, is counted for chosen limits in [`Self::grown`].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct MergeTree {
    /// The limit varied.
    pub limit: SweptLimit,
    /// Number of faces.
    pub faces: usize,
    /// The joins, by ascending limit.
    pub joins: Vec<Join>,
    /// Number of regions that merging as usual gives, with weak borders as far beyond the limit as the
    /// options have them.
    pub grown: Vec<Step>,
}

/// Two regions of a [`MergeTree`] become one.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Join {
    /// From this value of the limit on; 0 for faces that are there twice or kept together.
    pub at: f64,
    /// Their smallest faces. The smaller one names what they become.
    pub regions: [usize; 2],
    /// Their numbers of faces.
    pub faces: [usize; 2],
}

/// A number of regions.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Step {
    /// From this value of the limit on.
    pub at: f64,
    /// So many regions.
    pub regions: usize,
}

/// Builds the merge tree of `merged`, whose joints were measured with `options`; `grown_at` are the limits at
/// which to count what merging as usual gives.
#[must_use]
pub fn sweep(merged: &Merge, options: &MergeOptions, limit: SweptLimit, grown_at: &[f64]) -> MergeTree {
    let faces = merged.region_of_face.len();
    let mut sets = Counted { sets: DisjointSets::new(faces), faces: vec![1; faces] };
    let mut found = Vec::new();
    for d in &merged.duplicates {
        found.extend(sets.join(0.0, [d.original, d.copy]));
    }
    let wishes = options.constraints.of(faces, &merged.duplicates);
    for pair in merged.joints.iter().map(|j| j.sides.map(|s| s.face)).filter(|p| wishes.together(*p)) {
        found.extend(sets.join(0.0, pair));
    }
    for (at, pair) in needed(merged, options, limit, &wishes) {
        found.extend(sets.join(at, pair));
    }
    let around =
        Surroundings { area_of_face_mm2: &merged.area_of_face_mm2, naked: &merged.naked, laps: &merged.laps };
    let grown = |&at: &f64| {
        let options = limit.set(options, at);
        Step { at, regions: growing::count(&merged.joints, &merged.duplicates, around, &options) }
    };
    MergeTree { limit, faces, joins: found, grown: grown_at.iter().map(grown).collect() }
}

/// The least limit at which each pair of faces joins, ascending; pairs that no limit joins are left out.
fn needed(
    merged: &Merge,
    options: &MergeOptions,
    limit: SweptLimit,
    wishes: &Wishes,
) -> Vec<(f64, [usize; 2])> {
    let mut values: BTreeMap<[usize; 2], Vec<(f64, f64)>> = BTreeMap::new();
    for joint in merged.joints.iter().filter(|j| may_join(j, wishes)) {
        let pair = values.entry(ordered(joint.sides.map(|s| s.face))).or_default();
        match options.judged {
            Judged::Along => {
                pair.extend(joint.samples.iter().map(|s| (limit.value(options, joint, s), s.length_mm)));
            }
            Judged::MidPoint => pair.push((limit.value(options, joint, &joint.mid), joint.length_mm)),
        }
    }
    let least = |mut values: Vec<(f64, f64)>| -> Option<f64> {
        values.sort_by(|a, b| a.0.total_cmp(&b.0));
        let total: f64 = values.iter().map(|v| v.1).sum();
        let mut within = 0.0;
        let enough = values.iter().find(|v| {
            within += v.1;
            within >= STRONG_SHARE * total
        });
        enough.map(|v| v.0).filter(|at| at.is_finite())
    };
    let mut needed: Vec<_> =
        values.into_iter().filter_map(|(pair, values)| Some((least(values)?, pair))).collect();
    needed.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    needed
}

/// Sets with the number of their faces.
struct Counted {
    sets: DisjointSets,
    /// By root.
    faces: Vec<usize>,
}

impl Counted {
    fn join(&mut self, at: f64, pair: [usize; 2]) -> Option<Join> {
        let regions = ordered(pair.map(|f| self.sets.root(f)));
        let faces = regions.map(|r| self.faces[r]);
        self.sets.join(regions[0], regions[1]).then(|| {
            self.faces[regions[0]] = faces[0] + faces[1];
            Join { at, regions, faces }
        })
    }
}

impl SweptLimit {
    /// The limit that `sample` needs; infinite where another limit forbids it.
    fn value(self, options: &MergeOptions, joint: &Joint, sample: &JointSample) -> f64 {
        let floor = joint.curvature_floor_per_mm;
        let others = self.limits(&options.low, f64::INFINITY);
        if options.excess(&others, sample, floor).is_some() {
            return f64::INFINITY;
        }
        let jump = sample.curvature_jump_per_mm();
        match self {
            SweptLimit::Angle => sample.angle_deg.abs(),
            _ if jump <= floor => 0.0,
            SweptLimit::CurvatureMachining => options.ball_radius_mm * jump,
            SweptLimit::CurvatureRelative => sample.curvature_relative(floor),
        }
    }

    fn limits(self, limits: &Limits, at: f64) -> Limits {
        match self {
            SweptLimit::Angle => Limits { angle_deg: at, ..*limits },
            SweptLimit::CurvatureMachining => Limits { curvature: CurvatureLimit::Machining(at), ..*limits },
            SweptLimit::CurvatureRelative => Limits { curvature: CurvatureLimit::Relative(at), ..*limits },
        }
    }

    /// The options with this limit at `at`, and the high limit as much higher as it was.
    fn set(self, options: &MergeOptions, at: f64) -> MergeOptions {
        use CurvatureLimit::{Machining, Relative};
        let (low, high) = (&options.low, &options.high);
        let ratio = match (self, low.curvature, high.curvature) {
            (SweptLimit::Angle, ..) => high.angle_deg / low.angle_deg,
            (SweptLimit::CurvatureMachining, Machining(l), Machining(h))
            | (SweptLimit::CurvatureRelative, Relative(l), Relative(h)) => h / l,
            // Where curvature decides, its high limit is twice the low one.
            _ => 2.0,
        };
        MergeOptions { low: self.limits(low, at), high: self.limits(high, at * ratio), ..options.clone() }
    }
}

impl MergeTree {
    /// Number of regions at `limit`.
    #[must_use]
    pub fn regions_at(&self, limit: f64) -> usize {
        self.faces - self.joins.partition_point(|j| j.at <= limit)
    }

    /// Number of regions as the limit grows, one step for each value at which it changes.
    #[must_use]
    pub fn curve(&self) -> Vec<Step> {
        let mut curve = vec![Step { at: 0.0, regions: self.faces }];
        for (k, join) in self.joins.iter().enumerate() {
            let step = Step { at: join.at, regions: self.faces - k - 1 };
            match curve.last_mut() {
                Some(last) if last.at == join.at => *last = step,
                _ => curve.push(step),
            }
        }
        curve
    }

    /// The region of each face at `limit`, named by its smallest face.
    #[must_use]
    pub fn regions_of_faces(&self, limit: f64) -> Vec<usize> {
        let mut sets = DisjointSets::new(self.faces);
        for join in self.joins.iter().take_while(|j| j.at <= limit) {
            sets.join(join.regions[0], join.regions[1]);
        }
        (0..self.faces).map(|f| sets.root(f)).collect()
    }
}
