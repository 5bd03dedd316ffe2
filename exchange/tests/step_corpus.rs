//! Reads the STEP files of the corpus.

use std::path::PathBuf;
use std::time::Instant;

use claymill_exchange::{Import, read};
use claymill_nurbs::{Curve2, Face};

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

/// Five-point Gauss–Legendre nodes and weights on `[0, 1]`.
const GAUSS: [(f64, f64); 5] = [
    (0.046910077030668, 0.118_463_442_528_094_5),
    (0.2307653449471585, 0.239314335249683),
    (0.5, 0.284_444_444_444_444_4),
    (0.7692346550528415, 0.239314335249683),
    (0.953089922969332, 0.118_463_442_528_094_5),
];

/// Area of a trimmed face by Green's theorem: the integral of `F dv` around the loops, where `F(u, v)` is the
/// integral of the area element from `u0` to `u`. Nothing of the kernel but evaluation is used.
fn green_area(face: &Face) -> f64 {
    let surface = &face.surface;
    let breaks = surface.knots_u().breaks();
    let strip = |u: f64, v: f64| -> f64 {
        let element = |t: f64| {
            let j = surface.jet(t, v);
            j.su.cross(&j.sv).norm()
        };
        breaks
            .windows(2)
            .filter(|w| w[0] < u)
            .map(|w| {
                let (a, b) = (w[0], w[1].min(u));
                GAUSS
                    .iter()
                    .map(|(x, w)| w * (b - a) * element(a + (b - a) * x))
                    .sum::<f64>()
            })
            .sum()
    };
    let edge = |c: &Curve2| -> f64 {
        let spans = c.knots().breaks();
        let parts = if spans.len() > 8 { 1 } else { 12 };
        spans
            .windows(2)
            .flat_map(|w| {
                (0..parts).map(move |k| {
                    (
                        w[0] + (w[1] - w[0]) * f64::from(k) / f64::from(parts),
                        (w[1] - w[0]) / f64::from(parts),
                    )
                })
            })
            .flat_map(|(a, step)| GAUSS.map(|(x, w)| (a + step * x, w * step)))
            .map(|(t, w)| {
                let [p, d, _] = c.derivatives(t);
                if d.y == 0.0 {
                    0.0
                } else {
                    w * d.y * strip(p.x, p.y)
                }
            })
            .sum()
    };
    face.boundary()
        .iter()
        .flat_map(|l| &l.edges)
        .map(|e| edge(&e.pcurve))
        .sum()
}

#[test]
fn areas_are_those_of_another_kernel() {
    for (name, area) in [
        ("race_car_nose_141.stp", 1_707_286.461),
        ("prismatic_ctc01.stp", 807_326.814),
        ("prismatic_ctc03_inch.stp", 353_029.148),
        ("prismatic_ctc05_inch.stp", 857_521.801),
        ("airliner_272.stp", 721_594_383.574),
        ("wind_turbine_blade_unit_trap.stp", 1_099.797),
    ] {
        let Some(import) = import(name) else { continue };
        let areas: Vec<f64> = import.model.faces.iter().map(green_area).collect();
        let sum: f64 = areas.iter().sum();
        eprintln!(
            "  area {sum:.3}, expected {area}, relative {:.2e}",
            sum / area - 1.0
        );
        for (f, a) in import.model.faces.iter().zip(&areas).filter(|(_, a)| **a <= 0.0) {
            eprintln!("   {} {:?} {a}", f.source.entity, f.kind);
        }
        if let Some(wanted) = std::env::var_os("DUMP_AREAS") {
            let _ = std::fs::write(
                std::path::Path::new(&wanted).join(name),
                import
                    .model
                    .faces
                    .iter()
                    .zip(&areas)
                    .map(|(f, a)| format!("{} {:?} {a}\n", f.source.entity, f.kind))
                    .collect::<String>(),
            );
        }
    }
}
