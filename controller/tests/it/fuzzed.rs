//! A short, repeatable run of the fuzzing in `fuzz/`: its seeds and the cases once found, and seeded mutations of them.

#[path = "../../../fuzz/src/control.rs"]
mod fuzzing;

use std::time::{Duration, Instant};

use claymill_tests::{fuzz_seeds, mutate};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

const MUTATIONS: usize = 6000;
/// What readers meet in bad files: extremes, separators, words of several grammars.
const BITS: [&[u8]; 16] = [
    b"-1",
    b"0",
    b"2147483648",
    b"1E308",
    b"nan",
    b"G",
    b"X",
    b"\n",
    b"(",
    b")",
    b"K3X",
    b"PL=",
    b"#1",
    b"\xff\xff\xff\xff",
    b"\0\0\0\0\0\0\xf0\x7f",
    b"\x00\x00\x10\x00",
];

fn run(name: &str, target: fn(&[u8])) {
    let seeds: Vec<Vec<u8>> = fuzz_seeds(name).into_iter().map(|(_, bytes)| bytes).collect();
    seeds.iter().for_each(|seed| target(seed));
    let mut random = ChaCha8Rng::seed_from_u64(31);
    for i in 0..MUTATIONS {
        let mut bytes = seeds[i % seeds.len()].clone();
        for _ in 0..random.random_range(1..5) {
            let other = random.random_range(0..seeds.len());
            mutate(&mut bytes, &seeds[other], &BITS, &mut random);
        }
        let begun = Instant::now();
        target(&bytes);
        assert!(begun.elapsed() < Duration::from_secs(5), "{name}: {:?}", begun.elapsed());
    }
}

#[test]
fn programs() {
    run("program", fuzzing::program);
}

#[test]
fn streams() {
    run("stream", fuzzing::stream);
}

#[test]
fn machines() {
    run("machine", fuzzing::machine);
}
