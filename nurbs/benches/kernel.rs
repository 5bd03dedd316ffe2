//! Speed of the kernel's inner loops: points and jets, triangulation, inside tests.

#[path = "../tests/it/shapes/mod.rs"]
mod shapes;

use std::hint::black_box;

use claymill_nurbs::{Domain, MeshOptions, tessellate};
use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use shapes::{circle, ellipse, face, panel, random_points, sphere};

fn evaluation(c: &mut Criterion) {
    let at: Vec<(f64, f64)> = random_points(1000).collect();
    let mut group = c.benchmark_group("evaluation");
    group.throughput(Throughput::Elements(at.len() as u64));
    for (name, surface) in [("bicubic", panel()), ("rational biquadratic", sphere(40.0))] {
        group.bench_function(format!("point, {name}"), |b| {
            b.iter(|| at.iter().map(|&(u, v)| surface.point(u, v).x).sum::<f64>());
        });
        group.bench_function(format!("jet, {name}"), |b| {
            b.iter(|| at.iter().map(|&(u, v)| surface.jet(u, v).suv.x).sum::<f64>());
        });
    }
    group.finish();
}

fn triangulation(c: &mut Criterion) {
    let options = MeshOptions { deviation_mm: 0.01, longest_edge_mm: f64::INFINITY };
    let trims = vec![ellipse((0.5, 0.5), 0.45, 0.3), circle((0.5, 0.5), 0.12)];
    let mut group = c.benchmark_group("triangles");
    group.sample_size(10);
    for (name, face) in [("whole panel", face(panel(), vec![])), ("trimmed panel", face(panel(), trims))] {
        let count = tessellate(&face, &options).map_or(0, |m| m.triangles.len());
        group.throughput(Throughput::Elements(count as u64));
        group.bench_function(name, |b| b.iter(|| tessellate(black_box(&face), &options)));
    }
    group.finish();
}

fn inside_test(c: &mut Criterion) {
    let at: Vec<(f64, f64)> = random_points(1000).collect();
    let mut group = c.benchmark_group("inside");
    group.throughput(Throughput::Elements(at.len() as u64));
    let few = vec![ellipse((0.5, 0.5), 0.45, 0.3), circle((0.5, 0.5), 0.12)];
    let grille =
        (0..100).map(|k| circle((f64::from(k % 10) * 0.1 + 0.05, f64::from(k / 10) * 0.1 + 0.05), 0.04));
    for (name, loops) in [("two loops", few), ("a hundred loops", grille.collect())] {
        let domain = Domain::new(&face(panel(), loops));
        group.bench_function(name, |b| {
            b.iter(|| at.iter().filter(|&&(u, v)| domain.contains(u, v)).count());
        });
    }
    group.finish();
}

criterion_group!(kernel, evaluation, triangulation, inside_test);
criterion_main!(kernel);
