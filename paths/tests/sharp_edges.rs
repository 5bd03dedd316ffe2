//! Rows over a thin body with sharp round edges: they are close together where the ball goes round an edge, and nowhere
//! else.

mod one_face;

use std::f64::consts::TAU;

use claymill_nurbs::analytic::{Frame as Placement, cylinder};
use claymill_nurbs::{Point3, Vector3};
use claymill_paths::{FitTolerance, PlanOptions, flat_mm};
use claymill_toolpath::MoveKind;
use one_face::planned;

const R: f64 = 2.0;
const SCALLOP_MM: f64 = 0.02;
const LENGTH_MM: f64 = 60.0;
/// Half the width and half the thickness of the body: an elliptic bar, along x.
const HALF_MM: [f64; 2] = [12.0, 1.2];

#[test]
fn rows_are_close_only_around_sharp_edges() {
    let placement = Placement::new(Point3::origin(), Vector3::x(), Vector3::y()).unwrap();
    let round = cylinder(&placement, HALF_MM[0], (0.0, TAU), (0.0, LENGTH_MM)).unwrap();
    let bar = round.mapped(|p| Point3::new(p.x, p.y, p.z * HALF_MM[1] / HALF_MM[0]));
    let plan = planned(bar, R, SCALLOP_MM, |usual| PlanOptions { row_angle_deg: Some(0.0), ..usual });

    // Where the rows from the top cross the middle of the bar.
    let mut rows: Vec<f64> = Vec::new();
    for m in plan.program.moves.iter().filter(|m| m.kind == MoveKind::Cut && m.axis_start[2] > 0.5) {
        let curve = m.curve().unwrap();
        let (a, b) = curve.domain();
        let places: Vec<Point3> =
            (0..=200).map(|k| curve.point(a + (b - a) * f64::from(k) / 200.0)).collect();
        let middle = 0.5 * LENGTH_MM;
        rows.extend(places.windows(2).filter(|w| (w[0].x < middle) != (w[1].x < middle)).map(|w| w[0].y));
    }
    rows.sort_by(f64::total_cmp);
    let apart: Vec<(f64, f64)> = rows.windows(2).map(|w| (0.5 * (w[0] + w[1]), w[1] - w[0])).collect();

    let flat = flat_mm(R, FitTolerance::of_scallop(SCALLOP_MM).to_lay_mm(SCALLOP_MM));
    let on_top: Vec<f64> = apart.iter().filter(|(y, _)| y.abs() < 9.0).map(|(_, d)| *d).collect();
    let mean = on_top.iter().sum::<f64>() / on_top.len() as f64;
    assert!(mean > 0.85 * flat && mean < 1.05 * flat, "{mean} mm apart on top, {flat} mm on a plane");
    // Around the edges the ball's centre goes round an arc of more than its radius.
    let at_edges: Vec<f64> = apart.iter().filter(|(y, _)| y.abs() > 12.5).map(|(_, d)| *d).collect();
    assert!(at_edges.iter().any(|d| *d < 0.7 * flat), "{at_edges:?}");
}
