//! Millions of evaluations per second of CPU time on one core: `evaluate [REPEATS]` prints the best of so many, a line
//! a kind of surface. The columns: degrees, rational or not, leaves in bulk (with second derivatives, unit normal and
//! both fundamental forms), leaves point by point, the surface itself point by point (both with second derivatives),
//! and `z` of the point and of `Suv` at (0.3, 0.6) for comparing with others.

use std::hint::black_box;
use std::time::Instant;

use claymill_nurbs::{Jet, KnotVector, LANES, Leaves, NurbsSurface, Places, Point3, Shapes};
use claymill_tests::thread_cpu_s;

/// As many points as stay in the fastest caches with what comes out of them.
const COUNT: usize = 128;

/// A bulged panel of one piece.
fn panel(p: usize, q: usize, rational: bool) -> NurbsSurface {
    let (mut points, mut weights) = (Vec::new(), Vec::new());
    for i in 0..=p {
        for j in 0..=q {
            let (x, y) = (i as f64 / p as f64, j as f64 / q as f64);
            let z = 20.0 * (1.3 * x).sin() + 15.0 * (1.7 * y).cos();
            points.push(Point3::new(1500.0 + 60.0 * x, 700.0 + 50.0 * y, 300.0 + z));
            weights.push(1.0 + 0.2 * (x - y * y));
        }
    }
    let knots = |degree| KnotVector::clamped_uniform(degree, degree + 1);
    NurbsSurface::new(knots(p), knots(q), points, rational.then_some(weights)).expect("the panel is sound")
}

/// Millions of evaluations a second, best of `repeats`, when `work` does `COUNT` of them.
fn rate(repeats: usize, mut work: impl FnMut()) -> f64 {
    let start = Instant::now();
    let mut seconds = |rounds: usize| {
        let before = thread_cpu_s(start);
        (0..rounds).for_each(|_| work());
        thread_cpu_s(start) - before
    };
    let mut rounds = 100;
    while seconds(rounds) < 0.02 {
        rounds *= 2;
    }
    let least = (0..repeats).map(|_| seconds(rounds)).fold(f64::INFINITY, f64::min);
    (COUNT * rounds) as f64 / least * 1e-6
}

fn main() {
    let repeats = std::env::args().nth(1).and_then(|n| n.parse().ok()).unwrap_or(15);
    for (p, q) in [(1, 1), (2, 2), (3, 3), (3, 5), (5, 5), (7, 7), (15, 15)] {
        for rational in [false, true] {
            let surface = panel(p, q, rational);
            let leaves = Leaves::new(&surface);
            let leaf = &leaves.as_slice()[0];
            let place = |k: usize| {
                let at = |l: usize, step: f64| ((k * LANES + l) as f64 * step).fract();
                Places { u: std::array::from_fn(|l| at(l, 0.618)), v: std::array::from_fn(|l| at(l, 0.755)) }
            };
            let places: Vec<Places> = (0..COUNT / LANES).map(place).collect();
            let mut shapes = vec![Shapes::default(); places.len()];
            let batch = rate(repeats, || black_box(leaf).shapes(black_box(&places), black_box(&mut shapes)));
            let each = |jet: &dyn Fn(f64, f64) -> Jet| {
                for (&u, &v) in places.iter().flat_map(|b| b.u.iter().zip(&b.v)) {
                    black_box(jet(u, v));
                }
            };
            let single = rate(repeats, || each(&|u, v| leaves.jet(u, v)));
            let plain = rate(repeats, || each(&|u, v| surface.jet(u, v)));
            let check = leaves.jet(0.3, 0.6);
            println!(
                "{p}x{q} {} {batch:.1} {single:.2} {plain:.2} {:.9} {:.9}",
                u8::from(rational),
                check.p.z,
                check.suv.z
            );
        }
    }
}
