//! Damaged programs and machine definitions, seeded: never a panic, never a hang.

use std::time::{Duration, Instant};

use claymill_controller::{Dialect, Machine, check, post};
use rand::{Rng, SeedableRng};

use crate::job;

/// Words that mean something to one grammar or another.
const PIECES: [&str; 40] = [
    "G0",
    "G1",
    "G2 ",
    "G5.2",
    "G5.3",
    "G06.2",
    "G17",
    "G18",
    "K",
    "P4",
    "X1e9",
    "Y-",
    "Z.",
    "I0.",
    "R1.",
    "F0",
    "BSPLINE",
    "POLY",
    "PO[X]=(",
    "PO[]=(1,2)",
    "PL=",
    "PW=9",
    "SPL",
    "K3X+1.0E255",
    "L ",
    "MOVNRB/ON,4,8,0,4,1",
    "MOVNRB/NEXT",
    "GOTO/1,2,3",
    "BEGIN NURBS_SIEMENS(D=3,F=1.,AXIS=0,0,1);",
    "END NURBS;",
    "#SPLINE ON",
    "#13=",
    "((((((((",
    "'",
    "/*",
    "$",
    "\u{fffd}",
    "999999999999",
    "\n\n",
    "(",
];

fn programs() -> Vec<(Dialect, String)> {
    let folder = tempfile::tempdir().unwrap();
    let machine = Machine::default();
    let job = job::job(&job::curves(), &machine);
    let write = |dialect: Dialect| {
        let out = folder.path().join(dialect.name());
        post(&job, dialect, &machine, &out, &|_| ()).unwrap();
        (dialect, std::fs::read_to_string(&out).unwrap())
    };
    Dialect::ALL.into_iter().map(write).collect()
}

#[test]
fn damaged_programs_are_refused_or_read() {
    let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(2026);
    let machine = Machine::default();
    let (mut refused, mut read) = (0, 0);
    for (dialect, whole) in programs() {
        assert!(check(&whole, dialect, &machine).is_ok());
        for _ in 0..400 {
            let mut bytes = whole.clone().into_bytes();
            for _ in 0..rng.random_range(1..6) {
                let at = rng.random_range(0..bytes.len());
                match rng.random_range(0..5) {
                    0 => bytes[at] = rng.random(),
                    1 => bytes.truncate(at.max(1)),
                    2 => {
                        let piece = PIECES[rng.random_range(0..PIECES.len())].bytes();
                        bytes.splice(at..at, piece);
                    }
                    3 => {
                        let end = (at + rng.random_range(1..200)).min(bytes.len());
                        bytes.drain(at..end);
                        bytes.push(b'\n');
                    }
                    _ => {
                        let end = (at + rng.random_range(1..200)).min(bytes.len());
                        let copy = bytes[at..end].to_vec();
                        bytes.splice(at..at, copy);
                    }
                }
            }
            let begun = Instant::now();
            match check(&String::from_utf8_lossy(&bytes), dialect, &machine) {
                Ok(_) => read += 1,
                Err((_, refusal)) => {
                    refused += 1;
                    assert!(!refusal.rule.is_empty() && !refusal.detail.is_empty());
                }
            }
            assert!(begun.elapsed() < Duration::from_secs(5), "{dialect} takes {:?}", begun.elapsed());
        }
    }
    eprintln!("{refused} refused, {read} read");
    assert!(refused > 1000);
}

#[test]
fn words_thrown_together_never_panic() {
    let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(7);
    for dialect in Dialect::ALL {
        for _ in 0..2000 {
            let mut text = String::from("G90 G21\nG0 Z1.\nG0 X0. Y0.\nBEGIN PGM A MM\n");
            for _ in 0..rng.random_range(1..60) {
                text.push_str(PIECES[rng.random_range(0..PIECES.len())]);
                text.push_str([" ", "\n", "", ";"][rng.random_range(0..4)]);
            }
            let _ = check(&text, dialect, &Machine::default());
        }
    }
}

#[test]
fn damaged_machine_definitions_are_refused_or_read() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("machine.toml");
    let whole = "name = \"mill\"\nunits = \"mm\"\ndigits = 3\ntolerance_mm = 0.002\nfiles = \"setup\"\n\
                 line_numbers = { first = 10, step = 10 }\n[axes]\nx = [-10, 4000]\n[feed]\nmax_mm_per_min = 9000\n\
                 [spindle]\nspeed_rpm = 12000\n[setups.top]\nwork_offset = \"G55\"\nzero_mm = [0, 0, 0]\n";
    std::fs::write(&path, whole).unwrap();
    Machine::read(&path).unwrap();
    let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(11);
    for _ in 0..3000 {
        let mut bytes = whole.as_bytes().to_vec();
        for _ in 0..rng.random_range(1..4) {
            let at = rng.random_range(0..bytes.len());
            bytes[at] = rng.random();
        }
        std::fs::write(&path, &bytes).unwrap();
        if let Ok(machine) = Machine::read(&path) {
            machine.check().unwrap();
        }
    }
}
