//! Every IGES file of the corpus against the second opinion of its `answers.json`.

use claymill_exchange::{Import, read};
use claymill_nurbs::{Aabb, Face, NurbsSurface, Point2};
use claymill_tests::corpus;
use rayon::prelude::*;

fn import(path: &std::path::Path) -> Import {
    let import = read(path).unwrap_or_else(|e| panic!("{e}"));
    let report = &import.report;
    assert_eq!(report.faces_in_file, report.faces_read + report.skipped.len());
    assert_eq!(import.model.faces.len(), report.faces_read);
    import
}

/// Gauss–Legendre nodes and weights on `[0, 1]`, five points.
const GAUSS: [(f64, f64); 5] = [
    (0.046_910_077_030_668, 0.118_463_442_528_095),
    (0.230_765_344_947_158, 0.239_314_335_249_683),
    (0.5, 0.284_444_444_444_444),
    (0.769_234_655_052_842, 0.239_314_335_249_683),
    (0.953_089_922_969_332, 0.118_463_442_528_095),
];

/// Integral of `|Su × Sv|` over a stretch of one line `v = const`, knot span by knot span.
fn stretch(surface: &NurbsSurface, v: f64, (a, b): (f64, f64)) -> f64 {
    let breaks = surface.knots_u().breaks();
    let spans = breaks.windows(2).map(|w| (w[0].max(a), w[1].min(b)));
    let piece = |(a, b): (f64, f64)| -> f64 {
        let node = |(x, w): (f64, f64)| {
            let j = surface.jet(a + (b - a) * x, v);
            j.su.cross(&j.sv).norm() * w
        };
        (b - a) * GAUSS.into_iter().map(node).sum::<f64>()
    };
    // Two halves a span: the area element is no polynomial.
    spans.filter(|(a, b)| b > a).map(|(a, b)| piece((a, 0.5 * (a + b))) + piece((0.5 * (a + b), b))).sum()
}

/// Area by scan lines: slow and simple, and nothing that the reader or the kernel's own measure use.
fn area(face: &Face) -> f64 {
    let surface = &face.surface;
    let breaks = surface.knots_v().breaks();
    if face.loops.is_empty() {
        let lines = breaks.windows(2).flat_map(|w| {
            let half = 0.5 * (w[1] - w[0]);
            [w[0], w[0] + half]
                .into_iter()
                .flat_map(move |v0| GAUSS.map(|(x, weight)| (v0 + half * x, weight * half)))
        });
        return lines.map(|(v, w)| w * stretch(surface, v, surface.domain().0)).sum();
    }
    let rings: Vec<Vec<Point2>> = (face.loops.iter())
        .map(|l| {
            let along = l.edges.iter().flat_map(|e| {
                let breaks = e.pcurve.knots().breaks();
                let stations: Vec<_> = breaks
                    .windows(2)
                    .flat_map(|w| (0..100).map(|i| w[0] + (w[1] - w[0]) * f64::from(i) / 100.0))
                    .collect();
                stations.into_iter().map(|t| e.pcurve.point(t))
            });
            along.collect()
        })
        .collect();
    let heights = || rings.iter().flatten().map(|p| p.y);
    let (low, high) = (heights().fold(f64::INFINITY, f64::min), heights().fold(f64::NEG_INFINITY, f64::max));
    // The round ends of loops make the sum converge slowly; small surfaces can afford more lines.
    let lines = 24_000 / surface.knots_u().breaks().len() as u32;
    let step = (high - low) / f64::from(lines);
    let line = |i: u32| {
        let v = low + step * (f64::from(i) + 0.5);
        let mut crossings: Vec<f64> = (rings.iter())
            .flat_map(|r| r.iter().zip(r.iter().cycle().skip(1)))
            .filter(|(a, b)| (a.y > v) != (b.y > v))
            .map(|(a, b)| a.x + (v - a.y) / (b.y - a.y) * (b.x - a.x))
            .collect();
        crossings.sort_by(f64::total_cmp);
        crossings.chunks(2).map(|c| stretch(surface, v, (c[0], c[1]))).sum::<f64>()
    };
    (0..lines).map(line).sum::<f64>() * step
}

/// A box of surface points, edges included, and thus inside the true box.
fn inner_box(import: &Import) -> Aabb {
    let mut bounds = Aabb::empty();
    for face in &import.model.faces {
        for trim in face.boundary() {
            for edge in &trim.edges {
                let (a, b) = edge.pcurve.domain();
                for i in 0..=40 {
                    let p = edge.pcurve.point(a + (b - a) * f64::from(i) / 40.0);
                    bounds.add(&face.surface.point(p.x, p.y));
                }
            }
        }
        if face.loops.is_empty() {
            let ((u0, u1), (v0, v1)) = face.surface.domain();
            for k in 0..64 {
                let (x, y) = (f64::from(k % 8) / 7.0, f64::from(k / 8) / 7.0);
                bounds.add(&face.surface.point(u0 + (u1 - u0) * x, v0 + (v1 - v0) * y));
            }
        }
    }
    bounds
}

#[test]
fn counts_areas_and_boxes_of_all_files() {
    let Some(folder) = corpus() else { return };
    let answers = std::fs::read_to_string(folder.join("answers.json")).unwrap();
    let answers: serde_json::Value = serde_json::from_str(&answers).unwrap();
    let answers = answers.as_object().unwrap();
    let is_iges = |name: &&String| name.ends_with(".igs") || name.ends_with(".iges");
    for name in answers.keys().filter(is_iges) {
        let import = import(&folder.join(name));
        let answer = &answers[name];
        assert_eq!(import.report.skipped, [], "{name}");
        assert_eq!(import.model.faces.len() as u64, answer["faces"].as_u64().unwrap(), "{name}");
        let (found, expected) =
            (import.model.faces.par_iter().map(area).sum::<f64>(), answer["area_mm2"].as_f64().unwrap());
        let error = (found / expected - 1.0).abs();
        eprintln!("{name}: area {found:.3} mm², {error:.1e} from the answer");
        let corner = |i: usize| answer["box_mm"][i].as_f64().unwrap();
        let bounds = inner_box(&import);
        let mut worst = 0.0_f64;
        for k in 0..3 {
            let (below, above) = (bounds.min[k] - corner(k), corner(k + 3) - bounds.max[k]);
            eprintln!("   box axis {k}: {below:+.4} {above:+.4} mm inside");
            assert!(below > -1.5e-3 && above > -1.5e-3, "{name} axis {k}: {bounds:?}");
            worst = worst.max(below).max(above);
        }
        assert!(worst < 2e-3 * bounds.diagonal(), "{name}: {bounds:?}");
        assert!(error < 1e-5, "{name}: {found} instead of {expected} mm²");
    }
}

#[test]
fn what_the_files_declare_is_reported() {
    let Some(folder) = corpus() else { return };
    for (name, unit, scale, step) in [
        ("bracket_inch.iges", "INCH", 25.4, 1e-8),
        ("ship_hull_55.iges", "M", 1000.0, 1e-3),
        ("wind_turbine_blade_metre.igs", "M", 1000.0, 1e-6),
        ("sports_car_6300.igs", "MM", 1.0, 1e-5),
    ] {
        let import = import(&folder.join(name));
        assert_eq!((import.report.units.declared.as_str(), import.report.units.mm_per_unit), (unit, scale));
        let found = import.model.coordinate_step_mm;
        assert!(found > 0.0 && found < step, "{name}: {found}");
        let entities = &import.report.entities;
        assert!(entities["128 B-spline surface"].used > 0, "{name}: {entities:?}");
        let json = serde_json::to_string(&import.report).unwrap();
        assert_eq!(serde_json::from_str::<claymill_exchange::ImportReport>(&json).unwrap(), import.report);
    }
}

#[test]
fn a_large_file_is_read_in_seconds() {
    let Some(folder) = corpus() else { return };
    let start = std::time::Instant::now();
    let import = import(&folder.join("sports_car_25200.igs"));
    let elapsed = start.elapsed();
    eprintln!("25200 faces in {elapsed:.2?}");
    assert_eq!(import.model.faces.len(), 25200);
    assert!(elapsed.as_secs() < 20, "{elapsed:?}");
}
