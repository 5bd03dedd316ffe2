//! Passes over bodies with sharp round edges: they are close together where the ball goes round an edge, and nowhere else.

use std::f64::consts::TAU;

use crate::few_faces::planned;
use claymill_nurbs::analytic::{Frame as Placement, cylinder, extrusion};
use claymill_nurbs::{Curve3, KnotVector, Point3, Vector3};
use claymill_paths::{FitTolerance, Plan, PlanOptions, Strategy, flat_mm};
use claymill_toolpath::MoveKind;

const R: f64 = 2.0;
const SCALLOP_MM: f64 = 0.02;
const LENGTH_MM: f64 = 60.0;
/// Half the width and half the thickness of the body: an elliptic bar, along x.
const HALF_MM: [f64; 2] = [12.0, 1.2];

/// Where the passes from the top cross the middle of the body, from side to side.
fn in_the_middle(plan: &Plan) -> Vec<Point3> {
    const PLACES: u32 = 400;
    let mut crossings: Vec<Point3> = Vec::new();
    for m in plan.program.moves.iter().filter(|m| m.kind == MoveKind::Cut && m.axis_start[2] > 0.5) {
        let curve = m.curve().unwrap();
        let (a, b) = curve.domain();
        let at = |k: u32| curve.point(a + (b - a) * f64::from(k) / f64::from(PLACES));
        let places: Vec<Point3> = (0..=PLACES).map(at).collect();
        let is_before = |p: &Point3| p.x < 0.5 * LENGTH_MM;
        crossings.extend(places.windows(2).filter(|w| is_before(&w[0]) != is_before(&w[1])).map(|w| w[0]));
    }
    crossings.sort_by(|p, q| p.y.total_cmp(&q.y));
    crossings
}

#[test]
fn rows_are_close_only_around_sharp_edges() {
    let placement = Placement::new(Point3::origin(), Vector3::x(), Vector3::y()).unwrap();
    let round = cylinder(&placement, HALF_MM[0], (0.0, TAU), (0.0, LENGTH_MM)).unwrap();
    let bar = round.mapped(|p| Point3::new(p.x, p.y, p.z * HALF_MM[1] / HALF_MM[0]));
    let plan = planned([bar], R, SCALLOP_MM, |usual| PlanOptions { row_angle_deg: Some(0.0), ..usual });

    let rows: Vec<f64> = in_the_middle(&plan).iter().map(|p| p.y).collect();
    let apart: Vec<(f64, f64)> = rows.windows(2).map(|w| (0.5 * (w[0] + w[1]), w[1] - w[0])).collect();

    let flat = flat_mm(R, FitTolerance::of_scallop(SCALLOP_MM).to_lay_mm(SCALLOP_MM));
    let on_top: Vec<f64> = apart.iter().filter(|(y, _)| y.abs() < 9.0).map(|(_, d)| *d).collect();
    let mean = on_top.iter().sum::<f64>() / on_top.len() as f64;
    assert!(mean > 0.85 * flat && mean < 1.05 * flat, "{mean} mm apart on top, {flat} mm on a plane");
    // Around the edges the ball's centre goes round an arc of more than its radius.
    let at_edges: Vec<f64> = apart.iter().filter(|(y, _)| y.abs() > 12.5).map(|(_, d)| *d).collect();
    assert!(at_edges.iter().any(|d| *d < 0.7 * flat), "{at_edges:?}");
}

#[test]
fn sweeps_leave_no_high_crests_beside_a_ridge() {
    const BALL_MM: f64 = 6.0;
    const HEIGHT_MM: f64 = 0.1;
    const ROUND_MM: f64 = 2.0;
    // Two slopes along x that a cylinder joins smoothly, for ridges anywhere between two passes.
    let (rise, fall) = (10f64.to_radians(), 25f64.to_radians());
    for width_mm in [30.0, 30.7, 31.4, 32.1] {
        let along =
            |from: (f64, f64), angle: f64, mm: f64| (from.0 + mm * angle.cos(), from.1 + mm * angle.sin());
        let half = 0.5 * (rise + fall);
        let start = (0.0, 0.0);
        let up = along(start, rise, width_mm);
        let apex = along(up, rise, ROUND_MM * half.tan());
        let down = along(apex, -fall, ROUND_MM * half.tan());
        let end = along(down, -fall, 30.0);
        let between = |a: (f64, f64), b: (f64, f64)| (0.5 * (a.0 + b.0), 0.5 * (a.1 + b.1));
        let points = [start, between(start, up), up, apex, down, between(down, end), end];
        let points = points.map(|(y, z)| Point3::new(0.0, y, z)).to_vec();
        let knots = KnotVector::new(2, vec![0.0, 0.0, 0.0, 1.0, 1.0, 2.0, 2.0, 3.0, 3.0, 3.0]).unwrap();
        let section =
            Curve3::new(knots, points, Some(vec![1.0, 1.0, 1.0, half.cos(), 1.0, 1.0, 1.0])).unwrap();
        let ridge = extrusion(&section, &Vector3::x(), (0.0, 4.0 * LENGTH_MM)).unwrap();
        let on_ridge: Vec<Point3> = (0..=30_000).map(|k| section.point(f64::from(k) / 10_000.0)).collect();
        for strategy in [Strategy::Flow, Strategy::Scallop] {
            let plan =
                planned([ridge.clone()], BALL_MM, HEIGHT_MM, |usual| PlanOptions { strategy, ..usual });
            let centres: Vec<(f64, f64)> =
                in_the_middle(&plan).iter().map(|p| (p.y, p.z + BALL_MM)).collect();
            assert!(centres.len() > 20, "{strategy}, {width_mm}: {centres:?}");
            for w in centres.windows(2) {
                let ((y0, z0), (y1, z1)) = (w[0], w[1]);
                let half = 0.5 * (y1 - y0).hypot(z1 - z0);
                let sunk = (BALL_MM * BALL_MM - half * half).sqrt() / (2.0 * half);
                let crest =
                    Point3::new(0.0, 0.5 * (y0 + y1) + (z1 - z0) * sunk, 0.5 * (z0 + z1) - (y1 - y0) * sunk);
                let high_mm = on_ridge.iter().map(|p| (crest - p).norm()).fold(f64::INFINITY, f64::min);
                assert!(high_mm < 1.15 * HEIGHT_MM, "{strategy}, {width_mm}: {high_mm} mm between {w:?}");
            }
        }
    }
}
