//! A short, repeatable run of the fuzzing in `fuzz/`: its seeds and the cases once found, and seeded mutations of them.

#[allow(unreachable_pub, reason = "a library where it is at home")]
#[path = "../../fuzz/src/lib.rs"]
mod fuzzing;

use std::path::{Path, PathBuf};

use claymill_exchange::{Format, MeshFormat};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Mutated files of each format.
const MUTATIONS: usize = 4000;
/// What readers meet in bad files: extremes, separators, things cut short.
const BITS: [&[u8]; 16] = [
    b"-1",
    b"0",
    b"1",
    b"2147483648",
    b"1E308",
    b"-1D-320",
    b"nan",
    b"$",
    b"*",
    b"#1",
    b"(",
    b")",
    b"99999999H",
    b"\xff\xff\xff\xff",
    b"\x00\x00\x00\x80",
    b",,",
];

fn seeds(name: &str) -> Vec<(PathBuf, Vec<u8>)> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../fuzz/seeds").join(name);
    let mut paths: Vec<PathBuf> = std::fs::read_dir(folder).unwrap().map(|e| e.unwrap().path()).collect();
    paths.sort();
    paths.into_iter().map(|path| (path.clone(), std::fs::read(path).unwrap())).collect()
}

/// One of the changes that a fuzzer makes: a byte, a number, a piece left out, doubled or taken from another file.
fn mutate(bytes: &mut Vec<u8>, other: &[u8], random: &mut ChaCha8Rng) {
    let at = random.random_range(0..=bytes.len());
    let until = (at + random.random_range(0..=40)).min(bytes.len());
    match random.random_range(0..6) {
        0 => bytes.iter_mut().skip(at).take(1).for_each(|b| *b ^= 1 << random.random_range(0..8)),
        1 => {
            let bit = BITS[random.random_range(0..BITS.len())];
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

/// One test, not six: memory is counted for the whole process.
#[test]
fn mutated_seeds_end_in_a_model_or_a_message_and_in_little_memory() {
    let obstacles: [(&str, &[MeshFormat]); 3] = [
        ("stl", &[MeshFormat::StlText, MeshFormat::StlBinary]),
        ("gltf", &[MeshFormat::Gltf, MeshFormat::Glb]),
        ("obj", &[MeshFormat::Obj]),
    ];
    let models = [("iges", Format::Iges), ("step", Format::Step), ("threedm", Format::Rhino3dm)];
    let mesh = |formats: &'static [MeshFormat]| {
        Box::new(move |bytes: &[u8]| fuzzing::mesh(bytes, formats)) as Box<dyn Fn(&[u8])>
    };
    let model =
        |format: Format| Box::new(move |bytes: &[u8]| fuzzing::model(bytes, format)) as Box<dyn Fn(&[u8])>;
    let targets = (models.into_iter().map(|(name, format)| (name, model(format))))
        .chain(obstacles.into_iter().map(|(name, formats)| (name, mesh(formats))));
    for (name, read) in targets {
        let seeds = seeds(name);
        assert!(seeds.len() > 3, "{name}");
        for (path, bytes) in &seeds {
            eprintln!("{}", path.display());
            read(bytes);
        }
        for round in 0..MUTATIONS {
            let mut random = ChaCha8Rng::seed_from_u64(round as u64);
            let mut bytes = seeds[round % seeds.len()].1.clone();
            let other = &seeds[random.random_range(0..seeds.len())].1;
            for _ in 0..random.random_range(1..6) {
                mutate(&mut bytes, other, &mut random);
            }
            eprintln!("{name} mutation {round}");
            read(&bytes);
        }
        eprintln!();
    }
}
