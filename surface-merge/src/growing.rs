//! Faces grow into regions: first across smooth joints, then across nearly smooth borders.
//!
//! The result does not depend on the order of faces or joints: joining over strong joints is a transitive
//! closure, and each later round judges all borders of the regions as they stand before any is removed.

use std::collections::BTreeMap;

use crate::disjoint_sets::DisjointSets;
use crate::joint::Joint;
use crate::options::MergeOptions;
use crate::verdict::Standing;

/// Length that must be within the low limits for two faces to join at once.
const STRONG_SHARE: f64 = 0.98;
/// Length of a joint that must be within the high limits for the joint to be weak.
const WEAK_SHARE: f64 = 0.95;
/// Length of a border that weak joints must make up for two regions to join.
const BORDER_SHARE: f64 = 0.9;

/// The region of each face (named by its smallest face) and the standing of each joint. `rivals` lists for
/// each joint the others on the same edges.
pub(crate) fn grow(
    faces: usize,
    joints: &[Joint],
    rivals: &[Vec<usize>],
    options: &MergeOptions,
) -> (Vec<usize>, Vec<Standing>) {
    let shares: Vec<[f64; 2]> =
        joints.iter().map(|j| [&options.low, &options.high].map(|l| options.share_within(l, j))).collect();
    let outdone: Vec<bool> = (0..joints.len()).map(|i| is_outdone(joints, i, &rivals[i])).collect();
    let usable = |i: &usize| !outdone[*i] && joints[*i].sides[0].face != joints[*i].sides[1].face;

    // Strong: all joints between two faces taken together.
    let mut between: BTreeMap<[usize; 2], [f64; 2]> = BTreeMap::new();
    for i in (0..joints.len()).filter(usable) {
        let sums = between.entry(ordered(joints[i].sides.map(|s| s.face))).or_default();
        sums[0] += joints[i].length_mm;
        sums[1] += joints[i].length_mm * shares[i][0];
    }
    let mut sets = DisjointSets::new(faces);
    for ([a, b], [length, within]) in between {
        if within >= STRONG_SHARE * length {
            sets.join(a, b);
        }
    }

    // Weak: all joints between two regions taken together, until nothing changes.
    loop {
        let mut borders: BTreeMap<[usize; 2], [f64; 2]> = BTreeMap::new();
        for i in (0..joints.len()).filter(usable) {
            let regions = ordered(joints[i].sides.map(|s| sets.root(s.face)));
            if regions[0] != regions[1] {
                let sums = borders.entry(regions).or_default();
                sums[0] += joints[i].length_mm;
                sums[1] += if shares[i][1] >= WEAK_SHARE { joints[i].length_mm } else { 0.0 };
            }
        }
        let mut changed = false;
        for ([a, b], [length, weak]) in borders {
            changed |= weak >= BORDER_SHARE * length && sets.join(a, b);
        }
        if !changed {
            break;
        }
    }

    let regions: Vec<usize> = (0..faces).map(|f| sets.root(f)).collect();
    let standing = (0..joints.len())
        .map(|i| Standing {
            outdone: outdone[i],
            together: regions[joints[i].sides[0].face] == regions[joints[i].sides[1].face],
            strong: shares[i][0] >= STRONG_SHARE,
            weak: shares[i][1] >= WEAK_SHARE,
        })
        .collect();
    (regions, standing)
}

/// Whether a rival on the same edge is smoother. Of equally smooth ones all stay: neither is better.
fn is_outdone(joints: &[Joint], i: usize, rivals: &[usize]) -> bool {
    let roughness = |j: &Joint| j.angle_deg.rms;
    // Twins differ by rounding only.
    rivals.iter().any(|&r| roughness(&joints[r]) + 1e-6 < roughness(&joints[i]))
}

fn ordered([a, b]: [usize; 2]) -> [usize; 2] {
    [a.min(b), a.max(b)]
}
