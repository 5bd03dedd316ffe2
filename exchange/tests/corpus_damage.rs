//! Truncations and byte flips of every file of the corpus: never a panic, never a long run, and every
//! face accounted for.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use claymill_exchange::read_bytes;
use claymill_tests::{corpus, process_cpu_s};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Text files longer than this are cut to their first faces.
const LARGEST: usize = 400_000;
/// Damaged variants of each file.
const VARIANTS: usize = 135;
/// A damaged file takes no longer than the sound one times this, or than the second: one weight that is damaged makes a
/// surface rational, whose derivatives take ten times as long to bound, and a face that folds over uses up the budget of
/// its area.
const TIMES: u32 = 5;
const LONGEST: Duration = Duration::from_secs(2);

/// The first directory entries of an IGES file with their parameters.
fn cut_iges(text: &str) -> String {
    let of = |letter: u8| text.lines().filter(move |l| l.as_bytes().get(72) == Some(&letter));
    let mut kept: Vec<&str> = of(b'S').chain(of(b'G')).collect();
    let directory: Vec<&str> = of(b'D').collect();
    let first_card = |entry: usize| -> usize {
        directory.get(2 * entry).map_or(usize::MAX, |l| l[8..16].trim().parse().unwrap())
    };
    let entries = (0..directory.len() / 2).take_while(|e| first_card(*e) < LARGEST / 81).count();
    kept.extend(&directory[..2 * entries]);
    let last = first_card(entries);
    kept.extend(of(b'P').take_while(|l| l[73..80].trim().parse::<usize>().unwrap() < last));
    kept.extend(of(b'T'));
    kept.join("\n") + "\n"
}

/// The first faces of a STEP file with all that they refer to, and the units.
fn cut_step(text: &str) -> String {
    let (head, data) = text.split_once("DATA;").unwrap();
    let mut instances: BTreeMap<u64, &str> = BTreeMap::new();
    for statement in data.split(';') {
        let statement = statement.trim();
        let id = statement.strip_prefix('#').and_then(|s| s.split_once('=')).map(|(id, _)| id.trim());
        if let Some(id) = id.and_then(|id| id.parse().ok()) {
            instances.insert(id, statement);
        }
    }
    let roots = |word: &str| -> Vec<u64> {
        instances.iter().filter(|(_, s)| s.contains(word)).map(|(id, _)| *id).collect()
    };
    let (mut kept, mut size) = (BTreeSet::new(), 0);
    for root in roots("GLOBAL_UNIT_ASSIGNED_CONTEXT")
        .into_iter()
        .chain(roots("ADVANCED_FACE"))
        .chain(roots("=FACE_SURFACE"))
        .chain(roots("= FACE_SURFACE"))
    {
        let (mut part, mut open, mut grown) = (kept.clone(), vec![root], size);
        while let Some(id) = open.pop().filter(|_| grown <= LARGEST) {
            let Some(statement) = instances.get(&id).filter(|_| part.insert(id)) else { continue };
            grown += statement.len();
            let references = statement.split('#').skip(2).map(|s| {
                s.bytes().take_while(u8::is_ascii_digit).fold(0, |n, d| 10 * n + u64::from(d - b'0'))
            });
            open.extend(references);
        }
        // Faces larger than what is left are left out whole.
        if grown <= LARGEST {
            (kept, size) = (part, grown);
        }
    }
    let body: String = kept.iter().filter_map(|id| instances.get(id)).map(|s| format!("{s};\n")).collect();
    format!("{head}DATA;\n{body}ENDSEC;\nEND-ISO-10303-21;\n")
}

fn specimen(path: &Path) -> Vec<u8> {
    let bytes = std::fs::read(path).unwrap();
    if bytes.len() <= LARGEST || path.extension().is_some_and(|e| e == "3dm") {
        return bytes;
    }
    let text = String::from_utf8_lossy(&bytes);
    if path.extension().is_some_and(|e| e == "stp") { cut_step(&text) } else { cut_iges(&text) }.into_bytes()
}

fn damaged(sound: &[u8], random: &mut ChaCha8Rng, variant: usize) -> Vec<u8> {
    let mut bytes = sound.to_vec();
    if variant.is_multiple_of(3) {
        bytes.truncate(random.random_range(0..bytes.len()));
    }
    let flips = match variant % 4 {
        0 => 1,
        1 => random.random_range(2..20),
        2 => 1 + bytes.len() / 2000,
        _ if variant.is_multiple_of(3) => 0,
        _ => random.random_range(20..200),
    };
    for _ in 0..flips.min(bytes.len()) {
        let at = random.random_range(0..bytes.len());
        bytes[at] = match random.random_range(0..4) {
            0 => random.random(),
            1 => b"0123456789"[random.random_range(0..10)],
            2 => b",;H.-+DE#()'*$\n "[random.random_range(0..16)],
            _ => bytes[at] ^ (1 << random.random_range(0..8)),
        };
    }
    bytes
}

/// Reads the bytes and checks that all faces are accounted for; gives the time and the number of faces. Others work on the machine
/// too: where the processors worked for a shorter time than it took, that is what counts.
fn timed(bytes: &[u8], path: &Path) -> (Duration, usize) {
    let start = Instant::now();
    let before_s = process_cpu_s(start);
    let import = read_bytes(bytes, path);
    let worked = Duration::from_secs_f64(process_cpu_s(start) - before_s);
    let elapsed = start.elapsed().min(worked);
    let Ok(import) = import else { return (elapsed, 0) };
    let report = &import.report;
    assert_eq!(report.faces_in_file, report.faces_read + report.skipped.len());
    assert_eq!(report.faces_read, import.model.faces.len());
    for face in &import.model.faces {
        assert!(face.surface.net().iter().all(|h| h.iter().all(|c| c.is_finite())));
    }
    (elapsed, report.faces_read)
}

#[test]
fn damaged_files_end_in_a_model_or_a_message_soon() {
    let Some(folder) = corpus() else { return };
    let mut names: Vec<PathBuf> = (std::fs::read_dir(&folder).unwrap())
        .map(|entry| entry.unwrap().path())
        .filter(|p| {
            p.extension().is_some_and(|e| ["igs", "iges", "stp", "3dm"].iter().any(|known| e == *known))
        })
        .collect();
    names.sort();
    let mut total = 0;
    for path in names {
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        let sound = specimen(&path);
        let runs: Vec<_> = (0..3).map(|_| timed(&sound, &path)).collect();
        let faces = runs[0].1;
        assert!(faces > 0, "{name}: nothing is left to damage");
        let normal = runs.iter().map(|r| r.0).max().unwrap();
        let mut random = ChaCha8Rng::seed_from_u64(20_261_121);
        let (mut worst, mut survivors) = (Duration::ZERO, 0);
        for variant in 0..VARIANTS {
            let bytes = damaged(&sound, &mut random, variant);
            let (mut elapsed, read) = timed(&bytes, &path);
            // Others work on the machine too: only what is slow again is slow.
            for _ in 0..3 {
                if elapsed > (TIMES * normal).max(LONGEST) {
                    elapsed = elapsed.min(timed(&bytes, &path).0);
                }
            }
            if elapsed > (TIMES * normal).max(LONGEST) {
                let kept = std::env::temp_dir().join(format!("slow-{variant}-{name}"));
                let _ = std::fs::write(&kept, &bytes);
                panic!("{name} variant {variant}: {elapsed:?}, sound {normal:?}; kept as {}", kept.display());
            }
            worst = worst.max(elapsed);
            survivors += usize::from(read > 0);
            total += 1;
        }
        eprintln!(
            "{name}: {} bytes, {faces} faces in {normal:.0?}; {survivors} of {VARIANTS} readable, slowest {worst:.0?}",
            sound.len()
        );
    }
    assert!(total >= 2000, "{total}");
}
