//! Damaged files give an error or a part of their tools, never a panic.

use std::io::Write;
use std::path::Path;

use claymill_tooling::{Library, MachineShape, Profiles, ReadOptions, machine_from_freecad, parse_library};
use proptest::prelude::*;

use crate::files;

fn seeds() -> Vec<(&'static str, Vec<u8>)> {
    let own = Library::shipped().to_toml();
    vec![
        ("own.toml", own.as_bytes()[..3000].to_vec()),
        ("fusion.json", files::FUSION.into()),
        ("fusion.tools", files::tools_archive()),
        ("ball.fctb", files::BALL_BIT.into()),
        ("bull.fctb", files::BULL_BIT.into()),
        ("tool.tbl", files::TABLE.into()),
        ("machine.fcm", files::MACHINE.into()),
        ("machine.toml", MachineShape::shipped().to_toml().into()),
        ("process.toml", include_bytes!("../../data/process-general.toml").to_vec()),
        ("material.toml", include_bytes!("../../data/material-clay.toml").to_vec()),
    ]
}

/// Every reader on the same bytes: what must hold of any bytes.
fn read_all(bytes: &[u8], name: &str) {
    let path = Path::new(name);
    if let Ok(reading) = parse_library(bytes, path, &ReadOptions::default()) {
        reading.library.check().unwrap();
        let again = Library::parse(&reading.library.to_toml(), path).unwrap();
        assert_eq!(again.tools, reading.library.tools);
        for tool in &reading.library.tools {
            assert!(claymill_tooling::tool_svg(tool).ends_with("</svg>\n"));
        }
    }
    if let Ok((machine, _)) = machine_from_freecad(bytes, path) {
        machine.check().unwrap();
    }
    if let Ok(machine) = MachineShape::parse(bytes, path) {
        machine.check().unwrap();
    }
    if let Ok(text) = std::str::from_utf8(bytes) {
        let mut profiles = Profiles::shipped();
        if let Ok(name) = profiles.add(text, path) {
            let _ = profiles.resolve(&name, "clay", &std::collections::BTreeMap::new());
        }
    }
}

#[test]
fn the_seeds_are_whole() {
    seeds().iter().for_each(|(name, bytes)| read_all(bytes, name));
}

#[test]
fn every_shorter_archive_is_refused() {
    let whole = files::tools_archive();
    for length in 0..whole.len() {
        read_all(&whole[..length], "a.tools");
    }
}

/// A small archive that unpacks to more than any library.
#[test]
fn what_unpacks_beyond_the_bound_is_refused() {
    let mut archive = zip::ZipWriter::new(std::io::Cursor::new(Vec::new()));
    archive.start_file("tools.json", zip::write::SimpleFileOptions::default()).unwrap();
    archive.write_all(&vec![b' '; (16 << 20) + 1]).unwrap();
    let bytes = archive.finish().unwrap().into_inner();
    assert!(bytes.len() < 100_000);
    let error = parse_library(&bytes, Path::new("bomb.tools"), &ReadOptions::default()).unwrap_err();
    assert_eq!(error.to_string(), "bomb.tools: more than 16 MB unpacked");
    let many = format!("{{\"data\": [{}]}}", "{},".repeat(250_000));
    let error = parse_library(many.as_bytes(), Path::new("many.json"), &ReadOptions::default()).unwrap_err();
    assert_eq!(error.to_string(), "many.json: more than 250000 JSON objects");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(ProptestConfig::default().cases.max(1000)))]

    #[test]
    fn flipped_bytes_do_not_panic(seed in 0..10_usize, flips in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..6)) {
        let (name, mut bytes) = seeds().swap_remove(seed);
        for (at, value) in flips {
            let at = at.index(bytes.len());
            bytes[at] = value;
        }
        read_all(&bytes, name);
    }

    /// In printable characters, which get further than others.
    #[test]
    fn changed_letters_do_not_panic(seed in 0..10_usize, flips in prop::collection::vec((any::<prop::sample::Index>(), 32..127_u8), 1..4)) {
        let (name, mut bytes) = seeds().swap_remove(seed);
        for (at, value) in flips {
            let at = at.index(bytes.len());
            bytes[at] = value;
        }
        read_all(&bytes, name);
    }

    #[test]
    fn cut_off_files_do_not_panic(seed in 0..10_usize, from in any::<prop::sample::Index>(), to in any::<prop::sample::Index>()) {
        let (name, bytes) = seeds().swap_remove(seed);
        let (from, to) = (from.index(bytes.len()), to.index(bytes.len() + 1));
        read_all(&bytes[..to], name);
        read_all(&bytes[from..], name);
        // A piece is missing in the middle.
        let (from, to) = (from.min(to), from.max(to));
        read_all(&[&bytes[..from], &bytes[to..]].concat(), name);
    }

    #[test]
    fn any_text_does_not_panic(text in "\\PC{0,200}") {
        for name in ["a.toml", "a.json", "a.tbl", "a.fctb"] {
            read_all(text.as_bytes(), name);
            read_all(format!("T1 P1 {text}").as_bytes(), name);
        }
    }
}
