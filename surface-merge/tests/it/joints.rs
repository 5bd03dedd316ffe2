//! Joints whose measures follow from elementary geometry.

use std::f64::consts::{FRAC_PI_2, PI};

use crate::scene::{self, frame, model, moved, part, plate};
use approx::assert_abs_diff_eq;
use claymill_nurbs::analytic::{cylinder, plane_patch, sphere, torus};
use claymill_nurbs::{KnotVector, NurbsSurface, Point3, Vector3};
use claymill_surface_merge::{
    Continuity, CurvatureLimit, Judged, Merge, MergeOptions, Preset, Verdict, merge,
};

fn merged(surfaces: Vec<NurbsSurface>) -> Merge {
    merge(&model(surfaces), &MergeOptions::default()).unwrap()
}

fn assert_account_closes(m: &Merge) {
    let a = &m.account;
    let parts = a.matched_mm + a.lapped_mm + a.naked_mm + a.non_manifold_mm;
    assert_abs_diff_eq!(parts, a.total_mm, epsilon = 1e-9 * a.total_mm);
}

#[test]
fn two_planes_meet_at_their_angle_with_its_sign() {
    for deg in [0.2, 0.7, 5.0, 60.0, 135.0, 179.0] {
        for upward in [1.0, -1.0] {
            let angle = f64::to_radians(deg * upward);
            let rising = Vector3::new(angle.cos(), 0.0, angle.sin());
            let normal = rising.cross(&Vector3::y());
            let bent = plane_patch(&frame([0.0; 3], normal, rising), (0.0, 30.0), (0.0, 20.0)).unwrap();
            for other in [bent.clone(), bent.reversed_u(), bent.transposed()] {
                let m = merged(vec![plate((-30.0, 0.0), (0.0, 20.0), 0.0), other]);
                assert_eq!(m.joints.len(), 1, "{deg}°");
                let j = &m.joints[0];
                assert_abs_diff_eq!(j.angle_deg.max, deg, epsilon = 1e-9);
                assert_abs_diff_eq!(j.length_mm, 20.0, epsilon = 1e-9);
                // Both planes see the same valley or ridge, unless the second's outside is the other one.
                if j.normals_agree || j.sides[0].face == 0 {
                    assert_eq!(j.mid.angle_deg.signum(), upward, "{deg}° {upward}");
                }
                let verdict = match deg {
                    0.2 => Verdict::Merged,
                    0.7 => Verdict::MergedWeak,
                    _ => Verdict::SplitAngle,
                };
                assert_eq!(j.verdict, verdict, "{}", j.why);
                assert_account_closes(&m);
            }
        }
    }
}

#[test]
fn a_cylinder_leaves_its_tangent_plane_with_curvature_one_over_r() {
    for r in [5.0, 20.0, 150.0] {
        let axis = frame([0.0, 0.0, -r], Vector3::y(), Vector3::z());
        let round = cylinder(&axis, r, (0.0, FRAC_PI_2), (0.0, 40.0)).unwrap();
        let m = merged(vec![plate((-30.0, 0.0), (0.0, 40.0), 0.0), round]);
        let j = &m.joints[0];
        assert_eq!(j.continuity, Continuity::G1);
        for s in &j.samples {
            assert_abs_diff_eq!(s.curvature_jump_per_mm(), 1.0 / r, epsilon = 1e-12);
        }
        assert_abs_diff_eq!(j.curvature_machining.rms, 10.0 / r, epsilon = 1e-11);
        assert_abs_diff_eq!(j.angle_deg.max, 0.0, epsilon = 1e-9);
        let verdict = if 10.0 / r > 0.2 { Verdict::CrossedCurvatureJump } else { Verdict::Merged };
        assert_eq!(j.verdict, verdict);
        assert_eq!(m.regions.len(), 1);
    }
}

#[test]
fn sphere_octants_are_one_closed_region() {
    let z = frame([3.0, -2.0, 5.0], Vector3::z(), Vector3::x());
    let octant = |k: usize| {
        let from = FRAC_PI_2 * (k % 4) as f64;
        let latitudes = if k < 4 { (0.0, FRAC_PI_2) } else { (-FRAC_PI_2, 0.0) };
        sphere(&z, 25.0, (from, from + FRAC_PI_2), latitudes).unwrap()
    };
    let m = merged((0..8).map(octant).collect());
    assert_eq!(m.joints.len(), 12);
    for j in &m.joints {
        assert_eq!(j.continuity, Continuity::G2);
        assert!(j.samples.iter().all(|s| s.curvature_jump_per_mm() < 1e-11));
        assert_abs_diff_eq!(j.length_mm, 25.0 * FRAC_PI_2, epsilon = 1e-6);
    }
    assert_eq!(m.regions.len(), 1);
    assert_eq!(m.regions[0].boundary_loops, 0);
    assert!(m.regions[0].normal_half_angle_deg > 100.0);
    assert!(m.naked.is_empty(), "{:?}", m.naked);
    assert_account_closes(&m);
}

#[test]
fn closed_surfaces_meet_themselves() {
    let z = frame([0.0; 3], Vector3::z(), Vector3::x());
    let tube = merged(vec![cylinder(&z, 12.0, (0.0, 2.0 * PI), (0.0, 50.0)).unwrap()]);
    assert_eq!(tube.joints.len(), 1);
    assert_abs_diff_eq!(tube.account.matched_mm, 100.0, epsilon = 1e-9);
    assert_abs_diff_eq!(tube.account.naked_mm, 2.0 * 2.0 * PI * 12.0, epsilon = 1e-4);
    assert_eq!(tube.regions[0].boundary_loops, 2);
    let ring = merged(vec![torus(&z, 60.0, 12.0, (0.0, 2.0 * PI), (0.0, 2.0 * PI)).unwrap()]);
    assert_eq!(ring.regions[0].boundary_loops, 0);
    assert!(ring.joints.iter().all(|j| j.continuity == Continuity::G2));
    assert_account_closes(&ring);
}

#[test]
fn a_moved_patch_leaves_a_gap_of_that_size() {
    for (shift, normal, lateral) in [
        (Vector3::new(0.0, 0.0, 0.012), 0.012, 0.0),
        (Vector3::new(0.009, 0.0, 0.0), 0.0, 0.009),
        (Vector3::new(-0.006, 0.0, 0.008), 0.008, 0.006),
    ] {
        let right = moved(&plate((10.0, 30.0), (0.0, 20.0), 0.0), shift);
        let m = merged(vec![plate((0.0, 10.0), (0.0, 20.0), 0.0), right]);
        let j = &m.joints[0];
        assert_abs_diff_eq!(j.gap_normal_mm.max, normal, epsilon = 1e-12);
        assert_abs_diff_eq!(j.gap_lateral_mm.rms, lateral, epsilon = 1e-12);
        assert_eq!(j.verdict, Verdict::Merged);
    }
    let options = MergeOptions { tolerance_mm: Some(0.4), ..MergeOptions::default() };
    let apart = [plate((0.0, 10.0), (0.0, 20.0), 0.0), plate((10.0, 30.0), (0.0, 20.0), 0.3)];
    let m = merge(&model(apart.to_vec()), &options).unwrap();
    assert_eq!(m.joints[0].verdict, Verdict::SplitGap);
    assert!(m.joints[0].why.starts_with("gap 0.3000 mm"), "{}", m.joints[0].why);
}

#[test]
fn a_gap_wider_than_the_tolerance_is_listed_with_its_size() {
    let left = plate((0.0, 10.0), (0.0, 20.0), 0.0);
    // Edge beside edge; the same shorter and turned by 20°; above the inside of the other one.
    let slope = f64::to_radians(20.0);
    let rising = Vector3::new(slope.cos(), 0.0, slope.sin());
    let bent = frame([10.1, 0.0, 0.0], rising.cross(&Vector3::y()), rising);
    for (right, length, to_edge, gap) in [
        (plate((10.1, 30.0), (0.0, 20.0), 0.0), 20.0, true, 0.1),
        (plane_patch(&bent, (0.0, 15.0), (4.0, 11.0)).unwrap(), 7.0, true, 0.1),
        (plate((-5.0, 5.0), (-5.0, 25.0), 0.2), 50.0, false, 0.2),
    ] {
        let m = merged(vec![left.clone(), right]);
        assert!(m.joints.is_empty() && m.laps.is_empty() && m.regions.len() == 2);
        assert_abs_diff_eq!(m.account.naked_mm, m.account.total_mm, epsilon = 1e-9);
        let found: f64 = m.wide_gaps.iter().map(|g| g.length_mm).sum();
        assert_abs_diff_eq!(found, length, epsilon = 0.02);
        for g in &m.wide_gaps {
            assert_abs_diff_eq!(g.gap_max_mm, gap, epsilon = 1e-9);
            assert_eq!((g.to_edge, g.stretch.face + g.beside), (to_edge, 1));
        }
    }
    // Two skins of a sheet lie on the same side of what is between their edges: no gap to be closed.
    let skins = merged(vec![left.clone(), moved(&left, Vector3::new(0.0, 0.0, 0.3))]);
    assert!(skins.wide_gaps.iter().all(|g| !g.to_edge), "{:?}", skins.wide_gaps);
    // Where a third plate fills the rest of the side, only the gap is left.
    let upper = plate((10.0, 30.0), (12.0, 20.0), 0.0);
    let m = merged(vec![left, plate((10.1, 30.0), (0.0, 12.0), 0.0), upper]);
    assert_eq!((m.joints.len(), m.wide_gaps.len()), (2, 1));
    assert_abs_diff_eq!(m.wide_gaps[0].length_mm, 12.0, epsilon = 0.01);
}

#[test]
fn a_side_that_drifts_apart_is_joined_only_where_it_is_near() {
    // The right plate's side leaves the left one by 0.001 mm per mm.
    let k = || KnotVector::clamped_uniform(1, 2);
    let corners = [[10.0, 0.0], [10.1, 100.0], [30.0, 0.0], [30.0, 100.0]];
    let points = corners.map(|[x, y]| Point3::new(x, y, 0.0)).to_vec();
    let right = NurbsSurface::new(k(), k(), points, None).unwrap();
    let options = MergeOptions { tolerance_mm: Some(0.04), ..MergeOptions::default() };
    let m = merge(&model(vec![plate((0.0, 10.0), (0.0, 100.0), 0.0), right]), &options).unwrap();
    assert_eq!(m.joints.len(), 1);
    // 0.04 = 100.1/100 · y · 0.001 on the slanted side, seen from the shorter, straight one.
    assert_abs_diff_eq!(m.joints[0].length_mm, 40.0, epsilon = 1e-3);
    assert_account_closes(&m);
}

#[test]
fn a_long_side_is_shared_out_among_short_ones() {
    let narrow = |from: f64, to: f64| plate((10.0, 25.0), (from, to), 0.0);
    let cuts = [-4.0, 3.0, 11.5, 20.0];
    let mut all: Vec<_> = cuts.windows(2).map(|w| narrow(w[0], w[1])).collect();
    all.push(plate((0.0, 10.0), (0.0, 20.0), 0.0));
    let m = merged(all);
    let mut along_wide: Vec<f64> =
        m.joints.iter().filter(|j| j.sides.iter().any(|s| s.face == 3)).map(|j| j.length_mm).collect();
    along_wide.sort_by(f64::total_cmp);
    assert_eq!(along_wide.len(), 3);
    for (found, expected) in along_wide.iter().zip([3.0, 8.5, 8.5]) {
        assert_abs_diff_eq!(*found, expected, epsilon = 1e-7);
    }
    assert_eq!(m.joints.len(), 5);
    assert_abs_diff_eq!(m.account.matched_mm, 2.0 * (20.0 + 2.0 * 15.0), epsilon = 1e-6);
    assert_eq!(m.regions[0].boundary_loops, 1);
    assert_account_closes(&m);
}

#[test]
fn a_third_face_on_an_edge_leaves_the_smooth_pair_joined() {
    let flange = frame([10.0, 0.0, 0.0], Vector3::x(), Vector3::z());
    let upright = plane_patch(&flange, (0.0, 15.0), (-20.0, 0.0)).unwrap();
    let m =
        merged(vec![plate((0.0, 10.0), (0.0, 20.0), 0.0), plate((10.0, 30.0), (0.0, 20.0), 0.0), upright]);
    assert_eq!(m.joints.len(), 3);
    assert!(m.joints.iter().all(|j| j.non_manifold));
    assert_abs_diff_eq!(m.account.non_manifold_mm, 60.0, epsilon = 1e-9);
    let faces: Vec<_> = m.regions.iter().map(|r| r.faces.clone()).collect();
    assert_eq!(faces, [vec![0, 1], vec![2]]);
    let verdict_of = |a, b| {
        let is = |j: &&claymill_surface_merge::Joint| j.sides.iter().all(|s| s.face == a || s.face == b);
        m.joints.iter().find(is).unwrap().verdict
    };
    assert_eq!(verdict_of(0, 1), Verdict::Merged);
    assert_eq!(verdict_of(1, 2), Verdict::SplitNonManifold);
}

/// Two patches cut from one bicubic at `x = 0`; the third row of control points of the second is then
/// raised by `lift[j]`, which changes nothing but the curvature across the joint, by exactly
/// `p (p − 1) Σ B_j(v) lift_j / |Su|²`.
fn lifted(lift: [f64; 4]) -> (Vec<NurbsSurface>, impl Fn(f64) -> f64) {
    let k = || KnotVector::clamped_uniform(3, 4);
    let patch = |x0: f64, lift: [f64; 4]| {
        let point = |n: usize| {
            let (i, j) = (n / 4, n % 4);
            let z = if i == 2 { lift[j] } else { 0.0 };
            Point3::new(x0 + 10.0 * i as f64, 12.0 * j as f64, z)
        };
        NurbsSurface::new(k(), k(), (0..16).map(point).collect(), None).unwrap()
    };
    let jump = move |v: f64| {
        let w = 1.0 - v;
        let bernstein = [w * w * w, 3.0 * v * w * w, 3.0 * v * v * w, v * v * v];
        let sum: f64 = bernstein.iter().zip(lift).map(|(b, l)| b * l).sum();
        6.0 * sum / (30.0 * 30.0)
    };
    (vec![patch(-30.0, [0.0; 4]), patch(0.0, lift)], jump)
}

#[test]
fn the_mid_point_rule_passes_a_joint_that_is_not_smooth() {
    let (surfaces, jump) = lifted([0.5, 0.5 / 3.0, -0.5 / 3.0, -0.5]);
    let along = MergeOptions { tolerance_mm: Some(0.01), ..Preset::Paper.options() };
    let paper = merge(&model(surfaces.clone()), &along).unwrap();
    let ours = merge(&model(surfaces), &MergeOptions { judged: Judged::Along, ..along }).unwrap();
    let j = &ours.joints[0];
    for s in &j.samples {
        assert_abs_diff_eq!(s.curvature_jump_per_mm(), jump(s.point.y / 36.0).abs(), epsilon = 1e-15);
    }
    assert!(j.curvature_relative.mid < 1e-9 && j.curvature_relative.max > 0.9);
    assert_eq!(paper.regions.len(), 1);
    assert_eq!(paper.joints[0].verdict, Verdict::Merged);
    assert_eq!(ours.regions.len(), 2);
    assert_eq!(j.verdict, Verdict::SplitCurvature, "{}", j.why);
    assert_eq!(ours.joints[0].continuity, Continuity::G1);
}

#[test]
fn a_prescribed_curvature_jump_is_found_exactly_on_a_curved_joint() {
    let (surfaces, jump) = lifted([0.2, -0.1, 0.35, 0.15]);
    let m = merged(surfaces);
    let worst = m.joints[0].samples.iter().map(|s| jump(s.point.y / 36.0).abs()).fold(0.0, f64::max);
    assert_abs_diff_eq!(m.joints[0].curvature_machining.max, 10.0 * worst, epsilon = 1e-13);
    // And none where one curved surface was only cut.
    let master = scene::master();
    let halves = vec![part(&master, (0.0, 0.37), (0.0, 1.0)), part(&master, (0.37, 1.0), (0.0, 1.0))];
    let j = &merged(halves).joints[0];
    assert!(j.curvature_machining.max < 1e-9, "{}", j.curvature_machining.max);
    assert_eq!(j.continuity, Continuity::G2);
}

#[test]
fn options_that_make_no_sense_are_refused() {
    let options = MergeOptions { ball_radius_mm: 0.0, ..MergeOptions::default() };
    let refused = merge(&model(vec![plate((0.0, 1.0), (0.0, 1.0), 0.0)]), &options);
    assert!(refused.unwrap_err().to_string().contains("ball_radius_mm"));
    let none = MergeOptions {
        low: claymill_surface_merge::Limits { curvature: CurvatureLimit::Any, ..options.low },
        ..MergeOptions::default()
    };
    assert!(merge(&model(Vec::new()), &none).unwrap().regions.is_empty());
}

#[test]
fn a_wall_on_a_floor_and_an_overlap_are_laps() {
    // A wall across the middle of the floor: its foot lies on the floor's inside, half of it beyond the edge.
    let upright = frame([5.0, 10.0, 0.0], Vector3::x(), Vector3::y());
    let wall = plane_patch(&upright, (0.0, 20.0), (0.0, 15.0)).unwrap();
    let m = merged(vec![plate((0.0, 10.0), (0.0, 20.0), 0.0), wall]);
    assert!(m.joints.is_empty() && m.duplicates.is_empty());
    assert_eq!(m.laps.len(), 1);
    assert_eq!((m.laps[0].stretch.face, m.laps[0].onto), (1, 0));
    assert_abs_diff_eq!(m.laps[0].length_mm, 10.0, epsilon = 1e-5);
    assert_abs_diff_eq!(m.account.lapped_mm, 10.0, epsilon = 1e-5);
    assert_account_closes(&m);
    // Two plates that overlap by 3 mm at 0.01 mm distance: either ends on the other.
    let m = merged(vec![plate((0.0, 10.0), (0.0, 20.0), 0.0), plate((7.0, 30.0), (1.0, 19.0), 0.01)]);
    let laps: f64 = m.laps.iter().map(|l| l.length_mm).sum();
    assert_abs_diff_eq!(laps, 18.0 + 18.0 + 2.0 * 3.0, epsilon = 1e-4);
    assert!(m.laps.iter().all(|l| (l.gap_mm - 0.01).abs() < 1e-9));
    assert_eq!(m.regions.len(), 2);
    assert_account_closes(&m);
}

#[test]
fn the_halves_of_a_lens_are_no_copies() {
    let z = frame([0.0; 3], Vector3::z(), Vector3::x());
    let half = |from: f64| sphere(&z, 25.0, (0.0, 2.0 * PI), (from, from + FRAC_PI_2)).unwrap();
    let lens = merged(vec![half(0.0), half(-FRAC_PI_2)]);
    assert!(lens.duplicates.is_empty());
    let twice = merged(vec![half(0.0), half(0.0).transposed()]);
    assert_eq!(twice.duplicates.len(), 1);
    assert!(!twice.duplicates[0].normals_agree);
    assert_eq!(twice.regions.len(), 1);
    assert_eq!(twice.regions[0].flipped, [false, true]);
    assert_account_closes(&twice);
}
