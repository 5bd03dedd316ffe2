//! Small jobs made for tests.
#![allow(dead_code, reason = "not every test needs all of them")]

use claymill_controller::{Machine, MachineJob};
use claymill_nurbs::{Curve3, KnotVector, Point3, Vector3};
use claymill_toolpath::{Job, Move, MoveKind, Program};

/// `job.json` with two setups.
pub(crate) fn record() -> Job {
    let json = serde_json::json!({
        "format_version": 1, "claymill_version": "test",
        "model": {"path": "model.igs", "sha256": "", "units": "MM", "unit_mm": 1.0, "faces_in_file": 0,
            "faces_read": 0, "skipped": [], "area_mm2": 0.0, "box_mm": [0.0, 0.0, 0.0, 1.0, 1.0, 1.0]},
        "request": {"tool": {"shape": "ball", "radius_mm": 6.0}, "scallop_mm": 0.1, "strategy": "planar",
            "link": "lace", "preset": "clay", "up": "+z", "length": "-x", "only": [], "skip": [],
            "feed_mm_per_min": 6000.0, "rapid_mm_per_min": 20000.0},
        "tolerances": {}, "tools": [{"id": "T1", "shape": "ball", "radius_mm": 6.0}],
        "setups": [
            {"name": "top", "axis": [0.0, 0.0, 1.0], "clearance_mm": 60.0, "area_mm2": 0.0, "time_s": 0.0},
            {"name": "left", "axis": [0.0, -1.0, 0.0], "clearance_mm": 60.0, "area_mm2": 0.0, "time_s": 0.0}],
        "regions": [],
        "totals": {"moves": 0, "passes": 0, "retracts": 0,
            "length": {"cut_mm": 0.0, "lead_mm": 0.0, "link_mm": 0.0, "rapid_mm": 0.0},
            "control_points": 0, "time_s": 0.0, "lifted_locations": 0},
        "area": {"total_mm2": 0.0, "cut_mm2": 0.0, "uncut_mm2": {}},
        "faces": [], "timings": [], "peak_memory_mb": 0.0
    });
    serde_json::from_value(json).expect("a job record")
}

/// A curve with arc-length-like knots.
pub(crate) fn curve(degree: usize, points: &[[f64; 3]], weights: Option<&[f64]>) -> Curve3 {
    let points: Vec<Point3> = points.iter().map(|&p| p.into()).collect();
    let length: f64 = points.windows(2).map(|w| (w[1] - w[0]).norm()).sum();
    let spans = points.len() - degree;
    let mut knots = vec![0.0; degree];
    // Uneven on purpose.
    knots.extend((0..=spans).map(|i| {
        let s = i as f64 / spans as f64;
        (length * (0.8 * s + 0.2 * s * s) * 1e4).round() / 1e4
    }));
    knots.extend(vec![knots[knots.len() - 1]; degree]);
    Curve3::new(KnotVector::new(degree, knots).unwrap(), points, weights.map(<[f64]>::to_vec)).unwrap()
}

/// The moves of [`program`] for a machine.
pub(crate) fn job(curves: &[(&str, Curve3)], machine: &Machine) -> MachineJob {
    MachineJob::new(record(), &program(curves), machine).expect("a job")
}

/// Moves from curve to curve: down onto each one, up at its end and straight over to the next.
pub(crate) fn program(curves: &[(&str, Curve3)]) -> Program {
    program_along(curves, &|setup| if setup == "top" { Vector3::z() } else { -Vector3::y() })
}

/// As [`program`], with the tool axis of each setup.
pub(crate) fn program_along(curves: &[(&str, Curve3)], axis_of: &dyn Fn(&str) -> Vector3) -> Program {
    let mut moves: Vec<Move> = Vec::new();
    let mut add = |setup: &str, pass: usize, m: Move| {
        let seq = moves.len() as u64;
        moves.push(Move { seq, setup: setup.into(), tool: "T1".into(), region: 0, pass: pass as u32, ..m });
    };
    let mut last: Option<(&str, Point3)> = None;
    for (pass, (setup, curve)) in curves.iter().enumerate() {
        let axis = axis_of(setup);
        let lift = axis * 20.0;
        match last {
            Some((before, end)) if before == *setup => {
                let straight = |kind, a, b| Move::straight(kind, a, b, axis, 20_000.0);
                add(setup, pass, straight(MoveKind::LeadOut, end, end + lift));
                add(setup, pass, straight(MoveKind::Rapid, end + lift, curve.start() + lift));
            }
            _ => {}
        }
        let down = Move::straight(MoveKind::LeadIn, curve.start() + lift, curve.start(), axis, 3000.0);
        add(setup, pass, down);
        add(setup, pass, Move::along(MoveKind::Cut, curve, axis, 6000.0));
        last = Some((setup, curve.end()));
    }
    Program { moves }
}

/// Curves of every kind that a ladder meets: planar in each plane, in space, rational, of other degrees, with
/// an inner knot of full multiplicity.
pub(crate) fn curves() -> Vec<(&'static str, Curve3)> {
    let wave = |f: &dyn Fn(f64, f64) -> [f64; 3]| -> Vec<[f64; 3]> {
        (0..9)
            .map(|i| f(f64::from(i) * 8.0, [0.0, 3.0, 5.0, 2.0, -1.0, 0.0, 4.0, 6.0, 5.0][i as usize]))
            .collect()
    };
    let s = std::f64::consts::FRAC_1_SQRT_2;
    vec![
        ("top", curve(3, &wave(&|x, y| [x, y, 10.0]), None)),
        ("top", curve(3, &wave(&|x, y| [x, 12.5, 10.0 + y]), None)),
        ("top", curve(3, &wave(&|x, y| [7.5, x, 10.0 + y]), None)),
        ("top", curve(3, &wave(&|x, y| [x, y, 10.0 + 0.5 * y + 0.1 * x]), None)),
        ("top", curve(2, &[[10.0, 0.0, 5.0], [10.0, 10.0, 5.0], [0.0, 10.0, 5.0]], Some(&[1.0, s, 1.0]))),
        ("top", curve(2, &[[10.0, 3.0, 5.0], [10.0, 3.0, 15.0], [0.0, 3.0, 15.0]], Some(&[1.0, 5.0, 1.0]))),
        ("top", curve(4, &wave(&|x, y| [x, 30.0, 10.0 + y]), None)),
        ("top", curve(1, &[[0.0, 0.0, 8.0], [10.0, 0.0, 8.0], [10.0, 10.0, 9.0]], None)),
        ("left", curve(3, &wave(&|x, y| [x, 5.0 - y, 20.0]), None)),
        (
            "left",
            curve(
                5,
                &wave(&|x, y| [x, 5.0 - y, 20.0 + 2.0 * y]),
                Some(&[1., 2., 1., 1., 3., 1., 1., 0.5, 1.]),
            ),
        ),
    ]
}
