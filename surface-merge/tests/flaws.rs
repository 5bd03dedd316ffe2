//! Flaws of known size, planted and found again.

use std::collections::{BTreeMap, BTreeSet};

use approx::{assert_abs_diff_eq, assert_relative_eq};
use claymill_models::{Flaw, PlantedFlaw, RoadsterOptions, Sample, ribbon, roadster};
use claymill_surface_merge::{Joint, Merge, MergeOptions, merge};

fn merged(sample: &Sample) -> Merge {
    let m = merge(&sample.model, &MergeOptions::default()).unwrap();
    let a = &m.account;
    assert_abs_diff_eq!(
        a.matched_mm + a.lapped_mm + a.naked_mm + a.non_manifold_mm,
        a.total_mm,
        epsilon = 1e-9 * a.total_mm
    );
    m
}

fn faces(joint: &Joint) -> [usize; 2] {
    let [a, b] = joint.sides.map(|s| s.face);
    [a.min(b), a.max(b)]
}

/// The joints found, by faces; every planted one is there with its length, and no other.
fn one_for_one<'m>(sample: &Sample, m: &'m Merge) -> BTreeMap<[usize; 2], Vec<&'m Joint>> {
    let mut planted: BTreeMap<[usize; 2], f64> = BTreeMap::new();
    for joint in &sample.answers.joints {
        *planted.entry(joint.faces).or_default() += joint.length_mm;
    }
    let mut found: BTreeMap<[usize; 2], Vec<&Joint>> = BTreeMap::new();
    for joint in &m.joints {
        found.entry(faces(joint)).or_default().push(joint);
    }
    assert!(found.keys().eq(planted.keys()), "{} found, {} planted", found.len(), planted.len());
    for (faces, joints) in &found {
        let length: f64 = joints.iter().map(|j| j.length_mm).sum();
        // Ends within the tolerance of a corner count as the corner.
        let ends = 2.0 * m.tolerance.value_mm * joints.len() as f64;
        assert!(
            (length - planted[faces]).abs() <= ends,
            "{faces:?}: {length}, {} in {}",
            planted[faces],
            joints.len()
        );
    }
    found
}

fn assert_planted_partition(sample: &Sample, m: &Merge) {
    let planted: BTreeSet<_> = sample.answers.regions.iter().map(|r| r.faces.clone()).collect();
    let found: BTreeSet<_> = m.regions.iter().map(|r| r.faces.clone()).collect();
    assert_eq!(found.len(), planted.len());
    assert!(found == planted);
}

/// Size of a flaw as measured on one of its joints: largest, root mean square, in the middle.
fn measured(flaw: &PlantedFlaw, joint: &Joint) -> [f64; 3] {
    let (spread, unit) = match flaw.flaw.parse().unwrap() {
        Flaw::Gap(_) => (joint.gap_normal_mm, 1.0),
        Flaw::Shift(_) => (joint.gap_lateral_mm, 1.0),
        Flaw::Kink(_) => (joint.angle_deg, 1.0),
        Flaw::Curvature(_) => (joint.curvature_machining, MergeOptions::default().ball_radius_mm),
        other => panic!("{other} has no size on a joint"),
    };
    [spread.max / unit, spread.rms / unit, spread.mid / unit]
}

fn assert_sizes(sample: &Sample, found: &BTreeMap<[usize; 2], Vec<&Joint>>) {
    let mut flawed = BTreeSet::new();
    for flaw in sample.answers.flaws.iter().filter(|f| f.flaw.parse::<Flaw>().unwrap().is_on_a_line()) {
        assert!(!flaw.joints.is_empty());
        for faces in &flaw.joints {
            flawed.insert(*faces);
            for size in found[faces].iter().flat_map(|j| measured(flaw, j)) {
                assert_relative_eq!(size, flaw.size, max_relative = 1e-6);
            }
        }
    }
    // And nothing where nothing was planted.
    for joint in found.iter().filter(|(faces, _)| !flawed.contains(*faces)).flat_map(|(_, all)| all) {
        assert!(joint.gap_normal_mm.max < 1e-8 && joint.gap_lateral_mm.max < 1e-8);
        assert!(joint.angle_deg.max < 1e-8, "{}", joint.angle_deg.max);
        assert!(joint.curvature_machining.max < 1e-7, "{}", joint.curvature_machining.max);
    }
}

const ON_LINES: [Flaw; 8] = [
    Flaw::Gap(0.001),
    Flaw::Kink(1.5),
    Flaw::Shift(0.004),
    Flaw::Curvature(2e-4),
    Flaw::Gap(0.0099),
    Flaw::Kink(20.0),
    Flaw::Curvature(5e-3),
    Flaw::Shift(0.0099),
];

#[test]
fn flaws_on_lines_are_found_with_their_size() {
    for (seed, staggered) in [(1, false), (2, true), (3, true)] {
        let mut flaws = ON_LINES.to_vec();
        if staggered {
            flaws.push(Flaw::TJunctions);
        }
        let sample = ribbon(400, seed, &flaws).unwrap();
        let m = merged(&sample);
        assert_sizes(&sample, &one_for_one(&sample, &m));
        assert_planted_partition(&sample, &m);
        assert_eq!(m.regions.len(), 3);
    }
}

#[test]
fn two_thousand_patches_with_every_flaw_on_a_line() {
    let mut flaws = ON_LINES.to_vec();
    flaws.push(Flaw::TJunctions);
    let sample = ribbon(2000, 7, &flaws).unwrap();
    let m = merged(&sample);
    assert_sizes(&sample, &one_for_one(&sample, &m));
    assert_planted_partition(&sample, &m);
    // A patch of a staggered row meets up to two patches on each side that is not cut in line.
    assert!(sample.answers.joints.len() > 2 * sample.model.faces.len());
}

#[test]
fn missing_faces_leave_their_neighbours_naked() {
    for seed in 0..4 {
        let whole = ribbon(200, seed, &[Flaw::TJunctions]).unwrap();
        let sample = ribbon(200, seed, &[Flaw::TJunctions, Flaw::Delete(5)]).unwrap();
        let (before, after) = (merged(&whole), merged(&sample));
        one_for_one(&sample, &after);
        assert_planted_partition(&sample, &after);
        let gone = sample.answers.flaws.last().unwrap();
        assert_eq!((gone.flaw.as_str(), gone.size), ("delete:5", 5.0));
        let matched = |s: &Sample| 2.0 * s.answers.totals.joint_length_mm;
        assert_abs_diff_eq!(after.account.matched_mm, matched(&sample), epsilon = 1.0);
        // The outer rim of missing faces went with them.
        let rim_gone =
            (before.account.total_mm - matched(&whole)) - (after.account.naked_mm - gone.length_mm);
        assert!(rim_gone > -1.0, "{rim_gone}");
    }
}

#[test]
fn turned_faces_are_told_from_the_others() {
    let sample = ribbon(100, 5, &[Flaw::Flip(7), Flaw::Gap(0.003)]).unwrap();
    let m = merged(&sample);
    assert_eq!(m.regions.len(), 1);
    let r = &m.regions[0];
    let turned: Vec<usize> = r.faces.iter().zip(&r.flipped).filter(|f| *f.1).map(|f| *f.0).collect();
    let mut planted = sample.answers.flaws.iter().find(|f| f.flaw == "flip:7").unwrap().faces.clone();
    planted.sort_unstable();
    // Sides are told from the largest face, which may be one of those turned.
    let others: Vec<usize> = r.faces.iter().copied().filter(|f| !planted.contains(f)).collect();
    assert!(turned == planted || turned == others, "{turned:?} {planted:?}");
}

#[test]
fn coordinates_of_few_digits_change_neither_joints_nor_regions() {
    for digits in [3, 4] {
        let flaws = [Flaw::Kink(3.0), Flaw::TJunctions, Flaw::Round(digits)];
        let sample = ribbon(200, 4, &flaws).unwrap();
        let m = merged(&sample);
        let found = one_for_one(&sample, &m);
        assert_planted_partition(&sample, &m);
        let step = sample.answers.flaws.last().unwrap().size;
        assert_eq!(step, 10f64.powi(-(digits as i32)));
        // Either side is off by half a step in each coordinate at most.
        let off = step * 3f64.sqrt();
        for joint in found.values().flatten() {
            assert!(joint.gap_normal_mm.max <= off && joint.gap_lateral_mm.max <= off);
        }
    }
}

#[test]
fn flaws_can_be_planted_into_the_roadster() {
    let whole = roadster(&RoadsterOptions { patches: 500, seed: 2 });
    let faces = whole.model.faces.len();
    let sample = whole.clone().damaged(&[Flaw::Delete(3), Flaw::Round(4)], 2).unwrap();
    assert_eq!(sample.model.faces.len(), faces - 3);
    let m = merged(&sample);
    one_for_one(&sample, &m);
    assert_planted_partition(&sample, &m);
    assert!(whole.damaged(&[Flaw::Kink(1.0)], 2).is_err());
}
