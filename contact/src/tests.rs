//! Analytic cases (docs/theory.md §6.7).

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use claymill_nurbs::analytic::{self, Frame as Placement};
use claymill_nurbs::{
    ClosestPoints, Curve2, Face, KnotVector, Model, NurbsSurface, Point2, Point3, Source, SurfaceKind,
    TrimEdge, TrimLoop, Vector3,
};

use crate::Frame;
use crate::{BallDrop, Covering, Location, Support};

const R: f64 = 10.0;
/// What the search may leave out.
const EPSILON_MM: f64 = 1.1e-4;

fn face(surface: NurbsSurface) -> Face {
    Face { surface, loops: Vec::new(), reversed: false, kind: SurfaceKind::Nurbs, source: Source::default() }
}

fn placed(origin: Point3, z: Vector3) -> Placement {
    Placement::new(origin, z, Vector3::x()).unwrap()
}

/// Drops the ball at the given places from +z.
fn drop(surfaces: Vec<NurbsSurface>, at: &[(f64, f64)]) -> Vec<Option<Location>> {
    drop_on(surfaces.into_iter().map(face).collect(), at)
}

fn drop_on(faces: Vec<Face>, at: &[(f64, f64)]) -> Vec<Option<Location>> {
    let model = Model { faces, ..Model::default() };
    let area_mm2 = model.faces.iter().map(Face::area_mm2).sum();
    let covering = Covering::new(&model, &vec![false; model.faces.len()], area_mm2, R).unwrap();
    // Front +x: setup coordinates are model coordinates.
    let top = Frame::five("+z".parse().unwrap(), "+x".parse().unwrap()).unwrap()[0];
    let ball = BallDrop::new(&model, &covering, &top, R);
    at.iter().map(|&(x, y)| ball.drop(x, y)).collect()
}

fn plane_through(tilt_deg: f64, x: (f64, f64)) -> NurbsSurface {
    let t = tilt_deg.to_radians();
    let along = Vector3::new(t.cos(), 0.0, t.sin());
    let frame = Placement::new(Point3::origin(), along.cross(&Vector3::y()), along).unwrap();
    analytic::plane_patch(&frame, x, (-200.0, 200.0)).unwrap()
}

#[test]
fn sphere() {
    let rho = 40.0;
    let sphere =
        analytic::sphere(&placed(Point3::origin(), Vector3::z()), rho, (0.0, TAU), (-FRAC_PI_2, FRAC_PI_2));
    let places: Vec<_> = (0..200).map(|i| (f64::from(i) * 0.22, f64::from(i % 7) * 1.3)).collect();
    for (location, (x, y)) in drop(vec![sphere.unwrap()], &places).iter().zip(&places) {
        let exact = ((rho + R).powi(2) - x * x - y * y).sqrt();
        let l = location.unwrap();
        // The parametrisation is singular at the pole: there the proven bound stands in.
        let allowed = if x.hypot(*y) < 0.01 { EPSILON_MM } else { 1e-9 };
        assert!((l.centre.z - exact).abs() < allowed, "({x}, {y}): {} {exact} {:?}", l.centre.z, l.support);
    }
}

#[test]
fn slope_and_groove() {
    let slope = drop(vec![plane_through(30.0, (-200.0, 200.0))], &[(5.0, 3.0)])[0].unwrap();
    approx::assert_abs_diff_eq!(
        slope.centre.z,
        5.0 * 30f64.to_radians().tan() + 11.547_005_383_792_515,
        epsilon = 1e-9
    );
    let groove = vec![plane_through(30.0, (0.0, 200.0)), plane_through(-30.0, (-200.0, 0.0))];
    let places = [(0.0, 0.0), (3.0, 1.0), (5.5, 0.0)];
    let z: Vec<f64> = drop(groove, &places).into_iter().map(|l| l.unwrap().centre.z).collect();
    approx::assert_abs_diff_eq!(z[0], 11.547_005_383_792_515, epsilon = 1e-9);
    for k in 1..3 {
        let exact = places[k].0 * 30f64.to_radians().tan() + 11.547_005_383_792_515;
        approx::assert_abs_diff_eq!(z[k], exact, epsilon = 1e-9);
    }
}

#[test]
fn chords_of_a_rim_that_bends_inwards_do_not_hold_the_ball_up() {
    // A plate that stands almost upright; its upper rim sags like h = x² / 100.
    let tilt = 87f64.to_radians();
    let up = Vector3::new(0.0, tilt.cos(), tilt.sin());
    let frame = Placement::new(Point3::origin(), Vector3::x().cross(&up), Vector3::x()).unwrap();
    let rim = |ends: &[(f64, f64)]| {
        let points = ends.iter().map(|&(x, y)| Point2::new(x, y)).collect();
        let knots = [0.0, 1.0].into_iter().flat_map(|k| std::iter::repeat_n(k, ends.len())).collect();
        let knots = KnotVector::new(ends.len() - 1, knots).unwrap();
        let pcurve = Curve2::new(knots, points, None).unwrap();
        TrimEdge { pcurve, shared: None }
    };
    let (left, right) = ((-20.0, -30.0), (20.0, -30.0));
    let sagging = [(20.0, 4.0), (0.0, -4.0), (-20.0, 4.0)];
    let edges = vec![rim(&[left, right]), rim(&[right, sagging[0]]), rim(&sagging), rim(&[sagging[2], left])];
    let plate = Face {
        loops: vec![TrimLoop { edges }],
        ..face(analytic::plane_patch(&frame, (-25.0, 25.0), (-40.0, 10.0)).unwrap())
    };
    let places: Vec<_> = (0..120).map(|k| (f64::from(k) * 0.25 - 15.0, 3.0)).collect();
    for (location, (x, y)) in drop_on(vec![plate], &places).iter().zip(&places) {
        let height = |k: i32| {
            let rim_x = f64::from(k) * 1e-3;
            let rim = Point3::new(rim_x, 0.0, 0.0) + up * (0.01 * rim_x * rim_x);
            rim.z + (R * R - (rim.x - x).powi(2) - (rim.y - y).powi(2)).max(0.0).sqrt()
        };
        let exact = (-20_000..=20_000).map(height).fold(f64::NEG_INFINITY, f64::max);
        let z = location.unwrap().centre.z;
        assert!((z - exact).abs() < 2.0 * EPSILON_MM, "x {x}: {} µm too high", (z - exact) * 1e3);
    }
}

#[test]
fn a_valley_narrower_than_the_ball_carries_it_on_its_rims() {
    // Concave half cylinder of radius 8 along y, opening upward, rims at z = 0.
    let frame = Placement::new(Point3::origin(), Vector3::y(), Vector3::x()).unwrap();
    let valley = analytic::cylinder(&frame, 8.0, (0.0, PI), (-50.0, 50.0)).unwrap();
    let valley = if valley.point(FRAC_PI_2, 0.0).z < 0.0 {
        valley
    } else {
        analytic::cylinder(&frame, 8.0, (PI, TAU), (-50.0, 50.0)).unwrap()
    };
    let l = drop(vec![valley], &[(0.0, 0.0), (2.0, 5.0)]);
    approx::assert_abs_diff_eq!(l[0].unwrap().centre.z, 6.0, epsilon = EPSILON_MM);
    let exact = (R * R - 100.0f64.min((8.0f64 - 2.0).powi(2))).sqrt();
    approx::assert_abs_diff_eq!(l[1].unwrap().centre.z, exact, epsilon = EPSILON_MM);
}

#[test]
fn torus_outside_and_inside() {
    let (major, minor) = (60.0, 20.0);
    let torus =
        analytic::torus(&placed(Point3::origin(), Vector3::z()), major, minor, (0.0, TAU), (0.0, TAU))
            .unwrap();
    let places: Vec<_> = (0..120).map(|i| (f64::from(i) * 0.7, f64::from(i % 5) * 2.0)).collect();
    for (location, (x, y)) in drop(vec![torus], &places).iter().zip(&places) {
        let d = x.hypot(*y) - major;
        let reach = minor + R;
        if d.abs() < reach - 0.5 {
            let exact = (reach * reach - d * d).sqrt();
            let l = location.unwrap();
            assert!((l.centre.z - exact).abs() < 1e-8, "({x}, {y}): {} {exact} {:?}", l.centre.z, l.support);
        }
    }
}

#[test]
fn step_edges_and_corners_are_touched() {
    let plate =
        analytic::plane_patch(&placed(Point3::origin(), Vector3::z()), (-30.0, 30.0), (-30.0, 30.0)).unwrap();
    let l = drop(vec![plate], &[(0.0, 0.0), (36.0, 0.0), (36.0, 38.0), (33.0, 34.0), (50.0, 0.0)]);
    approx::assert_abs_diff_eq!(l[0].unwrap().centre.z, 10.0, epsilon = 1e-9);
    approx::assert_abs_diff_eq!(l[1].unwrap().centre.z, 8.0, epsilon = 1e-9);
    assert_eq!(l[1].unwrap().support, Support::Edge);
    assert!(l[2].is_none() && l[4].is_none(), "out of reach of the corner and the side");
    approx::assert_abs_diff_eq!(l[3].unwrap().centre.z, 75f64.sqrt(), epsilon = 1e-9);
}

#[test]
fn two_spheres_share_the_ball() {
    let sphere = |x: f64| {
        let frame = placed(Point3::new(x, 0.0, 0.0), Vector3::z());
        analytic::sphere(&frame, 15.0, (0.0, TAU), (-FRAC_PI_2, FRAC_PI_2)).unwrap()
    };
    let l = drop(vec![sphere(-14.0), sphere(14.0)], &[(0.0, 0.0), (0.0, 6.0), (1.0, 2.0)]);
    for (l, (x, y)) in l.iter().zip([(0.0f64, 0.0f64), (0.0, 6.0), (1.0, 2.0)]) {
        let exact = (625.0 - (14.0 - x).powi(2) - y * y).sqrt();
        approx::assert_abs_diff_eq!(l.unwrap().centre.z, exact, epsilon = 1e-9);
    }
}

#[test]
fn a_groove_inside_one_face_is_touched_on_both_flanks() {
    // One cubic patch bent into a groove whose root is much tighter than the ball.
    let profile =
        [(-40.0, 40.0), (-12.0, 8.0), (-2.0, -6.0), (0.0, -7.0), (2.0, -6.0), (12.0, 8.0), (40.0, 40.0)];
    let points = profile.iter().flat_map(|&(x, z)| [-60.0, 60.0].map(|y| Point3::new(x, y, z))).collect();
    let knots = claymill_nurbs::KnotVector::clamped_uniform;
    let groove = NurbsSurface::new(knots(3, 7), knots(1, 2), points, None).unwrap();
    let places: Vec<_> = (-40..=40).map(|i| (f64::from(i) * 0.25, 1.0)).collect();
    let sampled: Vec<Point3> = (0..=400_000)
        .map(|i| groove.point(f64::from(i) / 400_000.0, 0.5))
        .map(|p| Point3::new(p.x, 1.0, p.z))
        .collect();
    for (location, (x, y)) in drop(vec![groove], &places).iter().zip(&places) {
        let brute = sampled
            .iter()
            .filter_map(|p| crate::exact::flat::on_point(p, *x, *y, R))
            .fold(f64::MIN, f64::max);
        let found = location.unwrap().centre.z;
        assert!((found - brute).abs() < 2.0 * EPSILON_MM, "at {x}: {found} {brute}");
    }
}

/// A fillet of this part ends on an arc. Triangles with all corners on the arc lie within their own plane but
/// enclose what is no part of the face; the ball must not rest on them.
#[test]
fn chords_of_an_arc_do_not_hold_the_ball_up() {
    const RADIUS_MM: f64 = 3.0;
    let Some(folder) = claymill_tests::corpus() else { return };
    let model = claymill_exchange::read(&folder.join("prismatic_ctc05_inch.stp")).unwrap().model;
    let area_mm2 = model.faces.iter().map(Face::area_mm2).sum();
    let covering = Covering::new(&model, &vec![false; model.faces.len()], area_mm2, RADIUS_MM).unwrap();
    let rear = Frame::five("+z".parse().unwrap(), "-y".parse().unwrap()).unwrap()[4];
    let ball = BallDrop::new(&model, &covering, &rear, RADIUS_MM);
    let closest = ClosestPoints::new(&model);
    for k in 0..40 {
        let over = rear.to_setup(&Point3::new(-69.7729, 0.0, 3.2 + 0.1 * f64::from(k)));
        let rest = ball.drop(over.x, over.y).unwrap();
        let foot = closest.closest(&rear.to_model(&rest.centre), 2.0 * RADIUS_MM).unwrap();
        approx::assert_abs_diff_eq!(foot.distance_mm, RADIUS_MM, epsilon = 1e-3);
    }
}

/// Two walls at 30° with a fillet of 4 mm between them: a ball of 10 mm touches them at R·tan 30° from where they would
/// meet, and nothing nearer.
#[test]
fn a_ball_that_touches_one_flank_of_a_groove_is_held_up_by_the_other() {
    const FILLET_MM: f64 = 4.0;
    let (sine, cosine) = 30f64.to_radians().sin_cos();
    // Where the walls would meet.
    let low = FILLET_MM - FILLET_MM / cosine;
    let foot_mm = FILLET_MM * sine / cosine;
    let wall = |side: f64| {
        let along = Vector3::new(cosine, 0.0, side * sine);
        let frame = Placement::new(Point3::new(0.0, 0.0, low), along.cross(&Vector3::y()), along).unwrap();
        let range = if side > 0.0 { (foot_mm, 60.0) } else { (-60.0, -foot_mm) };
        analytic::plane_patch(&frame, range, (0.0, 200.0)).unwrap()
    };
    let axis = Placement::new(Point3::new(0.0, 0.0, FILLET_MM), -Vector3::y(), Vector3::x()).unwrap();
    let angles = (240f64.to_radians(), 300f64.to_radians());
    let fillet = analytic::cylinder(&axis, FILLET_MM, angles, (-200.0, 0.0)).unwrap();
    let model = Model { faces: vec![face(wall(-1.0)), face(fillet), face(wall(1.0))], ..Model::default() };
    let covering = Covering::new(&model, &[false; 3], 24_000.0, 1.5).unwrap();
    let [top, ..] = Frame::five("+z".parse().unwrap(), "+x".parse().unwrap()).unwrap();
    let ball = BallDrop::new(&model, &covering, &top, R);
    let held = |p: Point3, normal: Vector3, face: usize, (u, v): (f64, f64)| {
        let touch = Location::touching(p + normal * R, normal, face, [u, v]);
        ball.is_blocked_from(&touch, 0.0125 / normal.z)
    };
    for s in [2.5, 3.0, 5.0, 5.7, 5.8, 8.0, 40.0] {
        let p = Point3::new(s * cosine, 50.0, low + s * sine);
        assert_eq!(held(p, Vector3::new(-sine, 0.0, cosine), 2, (s, 50.0)), s < 5.75, "on the wall at {s}");
    }
    let surface = &model.faces[1].surface;
    for share in [0.01, 0.3, 0.5, 0.99] {
        let u = angles.0 + share * (angles.1 - angles.0);
        let (n, _) = surface.normal(u, -50.0).unwrap();
        assert!(held(surface.point(u, -50.0), n * n.z.signum(), 1, (u, -50.0)), "in the fillet at {share}");
    }
}

/// Of a plane and a sphere, whose parameters are uneven at its poles.
#[test]
fn as_many_triangles_are_expected_as_there_are() {
    let ball =
        analytic::sphere(&placed(Point3::origin(), Vector3::z()), 60.0, (0.0, TAU), (-FRAC_PI_2, FRAC_PI_2));
    let model = Model {
        faces: vec![face(plane_through(0.0, (-100.0, 100.0))), face(ball.unwrap())],
        ..Model::default()
    };
    let area_mm2 = model.faces.iter().map(Face::area_mm2).sum();
    for radius_mm in [1.0, 3.0] {
        let covering = Covering::new(&model, &[false; 2], area_mm2, radius_mm).unwrap();
        let count = covering.meshes().iter().map(|mesh| mesh.triangles.len()).sum::<usize>() as f64;
        let expected = Covering::expected_triangles(&model, &[false; 2], area_mm2, radius_mm);
        assert!((0.7..1.5).contains(&(expected / count)), "{expected} for {count}");
        let of_one = Covering::expected_triangles(&model, &[true, false], area_mm2, radius_mm);
        assert!(of_one < expected);
    }
}
