//! Volumes of the reference cases: each within its stated interval, and that no wider than 0.15 %.

use claymill_toolpath::{Move, MoveKind};

use super::super::{InitialStock, StockCheck, VolumeEstimate};
use super::*;

fn is_known(found: VolumeEstimate, exact: f64, case: &str) {
    let off = (found.mm3 - exact).abs();
    assert!(off <= found.plus_minus_mm3, "{case}: {found:?}, exactly {exact}");
    assert!(found.plus_minus_mm3 <= 1.5e-3 * exact, "{case}: {found:?}, exactly {exact}");
}

fn removed(check: &StockCheck<'_>) -> VolumeEstimate {
    check.volumes(&|| true).unwrap().removed
}

/// Cuts of a tool in a large block whose upper side is at height 0.
fn cut_in_block(text: &str, points: &[[f64; 3]]) -> VolumeEstimate {
    let moves = numbered(polyline(MoveKind::Cut, points));
    removed(&check(block([-40.0, -40.0, -60.0], [90.0, 40.0, 0.0]), &moves, &[tool("T1", text, None)]))
}

#[test]
fn a1_block_less_a_sphere() {
    let moves = [straight(MoveKind::Cut, [0.0, 0.0, -50.0], [0.0, 0.0, -50.0])];
    let found = bare_ball(block([-50.0; 3], [50.0; 3]), &moves, 50.0).volumes(&|| true).unwrap();
    is_known(found.left, 476_401.224_401_701, "A1");
}

#[test]
fn a2_ball_slots() {
    let slot = |depth: f64| cut_in_block("ball:10", &[[0.0, 0.0, -depth], [50.0, 0.0, -depth]]);
    is_known(slot(4.0), 2_672.110_271_306, "A2");
    is_known(slot(10.0), 9_948.376_736_368, "A2b");
}

#[test]
fn a3_capsule() {
    let moves = [straight(MoveKind::Cut, [0.0, 0.0, -30.0], [30.0, 40.0, -30.0])];
    let stock = block([-50.0, -50.0, -60.0], [90.0, 90.0, 0.0]);
    is_known(removed(&bare_ball(stock, &moves, 10.0)), 19_896.753_472_735, "A3");
}

#[test]
fn a5_flat_slot() {
    let found = cut_in_block("flat:5", &[[0.0, 0.0, -3.0], [40.0, 0.0, -3.0]]);
    is_known(found, 1_435.619_449_019, "A5");
}

#[test]
fn a6_bull_plunge_and_slot() {
    let plunge = cut_in_block("bull:10:2", &[[0.0, 0.0, 5.0], [0.0, 0.0, -5.0]]);
    is_known(plunge, 1_519.270_486_973, "A6 plunge");
    let slot = cut_in_block("bull:10:2", &[[0.0, 0.0, -5.0], [50.0, 0.0, -5.0]]);
    is_known(slot, 6_433.429_752_332, "A6 slot");
}

/// Once around a square with its corners rounded off by `around`.
fn ring(half: f64, around: f64, z: f64) -> Vec<Move> {
    let mut moves = Vec::new();
    let turned = |k: usize, x: f64, y: f64| match k {
        0 => [x, y, z],
        1 => [-y, x, z],
        2 => [-x, -y, z],
        _ => [y, -x, z],
    };
    for k in 0..4 {
        moves.push(straight(MoveKind::Cut, turned(k, half + around, -half), turned(k, half + around, half)));
        if around > 0.0 {
            let mut arc = circle(1.0, z);
            arc.degree = 2;
            arc.knots = vec![0.0, 0.0, 0.0, around, around, around];
            arc.weights = Some(vec![1.0, 0.5f64.sqrt(), 1.0]);
            let far = half + around;
            arc.points = vec![turned(k, far, half), turned(k, far, far), turned(k, half, far)];
            moves.push(arc);
        }
    }
    moves
}

#[test]
fn a7_pyramid_by_levels() {
    let radius = 10.0;
    let mut moves = Vec::new();
    for row in 0..8 {
        let y = -50.0 + 15.0 * f64::from(row);
        moves.push(straight(MoveKind::Cut, [-50.0, y, 50.5], [50.0, y, 50.5]));
    }
    for (side, level) in [(10.0, 40.5), (30.0, 30.5), (50.0, 20.5), (70.0, 10.5), (90.0, 0.0)] {
        moves.extend(ring(0.5 * side, radius + 0.5, level));
        let mut half = 0.5 * side + 0.5 + 2.2 * radius;
        while half - radius < 50.0 {
            moves.extend(ring(half, 0.0, level));
            half += 1.5 * radius;
        }
    }
    let moves = numbered(moves);
    let tools = [tool("T1", "flat:10", None)];
    let found = removed(&check(block([-50.0, -50.0, 0.0], [50.0, 50.0, 55.0]), &moves, &tools));
    is_known(found, 375_820.337_392_748, "A7");
}

/// Stairs about a dome with a flat tool: volume left over it, and the thickness at the edges of the stairs.
#[test]
fn a8_dome_by_stairs() {
    let rho = 50.0f64;
    let radius_at = |z: f64| (rho * rho - z * z).sqrt();
    let stock = || InitialStock::cylinder(Point3::origin(), Vector3::z(), rho, rho).unwrap();
    for (step, left) in [(5.0, 18_980.455_615_438), (2.5, 9_653.852_425_094)] {
        let levels: Vec<f64> = (0..(rho / step) as usize).map(|k| step * k as f64).collect();
        // The lowest only runs along the cylinder: what rounding takes there is nothing.
        let cut = levels[1..].iter().rev().map(|&z| circle(radius_at(z) + 15.0, z));
        let moves = numbered(cut.collect());
        // Coarser chords than usual: so large a tool on so many of them takes long.
        let options = StockOptions { chord_mm: 3e-3, ..StockOptions::default() };
        let tools = [tool("T1", "flat:15", None)];
        let check = StockCheck::new(stock(), &moves, &tools, &options, &|| true).unwrap();
        let found = check.volumes(&|| true).unwrap();
        let dome = 2.0 / 3.0 * std::f64::consts::PI * rho.powi(3);
        let exact = found.initial.mm3 - dome - left;
        let off = (found.removed.mm3 - exact).abs();
        assert!(off <= found.removed.plus_minus_mm3, "A8 {step}: {:?}, exactly {exact}", found.removed);
        assert!(found.removed.plus_minus_mm3 < 1e-3 * found.initial.mm3, "{:?}", found.removed);
        if step == 5.0 {
            for (layer, exact) in [(0, 0.249_378_106), (5, 2.678_268_764), (9, 4.543_560_573)] {
                let z = step * f64::from(layer);
                let n = Vector3::new(radius_at(z), 0.0, z + step).normalize();
                // A hair beside the edge, where the stairs have not been cut by the chord error.
                let found = check.thickness(&Point3::from(n * rho), &n, 20.0);
                let super::super::Thickness::Known(found) = found else { panic!("{found:?}") };
                assert!(
                    found > exact - 1e-6 && found < exact + 1e-2,
                    "A8 layer {layer}: {found}, exactly {exact}"
                );
            }
        }
    }
}
