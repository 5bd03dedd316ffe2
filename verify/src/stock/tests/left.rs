//! Stock left over the surface.

use claymill_toolpath::MoveKind;

use super::super::{LeftBand, StockSample, Thickness};
use super::*;

/// A4: cusps of a ball on a plane, height 0.1 mm: mean and largest thickness.
#[test]
fn a4_cusps_on_a_plane() {
    let spacing = 2.821_347_195_933_2;
    let rows = (0..5).map(|k| {
        let y = spacing * f64::from(k);
        straight(MoveKind::Cut, [-30.0, y, 0.0], [30.0, y, 0.0])
    });
    let mut moves: Vec<Move> = rows.collect();
    // Four digits of the written format would show in the spacing.
    for (k, m) in moves.iter_mut().enumerate() {
        m.points.iter_mut().for_each(|p| p[1] = spacing * k as f64);
    }
    let check =
        check(block([-20.0, -20.0, -10.0], [20.0, 40.0, 10.0]), &moves, &[tool("T1", "ball:10", None)]);
    let count = 400;
    let samples: Vec<StockSample> = (0..count)
        .map(|k| StockSample {
            point: Point3::new(1.0, spacing * (1.0 + 2.0 * (f64::from(k) + 0.5) / f64::from(count)), 0.0),
            normal: Vector3::z(),
            area_mm2: 0.5,
            ahead_mm: f64::INFINITY,
        })
        .collect();
    let band = LeftBand { allowance_mm: 0.0, less_mm: 0.005, more_mm: 0.05, reach_mm: 15.0 };
    let left = check.stock_left(&samples, &band, &|| true).unwrap();
    assert!((left.mean_mm - 0.033_266_380).abs() < 1e-5, "{left:?}");
    assert!((left.area_mm2 - 200.0).abs() < 1e-9 && left.below == 0.0 && left.beyond == 0, "{left:?}");
    // The height is y²/2R nearly: more than half of it is left over 1 − √½ of the width.
    assert!((left.above - (1.0 - 0.5f64.sqrt())).abs() < 0.01, "{left:?}");
    let on_crest = check.thickness(&Point3::new(0.0, 1.5 * spacing, 0.0), &Vector3::z(), 15.0);
    assert!(matches!(on_crest, Thickness::Known(h) if (h - 0.1).abs() < 1e-7), "{on_crest:?}");
}

/// Heights above, below and beyond what is looked at; roofs over a gap count.
#[test]
fn thickness_tells_air_gouge_and_roof() {
    let moves = [straight(MoveKind::Cut, [-40.0, 0.0, 5.0], [40.0, 0.0, 5.0])];
    let stock = || block([-20.0, -20.0, -10.0], [20.0, 20.0, 10.0]);
    let cut = check(stock(), &moves, &[tool("T1", "flat:3", None)]);
    let over = |x: f64, y: f64, z: f64| cut.thickness(&Point3::new(x, y, z), &Vector3::z(), 4.0);
    let known = |t: Thickness| if let Thickness::Known(d) = t { d } else { panic!("{t:?}") };
    assert!((known(over(0.0, 0.0, 4.5)) - 0.5).abs() < 1e-9);
    assert!((known(over(0.0, 0.0, 5.5)) + 0.5).abs() < 1e-9);
    assert_eq!(over(0.0, 5.0, 0.0), Thickness::Beyond);
    assert_eq!(over(0.0, 0.0, 9.9), Thickness::Nothing);
    assert_eq!(over(30.0, 0.0, 0.0), Thickness::Nothing);
    // A tunnel of a bare ball under a roof of 2 mm.
    let tunnel = [straight(MoveKind::Cut, [-40.0, 0.0, 4.0], [40.0, 0.0, 4.0])];
    let tunnel = bare_ball(stock(), &tunnel, 2.0);
    let roof = tunnel.thickness(&Point3::new(0.0, 0.0, 4.0), &Vector3::z(), 20.0);
    assert!((known(roof) - 6.0).abs() < 1e-8);
    let floor = tunnel.thickness(&Point3::new(0.0, 0.0, 3.5), &Vector3::z(), 4.0);
    assert!((known(floor) - 0.5).abs() < 1e-8, "{floor:?}");
}

/// What stands over other faces is not over a place: where stock reaches as far as that, it is as thick as that.
#[test]
fn stock_is_no_thicker_than_what_is_over_its_place() {
    let check = check(block([-20.0, -20.0, -10.0], [20.0, 20.0, 10.0]), &[], &[tool("T1", "flat:3", None)]);
    let over = |ahead_mm: f64| {
        let sample = StockSample { point: Point3::origin(), normal: Vector3::z(), area_mm2: 1.0, ahead_mm };
        let band = LeftBand { allowance_mm: 0.4, less_mm: 0.005, more_mm: 1.5, reach_mm: 8.0 };
        check.stock_left(&[sample], &band, &|| true).unwrap()
    };
    let (low, thick, all) = (over(1.2), over(3.0), over(f64::INFINITY));
    assert!(low.within == 1.0 && low.beyond == 0, "{low:?}");
    assert!(thick.above == 1.0 && thick.beyond == 0, "{thick:?}");
    assert!(all.above == 1.0 && all.beyond == 1, "{all:?}");
}
