//! Proofs that rapids are clear, and stock in their way found, sized and placed.

use claymill_toolpath::{Move, MoveKind};

use super::super::{InitialStock, StockCheck, StockHit, StockProof};
use super::*;

fn proof(check: &StockCheck<'_>, of_move: usize) -> StockProof {
    check.rapid_is_clear(of_move, check.time_of(of_move).unwrap()).unwrap()
}

fn hit(proof: StockProof) -> StockHit {
    let StockProof::Hit(hit) = proof else { panic!("{proof:?}") };
    hit
}

fn rapid(from: [f64; 3], to: [f64; 3]) -> Move {
    straight(MoveKind::Rapid, from, to)
}

#[test]
fn a_rapid_above_the_block_is_clear_and_one_lowered_into_it_is_not() {
    let tools = [tool("T1", "ball:5", None)];
    let stock = || block([0.0, 0.0, 0.0], [100.0, 60.0, 20.0]);
    let moves =
        [rapid([-20.0, 30.0, 20.1], [120.0, 30.0, 20.1]), rapid([-20.0, 30.0, 17.0], [120.0, 30.0, 17.0])];
    let check = check(stock(), &moves, &tools);
    assert_eq!(proof(&check, 0), StockProof::Clear);
    let found = hit(proof(&check, 1));
    assert!((found.size_mm - 3.0).abs() < 0.15 && found.size_at_most_mm >= found.size_mm, "{found:?}");
    let [x, y, z] = found.at.point_mm;
    assert!((0.0..=100.0).contains(&x) && (y - 30.0).abs() < 1.0 && (z - 18.5).abs() < 0.2, "{found:?}");
}

/// A fin of 0.2 mm that stands between two slots, whatever the tool that meets it.
#[test]
fn a_fin_of_a_fifth_of_a_millimetre_is_found() {
    for text in ["flat:5", "ball:5", "bull:5:1"] {
        let mut moves = Vec::new();
        for y in [24.9, 35.1] {
            moves.push(straight(MoveKind::Cut, [-20.0, y, 0.0], [120.0, y, 0.0]));
        }
        // Across the fin, then along a slot.
        moves.push(rapid([50.0, 24.9, 10.0], [50.0, 35.1, 10.0]));
        moves.push(rapid([-20.0, 24.9, 10.0], [120.0, 24.9, 10.0]));
        let moves = numbered(moves);
        let tools = [tool("T1", text, None)];
        let check = check(block([0.0, 0.0, 0.0], [100.0, 60.0, 20.0]), &moves, &tools);
        let found = hit(proof(&check, 2));
        assert!((found.size_mm - 0.2).abs() < 0.02, "{text}: {found:?}");
        assert!((found.at.point_mm[1] - 30.0).abs() < 0.02, "{text}: {found:?}");
        assert_eq!(proof(&check, 3), StockProof::Clear, "{text}");
    }
}

/// A rapid that grazes the top of a fin: 0.2 mm of it is in the way, the rest below the tool.
#[test]
fn a_rapid_that_grazes_a_fin_is_found() {
    let wall = block([49.9, 0.0, 0.0], [50.1, 60.0, 20.0]);
    let moves =
        [rapid([0.0, 30.0, 19.8], [100.0, 30.0, 19.8]), rapid([0.0, 30.0, 20.0], [100.0, 30.0, 20.0])];
    let check = check(wall, &moves, &[tool("T1", "ball:5", None)]);
    let found = hit(proof(&check, 0));
    assert!(found.size_mm > 0.15 && found.size_mm <= 0.2001, "{found:?}");
    assert_eq!(proof(&check, 1), StockProof::Clear);
}

#[test]
fn a_cleared_slot_is_clear_and_order_matters() {
    for text in ["flat:5", "ball:5", "bull:5:1", "ball:4,taper:5,length:30,shank:14"] {
        let slot = straight(MoveKind::Cut, [-20.0, 30.0, 5.0], [120.0, 30.0, 5.0]);
        let back = rapid([120.0, 30.0, 5.0], [-20.0, 30.0, 5.0]);
        let tools = [tool("T1", text, None)];
        for (moves, is_clear) in [([slot.clone(), back.clone()], true), ([back, slot], false)] {
            let check = check(block([0.0, 0.0, 0.0], [100.0, 60.0, 20.0]), &moves, &tools);
            let at = usize::from(is_clear);
            let found = proof(&check, at);
            assert_eq!(found == StockProof::Clear, is_clear, "{text}: {found:?}");
        }
    }
}

/// Up out of a plunge, sideways out of a pocket, and a millimetre too far.
#[test]
fn retracts_are_proven_along_the_walls_that_were_cut() {
    let mut moves = polyline(
        MoveKind::Cut,
        &[[30.0, 30.0, 30.0], [30.0, 30.0, 8.0], [60.0, 30.0, 5.0], [60.0, 40.0, 5.0]],
    );
    moves.push(rapid([60.0, 40.0, 5.0], [60.0, 40.0, 40.0]));
    moves.push(rapid([30.0, 30.0, 40.0], [30.0, 30.0, 8.0]));
    moves.push(rapid([30.0, 30.0, 40.0], [30.0, 30.0, 7.0]));
    moves.push(rapid([60.0, 40.0, 5.0], [61.0, 40.0, 40.0]));
    let moves = numbered(moves);
    for text in ["flat:5", "ball:5", "bull:5:1"] {
        let tools = [tool("T1", text, None)];
        let check = check(block([0.0, 0.0, 0.0], [100.0, 60.0, 20.0]), &moves, &tools);
        assert_eq!(proof(&check, 3), StockProof::Clear, "{text}");
        assert_eq!(proof(&check, 4), StockProof::Clear, "{text}");
        let deeper = hit(proof(&check, 5));
        assert!((deeper.size_mm - 1.0).abs() < 0.1, "{text}: {deeper:?}");
        assert!(deeper.at.point_mm[2] < 8.0 + 5.0, "{text}: {deeper:?}");
        // Leaning over by 1 mm in 35: 0.43 mm at the top of the block.
        let aside = hit(proof(&check, 6));
        assert!((0.2..0.45).contains(&aside.size_mm), "{text}: {aside:?}");
    }
}

#[test]
fn shank_and_holder_are_found_in_stock_that_the_flutes_left() {
    let deep = [straight(MoveKind::Cut, [-40.0, 30.0, 2.0], [140.0, 30.0, 2.0])];
    let stock = || block([0.0, 0.0, 0.0], [100.0, 60.0, 40.0]);
    // Flutes longer than the stock is deep; short flutes with a thick shank; a holder that comes too low.
    let long = [tool("T1", "flat:5,length:50,shank:10", Some("60:30x40"))];
    assert_eq!(check(stock(), &deep, &long).body_is_clear(0).unwrap(), StockProof::Clear);
    let thick = [tool("T1", "flat:5,length:30,shank:14", None)];
    let found = hit(check(stock(), &deep, &thick).body_is_clear(0).unwrap());
    assert_eq!(found.part, super::super::ToolPart::Shank);
    assert!((found.size_mm - 8.0).abs() < 0.3 && (found.at.point_mm[2] - 36.0).abs() < 0.5, "{found:?}");
    let low = [tool("T1", "flat:5", Some("35:30x40"))];
    let found = hit(check(stock(), &deep, &low).body_is_clear(0).unwrap());
    assert_eq!(found.part, super::super::ToolPart::Holder);
    assert!((found.size_mm - 3.0).abs() < 0.15 && found.at.point_mm[2] > 37.0, "{found:?}");
}

/// A slot around a circle, with the rapid back along the same circle: chords against chords.
#[test]
fn a_curved_way_back_is_clear() {
    let there = circle(30.0, 12.0);
    let back = Move { kind: MoveKind::Rapid, ..there.clone() };
    let moves = numbered(vec![there, back]);
    let stock = InitialStock::cylinder(Point3::origin(), Vector3::z(), 50.0, 20.0).unwrap();
    let check = check(stock, &moves, &[tool("T1", "bull:5:1", None)]);
    assert_eq!(proof(&check, 1), StockProof::Clear);
    assert!(matches!(check.rapid_is_clear(1, 0).unwrap(), StockProof::Hit(_)));
}

/// A bound on work is kept, and said so.
#[test]
fn too_few_boxes_leave_it_undecided() {
    let moves = numbered(vec![
        straight(MoveKind::Cut, [-20.0, 30.0, 5.0], [120.0, 30.0, 5.0]),
        straight(MoveKind::Cut, [-20.0, 31.0, 5.0], [120.0, 31.0, 5.0]),
        rapid([120.0, 30.5, 5.0], [-20.0, 30.5, 5.0]),
    ]);
    let options = StockOptions { most_boxes: 10, ..StockOptions::default() };
    let stock = block([0.0, 0.0, 0.0], [100.0, 60.0, 20.0]);
    let check = StockCheck::new(stock, &moves, &[tool("T1", "ball:5", None)], &options, &|| true).unwrap();
    assert!(matches!(proof(&check, 2), StockProof::Undecided(h) if h.size_at_most_mm > 1.0));
}

/// Random programs: where a rapid is clear, no point of many is deeper in stock than what is passed over; where it is not, the place
/// given is stock in the tool's way, as deep as said.
#[test]
fn proofs_agree_with_many_points() {
    let mut r = Random(29);
    let texts = ["flat:5", "ball:5", "bull:6:2", "ball:3,taper:6,length:25,shank:9"];
    let (mut clear, mut met, mut open) = (0, 0, 0);
    for round in 0..60 {
        let mut place = |low: f64| [r.between(5.0, 35.0), r.between(5.0, 35.0), r.between(low, 24.0)];
        let mut moves = polyline(MoveKind::Cut, &[place(4.0), place(4.0), place(4.0), place(4.0)]);
        // Most rapids run within what the cuts opened.
        let along = moves[round % 3].clone();
        let up = if round % 4 == 0 { -0.5 } else { 0.2 + 0.1 * f64::from(round as u32 % 5) };
        let raised = |[x, y, z]: [f64; 3]| [x, y, z + up];
        moves.push(rapid(raised(along.points[1]), raised(along.points[0])));
        let tools = [tool("T1", texts[round % texts.len()], Some("60:30x40"))];
        let check = check(block([0.0; 3], [40.0, 40.0, 20.0]), &moves, &tools);
        let before = check.time_of(3).unwrap();
        let flutes = check.sweeps_of(3);
        let depth = |p: &Point3| {
            let swept = flutes.iter().map(|s| -s.signed_mm(p)).fold(f64::NEG_INFINITY, f64::max);
            let uncut = (0..check.sweeps.count())
                .map(|i| check.sweeps.piece(i).signed_mm(p))
                .fold(f64::INFINITY, f64::min);
            swept.min(-check.initial().signed_mm(p)).min(uncut)
        };
        match check.rapid_is_clear(3, before).unwrap() {
            StockProof::Clear => {
                clear += 1;
                for _ in 0..2000 {
                    let p = Point3::new(r.between(0.0, 40.0), r.between(0.0, 40.0), r.between(0.0, 20.0));
                    assert!(depth(&p) <= 0.045 + 1e-9, "{round}: {p} {}", depth(&p));
                }
            }
            StockProof::Hit(hit) => {
                met += 1;
                let p = Point3::from(hit.at.point_mm);
                assert!(check.is_stock(&p, before), "{round}: {hit:?}");
                // A plunge is deeper in its union than in any of its places.
                assert!(
                    depth(&p) <= 0.5 * hit.size_mm + 1e-9 && hit.size_mm <= hit.size_at_most_mm,
                    "{round}: {hit:?}"
                );
            }
            StockProof::Undecided(_) => open += 1,
        }
    }
    assert!(clear >= 15 && met >= 10 && open <= 3, "{clear} {met} {open}");
}

/// Beside a wall that ends 50 mm above the tip a holder of 10 mm that sticks out 40 mm: in it, near it, and clear of it; a shank
/// need not keep a distance.
#[test]
fn what_is_struck_is_the_holder_where_stock_is_nearer_than_it_keeps() {
    let moves = [straight(MoveKind::Cut, [0.0, 0.0, -20.0], [0.0, 1.0, -20.0])];
    let stock = || block([20.0, -50.0, -30.0], [60.0, 50.0, 30.0]);
    let axis = Vector3::z();
    let struck = |tool: ToolRecord, x: f64, z: f64, kept_mm: f64| {
        check(stock(), &moves, &[tool]).struck_at(0, &Point3::new(x, 0.0, z), &axis, kept_mm)
    };
    let held = || tool("T1", "ball:5,length:30,shank:10", Some("40:20-20x60"));
    assert_eq!(struck(held(), 9.5, -20.0, 0.0), None);
    assert_eq!(struck(held(), 9.5, -20.0, 1.0), Some(ToolPart::Holder));
    assert_eq!(struck(held(), 8.9, -20.0, 1.0), None);
    assert_eq!(struck(held(), 10.5, -20.0, 0.0), Some(ToolPart::Holder));
    // Over it.
    assert_eq!(struck(held(), 12.0, -9.5, 0.0), None);
    assert_eq!(struck(held(), 12.0, -9.5, 1.0), Some(ToolPart::Holder));
    assert_eq!(struck(held(), 12.0, -8.9, 1.0), None);
    let thick = tool("T1", "ball:5,length:30,shank:20", None);
    assert_eq!(struck(thick.clone(), 10.5, -20.0, 0.0), Some(ToolPart::Shank));
    assert_eq!(struck(thick, 9.5, -20.0, 1.0), None);
}
