//! Closest-point queries per second on a car-like skin: 60 × 60 bicubic patches of about 45 mm.

use std::hint::black_box;

use claymill_nurbs::{
    ClosestPoints, Face, Hint, KnotVector, Model, NurbsSurface, Point3, Source, SurfaceKind, Vector3,
};
use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

const PATCHES: usize = 60;
const QUERIES: usize = 1000;

/// One quarter of a superellipsoid, 3 × 1.5 × 0.9 m, cut along its own parameters.
fn skin() -> Model {
    let power = |x: f64| x.signum() * x.abs().powf(0.7);
    let place = |a: f64, b: f64| {
        let (a, b) = (0.05 + 1.4 * a, 0.05 + 1.4 * b);
        Point3::new(
            3000.0 * power(a.cos()) * power(b.cos()),
            1500.0 * power(a.sin()) * power(b.cos()),
            900.0 * power(b.sin()) + 3.0 * (a * 60.0).sin() * (b * 45.0).sin(),
        )
    };
    let knots = KnotVector::clamped_uniform(3, 4);
    let patch = |k: usize| {
        let net = (0..16).map(|i| {
            let a = ((k / PATCHES) as f64 + (i / 4) as f64 / 3.0) / PATCHES as f64;
            let b = ((k % PATCHES) as f64 + (i % 4) as f64 / 3.0) / PATCHES as f64;
            place(a, b)
        });
        Face {
            surface: NurbsSurface::new(knots.clone(), knots.clone(), net.collect(), None)
                .expect("the net is sound"),
            loops: Vec::new(),
            reversed: false,
            kind: SurfaceKind::Nurbs,
            source: Source::default(),
        }
    };
    Model { faces: (0..PATCHES * PATCHES).map(patch).collect(), ..Model::default() }
}

/// Centres of a 10 mm ball that rests on the point `(u, v)` of a face.
fn ball(model: &Model, face: usize, u: f64, v: f64) -> Point3 {
    let jet = model.faces[face].surface.jet(u, v);
    jet.p + jet.normal().expect("the skin has normals everywhere") * 10.0
}

fn queries(c: &mut Criterion) {
    let model = skin();
    let index = ClosestPoints::new(&model);
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let mut group = c.benchmark_group("closest");
    group.throughput(Throughput::Elements(QUERIES as u64));

    let scattered: Vec<Point3> = (0..QUERIES)
        .map(|_| {
            let face = rng.random_range(0..model.faces.len());
            ball(&model, face, rng.random(), rng.random())
        })
        .collect();
    group.bench_function("incoherent, ball centres", |b| {
        b.iter(|| scattered.iter().filter_map(|p| index.closest(black_box(p), 20.0)).count());
    });

    let far: Vec<Point3> =
        (scattered.iter()).map(|p| p + Vector3::from_fn(|_, _| rng.random_range(-100.0..100.0))).collect();
    group.bench_function("incoherent, within 100 mm", |b| {
        b.iter(|| far.iter().filter_map(|p| index.closest(black_box(p), f64::INFINITY)).count());
    });

    // Steps of about 1.5 mm across 30 patches.
    let path: Vec<Point3> = (0..QUERIES)
        .map(|k| {
            let along = k as f64 / QUERIES as f64 * 30.0;
            ball(&model, (10 + along as usize) * PATCHES + 20, along.fract(), 0.3 + 0.001 * along)
        })
        .collect();
    group.bench_function("coherent, 1.5 mm steps", |b| {
        b.iter(|| {
            let mut hint = Hint::default();
            path.iter().filter_map(|p| index.closest_from(black_box(p), 20.0, &mut hint)).count()
        });
    });
    group.finish();

    c.bench_function("build, 3600 patches", |b| b.iter(|| ClosestPoints::new(black_box(&model))));
}

criterion_group!(benches, queries);
criterion_main!(benches);
