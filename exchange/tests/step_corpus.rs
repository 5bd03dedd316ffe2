//! Reads the STEP files of the corpus.

use std::path::PathBuf;
use std::time::Instant;

use claymill_exchange::{Import, read};

/// The file of the corpus, or `None` (with a message) where the corpus is absent.
fn corpus(name: &str) -> Option<PathBuf> {
    let folder = std::env::var_os("CLAYMILL_CORPUS").map_or_else(
        || PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../shared/corpus"),
        PathBuf::from,
    );
    let path = folder.join(name);
    if !path.exists() {
        eprintln!("skipped: {} is not there", path.display());
        return None;
    }
    Some(path)
}

fn import(name: &str) -> Option<Import> {
    let path = corpus(name)?;
    let start = Instant::now();
    let import = read(&path).unwrap();
    eprintln!(
        "{name}: {} faces in {:.2?}",
        import.model.faces.len(),
        start.elapsed()
    );
    for s in import.report.skipped.iter().take(5) {
        eprintln!("  skipped {} {}: {}", s.entity, s.what, s.reason);
    }
    for r in import.report.repairs.iter().take(5) {
        eprintln!("  repaired {} {}: {} mm", r.entity, r.what, r.size_mm);
    }
    for w in &import.report.warnings {
        eprintln!("  warning {w}");
    }
    eprintln!(
        "  {:?} tolerance {} step {}",
        import.report.units, import.model.tolerance_mm, import.model.coordinate_step_mm
    );
    Some(import)
}

#[test]
fn every_face_of_the_corpus_is_read() {
    for (name, faces) in [
        ("race_car_nose_141.stp", 141),
        ("prismatic_ctc01.stp", 113),
        ("prismatic_ctc03_inch.stp", 120),
        ("prismatic_ctc05_inch.stp", 163),
        ("airliner_272.stp", 272),
        ("wind_turbine_blade_unit_trap.stp", 3),
        ("sports_car_6300_sewn.stp", 6300),
    ] {
        let Some(import) = import(name) else { continue };
        assert_eq!(import.report.faces_in_file, faces, "{name}");
        assert_eq!(import.report.skipped, [], "{name}");
    }
}
