//! Faces grow into regions: first across smooth joints, then across nearly smooth borders.
//!
//! The result does not depend on the order of faces or joints: joining over strong joints is a transitive
//! closure, and each later round judges all borders of the regions as they stand before any is removed. What is
//! kept apart or together by wish is an equivalence of faces, so it does not bring order back.

use std::collections::BTreeMap;

use rayon::prelude::*;

use crate::absorption::{SmallRegion, Surroundings, absorb};
use crate::constraints::Wishes;
use crate::disjoint_sets::DisjointSets;
use crate::duplicates::Duplicate;
use crate::joint::Joint;
use crate::options::MergeOptions;
use crate::quotient::Quotient;
use crate::verdict::Standing;

/// Length that must be within the low limits for two faces to join at once.
pub(crate) const STRONG_SHARE: f64 = 0.98;
/// Length of a joint that must be within the high limits for the joint to be weak.
const WEAK_SHARE: f64 = 0.95;
/// Length of a border that weak joints must make up for two regions to join.
const BORDER_SHARE: f64 = 0.9;

/// What growing comes to.
pub(crate) struct Grown {
    /// The region of each face, named by its smallest face.
    pub(crate) labels: Vec<usize>,
    /// By joint.
    pub(crate) standings: Vec<Standing>,
    /// What was too small to stand alone, with faces in the place of regions.
    pub(crate) small: Vec<SmallRegion>,
}

/// Grows regions from faces.
pub(crate) fn grow(
    joints: &[Joint],
    duplicates: &[Duplicate],
    around: Surroundings<'_>,
    options: &MergeOptions,
) -> Grown {
    let faces = around.area_of_face_mm2.len();
    let shares = shares(joints, options);
    let wishes = options.constraints.of(faces, duplicates);
    let mut sets = partition(faces, joints, &shares, duplicates, &wishes);
    let before: Vec<usize> = (0..faces).map(|f| sets.root(f)).collect();
    let small = absorb(&mut sets, joints, around, &wishes, options);
    let regions: Vec<usize> = (0..faces).map(|f| sets.root(f)).collect();
    let mut quotient = Quotient::new(&regions);
    for (joint, shares) in joints.iter().zip(&shares).filter(|(j, _)| may_join(j, &wishes)) {
        let border = joint.sides.map(|s| regions[s.face]);
        quotient.add(border, joint.length_mm, shares[1] >= WEAK_SHARE);
    }
    let mut if_united: BTreeMap<[usize; 2], usize> = BTreeMap::new();
    let mut standing = |(joint, shares): (&Joint, &[f64; 2])| {
        let faces = joint.sides.map(|s| s.face);
        let border = ordered(faces.map(|f| regions[f]));
        let together = border[0] == border[1];
        let apart = wishes.apart(faces);
        let mut count = || quotient.regions_if_united(border, BORDER_SHARE);
        Standing {
            outdone: joint.outdone,
            apart,
            together,
            wished: wishes.together(faces),
            absorbed: together && before[faces[0]] != before[faces[1]] && options.is_tangent(joint),
            strong: shares[0] >= STRONG_SHARE,
            weak: shares[1] >= WEAK_SHARE,
            smooth_border: [quotient.smooth_share(border), BORDER_SHARE],
            regions_if_merged: (!together && !apart)
                .then(|| *if_united.entry(border).or_insert_with(&mut count)),
        }
    };
    let standings = joints.iter().zip(&shares).map(&mut standing).collect();
    Grown { labels: regions, standings, small }
}

/// Number of regions that `options` make of joints measured already.
pub(crate) fn count(
    joints: &[Joint],
    duplicates: &[Duplicate],
    around: Surroundings<'_>,
    options: &MergeOptions,
) -> usize {
    let faces = around.area_of_face_mm2.len();
    let wishes = options.constraints.of(faces, duplicates);
    let mut sets = partition(faces, joints, &shares(joints, options), duplicates, &wishes);
    absorb(&mut sets, joints, around, &wishes, options);
    (0..faces).filter(|&f| sets.root(f) == f).count()
}

/// Marks joints that a smoother one on the same edge outdoes; `rivals` lists for each the others on its edges.
pub(crate) fn mark_outdone(joints: &mut [Joint], rivals: &[Vec<usize>]) {
    let outdone: Vec<bool> = (0..joints.len()).map(|i| is_outdone(joints, i, &rivals[i])).collect();
    joints.iter_mut().zip(outdone).for_each(|(joint, outdone)| joint.outdone = outdone);
}

/// Whether a joint can join faces at all.
pub(crate) fn joins(joint: &Joint) -> bool {
    !joint.outdone && joint.sides[0].face != joint.sides[1].face
}

/// Whether a joint can join faces that are not to be kept apart.
pub(crate) fn may_join(joint: &Joint, wishes: &Wishes) -> bool {
    joins(joint) && !wishes.apart(joint.sides.map(|s| s.face))
}

/// Shares of the length of each joint within the low and the high limits.
fn shares(joints: &[Joint], options: &MergeOptions) -> Vec<[f64; 2]> {
    let of = |joint: &Joint| [&options.low, &options.high].map(|l| options.share_within(l, joint));
    joints.par_iter().map(of).collect()
}

fn partition(
    faces: usize,
    joints: &[Joint],
    shares: &[[f64; 2]],
    duplicates: &[Duplicate],
    wishes: &Wishes,
) -> DisjointSets {
    let usable = || joints.iter().zip(shares).filter(|(joint, _)| may_join(joint, wishes));
    let mut sets = DisjointSets::new(faces);
    for d in duplicates {
        sets.join(d.original, d.copy);
    }
    for faces in joints.iter().map(|j| j.sides.map(|s| s.face)).filter(|f| wishes.together(*f)) {
        sets.join(faces[0], faces[1]);
    }

    // Strong: all joints between two faces taken together.
    let mut between: BTreeMap<[usize; 2], [f64; 2]> = BTreeMap::new();
    for (joint, shares) in usable() {
        let sums = between.entry(ordered(joint.sides.map(|s| s.face))).or_default();
        sums[0] += joint.length_mm;
        sums[1] += joint.length_mm * shares[0];
    }
    for ([a, b], [length, within]) in between {
        if within >= STRONG_SHARE * length {
            sets.join(a, b);
        }
    }

    // Weak: all joints between two regions taken together, until nothing changes.
    loop {
        let mut borders: BTreeMap<[usize; 2], [f64; 2]> = BTreeMap::new();
        for (joint, shares) in usable() {
            let regions = ordered(joint.sides.map(|s| sets.root(s.face)));
            if regions[0] != regions[1] {
                let sums = borders.entry(regions).or_default();
                sums[0] += joint.length_mm;
                sums[1] += if shares[1] >= WEAK_SHARE { joint.length_mm } else { 0.0 };
            }
        }
        let mut changed = false;
        for ([a, b], [length, weak]) in borders {
            changed |= weak >= BORDER_SHARE * length && sets.join(a, b);
        }
        if !changed {
            return sets;
        }
    }
}

/// Whether a rival on the same edge is smoother. Of equally smooth ones all stay: neither is better.
fn is_outdone(joints: &[Joint], i: usize, rivals: &[usize]) -> bool {
    let roughness = |j: &Joint| j.angle_deg.rms;
    // Twins differ by rounding only.
    rivals.iter().any(|&r| roughness(&joints[r]) + 1e-6 < roughness(&joints[i]))
}

pub(crate) fn ordered([a, b]: [usize; 2]) -> [usize; 2] {
    [a.min(b), a.max(b)]
}
