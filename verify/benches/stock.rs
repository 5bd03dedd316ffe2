//! Building the swept pieces of a finish and asking them: about a kilometre of path in 2 mm chords.

use std::hint::black_box;

use claymill_nurbs::{Point3, Vector3};
use claymill_toolpath::{Move, MoveKind, Tool, ToolRecord};
use claymill_verify::stock::{InitialStock, StockCheck, StockOptions, StockProof, Thickness};
use criterion::{Criterion, Throughput, criterion_group, criterion_main};

/// Rows, and chords in a row of 2 mm.
const ROWS: usize = 357;
const CHORDS: usize = 751;
const SPACING_MM: f64 = 2.8;
const QUERIES: usize = 4096;

/// A wavy sheet of 1 × 1.5 m.
fn height(x: f64, y: f64) -> f64 {
    60.0 * (x * 0.006).sin() * (y * 0.005).cos()
}

/// Rows over it as straight moves, with a rapid above and one that comes too low.
fn moves() -> Vec<Move> {
    let place = |row: usize, k: usize| {
        let (x, y) = (2.0 * k as f64, SPACING_MM * row as f64);
        Point3::new(x, y, height(x, y))
    };
    let straight =
        |kind, a, b| Move { tool: "T1".into(), ..Move::straight(kind, a, b, Vector3::z(), 6000.0) };
    let row =
        |row: usize| (0..CHORDS - 1).map(move |k| straight(MoveKind::Cut, place(row, k), place(row, k + 1)));
    let mut all: Vec<Move> = (0..ROWS).flat_map(row).collect();
    let rapid = |z: f64| straight(MoveKind::Rapid, Point3::new(20.0, 20.0, z), Point3::new(1450.0, 950.0, z));
    all.extend([rapid(140.0), rapid(75.0), rapid(45.0)]);
    all
}

/// Points near the sheet, cut and uncut, spread by the golden ratios.
fn points() -> Vec<Point3> {
    let part = |n: usize, a: f64| (n as f64 * a).fract();
    (0..QUERIES)
        .map(|n| {
            let (x, y) = (1500.0 * part(n, 0.754_877_666), 999.0 * part(n, 0.569_840_291));
            Point3::new(x, y, height(x, y) - 2.0 + 14.0 * part(n, 0.618_033_989))
        })
        .collect()
}

fn bench(c: &mut Criterion) {
    let moves = moves();
    let record =
        |tool| ToolRecord { id: "T1".into(), tool, holder: None, setup_stick_out_mm: Default::default() };
    let tools = [record(Tool::ball(10.0))];
    let block = || {
        InitialStock::block(Point3::new(0.0, 0.0, -100.0), Point3::new(1500.0, 1000.0, 80.0))
            .expect("the block has sides")
    };
    let options = StockOptions::default();
    let made = || StockCheck::new(block(), &moves, &tools, &options, &|| true).expect("the moves are sound");
    let check = made();
    let (pieces, bytes) = check.pieces();
    eprintln!("{pieces} pieces, {:.1} MB", bytes as f64 * 1e-6);

    let mut group = c.benchmark_group("stock");
    group.sample_size(10);
    group.throughput(Throughput::Elements(pieces as u64));
    group.bench_function("build", |b| b.iter(|| black_box(made().pieces())));

    let points = points();
    group.throughput(Throughput::Elements(QUERIES as u64));
    group.bench_function("cut_at", |b| {
        b.iter(|| points.iter().filter(|p| check.cut_at(black_box(p)).is_some()).count());
    });
    group.bench_function("thickness", |b| {
        b.iter(|| {
            let up = Vector3::z();
            let over = |p: &Point3| check.thickness(&Point3::new(p.x, p.y, height(p.x, p.y)), &up, 20.0);
            points[..512].iter().filter(|p| over(p) != Thickness::Nothing).count()
        });
    });

    group.throughput(Throughput::Elements(1));
    let rapid = |k: usize| moves.len() - 3 + k;
    for (k, name, is_clear) in
        [(0, "rapid above", true), (1, "rapid low but clear", true), (2, "rapid into stock", false)]
    {
        let time = check.time_of(rapid(k)).expect("it is there");
        let found = check.rapid_is_clear(rapid(k), time).expect("it is there");
        eprintln!("{name}: {found:?}");
        assert_eq!(found == StockProof::Clear, is_clear);
        group.bench_function(name, |b| b.iter(|| check.rapid_is_clear(rapid(k), time)));
    }
    let cut = 180 * (CHORDS - 1) + 300;
    group.bench_function("engagement", |b| b.iter(|| check.engagement(cut, 1.0, 3.0, 2.0)));
    group.finish();
}

criterion_group!(benches, bench);
criterion_main!(benches);
