//! Metres of path a second, cut by a ball of 10 mm at a pitch of 1 mm: all three families of rays, and a height map that the
//! same moves lower at the same pitch.

use std::hint::black_box;

use claymill_nurbs::{Aabb, Point3, Vector3};
use claymill_stock::{Stock, Sweep, ToolBody};
use claymill_toolpath::{Holder, Tool};
use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use rayon::prelude::*;

const SIDE_MM: f64 = 400.0;
const RADIUS_MM: f64 = 10.0;
/// Distance of rows, length of pieces, mm.
const STEP_MM: f64 = 5.0;
const PIECE_MM: f64 = 8.0;

/// Tips along rows over gentle waves, 3 to 7 mm deep.
fn pieces() -> Vec<[Point3; 2]> {
    let tip = |x: f64, y: f64| Point3::new(x, y, 45.0 + 2.0 * (x / 40.0).sin() * (y / 55.0).cos());
    let counts = [SIDE_MM / PIECE_MM, SIDE_MM / STEP_MM].map(|n| n as u32);
    let row = |y: f64| {
        (0..counts[0]).map(move |i| {
            let x = PIECE_MM * f64::from(i);
            [tip(x, y), tip(x + PIECE_MM, y)]
        })
    };
    (0..counts[1]).flat_map(|j| row(STEP_MM * (f64::from(j) + 0.5))).collect()
}

/// The plain loop: a height for each cell, lowered to the ball at every millimetre of a piece.
fn lower(heights: &mut [f64], [from, to]: &[Point3; 2]) {
    let cells = SIDE_MM as i64;
    let steps = (to - from).norm().ceil();
    for step in 0..=steps as u32 {
        let tip = from + (to - from) * (f64::from(step) / steps);
        let range = |c: f64| {
            ((c - RADIUS_MM - 0.5).ceil().max(0.0) as i64)..=((c + RADIUS_MM - 0.5) as i64).min(cells - 1)
        };
        for j in range(tip.y) {
            for i in range(tip.x) {
                let (x, y) = (i as f64 + 0.5 - tip.x, j as f64 + 0.5 - tip.y);
                let square = RADIUS_MM * RADIUS_MM - x * x - y * y;
                if square > 0.0 {
                    let height = &mut heights[(j * cells + i) as usize];
                    *height = height.min(tip.z + RADIUS_MM - square.sqrt());
                }
            }
        }
    }
}

fn cut(c: &mut Criterion) {
    let pieces = pieces();
    let length_mm: f64 = pieces.iter().map(|p| (p[1] - p[0]).norm()).sum();
    let mut group = c.benchmark_group("cut");
    // Counted in metres: "elements" of the report are metres of path.
    group.throughput(Throughput::Elements((length_mm / 1e3).round() as u64));
    group.sample_size(20);

    let bounds = Aabb { min: Point3::origin(), max: Point3::new(SIDE_MM, SIDE_MM, 50.0) };
    let stock = Stock::block(&bounds, 1.0).expect("it fits");
    let tool: Tool = "ball:10".parse().expect("it is a tool");
    let bull: Tool = "bull:10:2".parse().expect("it is a tool");
    let bodies = [
        ("end", ToolBody::end(&tool)),
        ("end and flutes", ToolBody::cutting(&tool)),
        ("bull nose and flutes", ToolBody::cutting(&bull)),
    ];
    for (name, body) in bodies {
        let body = body.expect("it is sound");
        let sweep = |p: &[Point3; 2]| Sweep::new(&body, Vector3::z(), p[0], p[1]).expect("it is sound");
        let sweeps: Vec<Sweep<'_>> = pieces.iter().map(sweep).collect();
        for threads in [1, 2] {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads start");
            group.bench_function(format!("three families, {name}, {threads} threads"), |b| {
                b.iter(|| {
                    let mut later = stock.clone();
                    pool.install(|| later.cut_all(&sweeps));
                    black_box(later.is_empty())
                });
            });
        }
    }
    group.bench_function("height map", |b| {
        b.iter(|| {
            let mut heights = vec![50.0; (SIDE_MM * SIDE_MM) as usize];
            pieces.iter().for_each(|piece| lower(&mut heights, piece));
            black_box(heights[0])
        });
    });
    group.finish();
}

/// Pieces cut one after the other, each followed by a look at the shank and the holder: how passes are followed into a stock. The
/// limit is to cut all of them at once and then to look.
fn follow(c: &mut Criterion) {
    let pieces = pieces();
    let mut group = c.benchmark_group("follow");
    group.throughput(Throughput::Elements(pieces.len() as u64));
    group.sample_size(10);
    let bounds = Aabb { min: Point3::origin(), max: Point3::new(SIDE_MM, SIDE_MM, 50.0) };
    let stock = Stock::block(&bounds, 1.0).expect("it fits");
    let tool: Tool = "ball:10,length:30,shank:24".parse().expect("it is a tool");
    let holder = Holder::parse("60:27-34x50,63x26", &tool).expect("it is a holder");
    let cutting = ToolBody::cutting(&tool).expect("it is sound");
    let above = ToolBody::above(&tool, Some(&holder)).expect("it is sound");
    let sweep = |body, p: &[Point3; 2]| Sweep::new(body, Vector3::z(), p[0], p[1]).expect("it is sound");
    let [cuts, looks] =
        [&cutting, &above].map(|body| pieces.iter().map(|p| sweep(body, p)).collect::<Vec<_>>());
    group.bench_function("one by one", |b| {
        b.iter(|| {
            let mut later = stock.clone();
            let is_clear = |(cut, look): (&Sweep<'_>, &Sweep<'_>)| {
                later.cut(cut);
                later.is_clear(look, 1.0).expect("a margin")
            };
            black_box(cuts.iter().zip(&looks).map(is_clear).filter(|clear| *clear).count())
        });
    });
    group.bench_function("all at once", |b| {
        b.iter(|| {
            let mut later = stock.clone();
            later.cut_all(&cuts);
            let is_clear = |look: &&Sweep<'_>| later.is_clear(look, 1.0).expect("a margin");
            black_box(looks.par_iter().filter(is_clear).count())
        });
    });
    group.finish();
}

criterion_group!(benches, cut, follow);
criterion_main!(benches);
