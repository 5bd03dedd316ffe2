//! Flaws of known size, planted and found again.

use std::collections::{BTreeMap, BTreeSet};

use approx::{assert_abs_diff_eq, assert_relative_eq};
use claymill_models::{Flaw, PlantedFlaw, RoadsterOptions, Sample, ribbon, roadster};
use claymill_nurbs::Model;
use claymill_surface_merge::{Joint, Limits, Measure, Merge, MergeOptions, SweptLimit, merge, sweep};

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

type ByFaces<'m> = BTreeMap<[usize; 2], Vec<&'m Joint>>;

/// The joints found, by faces: those planted and no others.
fn one_for_one<'m>(sample: &Sample, m: &'m Merge) -> ByFaces<'m> {
    let planted: BTreeSet<[usize; 2]> = sample.answers.joints.iter().map(|j| j.faces).collect();
    let mut found = ByFaces::new();
    for joint in &m.joints {
        found.entry(faces(joint)).or_default().push(joint);
    }
    assert!(found.keys().eq(planted.iter()), "{} found, {} planted", found.len(), planted.len());
    found
}

fn assert_lengths(sample: &Sample, m: &Merge, found: &ByFaces<'_>) {
    let mut planted: BTreeMap<[usize; 2], f64> = BTreeMap::new();
    for joint in &sample.answers.joints {
        *planted.entry(joint.faces).or_default() += joint.length_mm;
    }
    for (faces, joints) in found {
        let length: f64 = joints.iter().map(|j| j.length_mm).sum();
        // Ends within the tolerance of a corner count as the corner.
        assert_abs_diff_eq!(length, planted[faces], epsilon = 2.0 * m.tolerance.value_mm);
    }
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

fn assert_sizes(sample: &Sample, m: &Merge) {
    let found = one_for_one(sample, m);
    assert_lengths(sample, m, &found);
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
        // A cut that passes within 0.03 mm of a knot leaves a span so narrow that rounding shows in its
        // derivatives: a hundred-thousandth of the limits.
        assert!(joint.angle_deg.max < 1e-7, "{}", joint.angle_deg.max);
        assert!(joint.curvature_machining.max < 1e-6, "{}", joint.curvature_machining.max);
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
        assert_sizes(&sample, &m);
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
    assert_sizes(&sample, &m);
    assert_planted_partition(&sample, &m);
    // A patch of a staggered row meets up to two patches on each side that is not cut in line.
    assert!(sample.answers.joints.len() > 2 * sample.model.faces.len());
}

/// Every kind of flaw in one model: precision and recall of joints, sizes, partition, copies, laps, sides.
fn every_kind_at_once(patches: usize) {
    let mut flaws = ON_LINES.to_vec();
    let on_faces = [Flaw::TJunctions, Flaw::Delete(12), Flaw::Flip(15), Flaw::Duplicate(9), Flaw::Lap(8)];
    flaws.extend(on_faces);
    let sample = ribbon(patches, 21, &flaws).unwrap();
    let m = merged(&sample);
    assert_sizes(&sample, &m);
    assert_planted_partition(&sample, &m);
    let planted = |kind: &'static str| sample.answers.flaws.iter().filter(move |f| f.flaw.starts_with(kind));
    let pairs = |kind| planted(kind).map(|f| [f.faces[0], f.faces[1]]).collect::<BTreeSet<_>>();
    let copies: BTreeSet<_> = m.duplicates.iter().map(|d| [d.original, d.copy]).collect();
    assert_eq!(copies, pairs("duplicate"));
    let laps: BTreeSet<_> = m.laps.iter().map(|l| [l.stretch.face, l.onto]).collect();
    assert_eq!(laps, pairs("lap"));
    let flipped: BTreeSet<usize> = planted("flip").flat_map(|f| f.faces.clone()).collect();
    let copied: BTreeSet<usize> = copies.iter().map(|c| c[1]).collect();
    for region in m.regions.iter().filter(|r| r.faces.len() > 1) {
        let sides: BTreeSet<bool> = region
            .faces
            .iter()
            .zip(&region.flipped)
            .filter(|(face, _)| !copied.contains(face))
            .map(|(face, turned)| flipped.contains(face) == *turned)
            .collect();
        assert_eq!(sides.len(), 1, "one side but for those turned");
    }
    // The same model with coordinates of four digits.
    flaws = vec![Flaw::Kink(1.5), Flaw::Kink(20.0), Flaw::TJunctions, Flaw::Delete(12), Flaw::Round(4)];
    let sample = ribbon(patches, 22, &flaws).unwrap();
    let m = merged(&sample);
    one_for_one(&sample, &m);
    assert_planted_partition(&sample, &m);
}

#[test]
fn every_kind_at_once_in_2000_patches() {
    every_kind_at_once(2000);
}

#[test]
#[ignore = "ten seconds: for `make bench`"]
fn every_kind_at_once_in_5000_patches() {
    every_kind_at_once(5000);
}

#[test]
#[ignore = "a minute: for `make bench`"]
fn every_kind_at_once_in_20000_patches() {
    every_kind_at_once(20_000);
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
fn copies_and_laps_are_told_from_joints() {
    for seed in 0..3 {
        let flaws = [Flaw::TJunctions, Flaw::Kink(5.0), Flaw::Duplicate(4), Flaw::Lap(3)];
        let sample = ribbon(150, seed, &flaws).unwrap();
        let m = merged(&sample);
        one_for_one(&sample, &m);
        assert_planted_partition(&sample, &m);
        let planted = |kind: &str| -> BTreeSet<[usize; 2]> {
            let of = sample.answers.flaws.iter().filter(|f| f.flaw.starts_with(kind));
            of.map(|f| [f.faces[0], f.faces[1]]).collect()
        };
        let copies: BTreeSet<_> = m.duplicates.iter().map(|d| [d.original, d.copy]).collect();
        assert_eq!(copies, planted("duplicate"));
        let laps: BTreeSet<_> = m.laps.iter().map(|l| [l.stretch.face, l.onto]).collect();
        assert_eq!(laps, planted("lap"));
        let boundary = |face: usize| {
            let lone = Model { faces: vec![sample.model.faces[face].clone()], ..Model::default() };
            merge(&lone, &MergeOptions::default()).unwrap().account.total_mm
        };
        let listed: f64 = m.laps.iter().map(|l| l.length_mm).sum();
        let whole: f64 = laps.iter().map(|l| boundary(l[0])).sum();
        assert_abs_diff_eq!(listed, whole, epsilon = 1e-5);
        let of_copies: f64 = copies.iter().map(|c| boundary(c[1])).sum();
        assert_abs_diff_eq!(m.account.lapped_mm, listed + of_copies, epsilon = 1e-5);
        let naked: f64 = m.naked.iter().map(|n| n.length_mm).sum();
        assert_abs_diff_eq!(naked, m.account.naked_mm, epsilon = 1e-2);
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

#[test]
fn a_sweep_tells_the_regions_at_every_limit() {
    let kinks = [0.15, 0.7, 0.7, 3.0, 12.0];
    let mut flaws: Vec<Flaw> = kinks.iter().map(|&deg| Flaw::Kink(deg)).collect();
    flaws.extend([Flaw::Curvature(1e-3), Flaw::Duplicate(2)]);
    let sample = ribbon(300, 11, &flaws).unwrap();
    let (m, options) = (merged(&sample), MergeOptions::default());
    let limits = [0.1, 0.5, 1.0, 2.0, 4.0, 20.0];
    let tree = sweep(&m, &options, SweptLimit::Angle, &limits);
    for limit in limits {
        let expected = 1 + kinks.iter().filter(|&&k| k > limit).count();
        assert_eq!(tree.regions_at(limit), expected, "{limit}");
        let narrow = Limits { angle_deg: limit, ..options.low };
        let strong = MergeOptions { low: narrow, high: narrow, ..options.clone() };
        let again = merge(&sample.model, &strong).unwrap();
        assert_eq!(again.regions.len(), expected);
        let mut of_tree: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
        tree.regions_of_faces(limit)
            .iter()
            .enumerate()
            .for_each(|(f, &r)| of_tree.entry(r).or_default().push(f));
        let of_merge: BTreeSet<_> = again.regions.iter().map(|r| r.faces.clone()).collect();
        assert_eq!(of_tree.into_values().collect::<BTreeSet<_>>(), of_merge);
    }
    // Weak borders reach twice as far as the limit.
    let grown: Vec<usize> = tree.grown.iter().map(|s| s.regions).collect();
    assert_eq!(grown, [5, 3, 3, 2, 2, 1]);
    assert_eq!(tree.grown[1].regions, m.regions.len());
    assert!(tree.curve().is_sorted_by(|a, b| a.at < b.at && a.regions > b.regions));
    assert_eq!(tree.curve().last().unwrap().regions, 1);
    // The jump of 0.001 per mm counts 0.01 for a ball of 10 mm; four kinks are above the low limit anyway.
    let tree = sweep(&m, &options, SweptLimit::CurvatureMachining, &[]);
    assert_eq!((tree.regions_at(0.0099), tree.regions_at(0.0101)), (6, 5));
}

#[test]
fn a_joint_that_is_not_merged_tells_what_is_missing() {
    let sample = ribbon(200, 3, &[Flaw::Kink(2.0), Flaw::Gap(0.006), Flaw::Kink(7.0)]).unwrap();
    let m = merged(&sample);
    assert_eq!(m.regions.len(), 3);
    for joint in &m.joints {
        let kink = sample.answers.joints.iter().find(|j| j.faces == faces(joint)).unwrap().angle_deg;
        let Some(failing) = joint.failing else {
            assert!(kink == 0.0 && joint.regions_if_merged.is_none());
            continue;
        };
        assert_eq!((failing.measure, failing.limit), (Measure::Angle, 1.0));
        assert_relative_eq!(failing.value, kink, max_relative = 1e-6);
        assert_abs_diff_eq!(failing.share_over, 1.0, epsilon = 1e-12);
        assert_eq!(joint.regions_if_merged, Some(2));
    }
    assert_eq!(m.joints.iter().filter(|j| j.failing.is_some()).count(), sample.answers.totals.joints_c0);
}
