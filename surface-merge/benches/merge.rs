//! Merging whole cars: `cargo bench -p claymill-surface-merge`.

use std::path::PathBuf;

use claymill_surface_merge::{MergeOptions, merge};
use criterion::{Criterion, criterion_group, criterion_main};

fn corpus(file: &str) -> PathBuf {
    let default = concat!(env!("CARGO_MANIFEST_DIR"), "/../../shared/corpus");
    PathBuf::from(std::env::var("CLAYMILL_CORPUS").unwrap_or_else(|_| default.into())).join(file)
}

fn cars(c: &mut Criterion) {
    let mut group = c.benchmark_group("merge");
    group.sample_size(10);
    for file in ["sports_car_1399.igs", "sports_car_6300.igs", "sports_car_25200.igs"] {
        let Ok(import) = claymill_exchange::read(&corpus(file)) else {
            eprintln!("skipped: no {file} in the corpus");
            continue;
        };
        group.bench_function(file, |b| b.iter(|| merge(&import.model, &MergeOptions::default())));
    }
    group.finish();
}

criterion_group!(benches, cars);
criterion_main!(benches);
