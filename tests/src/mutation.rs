//! Seed files of the fuzzers and random changes to them, for tests that readers survive damaged
//! files.

use std::path::{Path, PathBuf};

use rand::Rng;

/// The files of `fuzz/seeds/NAME`, by name: seeds made by hand and cases once found.
///
/// # Panics
/// There are none.
#[must_use]
pub fn fuzz_seeds(name: &str) -> Vec<(PathBuf, Vec<u8>)> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../fuzz/seeds").join(name);
    let mut paths: Vec<PathBuf> = std::fs::read_dir(folder).unwrap().map(|e| e.unwrap().path()).collect();
    paths.sort();
    assert!(!paths.is_empty(), "no seeds of {name}");
    paths.into_iter().map(|path| (path.clone(), std::fs::read(path).unwrap())).collect()
}

/// One of the changes that a fuzzer makes: a byte, one of `bits`, a digit, a piece left out, doubled or taken from
/// another file.
pub fn mutate(bytes: &mut Vec<u8>, other: &[u8], bits: &[&[u8]], random: &mut impl Rng) {
    let at = random.random_range(0..=bytes.len());
    let until = (at + random.random_range(0..=40)).min(bytes.len());
    match random.random_range(0..6) {
        0 => bytes.iter_mut().skip(at).take(1).for_each(|b| *b ^= 1 << random.random_range(0..8)),
        1 => {
            let bit = bits[random.random_range(0..bits.len())];
            bytes.splice(at..(at + bit.len()).min(bytes.len()), bit.iter().copied());
        }
        2 => bytes.iter_mut().skip(at).take(1).for_each(|b| *b = b"0123456789"[random.random_range(0..10)]),
        3 => drop(bytes.drain(at..until)),
        4 => {
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
