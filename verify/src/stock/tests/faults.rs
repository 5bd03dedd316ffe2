//! Planted faults in the program of a stepped pocket: each is found, sized and placed.

use claymill_toolpath::MoveKind;

use super::super::{LeftBand, StockReport, StockSample, ToolPart};
use super::*;

const SAFE: f64 = 30.0;

/// A pocket 60 × 30 in rows, at one level, begun by a plunge from the safe height and left by a rapid.
fn layer(z: f64, tool: &str) -> Vec<Move> {
    let corner = |k: usize, x: f64| [x, 15.0 + 6.0 * k as f64, z];
    let mut path = Vec::new();
    for k in 0..6 {
        let ends = if k % 2 == 0 { [20.0, 80.0] } else { [80.0, 20.0] };
        path.extend(ends.map(|x| corner(k, x)));
    }
    let (first, last) = (path[0], path[path.len() - 1]);
    // Down on a rapid to what the layer before has left, then at feed.
    let above = if z < 16.0 { z + 4.0 } else { 20.0 };
    let mut moves = vec![
        straight(MoveKind::Rapid, [first[0], first[1], SAFE], [first[0], first[1], above]),
        straight(MoveKind::LeadIn, [first[0], first[1], above], first),
    ];
    moves.extend(polyline(MoveKind::Cut, &path));
    moves.push(straight(MoveKind::Rapid, last, [last[0], last[1], SAFE]));
    moves.push(straight(MoveKind::Rapid, [last[0], last[1], SAFE], [20.0, 15.0, SAFE]));
    moves.into_iter().map(|m| Move { tool: tool.into(), ..m }).collect()
}

fn judged(moves: Vec<Move>) -> StockReport {
    let moves = numbered(moves);
    // Flutes of 6 mm only: a layer of 4 mm is cut, two at once meet the shank.
    let tools = [tool("T1", "flat:5,length:6,shank:10", Some("40:30x40")), tool("T2", "flat:2.5", None)];
    let check = check(block([0.0, 0.0, 0.0], [100.0, 60.0, 20.0]), &moves, &tools);
    let mut samples = Vec::new();
    for x in 0..30 {
        for y in 0..15 {
            let point = Point3::new(21.0 + 2.0 * f64::from(x), 16.0 + 2.0 * f64::from(y), 8.0);
            samples.push(StockSample { point, normal: Vector3::z(), area_mm2: 4.0, ahead_mm: f64::INFINITY });
        }
    }
    let band = LeftBand { allowance_mm: 0.0, less_mm: 0.005, more_mm: 0.01, reach_mm: 30.0 };
    let report = check.report(Some((&samples, &band)), &|| true).unwrap();
    let text = format!("{report:?}");
    assert!(!text.contains("NaN"), "{text}");
    report
}

fn layers(levels: &[f64]) -> Vec<Move> {
    levels.iter().flat_map(|z| layer(*z, "T1")).collect()
}

#[test]
fn a_sound_program_has_no_fault() {
    let report = judged(layers(&[16.0, 12.0, 8.0]));
    let rapids = &report.clear[&MoveKind::Rapid];
    assert_eq!((rapids.moves, rapids.touching, rapids.undecided), (9, 0, 0), "{rapids:?}");
    assert_eq!((report.body.touching, report.body.undecided), (0, 0), "{:?}", report.body);
    let left = report.left.unwrap();
    assert!(left.within == 1.0 && left.mean_mm.abs() < 1e-9, "{left:?}");
    // Plunges and slots are full engagement; the volume is that of the pocket with round corners.
    let exact = 12.0 * (60.0 * 30.0 + 2.0 * 5.0 * 90.0 + 25.0 * std::f64::consts::PI);
    // Rows 6 mm apart of a tool of 10 mm leave nothing between, but scallops at the ends of rows.
    let removed = report.volumes.removed;
    assert!(
        removed.mm3 < exact + removed.plus_minus_mm3 && removed.mm3 > 0.97 * exact,
        "{removed:?} {exact}"
    );
    assert!(report.engagement.unwrap().engagement.angle_deg > 179.0);
}

#[test]
fn a_layer_left_out_is_found_by_shank_and_rapid() {
    let report = judged(layers(&[16.0, 8.0]));
    // The rapid goes down to 12 where stock stands up to 16; the one up at the end meets what the shank ran through.
    let rapids = &report.clear[&MoveKind::Rapid];
    assert_eq!(rapids.touching, 2, "{rapids:?}");
    let worst = rapids.worst.as_ref().unwrap();
    assert!((worst.size_mm - 4.0).abs() < 0.2 && worst.part == ToolPart::Flutes, "{worst:?}");
    assert!((worst.at.point_mm[2] - 14.0).abs() < 0.3 && worst.at.move_seq == Some(15), "{worst:?}");
    // Flutes end 6 mm above the floor at 8: 2 mm of stock meet the shank.
    assert!(report.body.touching > 0, "{:?}", report.body);
    let shank = report.body.worst.unwrap();
    assert!((shank.size_mm - 2.0).abs() < 0.15 && shank.part == ToolPart::Shank, "{shank:?}");
    assert!((14.0..=16.0).contains(&shank.at.point_mm[2]), "{shank:?}");
}

#[test]
fn the_last_layer_left_out_is_found_in_what_is_left() {
    let left = judged(layers(&[16.0, 12.0])).left.unwrap();
    assert!(
        left.above == 1.0
            && left.extremes_mm.is_some_and(|[a, b]| (a - 4.0).abs() < 1e-9 && (b - 4.0).abs() < 1e-9)
    );
}

#[test]
fn a_rapid_lowered_into_stock_is_found() {
    let mut moves = layers(&[16.0, 12.0, 8.0]);
    let at = moves.len() - 1;
    assert_eq!(moves[at].kind, MoveKind::Rapid);
    // Back over the block at 17 instead of 30, beyond the border of the pocket.
    moves[at] =
        Move { tool: "T1".into(), ..straight(MoveKind::Rapid, [20.0, 45.0, 17.0], [-20.0, 45.0, 17.0]) };
    let report = judged(moves);
    let rapids = &report.clear[&MoveKind::Rapid];
    assert_eq!(rapids.touching, 1, "{rapids:?}");
    let worst = rapids.worst.as_ref().unwrap();
    assert!((worst.size_mm - 3.0).abs() < 0.15 && worst.at.move_seq == Some(at as u64), "{worst:?}");
    let [x, y, z] = worst.at.point_mm;
    assert!((0.0..=15.5).contains(&x) && (y - 45.0).abs() < 5.0 && (z - 18.5).abs() < 0.2, "{worst:?}");
}

#[test]
fn a_tool_swapped_is_found_in_what_is_left() {
    let mut moves = layers(&[16.0, 12.0]);
    moves.extend(layer(8.0, "T2"));
    // A tool of half the width leaves ribs of 1 mm between rows 6 mm apart, 4 mm high.
    let left = judged(moves).left.unwrap();
    assert!(left.above > 0.05 && left.within > 0.5, "{left:?}");
    assert!(left.extremes_mm.is_some_and(|[a, b]| a.abs() < 1e-9 && (b - 4.0).abs() < 1e-9), "{left:?}");
    let at = left.thickest_at.unwrap().point_mm;
    let row = ((at[1] - 15.0) / 6.0).fract();
    assert!((0.4..0.6).contains(&row), "{at:?}");
}

#[test]
fn an_operation_out_of_order_is_found() {
    let report = judged(layers(&[8.0, 16.0, 12.0]));
    let rapids = &report.clear[&MoveKind::Rapid];
    let worst = rapids.worst.as_ref().unwrap();
    assert!(rapids.touching >= 1 && worst.at.move_seq == Some(0), "{rapids:?}");
    assert!((worst.size_mm - 8.0).abs() < 0.3, "{worst:?}");
    assert!(report.body.touching > 0 && report.left.unwrap().within == 1.0);
}

/// The report does not depend on the number of threads.
#[test]
fn any_number_of_threads_gives_the_same_report() {
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| judged(layers(&[8.0, 16.0, 12.0])))
    };
    let one = with(1);
    assert!(one == with(2) && one == with(3));
}
