//! Whether the nearest point is the only one: analytic medial sets, and brute force.

use crate::shapes::{cylinder, ellipse, face, panel, plane, sphere, torus};
use claymill_nurbs::{ClosestPoints, Model, Nearest, NurbsSurface, Point3, Vector3};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

fn model(surfaces: Vec<NurbsSurface>) -> Model {
    Model { faces: surfaces.into_iter().map(|s| face(s, vec![])).collect(), ..Model::default() }
}

fn is_unique(n: Nearest) -> bool {
    matches!(n, Nearest::Unique(_))
}

#[test]
fn centres_and_axes_share_their_feet_and_points_beside_them_do_not() {
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    let ball = model(vec![sphere(20.0)]);
    let tube = model(vec![cylinder(20.0, 60.0)]);
    let ring = model(vec![torus(60.0, 15.0)]);
    let (ball, tube, ring) =
        (ClosestPoints::new(&ball), ClosestPoints::new(&tube), ClosestPoints::new(&ring));
    let ask = |index: &ClosestPoints, p: Vector3| index.nearest(&Point3::from(p), f64::INFINITY);
    assert!(matches!(ask(&ball, Vector3::zeros()), Nearest::Shared { .. }));
    for _ in 0..30 {
        let along = rng.random_range(5.0..55.0);
        let turn: f64 = rng.random_range(0.0..std::f64::consts::TAU);
        let out = Vector3::new(turn.cos(), turn.sin(), 0.0);
        assert!(matches!(ask(&tube, Vector3::z() * along), Nearest::Shared { .. }), "axis at {along}");
        assert!(matches!(ask(&ring, out * 60.0), Nearest::Shared { .. }), "circle at {turn}");
        assert!(
            matches!(ask(&ring, Vector3::z() * along), Nearest::Shared { .. }),
            "the torus' axis at {along}"
        );
        for aside in [0.1, 1.0, 5.0] {
            assert!(is_unique(ask(&ball, out * aside)), "beside the centre by {aside}, {turn}");
            assert!(
                is_unique(ask(&tube, out * aside + Vector3::z() * along)),
                "beside the axis by {aside}, {turn}"
            );
            assert!(is_unique(ask(&ring, out * (60.0 - aside))), "beside the circle by {aside}, {turn}");
        }
    }
}

#[test]
fn between_two_sheets_there_are_two_feet() {
    let up = plane(50.0).mapped(|p| p + Vector3::z() * 10.0);
    let both = model(vec![plane(50.0), up]);
    let index = ClosestPoints::new(&both);
    let Nearest::Shared { foot, other: Some(other) } = index.nearest(&Point3::new(3.0, 7.0, 5.0), 50.0)
    else {
        panic!("two sheets are equally near");
    };
    assert!((foot.point.z - other.z).abs() > 9.9 && (foot.point.x - other.x).abs() < 1e-6);
    assert!(is_unique(index.nearest(&Point3::new(3.0, 7.0, 5.0 - 1e-6), 50.0)));
    assert_eq!(index.nearest(&Point3::new(3.0, 7.0, 90.0), 50.0), Nearest::Nothing);
    // One foot on the edge that two faces share is one foot.
    let halves = model([0.5].iter().flat_map(|&u| panel().split_u(u)).flat_map(|(a, b)| [a, b]).collect());
    let index = ClosestPoints::new(&halves);
    let jet = panel().jet(0.5, 0.3);
    assert!(is_unique(index.nearest(&(jet.p + jet.normal().unwrap() * 12.0), 50.0)));
}

/// All places of a fine grid whose distance is below that of those around them, as distance and point.
fn minima(surface: &NurbsSurface, inside: impl Fn(f64, f64) -> bool, q: &Point3) -> Vec<(f64, Point3)> {
    const N: i32 = 240;
    let place = |i: i32, j: i32| (f64::from(i) / f64::from(N), f64::from(j) / f64::from(N));
    let distance = |i: i32, j: i32| {
        let (u, v) = place(i, j);
        let kept = (0..=N).contains(&i) && (0..=N).contains(&j) && inside(u, v);
        if kept { (surface.point(u, v) - q).norm() } else { f64::INFINITY }
    };
    let grid: Vec<f64> =
        (-1..=N + 1).flat_map(|i| (-1..=N + 1).map(move |j| (i, j))).map(|(i, j)| distance(i, j)).collect();
    let at = |i: i32, j: i32| grid[((i + 1) * (N + 3) + j + 1) as usize];
    let mut found = Vec::new();
    for i in 0..=N {
        for j in 0..=N {
            let here = at(i, j);
            let around = (-1..=1).flat_map(|a| (-1..=1).map(move |b| (a, b))).filter(|&x| x != (0, 0));
            if here.is_finite() && around.into_iter().all(|(a, b)| at(i + a, j + b) > here) {
                let (u, v) = place(i, j);
                found.push((here, surface.point(u, v)));
            }
        }
    }
    found
}

#[test]
fn brute_force_finds_no_rival_of_a_unique_foot() {
    let mut rng = ChaCha8Rng::seed_from_u64(11);
    let waves = panel().mapped(|p| Point3::new(p.x, p.y, p.z + 30.0 * (p.x / 50.0).sin()));
    let trims = vec![ellipse((0.5, 0.5), 0.45, 0.3)];
    for (name, loops, inside) in [
        ("whole", vec![], (|_, _| true) as fn(f64, f64) -> bool),
        ("trimmed", trims, |u, v| ((u - 0.5) / 0.45).powi(2) + ((v - 0.5) / 0.3).powi(2) <= 1.0),
    ] {
        let model = Model { faces: vec![face(waves.clone(), loops)], ..Model::default() };
        let index = ClosestPoints::new(&model);
        let (mut unique, mut rivals) = (0, 0);
        for _ in 0..60 {
            let q = Point3::new(
                rng.random_range(0.0..600.0),
                rng.random_range(0.0..360.0),
                rng.random_range(-80.0..160.0),
            );
            let foot = match index.nearest(&q, f64::INFINITY) {
                Nearest::Unique(foot) => foot,
                Nearest::Shared { foot, .. } => foot,
                Nearest::Nothing => panic!("{name}: the model is not empty"),
            };
            unique += usize::from(is_unique(index.nearest(&q, f64::INFINITY)));
            for (distance, point) in minima(&waves, inside, &q) {
                assert!(distance > foot.distance_mm - 1e-9, "{name}: nearer by brute force");
                // The grid is off by less than this at a minimum.
                rivals +=
                    usize::from((point - foot.point).norm() > 15.0 && distance < foot.distance_mm + 1e-3);
            }
        }
        // Random points are on no medial set.
        assert_eq!((unique, rivals), (60, 0), "{name}");
    }
}

#[test]
fn feet_on_both_flanks_of_a_symmetric_sheet_are_shared() {
    let net: Vec<Point3> = (0..5)
        .flat_map(|i| (0..3).map(move |j| (i, j)))
        .map(|(i, j)| {
            Point3::new(
                f64::from(i) * 20.0 - 40.0,
                f64::from(j) * 30.0 - 30.0,
                [30.0, 0.0, 25.0, 0.0, 30.0][i as usize],
            )
        })
        .collect();
    let knots = claymill_nurbs::KnotVector::clamped_uniform;
    let wave = NurbsSurface::new(knots(3, 5), knots(2, 3), net, None).unwrap();
    let model = model(vec![wave]);
    let index = ClosestPoints::new(&model);
    for y in [-20.0, 3.0, 17.0] {
        // From some heights the crest in the middle is the nearest, from others both flanks.
        let mut tied = 0;
        for k in 0..40 {
            let q = Point3::new(0.0, y, -60.0 + 5.0 * f64::from(k));
            if let Nearest::Shared { foot, other: Some(other) } = index.nearest(&q, f64::INFINITY) {
                assert!((foot.point.x + other.x).abs() < 1e-6, "{} {}", foot.point, other);
                tied += 1;
            }
            let beside = Point3::new(0.3, y, q.z);
            assert!(
                is_unique(index.nearest(&beside, f64::INFINITY)),
                "beside the plane of symmetry at {beside}"
            );
        }
        assert!(tied > 5, "{tied} ties");
    }
}
