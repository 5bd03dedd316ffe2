//! A short, repeatable run of the fuzzing in `fuzz/`: its seeds and the cases once found, and seeded mutations of them.

#[allow(unreachable_pub, reason = "a library where it is at home")]
#[path = "../../fuzz/src/lib.rs"]
mod fuzzing;

use claymill_exchange::{Format, MeshFormat};
use claymill_tests::{fuzz_seeds, mutate};
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
        let seeds = fuzz_seeds(name);
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
                mutate(&mut bytes, other, &BITS, &mut random);
            }
            eprintln!("{name} mutation {round}");
            read(&bytes);
        }
        eprintln!();
    }
}
