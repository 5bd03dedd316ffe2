//! Random damage, with checksums and without: nothing panics, hangs or eats memory.

use std::path::Path;
use std::time::{Duration, Instant};

use rand::{Rng, SeedableRng};

const VICTIMS: [&[u8]; 4] = [
    include_bytes!("../../tests/threedm/v2.3dm"),
    include_bytes!("../../tests/threedm/v4.3dm"),
    include_bytes!("../../tests/threedm/v5.3dm"),
    include_bytes!("../../tests/threedm/v8.3dm"),
];

#[test]
fn random_damage_never_panics_or_hangs() {
    let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(20_261_121);
    let (mut whole, mut partly, mut refused) = (0, 0, 0);
    for round in 0..3000 {
        let mut bytes = VICTIMS[round % VICTIMS.len()].to_vec();
        if round % 5 == 0 {
            bytes.truncate(random.random_range(0..bytes.len()));
        }
        for _ in 0..random.random_range(1..8).min(bytes.len()) {
            let at = random.random_range(0..bytes.len());
            match random.random_range(0..4) {
                0 => bytes[at] = random.random(),
                1 => bytes[at] ^= 1 << random.random_range(0..8),
                // Counts and lengths are integers: the extremes among them.
                2 => {
                    let value = [0, 1, -1, i32::MAX, i32::MIN, 1 << 20][random.random_range(0..6)];
                    let end = (at + 4).min(bytes.len());
                    bytes[at..end].copy_from_slice(&i32::to_le_bytes(value)[..end - at]);
                }
                _ => {
                    let value =
                        [0.0, -1.0, 1e-300, 1e300, f64::NAN, f64::INFINITY][random.random_range(0..6)];
                    let end = (at + 8).min(bytes.len());
                    bytes[at..end].copy_from_slice(&f64::to_le_bytes(value)[..end - at]);
                }
            }
        }
        let start = Instant::now();
        match super::read_checked(&bytes, Path::new("damaged.3dm"), round % 2 == 0) {
            Ok(import) => {
                let report = import.report;
                assert_eq!(report.faces_in_file, report.faces_read + report.skipped.len());
                // Two hidden surfaces and a mesh are skipped in sound files too.
                if report.skipped.len() > 3 { partly += 1 } else { whole += 1 }
            }
            Err(error) => {
                assert!(!error.to_string().is_empty() && !error.advice().is_empty());
                refused += 1;
            }
        }
        assert!(start.elapsed() < Duration::from_secs(5), "round {round}: {:?}", start.elapsed());
    }
    assert!(whole > 100 && partly > 100 && refused > 10, "{whole} whole, {partly} partly, {refused} refused");
}

/// A block that places itself twice, and those around it: a small file that unfolds without end.
#[test]
fn blocks_that_contain_themselves_end() {
    let bytes = VICTIMS[2];
    // The identity of the one block is at its two instances; the parts list names the part's identity. To name
    // an instance there closes the circle.
    let sound = super::read_checked(bytes, Path::new("sound.3dm"), false).unwrap();
    let placed: Vec<_> = sound
        .model
        .faces
        .iter()
        .filter(|f| f.source.entity.contains(" in "))
        .map(|f| &f.source.entity)
        .collect();
    assert_eq!(placed.len(), 2);
    let (part, instance) = (&placed[0][..36], &placed[0][placed[0].len() - 36..]);
    let raw = |text: &str| -> Vec<u8> {
        let hex: Vec<u8> = text
            .replace('-', "")
            .as_bytes()
            .chunks(2)
            .map(|c| u8::from_str_radix(std::str::from_utf8(c).unwrap(), 16).unwrap())
            .collect();
        [3, 2, 1, 0, 5, 4, 7, 6, 8, 9, 10, 11, 12, 13, 14, 15].map(|i: usize| hex[i]).to_vec()
    };
    let at = memchr::memmem::find(bytes, &raw(part)).unwrap();
    let mut circular = bytes.to_vec();
    circular[at..at + 16].copy_from_slice(&raw(instance));
    let import = super::read_checked(&circular, Path::new("circular.3dm"), false).unwrap();
    let told = |s: &&crate::Skipped| s.reason.contains("contain themselves");
    assert_eq!(import.report.skipped.iter().filter(told).count(), 2, "{:?}", import.report.skipped);
}
