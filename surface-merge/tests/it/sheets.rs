//! Which side of a sheet is free of material.

use std::f64::consts::{FRAC_PI_2, TAU};

use crate::scene::{self, frame, model, part, plate};
use claymill_models::{RoadsterOptions, roadster};
use claymill_nurbs::analytic::{plane_patch, sphere};
use claymill_nurbs::{KnotVector, Model, NurbsSurface, Point3, Vector3};
use claymill_surface_merge::{Evidence, MergeOptions, Sheet, SheetOptions, merge, sheets};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

const UNKNOWN: SheetOptions = SheetOptions { file_states_sides: false, up: None };
const STATED: SheetOptions = SheetOptions { file_states_sides: true, up: None };

fn found(model: &Model, options: &SheetOptions) -> Vec<Sheet> {
    let merged = merge(model, &MergeOptions::default()).unwrap();
    sheets(model, &merged, options)
}

/// The normal of a face on its free side, in the middle.
fn free_normal(model: &Model, sheet: &Sheet, k: usize) -> (Point3, Vector3) {
    let surface = &model.faces[sheet.faces[k]].surface;
    let ((u0, u1), (v0, v1)) = surface.domain();
    let (u, v) = (0.5 * (u0 + u1), 0.5 * (v0 + v1));
    let n = surface.normal(u, v).unwrap().0;
    (surface.point(u, v), if sheet.free_along[k] { n } else { -n })
}

/// Every second patch or so turned the other way.
fn shuffled(surfaces: Vec<NurbsSurface>, seed: u64) -> Vec<NurbsSurface> {
    let mut chance = ChaCha8Rng::seed_from_u64(seed);
    surfaces.into_iter().map(|s| if chance.random() { s.reversed_u() } else { s }).collect()
}

/// A part of a ball around the origin, cut into patches.
fn cap(radius_mm: f64, latitude: (f64, f64)) -> Vec<NurbsSurface> {
    let whole =
        sphere(&frame([0.0; 3], Vector3::z(), Vector3::x()), radius_mm, (0.0, TAU), latitude).unwrap();
    let ((u0, u1), (v0, v1)) = whole.domain();
    let at = |a: f64, b: f64, k: usize| a + (b - a) * k as f64 / 4.0;
    let patch = |i: usize, j: usize| {
        part(&whole, (at(u0, u1, i), at(u0, u1, i + 1)), (at(v0, v1, j), at(v0, v1, j + 1)))
    };
    (0..16).map(|k| patch(k / 4, k % 4)).collect()
}

/// Five or six sides of a box of 60 × 40 × 30.
fn boxed(lid: bool) -> Vec<NurbsSurface> {
    let side = |origin: [f64; 3], z: Vector3, x: Vector3, u: f64, v: f64| {
        plane_patch(&frame(origin, z, x), (0.0, u), (0.0, v)).unwrap()
    };
    let (x, y, z) = (Vector3::x(), Vector3::y(), Vector3::z());
    let mut sides = vec![
        side([0.0; 3], z, x, 60.0, 40.0),
        side([0.0; 3], -y, x, 60.0, 30.0),
        side([0.0, 40.0, 0.0], -y, x, 60.0, 30.0),
        side([0.0; 3], x, y, 40.0, 30.0),
        side([60.0, 0.0, 0.0], x, y, 40.0, 30.0),
    ];
    // Frames with −y as their axis run down in their second direction.
    sides[1] = plane_patch(&frame([0.0; 3], y, x), (0.0, 60.0), (-30.0, 0.0)).unwrap();
    sides[2] = plane_patch(&frame([0.0, 40.0, 0.0], y, x), (0.0, 60.0), (-30.0, 0.0)).unwrap();
    if lid {
        sides.push(side([0.0, 0.0, 30.0], z, x, 60.0, 40.0));
    }
    sides
}

#[test]
fn the_outside_of_half_a_ball_is_free_however_its_patches_are_turned() {
    for seed in 0..6 {
        let model = model(shuffled(cap(50.0, (0.0, FRAC_PI_2)), seed));
        let found = found(&model, &UNKNOWN);
        let [half] = &found[..] else { panic!("{} sheets", found.len()) };
        assert_eq!((half.evidence, half.clear), (Evidence::Encloses, true), "{half:?}");
        for k in 0..half.faces.len() {
            let (at, n) = free_normal(&model, half, k);
            assert!(n.dot(&at.coords) > 0.0, "seed {seed}, face {}", half.faces[k]);
        }
        assert!((half.open_mm - 50.0 * TAU).abs() < 0.1, "{}", half.open_mm);
    }
}

#[test]
fn a_closed_box_is_milled_from_outside_and_an_open_one_too() {
    for (lid, evidence) in [(true, Evidence::Closed), (false, Evidence::Encloses)] {
        for seed in 0..6 {
            let model = model(shuffled(boxed(lid), seed));
            let found = found(&model, &UNKNOWN);
            let [all] = &found[..] else { panic!("{} sheets, lid {lid}", found.len()) };
            assert_eq!((all.evidence, all.clear), (evidence, true), "{all:?}");
            for k in 0..all.faces.len() {
                let (at, n) = free_normal(&model, all, k);
                assert!(n.dot(&(at - Point3::new(30.0, 20.0, 15.0))) > 0.0, "{seed} {}", all.faces[k]);
            }
        }
    }
}

#[test]
fn both_skins_of_a_thick_shell_are_free() {
    let model =
        model(shuffled([cap(50.0, (-FRAC_PI_2, FRAC_PI_2)), cap(46.0, (-FRAC_PI_2, FRAC_PI_2))].concat(), 3));
    // Two closed sheets: the inner one bounds a hollow only if the file says so; nothing gets there.
    assert!(found(&model, &UNKNOWN).iter().all(|s| s.evidence == Evidence::Closed));

    // With an opening the two skins are one sheet, whose inner skin is free inwards.
    let rim = {
        let bottom = |r: f64| Point3::new(r * 0.5_f64.cos(), 0.0, r * (-0.5_f64).sin());
        let (a, b) = (bottom(46.0), bottom(50.0));
        let profile = claymill_nurbs::analytic::segment(a, b, (0.0, 1.0)).unwrap();
        claymill_nurbs::analytic::revolution(&profile, &Point3::origin(), &Vector3::z(), (0.0, TAU)).unwrap()
    };
    let open = |r| cap(r, (-0.5, FRAC_PI_2));
    let model = scene::model(shuffled([open(50.0), open(46.0), vec![rim]].concat(), 5));
    let found = found(&model, &UNKNOWN);
    let [shell] = &found[..] else { panic!("{} sheets", found.len()) };
    assert_eq!(shell.evidence, Evidence::Closed);
    for k in 0..shell.faces.len() {
        let (at, n) = free_normal(&model, shell, k);
        let away = n.dot(&at.coords.normalize());
        let is_skin = (at.coords.norm() - 50.0).abs() < 1e-6 || (at.coords.norm() - 46.0).abs() < 1e-6;
        assert!(!is_skin || (away > 0.0) == (at.coords.norm() > 48.0), "{}", shell.faces[k]);
    }
}

#[test]
fn a_level_sheet_is_cut_from_above_and_an_upright_one_as_the_file_has_it() {
    let up = SheetOptions { up: Some(Vector3::z()), ..UNKNOWN };
    for seed in 0..4 {
        let lying = model(shuffled(
            vec![plate((0.0, 50.0), (0.0, 50.0), 0.0), plate((50.0, 90.0), (0.0, 50.0), 0.0)],
            seed,
        ));
        let found = found(&lying, &up);
        assert_eq!((found[0].evidence, found[0].clear), (Evidence::Level, true));
        assert!((0..2).all(|k| free_normal(&lying, &found[0], k).1.z > 0.9));
    }
    let upright =
        || plane_patch(&frame([0.0; 3], Vector3::x(), Vector3::y()), (0.0, 50.0), (0.0, 40.0)).unwrap();
    let mut standing = model(vec![upright()]);
    let unsaid = found(&standing, &up);
    assert_eq!((unsaid[0].evidence, unsaid[0].clear), (Evidence::Assumed, false));
    for reversed in [false, true] {
        standing.faces[0].reversed = reversed;
        let said = found(&standing, &SheetOptions { up: Some(Vector3::z()), ..STATED });
        assert_eq!((said[0].evidence, said[0].clear), (Evidence::File, true));
        assert_eq!(said[0].free_along, [!reversed]);
    }
}

#[test]
fn a_file_that_contradicts_the_shape_makes_it_unclear() {
    let mut bowl = model(cap(50.0, (0.0, FRAC_PI_2)));
    let outward = found(&bowl, &UNKNOWN)[0].clone();
    for inside_out in [false, true] {
        for (face, along) in outward.faces.iter().zip(&outward.free_along) {
            bowl.faces[*face].reversed = *along == inside_out;
        }
        let said = &found(&bowl, &STATED)[0];
        assert_eq!((said.evidence, said.clear), (Evidence::Encloses, !inside_out));
        assert_eq!(said.free_along, outward.free_along);
        assert_eq!(said.file_agrees > 0.5, !inside_out);
    }
}

#[test]
fn a_moebius_strip_has_no_two_sides() {
    let count = 12;
    let edge = |k: usize| {
        let angle = TAU * k as f64 / count as f64;
        let half = 0.5 * angle;
        let across = Vector3::new(half.cos() * angle.cos(), half.cos() * angle.sin(), half.sin()) * 8.0;
        let middle = Point3::new(40.0 * angle.cos(), 40.0 * angle.sin(), 0.0);
        [middle - across, middle + across]
    };
    let patch = |k: usize| {
        let ([a, b], [c, d]) = (edge(k), edge(k + 1));
        let knots = || KnotVector::clamped_uniform(1, 2);
        NurbsSurface::new(knots(), knots(), vec![a, b, c, d], None).unwrap()
    };
    for seed in 0..3 {
        let model = model(shuffled((0..count).map(patch).collect(), seed));
        let found = found(&model, &UNKNOWN);
        let [strip] = &found[..] else { panic!("{} sheets", found.len()) };
        assert_eq!((strip.evidence, strip.clear), (Evidence::FaceByFace, false));
        assert!((strip.turned_mm - 16.0).abs() < 0.1, "{}", strip.turned_mm);
    }
}

#[test]
fn the_roadster_is_free_outside() {
    let sample = roadster(&RoadsterOptions { patches: 500, seed: 3 });
    let merged = merge(&sample.model, &MergeOptions::default()).unwrap();
    let up = SheetOptions { up: Some(Vector3::z()), ..UNKNOWN };
    let found = sheets(&sample.model, &merged, &up);
    let faces: usize = found.iter().map(|s| s.faces.len()).sum();
    assert_eq!(faces, sample.model.faces.len());
    assert!(found.iter().all(|s| s.clear), "{:#?}", found.iter().find(|s| !s.clear));
    let each = found.iter().flat_map(|s| &s.faces).copied().collect::<std::collections::BTreeSet<_>>();
    assert_eq!(each.len(), faces);
}
