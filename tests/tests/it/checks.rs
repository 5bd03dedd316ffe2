//! The shared checks can fail.

use claymill_nurbs::{Face, KnotVector, Model, NurbsSurface, Point3, Source, SurfaceKind, Vector3};
use claymill_tests::{measure_ball, same_partition};
use claymill_toolpath::{Move, MoveKind, Program};

/// The square `[0, 100]²` at height 0.
fn flat() -> Model {
    let knots = || KnotVector::clamped_uniform(1, 2);
    let corners = [(0.0, 0.0), (0.0, 100.0), (100.0, 0.0), (100.0, 100.0)];
    let points = corners.map(|(x, y)| Point3::new(x, y, 0.0)).to_vec();
    let face = Face {
        surface: NurbsSurface::new(knots(), knots(), points, None).unwrap(),
        loops: Vec::new(),
        reversed: false,
        kind: SurfaceKind::Plane,
        source: Source::default(),
    };
    Model { faces: vec![face], ..Model::default() }
}

fn along_x(kind: MoveKind, from: (f64, f64), to: (f64, f64)) -> Move {
    let point = |(x, z)| Point3::new(x, 50.0, z);
    Move::straight(kind, point(from), point(to), Vector3::z(), 1000.0)
}

#[test]
fn a_ball_that_dips_into_a_plane_is_measured() {
    let model = flat();
    // A cubic that sags below its ends by 0.75 of its inner points' depth.
    let mut cut = along_x(MoveKind::Cut, (10.0, 0.0), (70.0, 0.0));
    cut.degree = 3;
    cut.knots = vec![0.0, 0.0, 0.0, 0.0, 60.0, 60.0, 60.0, 60.0];
    cut.points = [(10.0, 0.0), (30.0, -0.02), (50.0, -0.02), (70.0, 0.0)].map(|(x, z)| [x, 50.0, z]).to_vec();
    let mut lift = along_x(MoveKind::Cut, (70.0, 0.0), (80.0, 0.03));
    lift.seq = 1;
    let rapid = along_x(MoveKind::Rapid, (80.0, 0.5), (10.0, 0.5));
    let ball = measure_ball(&model, &Program { moves: vec![cut, lift, rapid] }, 5.0, 0.5);
    let (depth, seq) = ball.deepest.unwrap();
    approx::assert_relative_eq!(depth, 0.015, epsilon = 1e-9);
    assert_eq!(seq, 0);
    let (excess, seq) = ball.excess.unwrap();
    approx::assert_relative_eq!(excess, 0.03, epsilon = 1e-9);
    assert_eq!(seq, 1);
    approx::assert_relative_eq!(ball.rapid_clearance.unwrap().0, 0.5, epsilon = 1e-9);
}

#[test]
fn partitions_are_compared_without_regard_to_numbers() {
    assert!(same_partition(&[0, 0, 1, 2], &[5, 5, 0, 1]));
    assert!(!same_partition(&[0, 0, 1, 2], &[5, 5, 0, 0]));
    assert!(!same_partition(&[0, 0, 1, 1], &[5, 5, 0, 1]));
    assert!(!same_partition(&[0, 0], &[0]));
}
