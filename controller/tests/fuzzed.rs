//! A short, repeatable run of the fuzzing in `fuzz/`: its seeds and the cases once found, and seeded mutations of them.

#[path = "../../fuzz/src/control.rs"]
mod fuzzing;

use std::path::Path;
use std::time::{Duration, Instant};

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

fn mutate(bytes: &mut Vec<u8>, other: &[u8], random: &mut ChaCha8Rng) {
    let at = random.random_range(0..=bytes.len());
    let until = (at + random.random_range(0..=40)).min(bytes.len());
    match random.random_range(0..5) {
        0 => bytes.iter_mut().skip(at).take(1).for_each(|b| *b ^= 1 << random.random_range(0..8)),
        1 => {
            let bit = BITS[random.random_range(0..BITS.len())];
            bytes.splice(at..(at + bit.len()).min(bytes.len()), bit.iter().copied());
        }
        2 => drop(bytes.drain(at..until)),
        3 => {
            let piece = bytes[at..until].to_vec();
            bytes.splice(at..at, piece);
        }
        _ => {
            let from = random.random_range(0..=other.len());
            let piece = &other[from..(from + random.random_range(0..=200)).min(other.len())];
            bytes.splice(at..until, piece.iter().copied());
        }
    }
}

fn run(name: &str, target: fn(&[u8])) {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../fuzz/seeds").join(name);
    let mut paths: Vec<_> = std::fs::read_dir(folder).unwrap().map(|e| e.unwrap().path()).collect();
    paths.sort();
    let seeds: Vec<Vec<u8>> = paths.iter().map(|p| std::fs::read(p).unwrap()).collect();
    seeds.iter().for_each(|seed| target(seed));
    let mut random = ChaCha8Rng::seed_from_u64(31);
    for i in 0..MUTATIONS {
        let mut bytes = seeds[i % seeds.len()].clone();
        for _ in 0..random.random_range(1..5) {
            let other = random.random_range(0..seeds.len());
            mutate(&mut bytes, &seeds[other], &mut random);
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
