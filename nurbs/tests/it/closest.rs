//! Closest points against distances known in closed form and against brute force.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use claymill_nurbs::analytic::{Frame, circle_arc, cone, cylinder, plane_patch, sphere, torus};
use claymill_nurbs::{
    ClosestPoints, Curve2, Face, Hint, KnotVector, Model, NurbsSurface, Point2, Point3, Source, SurfaceKind,
    TrimEdge, TrimLoop, Vector3,
};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

const EXACT_MM: f64 = 1e-9;

fn face(surface: NurbsSurface) -> Face {
    Face { surface, loops: Vec::new(), reversed: false, kind: SurfaceKind::Nurbs, source: Source::default() }
}

fn model(surfaces: Vec<NurbsSurface>) -> Model {
    Model { faces: surfaces.into_iter().map(face).collect(), ..Model::default() }
}

/// A frame askew to the axes and away from the origin.
fn askew() -> Frame {
    let origin = Point3::new(812.0, -1703.0, 455.0);
    Frame::new(origin, Vector3::new(0.3, -0.5, 0.8), Vector3::new(1.0, 0.2, 0.0)).unwrap()
}

fn within(rng: &mut ChaCha8Rng, size: f64) -> Vector3 {
    Vector3::from_fn(|_, _| rng.random_range(-size..size))
}

/// Compares `count` random queries with the `distance` of the point's coordinates in the askew frame.
fn check(
    name: &str,
    surface: NurbsSurface,
    count: usize,
    size: f64,
    mut p: impl FnMut(&mut ChaCha8Rng) -> Vector3,
    distance: impl Fn(&Vector3) -> f64,
) {
    let model = model(vec![surface]);
    let index = ClosestPoints::new(&model);
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    let mut hint = Hint::default();
    for k in 0..count {
        let at = p(&mut rng);
        let q = askew().point(at.x, at.y, at.z);
        let foot = index.closest(&q, f64::INFINITY).expect("the model is not empty");
        let expected = distance(&at);
        let error = (foot.distance_mm - expected).abs();
        assert!(error < EXACT_MM, "{name}: query {k} at {at}: {} for {expected}", foot.distance_mm);
        // The foot is what it says it is.
        let again = model.faces[foot.face].surface.point(foot.u, foot.v);
        assert!((again - foot.point).norm() < 1e-9, "{name}: query {k}: parameters do not fit the point");
        assert!(((foot.point - q).norm() - foot.distance_mm).abs() < 1e-9 + 1e-12 * size);
        let hinted = index.closest_from(&q, f64::INFINITY, &mut hint).unwrap();
        assert!((hinted.distance_mm - expected).abs() < EXACT_MM, "{name}: query {k} with a hint");
    }
}

/// Distance of `p` from the segment between `a` and `b` in the half plane of `(radius, height)`.
fn from_segment(p: (f64, f64), a: (f64, f64), b: (f64, f64)) -> f64 {
    let (dx, dy) = (b.0 - a.0, b.1 - a.1);
    let t = (((p.0 - a.0) * dx + (p.1 - a.1) * dy) / (dx * dx + dy * dy)).clamp(0.0, 1.0);
    (p.0 - a.0 - t * dx).hypot(p.1 - a.1 - t * dy)
}

#[test]
fn plane() {
    let s = plane_patch(&askew(), (-40.0, 60.0), (-10.0, 30.0)).unwrap();
    check(
        "plane",
        s,
        20_000,
        100.0,
        |r| within(r, 100.0),
        |p| {
            let outside = |x: f64, a: f64, b: f64| (a - x).max(x - b).max(0.0);
            Vector3::new(outside(p.x, -40.0, 60.0), outside(p.y, -10.0, 30.0), p.z).norm()
        },
    );
}

#[test]
fn whole_sphere_with_both_poles() {
    let s = sphere(&askew(), 50.0, (0.0, TAU), (-FRAC_PI_2, FRAC_PI_2)).unwrap();
    check("sphere", s, 10_000, 120.0, |r| within(r, 120.0), |p| (p.norm() - 50.0).abs());
}

#[test]
fn torus_inside_and_outside() {
    let s = torus(&askew(), 80.0, 25.0, (0.0, TAU), (0.0, TAU)).unwrap();
    check(
        "torus",
        s,
        10_000,
        130.0,
        |r| within(r, 130.0),
        |p| ((p.x.hypot(p.y) - 80.0).hypot(p.z) - 25.0).abs(),
    );
}

#[test]
fn cylinder_of_finite_height() {
    let s = cylinder(&askew(), 12.0, (0.0, TAU), (-50.0, 90.0)).unwrap();
    check(
        "cylinder",
        s,
        10_000,
        150.0,
        |r| within(r, 150.0),
        |p| from_segment((p.x.hypot(p.y), p.z), (12.0, -50.0), (12.0, 90.0)),
    );
}

#[test]
fn cone_with_its_apex() {
    let half_angle = 0.4f64;
    let s = cone(&askew(), 0.0, half_angle, (0.0, TAU), (0.0, 60.0)).unwrap();
    let rim = 60.0 * half_angle.tan();
    check(
        "cone",
        s,
        10_000,
        100.0,
        |r| within(r, 100.0),
        |p| from_segment((p.x.hypot(p.y), p.z), (0.0, 0.0), (rim, 60.0)),
    );
}

#[test]
fn medial_points_have_the_right_distance() {
    let ball = sphere(&askew(), 50.0, (0.0, TAU), (-FRAC_PI_2, FRAC_PI_2)).unwrap();
    let near_centre = |r: &mut ChaCha8Rng| {
        let size = 10f64.powi(r.random_range(-14..1));
        within(r, size)
    };
    check("sphere's centre", ball, 20, 50.0, near_centre, |p| (p.norm() - 50.0).abs());
    let tube = cylinder(&askew(), 12.0, (0.0, TAU), (-50.0, 90.0)).unwrap();
    let near_axis = |r: &mut ChaCha8Rng| {
        let size = 10f64.powi(r.random_range(-14..1));
        let aside = within(r, size);
        Vector3::new(aside.x, aside.y, r.random_range(-30.0..70.0))
    };
    check("cylinder's axis", tube, 60, 50.0, near_axis, |p| 12.0 - p.x.hypot(p.y));
    let ring = torus(&askew(), 80.0, 10.0, (0.0, TAU), (0.0, TAU)).unwrap();
    let near_tube = |r: &mut ChaCha8Rng| {
        let size = 10f64.powi(r.random_range(-14..0));
        let (a, aside) = (r.random_range(-PI..PI), within(r, size));
        Vector3::new(80.0 * a.cos(), 80.0 * a.sin(), 0.0) + aside
    };
    check("torus' tube", ring, 60, 50.0, near_tube, |p| (10.0 - (p.x.hypot(p.y) - 80.0).hypot(p.z)).abs());
}

/// A wavy surface over about 100 × 80 mm.
fn bumpy(rng: &mut ChaCha8Rng, (p, q): (usize, usize), rational: bool, height: f64) -> NurbsSurface {
    let (nu, nv) = (p + rng.random_range(1..5), q + rng.random_range(1..5));
    let (mut points, mut weights) = (Vec::new(), Vec::new());
    for i in 0..nu {
        for j in 0..nv {
            let (x, y) = (i as f64 / (nu - 1) as f64 * 100.0, j as f64 / (nv - 1) as f64 * 80.0);
            points.push(
                Point3::new(x, y, 0.0) + within(rng, 1.0).component_mul(&Vector3::new(6.0, 6.0, height)),
            );
            weights.push(rng.random_range(0.5..2.0));
        }
    }
    let weights = rational.then_some(weights);
    NurbsSurface::new(KnotVector::clamped_uniform(p, nu), KnotVector::clamped_uniform(q, nv), points, weights)
        .unwrap()
}

/// The least distance over a dense grid, each of the best grid points polished by shrinking pattern search:
/// slow, and shares nothing with the code under test but the surface's evaluator.
fn brute_force(s: &NurbsSurface, p: &Point3) -> f64 {
    const GRID: usize = 60;
    let ((u0, u1), (v0, v1)) = s.domain();
    let at = |x: f64, y: f64| {
        let (x, y) = (x.clamp(0.0, 1.0), y.clamp(0.0, 1.0));
        (s.point(u0 + x * (u1 - u0), v0 + y * (v1 - v0)) - p).norm()
    };
    let mut seeds: Vec<(f64, f64, f64)> = (0..=GRID * GRID + 2 * GRID)
        .map(|k| ((k / (GRID + 1)) as f64 / GRID as f64, (k % (GRID + 1)) as f64 / GRID as f64))
        .map(|(x, y)| (at(x, y), x, y))
        .collect();
    seeds.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut best = f64::INFINITY;
    for &(mut d, mut x, mut y) in seeds.iter().take(12) {
        let mut step = 1.0 / GRID as f64;
        while step > 1e-9 {
            let around =
                [(1., 0.), (-1., 0.), (0., 1.), (0., -1.), (1., 1.), (-1., -1.), (1., -1.), (-1., 1.)];
            let next = (around.iter())
                .map(|(a, b)| ((x + a * step).clamp(0.0, 1.0), (y + b * step).clamp(0.0, 1.0)))
                .map(|(x, y)| (at(x, y), x, y))
                .min_by(|a, b| a.0.total_cmp(&b.0))
                .unwrap();
            if next.0 < d {
                (d, x, y) = next;
            } else {
                step *= 0.5;
            }
        }
        best = best.min(d);
    }
    best
}

#[test]
fn bumpy_surfaces_against_brute_force() {
    let mut rng = ChaCha8Rng::seed_from_u64(11);
    for degree in [(1, 1), (2, 3), (3, 3), (4, 2), (5, 5), (7, 6), (9, 3)] {
        for rational in [false, true] {
            for height in [5.0, 40.0] {
                let s = bumpy(&mut rng, degree, rational, height);
                let model = model(vec![s]);
                let index = ClosestPoints::new(&model);
                for k in 0..25 {
                    let p = Point3::new(50.0, 40.0, 0.0)
                        + within(&mut rng, if k % 2 == 0 { 50.0 } else { 120.0 });
                    let d = index.closest(&p, f64::INFINITY).unwrap().distance_mm;
                    let expected = brute_force(&model.faces[0].surface, &p);
                    // A pattern search stops short of the minimum where the surface is steep.
                    assert!(
                        d < expected + EXACT_MM && d > expected - 1e-6,
                        "degree {degree:?} rational {rational} height {height} query {k}: {d} for {expected}"
                    );
                }
            }
        }
    }
}

/// `rows × columns` patches of 40 mm that form one wave, with a gap of a third of a millimetre between them.
fn patchwork(rows: usize, columns: usize) -> Vec<NurbsSurface> {
    let height = |x: f64, y: f64| 30.0 * (x / 70.0).sin() * (y / 90.0).cos();
    let mut patches = Vec::new();
    for r in 0..rows {
        for c in 0..columns {
            let points = (0..16).map(|k| {
                let (x, y) =
                    (r as f64 * 40.0 + (k / 4) as f64 * 13.2, c as f64 * 40.0 + (k % 4) as f64 * 13.2);
                Point3::new(x, y, height(x, y))
            });
            let knots = KnotVector::clamped_uniform(3, 4);
            patches.push(NurbsSurface::new(knots.clone(), knots, points.collect(), None).unwrap());
        }
    }
    patches
}

#[test]
fn an_assembly_finds_the_nearest_of_its_faces() {
    let whole = model(patchwork(12, 12));
    let index = ClosestPoints::new(&whole);
    let single: Vec<Model> = patchwork(12, 12).into_iter().map(|s| model(vec![s])).collect();
    let single: Vec<ClosestPoints<'_>> = single.iter().map(ClosestPoints::new).collect();
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    for _ in 0..2000 {
        let p = Point3::new(240.0, 240.0, 0.0)
            + within(&mut rng, 1.0).component_mul(&Vector3::new(260.0, 260.0, 60.0));
        let expected = (single.iter())
            .map(|one| one.closest(&p, f64::INFINITY).unwrap().distance_mm)
            .fold(f64::INFINITY, f64::min);
        let foot = index.closest(&p, f64::INFINITY).unwrap();
        assert!((foot.distance_mm - expected).abs() < EXACT_MM);
        assert!(index.closest(&p, expected * 0.999).is_none());
        assert!(index.any_within(&p, expected * 1.001));
        assert!(!index.any_within(&p, expected * 0.999));
    }
}

#[test]
fn a_path_with_a_hint_gives_the_same_distances() {
    let whole = model(patchwork(12, 12));
    let index = ClosestPoints::new(&whole);
    let mut hint = Hint::default();
    for k in 0..20_000 {
        let t = f64::from(k) * 0.05;
        let p = Point3::new(240.0 + 230.0 * (t * 0.013).cos(), t * 0.48, 25.0 * (t * 0.031).sin() + 10.0);
        let within = if k % 7 == 0 { 15.0 } else { 40.0 };
        let a = index.closest(&p, within).map(|f| f.distance_mm);
        let b = index.closest_from(&p, within, &mut hint).map(|f| f.distance_mm);
        match (a, b) {
            (Some(a), Some(b)) => assert!((a - b).abs() < EXACT_MM, "step {k}: {a} or {b}"),
            (None, None) => {}
            _ => panic!("step {k}: {a:?} or {b:?}"),
        }
    }
}

#[test]
fn an_empty_model_has_no_closest_point() {
    let none = Model::default();
    let index = ClosestPoints::new(&none);
    assert!(index.closest(&Point3::origin(), f64::INFINITY).is_none());
    assert!(index.closest_from(&Point3::origin(), 1.0, &mut Hint::default()).is_none());
    assert!(!index.any_within(&Point3::origin(), 1.0));
}

/// A circle in the parameter plane.
fn circle(centre: Point2, radius: f64) -> TrimLoop {
    let frame = Frame::new(Point3::new(centre.x, centre.y, 0.0), Vector3::z(), Vector3::x()).unwrap();
    let arc = circle_arc(&frame, radius, (0.0, TAU)).unwrap();
    let points = arc.points().iter().map(|p| p.xy()).collect();
    let pcurve = Curve2::new(arc.knots().clone(), points, arc.weights().map(<[f64]>::to_vec)).unwrap();
    TrimLoop { edges: vec![TrimEdge { pcurve, shared: None }] }
}

fn trimmed(surface: NurbsSurface, loops: Vec<TrimLoop>) -> Model {
    let face = Face { loops, ..face(surface) };
    Model { faces: vec![face], ..Model::default() }
}

#[test]
fn trimmed_ring_against_its_analytic_distance() {
    let plane = plane_patch(&askew(), (-100.0, 100.0), (-100.0, 100.0)).unwrap();
    let centre = Point2::new(7.0, -4.0);
    let ring = trimmed(plane, vec![circle(centre, 60.0), circle(centre, 20.0)]);
    let index = ClosestPoints::new(&ring);
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    for k in 0..5000 {
        let mut p = within(&mut rng, 100.0);
        if k % 50 == 0 {
            // On the axis, where the whole inner rim is equally near.
            (p.x, p.y) = (7.0, -4.0);
        }
        let foot = index.closest(&askew().point(p.x, p.y, p.z), f64::INFINITY).unwrap();
        let radius = (p.x - 7.0).hypot(p.y + 4.0);
        let aside = (20.0 - radius).max(radius - 60.0).max(0.0);
        assert!((foot.distance_mm - aside.hypot(p.z)).abs() < EXACT_MM, "query {k} at {p}");
        assert_eq!(foot.on_boundary, aside > 0.0, "query {k} at {p}");
    }
}

fn polygon(corners: &[Point2]) -> TrimLoop {
    let edge = |k: usize| Curve2::line(corners[k], corners[(k + 1) % corners.len()]);
    TrimLoop { edges: (0..corners.len()).map(|k| TrimEdge { pcurve: edge(k), shared: None }).collect() }
}

#[test]
fn a_foot_on_a_rim_is_on_the_boundary_where_pieces_end_there_too() {
    // A notch to the very middle of the plate, where its surface is halved.
    let plate = plane_patch(&askew(), (-40.0, 40.0), (-100.0, 100.0)).unwrap();
    let corners = [(40.0, -100.0), (40.0, 100.0), (-40.0, 100.0), (-40.0, 50.0), (0.0, 50.0), (0.0, -50.0)];
    let corners = corners.into_iter().chain([(-40.0, -50.0), (-40.0, -100.0)]);
    let corners: Vec<Point2> = corners.map(|(u, v)| Point2::new(u, v)).collect();
    let model = trimmed(plate, vec![polygon(&corners)]);
    let index = ClosestPoints::new(&model);
    let mut hint = Hint::default();
    for k in 0..200 {
        let v = -40.0 + 0.4 * f64::from(k);
        for (u, is_aside) in [(-16.0, true), (-1e-3, true), (1e-3, false), (6.0, false), (20.0, false)] {
            let p = askew().point(u, v, -0.7);
            let feet = [index.closest(&p, 50.0), index.closest_from(&p, 50.0, &mut hint)];
            assert_eq!(feet.map(|foot| foot.unwrap().on_boundary), [is_aside; 2], "over ({u}, {v})");
        }
    }
}

#[test]
fn trimmed_cylinder_near_its_axis() {
    // A window cut into a half pipe; the nearest points of the untrimmed pipe often lie in the window.
    let pipe = cylinder(&askew(), 12.0, (0.0, PI), (-50.0, 90.0)).unwrap();
    let window = [(0.5, -30.0), (2.5, -30.0), (2.5, 60.0), (0.5, 60.0)].map(|(u, v)| Point2::new(u, v));
    let ends = [(0.0, -50.0), (PI, -50.0), (PI, 90.0), (0.0, 90.0)].map(|(u, v)| Point2::new(u, v));
    let model = trimmed(pipe, vec![polygon(&ends), polygon(&window)]);
    let index = ClosestPoints::new(&model);
    let surface = &model.faces[0].surface;
    let mut rng = ChaCha8Rng::seed_from_u64(9);
    // Brute force over the grid of a parametrisation of its own: a bound from above within the grid's size.
    let inside = |u: f64, v: f64| !(u > 0.5 && u < 2.5 && v > -30.0 && v < 60.0);
    let grid: Vec<Point3> = (0..=400)
        .flat_map(|i| (0..=560).map(move |j| (f64::from(i) / 400.0 * PI, -50.0 + f64::from(j) * 0.25)))
        .filter(|&(u, v)| inside(u, v))
        .map(|(u, v)| surface.point(u, v))
        .collect();
    for k in 0..150 {
        let size = if k % 15 == 0 { 0.01 } else { 10.0 };
        let aside = within(&mut rng, size);
        let q = askew().point(aside.x, aside.y, rng.random_range(-60.0..100.0));
        let d = index.closest(&q, f64::INFINITY).unwrap();
        let expected = grid.iter().map(|g| (g - q).norm()).fold(f64::INFINITY, f64::min);
        assert!(d.distance_mm < expected + EXACT_MM && d.distance_mm > expected - 0.15, "query {k}");
        assert!(inside(d.u + 1e-9 * (1.5 - d.u).signum().min(0.0), d.v) || d.on_boundary, "query {k}");
    }
}

#[test]
fn a_knot_interval_of_rounding_size_adds_nothing_outside_the_trims() {
    // The triangle right of x = 0 and above the line from (0, 4) to (10, 0), with a rim along the sliver.
    let knots_u = KnotVector::new(1, vec![-5e-17, -5e-17, 0.0, 10.0, 10.0]).unwrap();
    let knots_v = KnotVector::new(1, vec![0.0, 0.0, 10.0, 10.0]).unwrap();
    let net: Vec<Point3> =
        [-5e-17, 0.0, 10.0].iter().flat_map(|&x| [0.0, 10.0].map(|y| Point3::new(x, y, 0.0))).collect();
    let surface = NurbsSurface::new(knots_u, knots_v, net, None).unwrap();
    let corners =
        [(-5e-17, 4.0), (10.0, 0.0), (10.0, 10.0), (-1.6e-17, 10.0)].map(|(u, v)| Point2::new(u, v));
    let edge = |k: usize| {
        let knots = KnotVector::new(1, vec![0.0, 0.0, 1.0, 1.0]).unwrap();
        let pcurve = Curve2::new(knots, vec![corners[k], corners[(k + 1) % 4]], None).unwrap();
        TrimEdge { pcurve, shared: None }
    };
    let trimmed = Face { loops: vec![TrimLoop { edges: (0..4).map(edge).collect() }], ..face(surface) };
    let model = Model { faces: vec![trimmed], ..Model::default() };
    let index = ClosestPoints::new(&model);
    // Normal form of the slanted edge: 4 x + 10 y = 40.
    for (x, y) in [(0.0, 1.0), (0.0, 3.0), (-2.0, 2.0), (1.0, 0.5)] {
        let p = Point3::new(x, y, 3.0);
        let aside = (40.0 - 4.0 * x - 10.0 * y) / 116.0_f64.sqrt();
        let along = (x * 10.0 - (y - 4.0) * 4.0) / 116.0_f64.sqrt();
        let expected = if along < 0.0 { (p - Point3::new(0.0, 4.0, 0.0)).norm() } else { aside.hypot(3.0) };
        let foot = index.closest(&p, f64::INFINITY).unwrap();
        assert!((foot.distance_mm - expected).abs() < EXACT_MM, "({x}, {y}): {foot:?}, not {expected}");
    }
}
