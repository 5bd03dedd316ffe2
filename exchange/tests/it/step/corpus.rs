//! The STEP files of the corpus against the answers of another kernel.

use std::time::Instant;

use claymill_exchange::{Import, read};
use claymill_tests::corpus_file;

use super::green::green_area;

#[track_caller]
fn import(name: &str) -> Option<Import> {
    let path = corpus_file(name)?;
    let start = Instant::now();
    let import = read(&path).unwrap();
    eprintln!("{name}: {} faces in {:.2?}", import.model.faces.len(), start.elapsed());
    Some(import)
}

#[test]
fn faces_units_and_areas_are_those_of_another_kernel() {
    // The race car's extrusions are where the other kernel's integration does not converge (its own
    // triangulation at 2 µm agrees with us to 2e-5 on each of them), hence the wider limit.
    for (name, faces, mm, area, limit) in [
        ("race_car_nose_141.stp", 141, 1000.0, 1_707_286.461, 1e-4),
        ("prismatic_ctc01.stp", 113, 1.0, 807_326.814, 1e-8),
        ("prismatic_ctc03_inch.stp", 120, 25.4, 353_029.148, 1e-8),
        ("prismatic_ctc05_inch.stp", 163, 25.4, 857_521.801, 1e-7),
        ("airliner_272.stp", 272, 1.0, 721_594_383.574, 1e-6),
        ("wind_turbine_blade_unit_trap.stp", 3, 1.0, 1_099.797, 1e-5),
    ] {
        let Some(import) = import(name) else { continue };
        assert_eq!(import.report.faces_in_file, faces, "{name}");
        assert_eq!(import.report.skipped, [], "{name}");
        assert_eq!(import.report.repairs, [], "{name}");
        assert_eq!(import.report.units.mm_per_unit, mm, "{name}");
        let sum: f64 = import.model.faces.iter().map(green_area).sum();
        eprintln!("  area {sum:.3}, relative to the answer {:.1e}", sum / area - 1.0);
        approx::assert_relative_eq!(sum, area, max_relative = limit);
    }
}

#[test]
fn the_large_sewn_car_keeps_its_topology() {
    let Some(import) = import("sports_car_6300_sewn.stp") else {
        return;
    };
    assert_eq!((import.report.faces_in_file, import.report.skipped.len()), (6300, 0));
    let mut uses = std::collections::BTreeMap::new();
    for edge in import.model.faces.iter().flat_map(|f| &f.loops).flat_map(|l| &l.edges) {
        *uses.entry(edge.shared.unwrap()).or_insert(0) += 1;
    }
    // 25 200 sides, of which 120 are free.
    let count = |n: usize| uses.values().filter(|u| **u == n).count();
    assert_eq!((count(1), count(2), uses.len()), (120, 12540, 12660));
}

#[test]
fn implausible_units_are_warned_about_and_sound_ones_are_not() {
    for (name, doubtful) in [
        ("wind_turbine_blade_unit_trap.stp", true),
        ("wind_turbine_blade_metre.igs", true),
        ("prismatic_ctc03_inch.stp", false),
        ("race_car_nose_141.stp", false),
        ("airliner_272.stp", false),
        ("airliner_fuselage_238.igs", false),
        ("bracket_inch.iges", false),
        ("helmet_928.igs", false),
    ] {
        let Some(import) = import(name) else { continue };
        let warned = import.report.warnings.iter().any(|w| w.contains("implausible"));
        assert_eq!(warned, doubtful, "{name}: {:?}", import.report.warnings);
    }
}
