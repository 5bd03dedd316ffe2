//! Regions too small to be worth strokes of their own join a neighbour that they run into smoothly.
//!
//! In rounds: all small regions choose by the regions as they stand, then all join, until none is left that can.
//! So the order of faces does not matter.

use std::collections::BTreeMap;

use claymill_nurbs::FaceId;
use serde::{Deserialize, Serialize};

use crate::account::NakedStretch;
use crate::constraints::Wishes;
use crate::disjoint_sets::DisjointSets;
use crate::growing::joins;
use crate::joint::Joint;
use crate::laps::Lap;
use crate::options::{CurvatureLimit, Judged, Limits, MergeOptions};

/// What counts as a small region. Zero turns a limit off.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Absorption {
    /// Regions of a smaller area are small, mm².
    pub area_mm2: f64,
    /// Narrower regions too, mm; the width is twice the area by the length of the border, as of a long strip.
    pub width_mm: f64,
}

/// A region that was small, and what became of it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SmallRegion {
    /// Its faces, ascending.
    pub faces: Vec<FaceId>,
    /// Area, mm².
    pub area_mm2: f64,
    /// Width as in [`Absorption::width_mm`]; `None` for a closed shell.
    pub width_mm: Option<f64>,
    /// Whether it joined its neighbour; if not, it is a region still.
    pub absorbed: bool,
    /// The region that it now is, or belongs to.
    pub region: usize,
    /// The neighbour it joined, or the one that it would take the smallest angle to join, as the region that
    /// this now belongs to; `None` where nothing is beside it.
    pub neighbour: Option<usize>,
    /// Length of the border with that neighbour, mm.
    pub border_mm: f64,
    /// Largest angle on that border, degrees.
    pub angle_max_deg: f64,
}

/// What lies around the faces besides joints.
#[derive(Clone, Copy)]
pub(crate) struct Surroundings<'a> {
    pub(crate) area_of_face_mm2: &'a [f64],
    pub(crate) naked: &'a [NakedStretch],
    pub(crate) laps: &'a [Lap],
}

/// A border is a candidate when it is at least this part as long as the longest one: smoothness on a short
/// stretch says little.
const LONG_ENOUGH: f64 = 0.5;
/// Differences that do not matter: of the angle (degrees), of `R·|Δκ|`, of lengths and places (mm).
const SAME: [f64; 3] = [1e-4, 1e-4, 1e-3];

/// All joints between two regions.
#[derive(Debug, Clone, Copy, Default)]
struct Border {
    length_mm: f64,
    angle_max_deg: f64,
    /// Squares by length of angle and `R·|Δκ|`.
    squares: [f64; 2],
    /// Sum of places by length.
    moment: [f64; 3],
    barred: bool,
}

impl Border {
    fn add(&mut self, joint: &Joint, barred: bool) {
        let l = joint.length_mm;
        self.length_mm += l;
        self.angle_max_deg = self.angle_max_deg.max(joint.angle_deg.max);
        self.squares[0] += l * joint.angle_deg.rms.powi(2);
        self.squares[1] += l * joint.curvature_machining.rms.powi(2);
        (0..3).for_each(|k| self.moment[k] += l * joint.mid.point[k]);
        self.barred |= barred;
    }

    fn roughness(&self, k: usize) -> f64 {
        (self.squares[k] / self.length_mm).sqrt()
    }
}

impl MergeOptions {
    /// Whether a joint is tangent-continuous within the high limits on the whole of its length.
    pub(crate) fn is_tangent(&self, joint: &Joint) -> bool {
        let limits = Limits { curvature: CurvatureLimit::Any, ..self.high };
        let fine = |s| self.excess(&limits, s, joint.curvature_floor_per_mm).is_none();
        match self.judged {
            Judged::MidPoint => fine(&joint.mid),
            Judged::Along => joint.samples.iter().all(fine),
        }
    }
}

/// Joins small regions to neighbours in `sets`; returns the steps taken and the small regions that are left, with
/// faces in the place of regions ([`SmallRegion::region`], [`SmallRegion::neighbour`]).
pub(crate) fn absorb(
    sets: &mut DisjointSets,
    joints: &[Joint],
    around: Surroundings<'_>,
    wishes: &Wishes,
    options: &MergeOptions,
) -> Vec<SmallRegion> {
    let Some(limits) = options.absorption else {
        return Vec::new();
    };
    let mut steps = Vec::new();
    loop {
        let (regions, borders) = stand(sets, joints, around, wishes, options);
        let small = regions.values().filter(|r| {
            r.area_mm2 < limits.area_mm2 || r.width_mm.is_some_and(|width| width < limits.width_mm)
        });
        let chosen: Vec<SmallRegion> = small.map(|r| choice(r, &borders)).collect();
        for step in chosen.iter().filter(|s| s.absorbed) {
            sets.join(step.region, step.neighbour.unwrap_or(step.region));
        }
        let done = !chosen.iter().any(|s| s.absorbed);
        steps.extend(chosen.into_iter().filter(|s| s.absorbed || done));
        if done {
            return steps;
        }
    }
}

type Borders = BTreeMap<usize, BTreeMap<usize, Border>>;

/// The regions as they stand, and for each its borders with the others.
fn stand(
    sets: &mut DisjointSets,
    joints: &[Joint],
    around: Surroundings<'_>,
    wishes: &Wishes,
    options: &MergeOptions,
) -> (BTreeMap<usize, SmallRegion>, Borders) {
    let mut regions: BTreeMap<usize, SmallRegion> = BTreeMap::new();
    for (face, area) in around.area_of_face_mm2.iter().enumerate() {
        let region = sets.root(face);
        let entry = regions.entry(region).or_insert_with(|| SmallRegion {
            faces: Vec::new(),
            area_mm2: 0.0,
            width_mm: None,
            absorbed: false,
            region,
            neighbour: None,
            border_mm: 0.0,
            angle_max_deg: 0.0,
        });
        entry.faces.push(face);
        entry.area_mm2 += area;
    }
    let mut perimeter: BTreeMap<usize, f64> = BTreeMap::new();
    let mut outline = |region: usize, length: f64| *perimeter.entry(region).or_default() += length;
    around.naked.iter().for_each(|n| outline(sets.root(n.stretch.face), n.length_mm));
    around.laps.iter().for_each(|l| outline(sets.root(l.stretch.face), l.length_mm));
    let mut borders = Borders::new();
    for joint in joints {
        let faces = joint.sides.map(|s| s.face);
        let [a, b] = faces.map(|f| sets.root(f));
        if a == b {
            continue;
        }
        outline(a, joint.length_mm);
        outline(b, joint.length_mm);
        if joins(joint) {
            let barred = wishes.apart(faces) || !options.is_tangent(joint);
            for (from, to) in [(a, b), (b, a)] {
                borders.entry(from).or_default().entry(to).or_default().add(joint, barred);
            }
        }
    }
    for (region, length) in perimeter {
        if let Some(r) = regions.get_mut(&region) {
            r.width_mm = Some(2.0 * r.area_mm2 / length);
        }
    }
    (regions, borders)
}

/// Which neighbour a small region joins: among those along enough of its border the smoothest one, by angle,
/// then by curvature, then the longest; of twins the one that comes first in space.
fn choice(region: &SmallRegion, borders: &Borders) -> SmallRegion {
    let beside = borders.get(&region.region);
    let all: Vec<(usize, Border)> = beside.into_iter().flatten().map(|(r, b)| (*r, *b)).collect();
    let smooth: Vec<_> = all.iter().copied().filter(|(_, b)| !b.barred).collect();
    let absorbed = !smooth.is_empty();
    let mut left = if absorbed { smooth } else { all };
    let longest = left.iter().fold(0.0, |m: f64, (_, b)| m.max(b.length_mm));
    left.retain(|(_, b)| b.length_mm >= LONG_ENOUGH * longest);
    keep_least(&mut left, SAME[0], |b| b.roughness(0));
    keep_least(&mut left, SAME[1], |b| b.roughness(1));
    keep_least(&mut left, SAME[2], |b| -b.length_mm);
    (0..3).for_each(|k| keep_least(&mut left, SAME[2], |b| b.moment[k] / b.length_mm));
    let mut found = region.clone();
    if let Some((neighbour, border)) = left.first() {
        found.absorbed = absorbed;
        found.neighbour = Some(*neighbour);
        (found.border_mm, found.angle_max_deg) = (border.length_mm, border.angle_max_deg);
    }
    found
}

/// Keeps those whose value is the least, or no different from it.
fn keep_least(left: &mut Vec<(usize, Border)>, same: f64, value: impl Fn(&Border) -> f64) {
    let least = left.iter().fold(f64::INFINITY, |m, (_, b)| m.min(value(b)));
    left.retain(|(_, b)| value(b) <= least + same);
}

/// Puts the numbers of regions in the place of the faces that [`absorb`] names them by.
pub(crate) fn number(steps: &mut [SmallRegion], region_of_face: &[usize]) {
    for step in steps {
        step.region = region_of_face[step.region];
        step.neighbour = step.neighbour.map(|f| region_of_face[f]);
    }
}
