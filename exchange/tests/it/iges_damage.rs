//! Damaged files: the sound faces are read, the others are named; nothing panics or hangs.

use std::path::Path;
use std::time::{Duration, Instant};

use crate::iges_text::{Entity, entity, file, flat, line};
use claymill_exchange::{ImportReport, ReadError, read_bytes};
use claymill_tests::corpus_file;
use rand::{Rng, SeedableRng};

/// Reads a sound face and behind it the damaged ones; gives the report.
fn beside_a_sound_face(damaged: Vec<Entity>) -> ImportReport {
    let mut entities = vec![flat(10.0, 8.0)];
    entities.extend(damaged);
    let text = file(&entities);
    let import = read_bytes(text.as_bytes(), Path::new("test.igs")).unwrap();
    let report = import.report;
    assert_eq!(report.faces_in_file, report.faces_read + report.skipped.len());
    assert_eq!(import.model.faces.len(), 1);
    report
}

fn reason(damaged: Vec<Entity>) -> String {
    let report = beside_a_sound_face(damaged);
    assert_eq!(report.skipped.len(), 1, "{report:?}");
    assert!(report.skipped[0].entity.starts_with("DE "));
    assert!(!report.skipped[0].advice.is_empty());
    report.skipped[0].reason.clone()
}

fn altered(from: &str, to: &str) -> Entity {
    let mut surface = flat(10.0, 8.0);
    assert!(surface.parameters.contains(from));
    surface.parameters = surface.parameters.replacen(from, to, 1);
    surface
}

#[test]
fn damaged_surfaces_are_skipped_by_name() {
    for (surface, expected) in [
        (altered("10.0,0.,0.,8.0,8.0", "nan,0.,0.,8.0,8.0"), "`nan`, not a number"),
        (altered("1.,1.,1.,1.", "1.,1.,0.,1."), "is 0: weights must be positive"),
        (altered("1.,1.,1.,1.", "1.,1.,-1.,1."), "weights must be positive"),
        (altered("0.,0.,10.0,10.0", "0.,10.0,0.,10.0"), "decreases"),
        (altered("0.,0.,10.0,10.0", "0.,0.,0.,0."), "empty domain"),
        (altered("0.,0.,0.,10.0,0.", "1E30,0.,0.,10.0,0."), "not a finite number"),
        (altered("1,1,1,1,", "1,1,0,1,"), "degree 0"),
        (altered("1,1,1,1,", "99999999999,1,1,1,"), "not a sensible count"),
        (altered("1,1,1,1,", "7,7,1,1,"), "missing or break off"),
        (flat(10.0, 0.0), "empty domain"),
    ] {
        let parameters = surface.parameters.clone();
        let reason = reason(vec![surface]);
        assert!(reason.contains(expected), "{parameters}: {reason}");
    }
    let line_like = entity(
        128,
        "1,1,1,1,0,0,1,0,0,0.,0.,1.,1.,0.,0.,1.,1.,1.,1.,1.,1.,0.,0.,0.,5.,0.,0.,0.,0.,0.,5.,0.,0.,0.,1.,0.,1.",
    );
    assert!(reason(vec![line_like]).contains("no area"));
}

/// A trimmed face at `DE 3` and following whose outer loop are the lines through `corners`.
fn trimmed(corners: &[[f64; 3]]) -> Vec<Entity> {
    let count = corners.len() - 1;
    let first = 9;
    let parts: Vec<_> = (0..count).map(|i| (first + 2 * i).to_string()).collect();
    let mut entities =
        vec![entity(144, "5,1,0,7"), flat(10.0, 8.0), entity(142, format!("0,5,0,{},2", first + 2 * count))];
    entities.extend(corners.windows(2).map(|w| line(w[0], w[1])));
    entities.push(entity(102, format!("{count},{}", parts.join(","))));
    entities
}

#[test]
fn small_gaps_are_bridged_and_reported_and_wide_ones_refused() {
    let with_gap =
        |gap: f64| trimmed(&[[1.0, 1.0, 0.0], [9.0, 1.0, 0.0], [9.0, 7.0, 0.0], [1.0, 1.0 + gap, 0.0]]);
    let mut entities = vec![flat(10.0, 8.0)];
    entities.extend(with_gap(0.02));
    let import = read_bytes(file(&entities).as_bytes(), Path::new("test.igs")).unwrap();
    assert_eq!((import.model.faces.len(), import.report.repairs.len()), (2, 1));
    let repair = &import.report.repairs[0];
    assert_eq!(repair.entity, "DE 3");
    assert!((repair.size_mm - 0.02).abs() < 1e-9);
    let reason = reason(with_gap(2.0));
    assert!(reason.contains("does not close: gap 2.000 mm"), "{reason}");
}

/// A face is worth more than 3.8 mm of its edge: the gap is closed, and said by name.
#[test]
fn a_gap_that_is_wide_but_small_beside_its_loop_is_closed_with_a_warning() {
    let corners = [[10.0, 10.0, 0.0], [90.0, 10.0, 0.0], [90.0, 70.0, 0.0], [10.0, 13.8, 0.0]];
    let mut entities = vec![flat(10.0, 8.0)];
    entities.extend(trimmed(&corners));
    entities[2] = flat(100.0, 80.0);
    let import = read_bytes(file(&entities).as_bytes(), Path::new("test.igs")).unwrap();
    assert_eq!((import.model.faces.len(), import.report.skipped.len()), (2, 0));
    assert!((import.report.repairs[0].size_mm - 3.8).abs() < 1e-9);
    let told = import.report.warnings.iter().filter(|w| w.contains("3.800 mm")).count();
    assert_eq!(told, 1, "{:?}", import.report.warnings);
    approx::assert_relative_eq!(
        import.model.faces[1].area_mm2(),
        0.5 * 80.0 * (60.0 + 3.8),
        max_relative = 1e-9
    );
}

#[test]
fn trims_off_the_surface_or_without_area_are_refused() {
    let off = trimmed(&[[1.0, 1.0, 3.0], [9.0, 1.0, 3.0], [9.0, 7.0, 3.0], [1.0, 1.0, 3.0]]);
    assert!(reason(off).contains("3.000 mm off its surface"));
    let empty = trimmed(&[[1.0, 1.0, 0.0], [9.0, 1.0, 0.0], [1.0, 1.0, 0.0]]);
    assert!(reason(empty).contains("no area"));
}

#[test]
fn wrong_pointers_are_told_from_unsupported_entities() {
    assert!(reason(vec![entity(144, "99,1,0,0")]).contains("DE 99 does not exist"));
    assert!(reason(vec![entity(144, "5,0,0,0"), line([0.; 3], [1.; 3])]).contains("not a surface"));
    assert!(reason(vec![entity(144, "5,0,0,0"), entity(192, "0,0,5.")]).contains("DE 0 does not exist"));
    // A composite that contains itself.
    let mut cycle = trimmed(&[[1.0, 1.0, 0.0], [9.0, 1.0, 0.0]]);
    let last = cycle.len() - 1;
    cycle[last] = entity(102, "1,11");
    assert!(reason(cycle).contains("contains itself"));
    let mut placed = flat(10.0, 8.0);
    placed.matrix = 5;
    let mut own = entity(124, "1.,0.,0.,0.,0.,1.,0.,0.,0.,0.,1.,0.");
    own.matrix = 5;
    assert!(reason(vec![placed, own]).contains("contains itself"));
}

#[test]
fn hidden_faces_are_listed() {
    let mut hidden = flat(10.0, 8.0);
    hidden.status = "01000000";
    assert!(reason(vec![hidden]).contains("hidden"));
}

#[test]
fn the_frame_of_the_file_is_checked() {
    let read = |text: &str| read_bytes(text.as_bytes(), Path::new("body.igs"));
    assert!(matches!(read(" \r\n "), Err(ReadError::Empty { .. })));
    let error = read("dear colleague, the model is attached\n").unwrap_err();
    assert!(matches!(error, ReadError::UnknownFormat { .. }));
    assert!(error.to_string().contains("body.igs") && !error.advice().is_empty());
    let text = file(&[flat(10.0, 8.0), line([0.; 3], [1.; 3])]);
    let without = |letter: u8| -> String {
        text.lines().filter(|l| l.as_bytes()[72] != letter).map(|l| format!("{l}\n")).collect()
    };
    assert!(matches!(read(&without(b'D')), Err(ReadError::Truncated { .. })));
    assert!(matches!(read(&without(b'P')), Err(ReadError::Truncated { .. })));
    let unterminated = read(&without(b'T')).unwrap();
    assert_eq!((unterminated.model.faces.len(), unterminated.report.warnings.len()), (1, 1));
    let error = read(&file(&[line([0.; 3], [1.; 3])])).unwrap_err();
    assert!(matches!(error, ReadError::NoFaces { .. }));
    assert!(error.to_string().contains("1 × 110 line"), "{error}");
}

#[test]
fn line_ends_and_trailing_blanks_do_not_matter() {
    let text = file(&[flat(10.0, 8.0)]);
    let cards = text.replace('\n', "\r\n");
    let old_mac = text.replace('\n', "\r");
    let long: String = text.lines().map(|l| format!("{l}      \n")).collect();
    for variant in [text.clone(), cards, old_mac, long] {
        let import = read_bytes(variant.as_bytes(), Path::new("test.igs")).unwrap();
        assert_eq!((import.report.faces_read, import.report.warnings.len()), (1, 0));
    }
}

/// Files for the random damage: a hand-made one with every kind of face and, where there is a corpus, small real ones.
fn victims() -> Vec<Vec<u8>> {
    let mut entities = vec![flat(10.0, 8.0), entity(408, "13,1.,2.,3.,1.")];
    entities.extend([
        entity(120, "7,9,0.,3."),
        line([0.; 3], [0., 0., 1.]),
        line([2., 0., 0.], [2., 0., 5.]),
        entity(144, "1,0,1,0,15"),
        entity(308, "0,1Hx,1,5"),
        entity(142, "0,1,0,17,2"),
        entity(102, "2,19,21"),
        entity(100, "0.,5.,4.,8.,4.,2.,4."),
        line([8., 4., 0.], [2., 4., 0.]),
    ]);
    let mut victims = vec![file(&entities).into_bytes()];
    let real = ["bracket_inch.iges", "ship_hull_55.iges"].into_iter().filter_map(corpus_file);
    victims.extend(real.map(|path| std::fs::read(path).unwrap()));
    victims
}

#[test]
fn random_damage_never_panics_or_hangs() {
    let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(20_240_501);
    let victims = victims();
    for round in 0..400 {
        // The small file takes most of the damage: its every byte matters.
        let victim = &victims[if round % 4 == 0 { round / 4 % victims.len() } else { 0 }];
        let mut bytes = victim.clone();
        if round % 3 == 0 {
            bytes.truncate(random.random_range(0..bytes.len()));
        }
        let flips = if round % 2 == 0 { 1 + bytes.len() / 500 } else { random.random_range(1..5) };
        for _ in 0..flips.min(bytes.len()) {
            let at = random.random_range(0..bytes.len());
            bytes[at] = match random.random_range(0..4) {
                0 => random.random(),
                1 => b"0123456789"[random.random_range(0..10)],
                2 => b",;H.-+DE \n"[random.random_range(0..10)],
                _ => bytes[at] ^ (1 << random.random_range(0..7)),
            };
        }
        let start = Instant::now();
        if let Ok(import) = read_bytes(&bytes, Path::new("damaged.igs")) {
            let report = &import.report;
            assert_eq!(report.faces_in_file, report.faces_read + report.skipped.len());
            let finite =
                |f: &claymill_nurbs::Face| f.surface.net().iter().all(|h| h.iter().all(|c| c.is_finite()));
            assert!(import.model.faces.iter().all(finite));
        }
        let elapsed = start.elapsed();
        assert!(elapsed < Duration::from_secs(20), "round {round}: {elapsed:?}");
    }
}
