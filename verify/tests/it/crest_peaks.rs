//! The highest crest against what is left on a dense grid, by distances from the paths alone.

use crate::synthetic::{R, along, check, job, model, program, rectangle, straight};
use claymill_nurbs::{Curve3, KnotVector, Point3};
use claymill_toolpath::Move;
use claymill_toolpath::MoveKind::{Cut, Link};

const STEP: f64 = 1.264_278_450_5;
/// The plate.
const SIZE: (f64, f64) = (40.0, 20.0);

fn at(x: f64, y: f64) -> Point3 {
    Point3::new(x, y, R)
}

/// Paths of the ball's centre in plan, by many short pieces.
fn pieces(moves: &[Move]) -> Vec<[[f64; 2]; 2]> {
    let mut all = Vec::new();
    for m in moves {
        let curve = m.curve().unwrap();
        let (a, b) = curve.domain();
        let count = if m.degree == 1 { 1 } else { 4000 };
        let at = |k: i32| {
            let p = curve.point(a + (b - a) * f64::from(k) / f64::from(count));
            [p.x, p.y]
        };
        all.extend((0..count).map(|k| [at(k), at(k + 1)]));
    }
    all
}

fn away(p: [f64; 2], [a, b]: &[[f64; 2]; 2]) -> f64 {
    let (d, m) = ([b[0] - a[0], b[1] - a[1]], [p[0] - a[0], p[1] - a[1]]);
    let t = ((m[0] * d[0] + m[1] * d[1]) / (d[0] * d[0] + d[1] * d[1])).clamp(0.0, 1.0);
    (m[0] - d[0] * t).hypot(m[1] - d[1] * t)
}

/// What is left at most on the plate: the farthest place from all paths, on a grid that is refined about the worst places.
fn highest(moves: &[Move]) -> f64 {
    let pieces = pieces(moves);
    let farthest =
        |p: [f64; 2], near: &[[[f64; 2]; 2]]| near.iter().map(|s| away(p, s)).fold(f64::INFINITY, f64::min);
    let coarse = 0.1;
    let mut cells: Vec<(f64, [f64; 2])> = Vec::new();
    for i in 0..=(SIZE.0 / coarse) as u32 {
        let x = f64::from(i) * coarse;
        let column: Vec<_> = pieces
            .iter()
            .filter(|s| (s[0][0].min(s[1][0]) - 3.0..s[0][0].max(s[1][0]) + 3.0).contains(&x))
            .copied()
            .collect();
        for j in 0..=(SIZE.1 / coarse) as u32 {
            let p = [x, f64::from(j) * coarse];
            cells.push((farthest(p, &column), p));
        }
    }
    cells.sort_by(|a, b| b.0.total_cmp(&a.0));
    let fine = 0.005;
    let mut most: f64 = 0.0;
    for (_, c) in &cells[..40] {
        let near: Vec<_> = pieces.iter().filter(|s| away(*c, s) < 3.0).copied().collect();
        for i in -20..=20 {
            for j in -20..=20 {
                let p = [c[0] + fine * f64::from(i), c[1] + fine * f64::from(j)];
                if (0.0..=SIZE.0).contains(&p[0]) && (0.0..=SIZE.1).contains(&p[1]) {
                    most = most.max(farthest(p, &near));
                }
            }
        }
    }
    R - (R * R - most * most).sqrt()
}

#[track_caller]
fn assert_highest_is_found(moves: Vec<Move>) -> f64 {
    let plate = model([rectangle((0.0, SIZE.0), (0.0, SIZE.1), 0.0)]);
    let exact = highest(&moves);
    let v = check(&plate, &job(&plate), &program(moves));
    let found = v.scallop.crests.max_mm;
    approx::assert_relative_eq!(found, exact, max_relative = 0.01);
    assert!(v.scallop.crests.max_at.is_some());
    found
}

fn rows(x: (f64, f64), first: u32) -> Vec<Move> {
    let row = |k: u32| {
        let y = STEP * f64::from(k) - 0.3;
        straight(Cut, first + k, at(x.0, y), at(x.1, y))
    };
    (0..17).map(row).collect()
}

#[test]
fn where_rows_end_beside_another_pass() {
    // No two passes have a crest there: the balls at the ends of the rows and the one along the other meet in points.
    for gap in [0.7, 0.9, 1.1, 1.3] {
        let mut moves = rows((0.0, 14.03), 0);
        for k in 0..22 {
            let x = 14.03 + gap + STEP * f64::from(k);
            moves.push(straight(Cut, 100 + k, at(x, 0.0), at(x, SIZE.1)));
        }
        let found = assert_highest_is_found(moves);
        assert!(found > 1.01 * 0.02 || gap < 0.8, "{gap}: {found}");
    }
}

#[test]
fn where_passes_fan_out() {
    // The highest place is at the very end, between two samples.
    let fan = |k: u32| {
        let y = STEP * f64::from(k) - 0.3;
        straight(Cut, k, at(0.0, 0.93 * y), at(SIZE.0, 1.04 * y))
    };
    assert_highest_is_found((0..20).map(fan).collect());
}

/// A pass with a bow aside, half a millimetre wide on either side of a place, so that no sample need fall upon it.
fn bowed(pass: u32, y: f64, x: f64, by: f64) -> Move {
    let half = 0.8;
    let points = vec![
        at(0.0, y),
        at(x / 3.0, y),
        at(x - 2.0 * half, y),
        at(x - half, y),
        at(x - 0.3 * half, y + by),
        at(x + 0.3 * half, y + by),
        at(x + half, y),
        at(x + 2.0 * half, y),
        at(x + (SIZE.0 - x) / 1.5, y),
        at(SIZE.0, y),
    ];
    let (a, b) = (x - half, x + half);
    let knots =
        vec![0.0, 0.0, 0.0, 0.0, a - 0.1, a, x - 0.1, x + 0.1, b, b + 0.1, SIZE.0, SIZE.0, SIZE.0, SIZE.0];
    along(Cut, pass, &Curve3::new(KnotVector::new(3, knots).unwrap(), points, None).unwrap())
}

#[test]
fn between_two_samples() {
    for x in [17.1, 18.0, 18.55, 19.3] {
        let mut moves = rows((0.0, SIZE.0), 0);
        moves[8] = bowed(8, STEP * 8.0 - 0.3, x, 0.35);
        let found = assert_highest_is_found(moves);
        assert!(found > 1.1 * 0.02, "{found}");
    }
}

#[test]
fn links_cut_too() {
    // Between the ends of rows that are linked on one side and not on the other.
    let mut moves = rows((1.0, SIZE.0 - 1.0), 0);
    for k in 0..16 {
        let x = if k % 2 == 0 { SIZE.0 - 1.0 } else { 1.0 };
        let y = |k: u32| STEP * f64::from(k) - 0.3;
        moves.push(straight(Link, k + 1, at(x, y(k)), at(x, y(k + 1))));
    }
    moves.push(straight(Cut, 50, at(-0.1, 0.0), at(-0.1, SIZE.1)));
    moves.push(straight(Cut, 51, at(SIZE.0 + 0.1, 0.0), at(SIZE.0 + 0.1, SIZE.1)));
    assert_highest_is_found(moves);
}
