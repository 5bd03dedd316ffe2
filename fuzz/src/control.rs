//! What must hold of programs of controls, of records of a stream and of machine definitions, whatever the bytes: no panic,
//! no hang, and only motions that end.

use claymill_controller::{Dialect, Machine, Path, RECORD_VERSION, Record, check};
use claymill_motion::{Chain, JointRule, Limits, Looks, Rail, Schedule, Track};

/// Reads a program; its first byte chooses the dialect.
pub(crate) fn program(bytes: &[u8]) {
    let Some((first, text)) = bytes.split_first() else { return };
    let dialect = Dialect::ALL[usize::from(first.wrapping_sub(b'a')) % Dialect::ALL.len()];
    if let Err((line, refusal)) = check(&String::from_utf8_lossy(text), dialect, &Machine::default()) {
        assert!(line <= text.len() + 1 && !refusal.rule.is_empty() && !refusal.detail.is_empty());
    }
}

/// Reads a machine definition.
pub(crate) fn machine(bytes: &[u8]) {
    let Ok(text) = std::str::from_utf8(bytes) else { return };
    if let Ok(machine) = Machine::parse(text, std::path::Path::new("fuzzed")) {
        assert!(machine.check().is_ok());
    }
}

/// Reads records behind their lengths, and plans a motion along those that are paths.
pub(crate) fn stream(mut bytes: &[u8]) {
    let limits = Limits { acceleration_mm_per_s2: 1000.0, jerk_mm_per_s3: 10_000.0 };
    while let Some((head, rest)) = bytes.split_first_chunk::<4>() {
        let length = (u32::from_le_bytes(*head) as usize).min(rest.len());
        let (record, rest) = rest.split_at(length);
        bytes = rest;
        // Under a version and a check sum that fit, for else nothing that was changed is looked at.
        let mut record = record.to_vec();
        record.iter_mut().zip(RECORD_VERSION.to_le_bytes()).for_each(|(old, new)| *old = new);
        record.extend(crc32fast::hash(&record).to_le_bytes());
        let Ok((seq, record)) = Record::decode(&record) else { continue };
        let mut again = Vec::new();
        record.encode(seq, &mut again);
        assert_eq!(Record::decode(&again), Ok((seq, record.clone())));
        if let Record::Path(path) = record {
            run(&path, limits);
        }
    }
}

fn run(path: &Path, limits: Limits) {
    let rail = Rail::new(path.curve.clone(), Looks::COARSE);
    assert!(rail.length_mm().is_finite());
    let mut track = Track::new(limits, JointRule::OnPath { cycle_s: 1e-3 });
    track.add(&rail, path.feed);
    assert!(Schedule::new(&track, true).time_s().is_finite(), "{path:?} {:?}", track.places());
    let chain = Chain::plan(track.places().to_vec(), limits);
    let (time_s, length_mm) = (chain.time_s(), chain.length_mm());
    let off = (length_mm - rail.length_mm()).abs();
    assert!(
        time_s.is_finite() && off <= 1e-6 * rail.length_mm() + 1e-6,
        "{time_s} s, {off} mm off in {path:?}"
    );
    let (way, speed) = chain.at(0.5 * time_s);
    assert!(
        (0.0..=length_mm + 1e-6).contains(&way)
            && speed >= 0.0
            && speed <= path.feed / 60.0 * 1.000_001 + 1e-6
    );
    assert!(rail.point(way).iter().all(|c| c.is_finite()));
}
