//! Reading times of corpus files, in bytes per second.

use std::hint::black_box;
use std::path::Path;

use claymill_exchange::read_bytes;
use criterion::{Criterion, Throughput, criterion_group, criterion_main};

fn reading(c: &mut Criterion) {
    let folder = std::env::var_os("CLAYMILL_CORPUS")
        .map_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/corpus"), Into::into);
    let mut group = c.benchmark_group("read");
    group.sample_size(10);
    for name in ["sports_car_25200.igs", "sports_car_1399.igs", "bracket_inch.iges"] {
        let path = folder.join(name);
        let Ok(bytes) = std::fs::read(&path) else {
            eprintln!("skipped: {} is not there", path.display());
            continue;
        };
        group.throughput(Throughput::Bytes(bytes.len() as u64));
        group.bench_function(name, |b| b.iter(|| read_bytes(black_box(&bytes), &path)));
    }
    group.finish();
}

criterion_group!(benches, reading);
criterion_main!(benches);
