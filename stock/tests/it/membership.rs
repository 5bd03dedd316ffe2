//! What is removed was swept, and what was swept is removed: random tools, axes and ways.

use claymill_nurbs::{Point3, Vector3};
use claymill_stock::{Family, Stock, Sweep, ToolBody};
use claymill_toolpath::{Holder, Tool};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

use super::oracle::{Outline, Parts, distance, outlines};
use super::{bounds, tool};

/// Rounding of coordinates and of the oracle, mm: 0.02 nm.
const ROUNDING_MM: f64 = 2e-8;
/// What is this far inside of a sweep is removed, mm: two quanta and what a grazing ray makes of them.
const INSIDE_MM: f64 = 1e-3;
const TOOLS: [&str; 10] = [
    "ball:6",
    "ball:1.5",
    "flat:5",
    "flat:0.7",
    "bull:8:2",
    "bull:5:4.5",
    "ball:3,taper:5,length:14,shank:7",
    "flat:2,taper:20,length:9,shank:10",
    "bull:4:1,taper:40,length:6,shank:5",
    "flat:6,length:8,shank:4",
];

struct Case {
    tool: &'static str,
    parts: Parts,
    axis: Vector3,
    from: Point3,
    to: Point3,
}

fn direction(rng: &mut ChaCha8Rng) -> Vector3 {
    let mut v = Vector3::zeros();
    match rng.random_range(0..4) {
        0 => v[rng.random_range(0..3)] = if rng.random() { 1.0 } else { -1.0 },
        1 => {
            let (i, angle) = (rng.random_range(0..3), rng.random_range(0.0..6.3_f64));
            (v[i], v[(i + 1) % 3]) = angle.sin_cos();
        }
        _ => v = Vector3::from_fn(|_, _| rng.random_range(-1.0..1.0)),
    }
    if v.norm() > 1e-3 { v.normalize() } else { Vector3::z() }
}

fn case(rng: &mut ChaCha8Rng) -> Case {
    let axis = direction(rng);
    let from = Point3::from([0; 3].map(|_| rng.random_range(-14.0..14.0)));
    let length = rng.random_range(0.0..25.0);
    let way = match rng.random_range(0..8) {
        0 => Vector3::zeros(),
        1 => axis * length,
        2 => axis * -length,
        3 | 4 => {
            let across = axis.cross(&direction(rng));
            if across.norm() > 1e-3 { across.normalize() * length } else { Vector3::x() }
        }
        // Nearly along the axis, nearly across it.
        5 => (axis + direction(rng) * 10f64.powf(rng.random_range(-14.0..-2.0))) * length,
        6 => {
            let across = axis.cross(&direction(rng));
            (across + axis * 10f64.powf(rng.random_range(-14.0..-2.0))) * length
        }
        _ => direction(rng) * length,
    };
    let parts = [Parts::End, Parts::Cutting, Parts::Whole][rng.random_range(0..3)];
    Case { tool: TOOLS[rng.random_range(0..TOOLS.len())], parts, axis, from, to: from + way }
}

fn body(tool: &Tool, holder: &Holder, parts: Parts) -> ToolBody {
    match parts {
        Parts::End => ToolBody::end(tool),
        Parts::Cutting => ToolBody::cutting(tool),
        Parts::Whole => ToolBody::whole(tool, Some(holder)),
    }
    .unwrap()
}

/// The intervals between those of a list, from end to end.
fn gaps(list: &[[f64; 2]], [low, high]: [f64; 2]) -> Vec<[f64; 2]> {
    let mut ends = vec![low];
    ends.extend(list.iter().flatten());
    ends.push(high);
    ends.chunks(2).map(|e| [e[0], e[1]]).filter(|e| e[0] < e[1]).collect()
}

/// Checks points of random rays; returns how many of each kind.
fn check(case: &Case, outlines: &[Outline], stock: &Stock, rng: &mut ChaCha8Rng) -> [usize; 2] {
    let mut counts = [0, 0];
    let swept = |p: &Point3| distance(outlines, &case.axis, &case.from, &case.to, p);
    let about = || {
        format!("{} {:?} axis {:?} from {:?} to {:?}", case.tool, case.parts, case.axis, case.from, case.to)
    };
    let grid = stock.grid();
    for _ in 0..60 {
        let family = Family::ALL[rng.random_range(0..3)];
        let (k, across) = (family.index(), family.across());
        let cell = across.map(|axis| rng.random_range(0..grid.cells()[axis]));
        let at = |t: f64| {
            let mut p = Point3::origin();
            for (axis, cell) in across.iter().zip(cell) {
                p[*axis] = grid.bounds().min[*axis] + (f64::from(cell) + 0.5) * grid.pitch_mm();
            }
            p[k] = t;
            p
        };
        let list = stock.on_ray(family, cell);
        for [low, high] in gaps(&list, [grid.bounds().min[k], grid.bounds().max[k]]) {
            let mut places = vec![low, high];
            places.extend((0..12).map(|_| rng.random_range(low..high)));
            for t in places {
                let off = swept(&at(t));
                assert!(off <= ROUNDING_MM, "{family:?} {cell:?} at {t}: {off:e} outside; {}", about());
                counts[0] += 1;
            }
        }
        for [low, high] in list {
            for t in [low, high, rng.random_range(low..high)] {
                let p = at(t);
                let is_deep = (0..27).all(|i| {
                    let step = Vector3::new(f64::from(i % 3), f64::from(i / 3 % 3), f64::from(i / 9));
                    swept(&(p + (step - Vector3::repeat(1.0)) * INSIDE_MM)) == 0.0
                });
                assert!(!is_deep, "{family:?} {cell:?} at {t}: swept, and still there; {}", about());
                counts[1] += 1;
            }
        }
    }
    counts
}

/// A tool on its way through a small block, with what it cut.
fn with_stock<T>(seed: u64, then: impl Fn(&Case, &[Outline], &ToolBody, Stock, &mut ChaCha8Rng) -> T) -> T {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let case = case(&mut rng);
    let tool = tool(case.tool);
    let holder = Holder::parse("17:20-30x6,26-12x7,22x5", &tool).unwrap();
    let body = body(&tool, &holder, case.parts);
    let min = [0; 3].map(|_| f64::from(rng.random_range(-200_000..-190_000)) * 1e-4);
    let stock = Stock::block(&bounds(min, min.map(|c| c + 39.0)), 1.3).unwrap();
    then(&case, &outlines(&tool, Some(&holder), case.parts), &body, stock, &mut rng)
}

fn removed_and_kept(seeds: std::ops::Range<u64>) -> [usize; 2] {
    let of_case = |seed: u64| {
        with_stock(seed, |case, outlines, body, mut stock, rng| {
            stock.cut(&Sweep::new(body, case.axis, case.from, case.to).unwrap());
            check(case, outlines, &stock, rng)
        })
    };
    let sum = |a: [usize; 2], b: [usize; 2]| [a[0] + b[0], a[1] + b[1]];
    let counts = seeds.into_par_iter().map(of_case).reduce(|| [0, 0], sum);
    println!("points removed and kept: {counts:?}");
    counts
}

#[test]
fn what_is_removed_was_swept_and_what_was_swept_is_removed() {
    let counts = removed_and_kept(0..1000);
    assert!(counts.iter().all(|c| *c > 100_000), "{counts:?}");
}

#[test]
#[ignore = "the same with five million points: two minutes"]
fn what_is_removed_was_swept_and_what_was_swept_is_removed_at_length() {
    let counts = removed_and_kept(1000..16_000);
    assert!(counts.iter().all(|c| *c > 1_500_000), "{counts:?}");
}

/// A move is clear only of stock that is further than the margin, and never of nothing.
#[test]
fn a_clear_move_keeps_its_margin() {
    let of_case = |seed: u64| {
        with_stock(seed, |case, outlines, body, stock, rng| {
            // A smaller block, so that some moves pass it.
            let grid = *stock.grid();
            let half = rng.random_range(2.0..9.0);
            let small = Stock::from_rays(grid, |ray| {
                ray.across_mm.iter().all(|c| c.abs() < half).then(|| vec![[-half, half]])
            })
            .unwrap();
            let margin = rng.random_range(0.0..6.0);
            let sweep = Sweep::new(body, case.axis, case.from, case.to).unwrap();
            let is_clear = small.is_clear(&sweep, margin).unwrap();
            let mut nearest = f64::INFINITY;
            for _ in 0..300 {
                let family = Family::ALL[rng.random_range(0..3)];
                let cell = family.across().map(|axis| rng.random_range(0..grid.cells()[axis]));
                let mut p = Point3::origin();
                for (axis, cell) in family.across().iter().zip(cell) {
                    p[*axis] = grid.bounds().min[*axis] + (f64::from(cell) + 0.5) * grid.pitch_mm();
                }
                for [low, high] in small.on_ray(family, cell) {
                    p[family.index()] = rng.random_range(low..high);
                    nearest = nearest.min(distance(outlines, &case.axis, &case.from, &case.to, &p));
                }
            }
            assert!(!is_clear || nearest > margin - 1e-3, "{seed}: {nearest} within {margin}");
            // Sharp rims grow by up to √2 and more at pointed ones: what is further than that is clear.
            [is_clear, !is_clear && nearest > 4.0 * margin + 4.0].map(usize::from)
        })
    };
    let sum = |a: [usize; 2], b: [usize; 2]| [a[0] + b[0], a[1] + b[1]];
    let [clear, wrong] = (20_000..21_500_u64).into_par_iter().map(of_case).reduce(|| [0, 0], sum);
    println!("clear {clear} of 1500");
    assert!(clear > 200 && wrong == 0, "{clear} {wrong}");
}

/// Chords within δ and a body smaller by δ remove nothing that the tool on the curve does not sweep.
#[test]
fn a_smaller_body_on_chords_stays_within_the_sweep_of_the_curve() {
    let mut rng = ChaCha8Rng::seed_from_u64(8);
    let mut removed = 0;
    for text in ["ball:6", "flat:5", "bull:8:2"] {
        let tool = tool(text);
        let outlines = outlines(&tool, None, Parts::Cutting);
        // A circle of radius 9 about the middle, slightly rising, as 7 chords: their height is r·(1 − cos(π/7)).
        let (radius, count) = (9.0, 7);
        let angle = std::f64::consts::TAU / f64::from(count);
        let delta = radius * (1.0 - (0.5 * angle).cos());
        let on_circle = |a: f64| Point3::new(radius * a.cos(), radius * a.sin(), -4.0);
        let body = ToolBody::cutting(&tool).unwrap().offset(-delta).unwrap();
        let mut stock = Stock::block(&bounds([-20.0; 3], [20.0; 3]), 0.8).unwrap();
        let sweeps: Vec<_> = (0..count)
            .map(|i| {
                let a = angle * f64::from(i);
                Sweep::new(&body, Vector3::z(), on_circle(a), on_circle(a + angle)).unwrap()
            })
            .collect();
        stock.cut_all(&sweeps);
        for _ in 0..3000 {
            let cell = [0; 2].map(|_| rng.random_range(0..50));
            for [low, high] in gaps(&stock.on_ray(Family::X, cell), [-20.0, 20.0]) {
                for t in [low, high, 0.5 * (low + high)] {
                    let p = Point3::new(
                        t,
                        -20.0 + 0.8 * (f64::from(cell[0]) + 0.5),
                        -20.0 + 0.8 * (f64::from(cell[1]) + 0.5),
                    );
                    // Nearest place of the circle to the foot of a vertical axis: at the same angle.
                    let foot = on_circle(p.y.atan2(p.x));
                    assert!(
                        distance(&outlines, &Vector3::z(), &foot, &foot, &p) <= ROUNDING_MM,
                        "{text} {p:?}"
                    );
                    removed += 1;
                }
            }
        }
    }
    assert!(removed > 5000, "{removed}");
}
