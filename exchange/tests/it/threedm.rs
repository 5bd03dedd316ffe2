//! Rhino archives of several versions against their formulas, and the corpus against second opinions.
//!
//! The archives beside this file were written by McNeel's own toolkit (`make.py`): every version holds the same
//! objects.

use std::collections::BTreeMap;
use std::f64::consts::PI;
use std::path::{Path, PathBuf};

use claymill_exchange::{Format, Import, ReadError, read, read_bytes};
use claymill_nurbs::{Face, SurfaceKind};
use claymill_tests::corpus;

fn fixture(name: &str) -> PathBuf {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/threedm")).join(name)
}

fn import(path: &Path) -> Import {
    let import = read(path).unwrap_or_else(|e| panic!("{e}"));
    let report = &import.report;
    assert_eq!(report.faces_in_file, report.faces_read + report.skipped.len());
    assert_eq!((import.model.faces.len(), report.format), (report.faces_read, Format::Rhino3dm));
    import
}

fn areas_by_name(faces: &[Face]) -> BTreeMap<&str, (usize, f64)> {
    let mut areas: BTreeMap<&str, (usize, f64)> = BTreeMap::new();
    for face in faces {
        let entry = areas.entry(face.source.name.as_deref().unwrap()).or_default();
        *entry = (entry.0 + 1, entry.1 + face.area_mm2());
    }
    areas
}

/// Area of the vase: a line from (6, 0) to (10, 5) and the arc on through (9, 9) to (6.5, 11), in radius and
/// height, turned by 4.7 radians.
fn vase() -> f64 {
    let (a, b, c) = ([10.0, 5.0], [9.0, 9.0], [6.5, 11.0]);
    // The circle through three points: equal distances, two linear equations.
    let row = |p: [f64; 2], q: [f64; 2]| {
        let [x, y] = [q[0] - p[0], q[1] - p[1]];
        (x, y, 0.5 * (q[0] * q[0] + q[1] * q[1] - p[0] * p[0] - p[1] * p[1]))
    };
    let ((x1, y1, d1), (x2, y2, d2)) = (row(a, b), row(b, c));
    let det = x1 * y2 - x2 * y1;
    let centre = [(d1 * y2 - d2 * y1) / det, (x1 * d2 - x2 * d1) / det];
    let radius = f64::hypot(a[0] - centre[0], a[1] - centre[1]);
    let angle = |p: [f64; 2]| f64::atan2(p[1] - centre[1], p[0] - centre[0]);
    // Pappus: the integral of the distance from the axis along the arc.
    let (from, to) = (angle(a), angle(c));
    let arc = radius * (centre[0] * (to - from) + radius * (to.sin() - from.sin()));
    let line = 8.0 * f64::hypot(4.0, 5.0);
    4.7 * (line + arc)
}

#[test]
fn every_version_holds_the_same_objects() {
    for (name, unit, blocks) in
        [("v2.3dm", 1.0, false), ("v4.3dm", 25.4, true), ("v5.3dm", 1.0, true), ("v8.3dm", 25.4, true)]
    {
        let import = import(&fixture(name));
        let (faces, report) = (&import.model.faces, &import.report);
        assert_eq!(report.units.mm_per_unit, unit, "{name}");
        assert!((report.tolerance_mm - 0.001 * unit).abs() < 1e-12, "{name}");
        assert_eq!(report.warnings, Vec::<String>::new(), "{name}");
        let mut expected = BTreeMap::from([
            ("box", (6, 2200.0)),
            ("cylinder", (3, 2.0 * PI * 25.0 + 2.0 * PI * 5.0 * 12.0)),
            ("sphere", (1, 4.0 * PI * 49.0)),
            ("ball", (1, 4.0 * PI * 9.0)),
            ("vase", (1, vase())),
            ("plate", (7, 2.0 * (200.0 - 4.0 * PI) + 6.0 * (60.0 + 4.0 * PI))),
        ]);
        if blocks {
            expected.insert("bolt part", (2, 30.0));
        }
        let areas = areas_by_name(faces);
        assert_eq!(areas.keys().collect::<Vec<_>>(), expected.keys().collect::<Vec<_>>(), "{name}");
        for (object, (count, area)) in expected {
            let (read_count, read_area) = areas[object];
            assert_eq!(read_count, count, "{name} {object}");
            let error = read_area / (area * unit * unit) - 1.0;
            assert!(error.abs() < 1e-9, "{name} {object}: {error:e}");
        }
        let reasons: Vec<_> = report.skipped.iter().map(|s| s.reason.as_str()).collect();
        let count = |text: &str| reasons.iter().filter(|r| r.contains(text)).count();
        // Version 2 knows no blocks: the toolkit writes the instances alone.
        let lost = if blocks { 0 } else { 2 };
        assert_eq!(
            (count("layer (hidden)"), count("object is hidden"), count("mesh")),
            (1, 1, 1),
            "{reasons:?}"
        );
        assert_eq!((count("block that is placed here is not in the file"), reasons.len()), (lost, 3 + lost));
    }
}

#[test]
fn names_layers_colours_and_blocks_come_along() {
    let import = import(&fixture("v8.3dm"));
    let named = |name: &str| -> Vec<&Face> {
        import.model.faces.iter().filter(|f| f.source.name.as_deref() == Some(name)).collect()
    };
    let (sphere, ball) = (named("sphere")[0], named("ball")[0]);
    assert_eq!(sphere.source.layer.as_deref(), Some("body"));
    assert_eq!((sphere.source.colour, ball.source.colour), (Some([200, 100, 50]), Some([10, 20, 30])));
    assert_eq!((sphere.kind, ball.kind), (SurfaceKind::Revolution, SurfaceKind::Nurbs));
    // One block is moved by 200 inches, the other mirrored at 220.
    let placed = named("bolt part");
    let left = |f: &Face| f.bounds().min.x / 25.4;
    assert!((left(placed[0]) - 200.0).abs() < 1e-9 && (left(placed[1]) - 437.0).abs() < 1e-9);
    assert_eq!((placed[0].reversed, placed[1].reversed), (false, true));
    // Solids look outwards.
    for (name, centre) in
        [("box", [5.0, 10.0, 15.0]), ("cylinder", [50.0, 0.0, 6.0]), ("plate", [2.0, 2.0, 3.0])]
    {
        for face in named(name).into_iter().filter(|f| f.bounds().diagonal() > 6.0 * 25.4) {
            let ((u0, u1), (v0, v1)) = face.surface.domain();
            let (p, n) = (0.3, 0.4);
            let (u, v) = (u0 + p * (u1 - u0), v0 + n * (v1 - v0));
            let out = face.surface.point(u, v) - claymill_nurbs::Point3::from(centre).coords * 25.4;
            let normal = face.surface.normal(u, v).unwrap().0;
            let outward = normal.dot(&out.coords) > 0.0;
            assert_eq!(outward, !face.reversed, "{name}: {:?}", face.source.entity);
        }
    }
}

#[test]
fn the_frame_of_the_file_is_checked() {
    let sound = std::fs::read(fixture("v5.3dm")).unwrap();
    let read = |bytes: &[u8]| read_bytes(bytes, Path::new("body.3dm"));
    assert!(matches!(read(&sound[..40]), Err(ReadError::Truncated { .. })));
    let with_version = |text: &[u8]| {
        let mut bytes = sound.clone();
        bytes[24..32].copy_from_slice(text);
        bytes
    };
    assert!(matches!(read(&with_version(b"       1")), Err(ReadError::Unsupported { .. })));
    assert!(matches!(read(&with_version(b"      xx")), Err(ReadError::Damaged { .. })));
    // Cut in the middle of the objects: those before the cut are read, the loss is told.
    let cut = read(&sound[..sound.len() / 2]).unwrap();
    assert!(cut.report.faces_read > 0 && !cut.report.warnings.is_empty());
    assert!(cut.report.skipped.last().unwrap().reason.contains("break off"), "{:?}", cut.report.skipped);
}

#[test]
fn a_changed_byte_is_caught_by_the_checksum() {
    let mut bytes = std::fs::read(fixture("v8.3dm")).unwrap();
    let ball = import(&fixture("v8.3dm"));
    let face = ball.model.faces.iter().find(|f| f.source.name.as_deref() == Some("ball")).unwrap();
    // A digit of a coordinate of the ball: still a number.
    let z = 100.0_f64.to_le_bytes();
    let at = bytes.windows(8).rposition(|w| w == z).unwrap();
    bytes[at + 5] ^= 1;
    let import = read_bytes(&bytes, Path::new("body.3dm")).unwrap();
    let caught = import.report.skipped.iter().find(|s| s.reason.contains("checksum")).unwrap();
    assert!(face.source.entity.starts_with(&caught.entity), "{caught:?}");
}

/// The bottle was saved with the display meshes of its faces: their area, added up from the file by McNeel's
/// reader, is 110 435.79 mm² with chords. Faces of which Open CASCADE 7.9 could rebuild the trims from the edges
/// in space agree within 4e-4 each.
#[test]
fn the_bottle_agrees_with_its_display_meshes() {
    let Some(folder) = corpus() else { return };
    let import = import(&folder.join("perfume_bottle.3dm"));
    assert_eq!((import.report.faces_read, import.report.skipped.len()), (260, 0));
    let area: f64 = import.model.faces.iter().map(Face::area_mm2).sum();
    assert!((area / 110_435.79 - 1.0).abs() < 1e-3, "{area}");
    assert!((area / 110_484.611 - 1.0).abs() < 1e-7, "{area}");
}

/// The teapot has none. Its largest trimmed plane, a disc with twenty holes, has an area of 470.892 365 mm² by
/// the edges in space as McNeel's reader evaluates them.
#[test]
fn the_teapot_agrees_with_its_edges_in_space() {
    let Some(folder) = corpus() else { return };
    let import = import(&folder.join("teapot.3dm"));
    assert_eq!((import.report.faces_read, import.report.skipped.len()), (97, 0));
    let planes: Vec<_> = import.model.faces.iter().filter(|f| f.kind == SurfaceKind::Plane).collect();
    let largest = planes.iter().map(|f| f.area_mm2()).fold(0.0, f64::max);
    assert!((largest / 470.892_364_5 - 1.0).abs() < 1e-6, "{largest}");
    assert_eq!(import.model.faces.iter().filter(|f| f.kind == SurfaceKind::Revolution).count(), 6);
    // One edge strays from its surface, a ring of revolution of 257.958 mm², by a hundredth of a millimetre. The
    // trim does not: the face is no larger than the surface.
    let ring = import.model.faces.iter().find(|f| (257.0..259.0).contains(&f.area_mm2())).unwrap();
    let whole = Face { loops: Vec::new(), ..ring.clone() }.area_mm2();
    assert!(ring.area_mm2() <= whole && ring.area_mm2() > whole - 0.1, "{} of {whole}", ring.area_mm2());
    let layers: std::collections::BTreeSet<_> =
        import.model.faces.iter().filter_map(|f| f.source.layer.clone()).collect();
    assert_eq!(layers.into_iter().collect::<Vec<_>>(), ["Lids", "Logos", "Pots"]);
}
