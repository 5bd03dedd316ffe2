//! What goes before the limits: faces kept apart or together, and small regions absorbed.

use std::collections::BTreeSet;

use crate::scene::{frame, master, model, moved, part, plate};
use approx::assert_abs_diff_eq;
use claymill_nurbs::analytic::{cylinder, plane_patch};
use claymill_nurbs::{Model, NurbsSurface, Vector3};
use claymill_surface_merge::{
    Absorption, Constraints, Merge, MergeOptions, Preset, SweptLimit, Verdict, merge, sweep,
};
use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;

fn merged(surfaces: &[NurbsSurface], options: &MergeOptions) -> Merge {
    merge(&model(surfaces.to_vec()), options).unwrap()
}

fn partition(m: &Merge) -> BTreeSet<BTreeSet<usize>> {
    m.regions.iter().map(|r| r.faces.iter().copied().collect()).collect()
}

fn sets(parts: &[&[usize]]) -> BTreeSet<BTreeSet<usize>> {
    parts.iter().map(|p| p.iter().copied().collect()).collect()
}

/// A flat plate, a fillet of radius 3 mm over 30°, and a roof of radius `r` that goes on where the fillet ends; at
/// the far end of the roof a strip 2 mm wide that turns away by 10°.
fn section(r: f64) -> Vec<NurbsSurface> {
    let along = (0.0, 40.0);
    let arc = |radius: f64, end: f64, from: f64, to: f64, at: [f64; 2]| {
        // The centre lies below: angles run from the vertical.
        let centre = [at[0] - radius * end.sin(), 0.0, at[1] - radius * end.cos()];
        cylinder(&frame(centre, Vector3::y(), Vector3::z()), radius, (from, to), along).unwrap()
    };
    let (bend, turn) = (f64::to_radians(30.0), f64::to_radians(10.0));
    let meet = [3.0 * bend.sin(), 3.0 * bend.cos() - 3.0];
    let (sin, cos) = (bend + turn).sin_cos();
    let end = [meet[0] + r * (sin - bend.sin()), meet[1] + r * (cos - bend.cos())];
    let down = bend + 2.0 * turn;
    let away = Vector3::new(down.cos(), 0.0, -down.sin());
    let strip =
        plane_patch(&frame([end[0], 0.0, end[1]], away.cross(&Vector3::y()), away), (0.0, 2.0), along);
    vec![
        plate((-30.0, 0.0), along, 0.0),
        arc(3.0, 0.0, 0.0, bend, [0.0, 0.0]),
        arc(r, bend, bend, bend + turn, meet),
        strip.unwrap(),
    ]
}

fn absorbing(area_mm2: f64, width_mm: f64) -> MergeOptions {
    let absorption = Some(Absorption { area_mm2, width_mm });
    MergeOptions { absorption, ..Preset::ClassA.options() }
}

#[test]
fn a_fillet_joins_the_neighbour_it_runs_into_most_smoothly_and_no_crease() {
    let alone = merged(&section(40.0), &Preset::ClassA.options());
    assert_eq!(partition(&alone), sets(&[&[0], &[1], &[2], &[3]]));
    assert!(alone.small.is_empty());
    // 1/3 − 1/40 against 1/3: the roof is the smoother neighbour of the fillet.
    let m = merged(&section(40.0), &absorbing(0.0, 2.5));
    assert_eq!(partition(&m), sets(&[&[0], &[1, 2], &[3]]));
    let (fillet, strip) = (&m.small[0], &m.small[1]);
    let arc = 3.0 * f64::to_radians(30.0);
    assert!(fillet.absorbed && fillet.faces == [1] && fillet.region == m.region_of_face[2]);
    assert_eq!(fillet.neighbour, Some(fillet.region));
    assert_abs_diff_eq!(fillet.area_mm2, 40.0 * arc, epsilon = 1e-6);
    assert_abs_diff_eq!(fillet.width_mm.unwrap(), 40.0 * arc / (40.0 + arc), epsilon = 1e-6);
    assert_abs_diff_eq!(fillet.border_mm, 40.0, epsilon = 1e-9);
    // The strip stands at a crease: it stays, and is told with what keeps it.
    assert!(!strip.absorbed && strip.faces == [3]);
    assert_eq!((strip.region, strip.neighbour), (m.region_of_face[3], Some(m.region_of_face[2])));
    assert_abs_diff_eq!(strip.angle_max_deg, 10.0, epsilon = 1e-9);
    let verdict = |faces: [usize; 2]| {
        let joint = m.joints.iter().find(|j| {
            let [a, b] = j.sides.map(|s| s.face);
            [a.min(b), a.max(b)] == faces
        });
        joint.unwrap().verdict
    };
    assert_eq!(verdict([1, 2]), Verdict::Absorbed);
    assert_eq!(verdict([0, 1]), Verdict::SplitCurvature);
    assert_eq!(verdict([2, 3]), Verdict::SplitAngle);
    // By area: the fillet has 62.8 mm², the strip 80, the roof 279.
    assert_eq!(merged(&section(40.0), &absorbing(60.0, 0.0)).regions.len(), 4);
    assert_eq!(merged(&section(40.0), &absorbing(70.0, 0.0)).regions.len(), 3);
    // Sweeps absorb as well.
    let swept = sweep(&m, &absorbing(0.0, 2.5), SweptLimit::Angle, &[0.1]);
    assert_eq!(swept.grown[0].regions, 3);
    // Where the user keeps them apart, the other neighbour is left.
    let constraints = Constraints { class_of_face: vec![0, 0, 1, 1], together: Vec::new() };
    let kept = merged(&section(40.0), &MergeOptions { constraints, ..absorbing(0.0, 2.5) });
    assert_eq!(partition(&kept), sets(&[&[0, 1], &[2], &[3]]));
}

#[test]
fn absorption_does_not_depend_on_order() {
    let mut rng = ChaCha8Rng::seed_from_u64(9);
    // Each face of the section in four, so that small regions have small neighbours; r = −3 would be a twin.
    let whole = section(40.0);
    let quarter = |s: &NurbsSurface| {
        let ((u0, u1), (v0, v1)) = s.domain();
        let cut = |a: f64, b: f64, k: f64| a + (b - a) * k;
        let (um, vm) = (cut(u0, u1, 0.4), cut(v0, v1, 0.55));
        [((u0, um), (v0, vm)), ((um, u1), (v0, vm)), ((u0, um), (vm, v1)), ((um, u1), (vm, v1))]
            .map(|(u, v)| part(s, u, v))
    };
    let faces: Vec<NurbsSurface> = whole.iter().flat_map(quarter).collect();
    let expected = sets(&[&[0, 1, 2, 3], &[4, 5, 6, 7, 8, 9, 10, 11], &[12, 13, 14, 15]]);
    for _ in 0..20 {
        let mut order: Vec<usize> = (0..faces.len()).collect();
        order.shuffle(&mut rng);
        let shuffled: Vec<NurbsSurface> = order
            .iter()
            .enumerate()
            .map(|(k, &f)| if k % 2 == 0 { faces[f].transposed() } else { faces[f].reversed_u() })
            .collect();
        let m = merged(&shuffled, &absorbing(0.0, 2.5));
        let found: BTreeSet<BTreeSet<usize>> =
            m.regions.iter().map(|r| r.faces.iter().map(|&f| order[f]).collect()).collect();
        assert_eq!(found, expected);
    }
}

#[test]
fn faces_are_kept_apart_and_together() {
    // Four plates in a row; the last one stands up.
    let wall = plane_patch(&frame([30.0, 0.0, 0.0], Vector3::x(), Vector3::z()), (0.0, 10.0), (-20.0, 0.0));
    let mut plates: Vec<NurbsSurface> = (0..3)
        .map(|k| moved(&plate((0.0, 10.0), (0.0, 20.0), 0.0), Vector3::new(10.0 * f64::from(k), 0.0, 0.0)))
        .collect();
    plates.push(wall.unwrap());
    let with = |class_of_face: &[usize], together: &[&[usize]]| MergeOptions {
        constraints: Constraints {
            class_of_face: class_of_face.to_vec(),
            together: together.iter().map(|set| set.to_vec()).collect(),
        },
        ..MergeOptions::default()
    };
    assert_eq!(partition(&merged(&plates, &with(&[], &[]))), sets(&[&[0, 1, 2], &[3]]));
    let apart = merged(&plates, &with(&[0, 0, 7, 7], &[]));
    assert_eq!(partition(&apart), sets(&[&[0, 1], &[2], &[3]]));
    let kept: Vec<_> = apart.joints.iter().filter(|j| j.verdict == Verdict::KeptApart).collect();
    assert_eq!(kept.len(), 1);
    assert!(kept[0].regions_if_merged.is_none() && kept[0].why.starts_with("kept apart"));
    let together = merged(&plates, &with(&[], &[&[2, 3]]));
    assert_eq!(partition(&together), sets(&[&[0, 1, 2, 3]]));
    let joint = together.joints.iter().find(|j| j.verdict == Verdict::KeptTogether).unwrap();
    assert!(joint.why.contains("angle 90.000°"), "{}", joint.why);
    let halves = [(0.0, 0.4), (0.4, 1.0)].map(|u| part(&master(), u, (0.0, 1.0)));
    assert_eq!(merged(&halves, &with(&[1, 0], &[])).regions.len(), 2);
    // Sets that share a face are one; faces that do not touch stay apart.
    assert_eq!(merged(&plates, &with(&[], &[&[3, 1], &[1, 2]])).regions.len(), 1);
    assert_eq!(merged(&plates, &with(&[], &[&[3, 0]])).regions.len(), 2);
    for (options, says) in [
        (with(&[0, 1, 2, 3], &[&[1, 2]]), "faces 1 and 2 are to be kept together, and apart too"),
        (with(&[0], &[]), "1 classes for 4 faces"),
        (with(&[], &[&[1, 9]]), "face 9 does not exist"),
        (
            MergeOptions { absorption: Some(Absorption { area_mm2: 0.0, width_mm: 0.0 }), ..with(&[], &[]) },
            "absorption",
        ),
    ] {
        let refused = merge(&Model { ..model(plates.clone()) }, &options).unwrap_err();
        assert!(refused.to_string().contains(says), "{refused}");
    }
}
