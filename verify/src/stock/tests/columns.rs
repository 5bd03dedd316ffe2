//! What is called cleared from the plane holds no stock for the proof by boxes, and of ways over cleared ground most are called so:
//! corners leave cusps over which a way may run that the plane knows nothing of.

use std::f64::consts::TAU;

use claymill_toolpath::{Move, MoveKind};

use super::super::proof::depth;
use super::super::sweeps::{Moved, moved};
use super::*;

/// Ways in levels of 4 mm, from the top down, and a link after every fourth.
fn levels(r: &mut Random) -> Vec<Move> {
    let mut moves = Vec::new();
    for level in 1..=3 {
        let z = 20.0 - 4.0 * f64::from(level) + if r.unit() < 0.3 { r.between(-0.03, 0.03) } else { 0.0 };
        let mut at = [r.between(5.0, 35.0), r.between(5.0, 35.0), z];
        let first = at;
        for k in 0..12 {
            let to = [at[0] + r.between(-9.0, 9.0), at[1] + r.between(-9.0, 9.0), z];
            moves.push(straight(MoveKind::Cut, at, to));
            at = to;
            if k % 4 == 3 {
                // Back to where it was, straight, a little higher or as high, and down again.
                let up = if r.unit() < 0.5 { 0.0 } else { r.between(0.0, 1.0) };
                let back = [first[0], first[1], z + up];
                moves.push(straight(MoveKind::Link, [at[0], at[1], z + up], back));
                moves.push(straight(MoveKind::LeadIn, [first[0], first[1], z + 6.0], first));
            }
        }
    }
    numbered(moves)
}

#[test]
fn what_is_cleared_in_the_plane_is_clear_for_boxes() {
    let mut r = Random(5);
    let (mut called, mut clear) = (0, 0);
    for text in
        ["flat:8", "bull:8:1.5", "bull:10:0.5", "flat:6,length:7,shank:6", "bull:8:2,length:5,shank:7"]
    {
        for _ in 0..4 {
            let moves = levels(&mut r);
            let check = check(block([0.0; 3], [40.0, 40.0, 20.0]), &moves, &[tool("T1", text, None)]);
            let limits = check.options.limits(20_000);
            for (k, _) in moves.iter().enumerate().filter(|(_, m)| m.kind != MoveKind::Cut) {
                let (flat, time) = (&check.flats[k], check.time_of(k).unwrap());
                let swept: Vec<_> = moved(flat, &flat.chords[0], &check.bodies[0], false).collect();
                let bodies: Vec<_> = swept.iter().map(|m: &Moved| m.sweep).collect();
                let is_called = check.is_over_cleared_ground(k, &bodies, time, limits.radius_mm);
                let found = bodies.iter().map(|b| depth(b, time, &check.sweeps, &check.stock, &limits));
                let found: Vec<_> = found.collect();
                let is_hit = found.iter().any(|d| d.found_mm > limits.radius_mm);
                assert!(!(is_called && is_hit), "{text} {:?}: {found:?}", moves[k]);
                called += u32::from(is_called);
                clear += u32::from(found.iter().all(|d| d.bound_mm <= limits.radius_mm));
            }
        }
    }
    assert!(clear > 50 && f64::from(called) > 0.8 * f64::from(clear), "{called} of {clear}");
}

/// A ring leaves an island: a way across it is not over cleared ground, one along the ring is, and one across before the island went.
#[test]
fn an_island_is_seen() {
    let ring = |radius: f64| {
        let at = |k: u32| {
            let (sine, cosine) = (TAU * f64::from(k) / 24.0).sin_cos();
            [20.0 + radius * cosine, 20.0 + radius * sine, 5.0]
        };
        polyline(MoveKind::Cut, &(0..=24).map(at).collect::<Vec<_>>())
    };
    let mut moves = ring(12.0);
    let across = straight(MoveKind::Link, [8.0, 20.0, 5.0], [32.0, 20.0, 5.0]);
    let up = straight(MoveKind::Link, [32.0, 20.0, 5.0], [32.0, 20.0, 30.0]);
    moves.extend([across.clone(), up]);
    moves.extend([ring(4.0), vec![across]].concat());
    let moves = numbered(moves);
    let check = check(block([0.0; 3], [40.0, 40.0, 20.0]), &moves, &[tool("T1", "bull:10:1", None)]);
    let is_cleared = |k: usize| {
        let swept = moved(&check.flats[k], &check.flats[k].chords[0], &check.bodies[0], false);
        let bodies: Vec<_> = swept.map(|m| m.sweep).collect();
        check.is_over_cleared_ground(k, &bodies, check.time_of(k).unwrap(), 0.045)
    };
    assert!(!is_cleared(24) && is_cleared(25) && is_cleared(moves.len() - 1));
}
