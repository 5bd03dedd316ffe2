//! Membership of random pieces against brute force that knows nothing of closed forms.

use super::super::body::Shape;
use super::super::piece::Sweep;
use super::*;

fn random_shape(r: &mut Random) -> Shape {
    let corner = r.between(0.2, 8.0);
    match (r.unit() * 6.0) as u32 {
        0 => Shape::End { disc: 0.0, corner, centre: corner, cap: f64::INFINITY },
        1 => Shape::End { disc: r.between(0.1, 9.0), corner, centre: corner, cap: f64::INFINITY },
        2 => Shape::End {
            disc: r.between(0.0, 9.0),
            corner,
            centre: corner,
            cap: corner * r.between(1.0, 2.0),
        },
        3 => {
            let (low, radius) = (r.between(-5.0, 20.0), r.between(0.2, 10.0));
            Shape::frustum([low, radius], [low + r.between(0.5, 40.0), radius])
        }
        _ => {
            let low = r.between(-5.0, 20.0);
            Shape::frustum([low, r.between(0.0, 10.0)], [low + r.between(0.5, 40.0), r.between(0.0, 20.0)])
        }
    }
}

fn random_sweep(r: &mut Random) -> Sweep {
    let axis = if r.unit() < 0.3 { Vector3::z() } else { r.direction() };
    let way = match (r.unit() * 5.0) as u32 {
        0 => axis * r.between(-30.0, 30.0),
        1 => r.direction().cross(&axis) * r.between(0.0, 40.0),
        2 => Vector3::zeros(),
        _ => r.vector(40.0),
    };
    Sweep { start: Point3::from(r.vector(500.0)), way, axis, shape: random_shape(r) }
}

/// How far a point is outside of the body at a place of its way: positive outside, negative inside.
fn outside_at(sweep: &Sweep, p: &Point3, s: f64) -> f64 {
    let q = p - (sweep.start + sweep.way * s);
    let (z, x) = (q.dot(&sweep.axis), q.cross(&sweep.axis).norm());
    match sweep.shape {
        Shape::End { disc, corner, centre, cap } => {
            let foot = x.min(disc);
            ((x - foot).powi(2) + (z - centre).powi(2)).sqrt().max(0.0) - corner
        }
        .max(z - cap),
        Shape::Frustum { low, high, radius, slope, .. } => {
            (x - (radius + slope * (z - low))).max(low - z).max(z - high)
        }
    }
}

/// The least of it along the way: by the golden section, for it is convex.
fn outside(sweep: &Sweep, p: &Point3) -> f64 {
    let ratio = 0.5 * (5f64.sqrt() - 1.0);
    let (mut a, mut b) = (0.0, 1.0);
    let mut least = outside_at(sweep, p, 0.0).min(outside_at(sweep, p, 1.0));
    for _ in 0..90 {
        let (c, d) = (b - ratio * (b - a), a + ratio * (b - a));
        let (at_c, at_d) = (outside_at(sweep, p, c), outside_at(sweep, p, d));
        least = least.min(at_c).min(at_d);
        if at_c < at_d { b = d } else { a = c }
    }
    least
}

/// A point near the skin of a sweep, mostly.
fn near(r: &mut Random, sweep: &Sweep) -> Point3 {
    let [low, high, radius] = sweep.shape.extent();
    let s = r.between(-0.1, 1.1);
    let at = sweep.start + sweep.way * s + sweep.axis * r.between(low - 1.0, high + 1.0);
    at + r.direction().cross(&sweep.axis).normalize() * r.between(0.0, 1.3 * radius + 0.1)
}

#[test]
fn membership_agrees_with_brute_force() {
    let mut r = Random(7);
    let (mut inside, mut doubtful) = (0, 0);
    for _ in 0..2000 {
        let sweep = random_sweep(&mut r);
        for _ in 0..50 {
            let p = near(&mut r, &sweep);
            let brute = outside(&sweep, &p);
            if brute.abs() <= 1e-9 {
                doubtful += 1;
                continue;
            }
            assert_eq!(sweep.holds(&p), brute < 0.0, "{sweep:?} {p} {brute}");
            assert_eq!(sweep.signed_mm(&p) <= 0.0, brute < 0.0, "{sweep:?} {p} {brute}");
            inside += u32::from(brute < 0.0);
        }
    }
    assert!(inside > 20_000 && inside < 80_000 && doubtful < 10, "{inside} {doubtful}");
}

/// Without the help of convexity: whatever any of many places holds, the sweep holds, and hardly more.
#[test]
fn a_sweep_is_the_union_of_its_places() {
    let mut r = Random(11);
    for _ in 0..300 {
        let sweep = random_sweep(&mut r);
        for _ in 0..10 {
            let p = near(&mut r, &sweep);
            let places = 2000;
            let least = (0..=places)
                .map(|k| outside_at(&sweep, &p, f64::from(k) / f64::from(places)))
                .fold(f64::INFINITY, f64::min);
            let blur = 40.0 * sweep.way.norm() / f64::from(places);
            if least < 0.0 {
                assert!(sweep.holds(&p), "{sweep:?} {p} {least}");
            } else if least > blur {
                assert!(!sweep.holds(&p), "{sweep:?} {p} {least}");
            }
        }
    }
}

/// The signed distance never changes faster than the point, the box holds the sweep, and lines are cut where they should be.
#[test]
fn distances_boxes_and_lines_are_true() {
    let mut r = Random(13);
    for _ in 0..2000 {
        let sweep = random_sweep(&mut r);
        let (p, q) = (near(&mut r, &sweep), near(&mut r, &sweep));
        let change = (sweep.signed_mm(&p) - sweep.signed_mm(&q)).abs();
        assert!(change <= (p - q).norm() + 1e-9, "{sweep:?} {p} {q}");
        // Whatever the sweep holds is no nearer than said, and something is as near.
        let away = sweep.signed_mm(&p);
        if away > 1e-6 {
            let held: Vec<Point3> =
                (0..40).map(|_| near(&mut r, &sweep)).filter(|q| sweep.holds(q)).collect();
            assert!(held.iter().all(|q| (p - q).norm() >= away - 1e-9), "{sweep:?} {p}");
            let grown = |by: f64| sweep.shape.grown(by).map(|shape| Sweep { shape, ..sweep });
            assert!(grown(1.001 * away).is_none_or(|g| g.holds(&p)), "{sweep:?} {p} {away}");
        }
        if sweep.holds(&p) {
            assert!(sweep.bounds().distance_squared(&p) == 0.0, "{sweep:?} {p}");
        }
        let n = r.direction();
        if sweep.holds(&p) {
            let t = sweep.exit(&p, &n, 0.0, -30.0);
            assert!(
                sweep.holds(&(p + n * t)) && (t == -30.0 || !sweep.holds(&(p + n * (t - 1e-7)))),
                "{sweep:?} {p} {n}"
            );
        }
    }
}

/// Grown and shrunk bodies keep their promise.
#[test]
fn grown_bodies_hold_what_is_near_and_shrunk_ones_keep_away() {
    let mut r = Random(17);
    for _ in 0..2000 {
        let sweep = random_sweep(&mut r);
        let by = r.between(0.001, 0.1);
        let (p, step) = (near(&mut r, &sweep), r.direction() * (0.999 * by));
        let with = |shape: Option<Shape>| shape.map(|shape| Sweep { shape, ..sweep });
        let (grown, shrunk) = (with(sweep.shape.grown(by)), with(sweep.shape.grown(-by)));
        if sweep.holds(&p) {
            assert!(grown.is_none_or(|g| g.holds(&(p + step))), "{sweep:?} {p}");
        }
        if shrunk.is_some_and(|s| s.holds(&p)) {
            assert!(sweep.holds(&(p + step)), "{sweep:?} {p} {by}");
        }
    }
}

/// The tree finds the earliest piece, as a look at all of them does.
#[test]
fn the_earliest_cut_is_that_of_a_look_at_all_moves() {
    let mut r = Random(19);
    let moves: Vec<Move> = (0..400)
        .map(|k| {
            let from = Point3::from(r.vector(60.0));
            let kind = if k % 7 == 3 { MoveKind::Rapid } else { MoveKind::Cut };
            let m = Move::straight(kind, from, from + r.vector(20.0), r.direction(), 100.0);
            Move { tool: if k % 3 == 0 { "T1" } else { "T2" }.into(), seq: k, ..m }
        })
        .collect();
    let tools = [
        tool("T1", "bull:4:1,length:12,shank:6", None),
        tool("T2", "ball:3,taper:5,length:20,shank:10", None),
    ];
    let check = check(block([-70.0; 3], [70.0; 3]), &moves, &tools);
    let mut cut = 0;
    for _ in 0..20_000 {
        let p = Point3::from(r.vector(70.0));
        let all = (0..check.sweeps.count()).filter(|&i| check.sweeps.piece(i).holds(&p));
        let earliest = all.map(|i| check.sweeps.time_of_piece(i)).min();
        assert_eq!(check.cut_at(&p).map(|c| c.time), earliest, "{p}");
        cut += u32::from(earliest.is_some());
    }
    assert!(cut > 3000, "{cut}");
}
