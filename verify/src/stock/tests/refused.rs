//! Absurd input is refused by name, and a wish to stop is obeyed.

use claymill_nurbs::MeshOptions;
use claymill_toolpath::{End, MoveKind, Tool};

use super::super::{InitialStock, LeftBand, StockCheck, StockError, StockOptions};
use super::*;

#[test]
fn absurd_stocks_are_refused() {
    let p = Point3::origin();
    let nan = f64::NAN;
    assert!(matches!(InitialStock::block(p, Point3::new(nan, 1.0, 1.0)), Err(StockError::Size { .. })));
    assert!(matches!(InitialStock::block(p, Point3::new(1.0, -1.0, 1.0)), Err(StockError::Size { .. })));
    assert!(matches!(InitialStock::block(p, Point3::new(1e9, 1.0, 1.0)), Err(StockError::Size { .. })));
    for (axis, radius) in [(Vector3::z(), nan), (Vector3::z(), 0.0), (Vector3::z(), f64::INFINITY)] {
        assert!(matches!(InitialStock::cylinder(p, axis, radius, 1.0), Err(StockError::Size { .. })));
    }
    assert!(matches!(InitialStock::cylinder(p, Vector3::zeros(), 1.0, 1.0), Err(StockError::Direction(_))));
    assert!(matches!(
        InitialStock::mesh(&[Point3::new(nan, 0.0, 0.0)], &[[0, 0, 0]]),
        Err(StockError::Size { .. })
    ));
    let none = claymill_nurbs::Model::default();
    let mesh = MeshOptions { deviation_mm: 0.1, longest_edge_mm: 5.0 };
    assert!(matches!(InitialStock::layer(&none, 1.0, None, &mesh), Err(StockError::Empty("model"))));
    assert!(matches!(InitialStock::layer(&none, nan, None, &mesh), Err(StockError::Size { .. })));
}

#[test]
fn absurd_moves_tools_and_options_are_refused() {
    let stock = || block([0.0; 3], [10.0; 3]);
    let good = straight(MoveKind::Cut, [0.0, 0.0, 0.0], [1.0, 0.0, 0.0]);
    let ball = tool("T1", "ball:1", None);
    let usual = StockOptions::default();
    let made = |m: &Move, t: &claymill_toolpath::ToolRecord, o: &StockOptions| {
        StockCheck::new(stock(), std::slice::from_ref(m), std::slice::from_ref(t), o, &|| true)
            .map(|_| ())
            .unwrap_err()
    };
    let other = Move { tool: "T9".into(), seq: 4, ..good.clone() };
    assert_eq!(made(&other, &ball, &usual), StockError::UnknownTool { seq: 4, tool: "T9".into() });
    let astray = Move { points: vec![[0.0; 3], [1e9, 0.0, 0.0]], ..good.clone() };
    assert!(matches!(made(&astray, &ball, &usual), StockError::Size { .. }));
    let broken = Move { points: vec![[0.0; 3], [f64::NAN, 0.0, 0.0]], ..good.clone() };
    assert!(matches!(made(&broken, &ball, &usual), StockError::Move(_) | StockError::Size { .. }));
    let lying = Move { axis_end: [0.0, 0.0, 2.0], ..good.clone() };
    assert!(matches!(made(&lying, &ball, &usual), StockError::Move(_)));
    for radius_mm in [f64::NAN, -1.0, 1e9, f64::INFINITY] {
        let odd = claymill_toolpath::ToolRecord { tool: Tool::of(End::Flat { radius_mm }), ..ball.clone() };
        assert!(matches!(made(&good, &odd, &usual), StockError::Size { .. }), "{radius_mm}");
    }
    for options in [
        StockOptions { chord_mm: 0.0, ..usual.clone() },
        StockOptions { turn_mm: f64::NAN, ..usual.clone() },
        StockOptions { smallest_box_mm: -1.0, ..usual.clone() },
        StockOptions { volume_points: u64::MAX, ..usual.clone() },
    ] {
        assert!(matches!(made(&good, &ball, &options), StockError::Size { .. }), "{options:?}");
    }
}

#[test]
fn whoever_wants_to_stop_is_obeyed_and_no_number_is_out_of_range() {
    let moves = [straight(MoveKind::Cut, [0.0, 0.0, 0.0], [1.0, 0.0, 0.0])];
    let tools = [tool("T1", "ball:1", None)];
    let stopped =
        StockCheck::new(block([0.0; 3], [10.0; 3]), &moves, &tools, &StockOptions::default(), &|| false);
    assert_eq!(stopped.unwrap_err(), StockError::Stopped);
    let check = check(block([0.0; 3], [10.0; 3]), &moves, &tools);
    assert_eq!(check.volumes(&|| false).unwrap_err(), StockError::Stopped);
    assert_eq!(check.report(None, &|| false).unwrap_err(), StockError::Stopped);
    assert_eq!(check.rapid_is_clear(1, 0).unwrap_err(), StockError::NoMove(1));
    assert_eq!(check.body_is_clear(7).unwrap_err(), StockError::NoMove(7));
    assert_eq!(check.engagement(7, 0.0, 0.0, 1.0).unwrap_err(), StockError::NoMove(7));
    assert!(check.engagement(0, f64::NAN, 0.0, 1.0).is_err() && check.engagement(0, 0.0, 0.5, 0.0).is_err());
    let band = LeftBand { allowance_mm: f64::NAN, less_mm: 0.0, more_mm: 0.0, reach_mm: 1.0 };
    assert!(check.stock_left(&[], &band, &|| true).is_err());
    // No moves at all are a program too.
    let empty =
        StockCheck::new(block([0.0; 3], [10.0; 3]), &[], &[], &StockOptions::default(), &|| true).unwrap();
    let report = empty.report(None, &|| true).unwrap();
    assert!(report.volumes.left.mm3 == 1000.0 && report.engagement.is_none() && report.pieces == 0);
}

/// A tool that turns: the ball is exact, what stands above shrinks by what was allowed; a collision of a leaning shank is found.
#[test]
fn a_turning_axis_is_followed() {
    let m =
        Move { axis_end: [0.6, 0.0, 0.8], ..straight(MoveKind::Cut, [20.0, 30.0, 18.0], [80.0, 30.0, 18.0]) };
    let moves = [m];
    let tools = [tool("T1", "ball:5,length:10,shank:8", Some("60:30x20"))];
    let check = check(block([0.0, 0.0, 0.0], [100.0, 60.0, 20.0]), &moves, &tools);
    // The ball's middle is 5 mm along the axis from the tip.
    for (t, axis) in [(0.0, [0.0, 0.0, 1.0]), (60.0, [0.6, 0.0, 0.8])] {
        let centre = Point3::new(20.0 + t, 30.0, 18.0) + Vector3::from(axis) * 5.0;
        // Across the plane in which all happens.
        let aside = |d: f64| centre + Vector3::y() * d;
        assert!(check.cut_at(&aside(4.9999)).is_some() && check.cut_at(&aside(5.0001)).is_none(), "{t}");
    }
    assert_eq!(check.body_is_clear(0).unwrap(), super::super::StockProof::Clear);
}
