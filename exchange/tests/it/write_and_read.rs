//! What is written reads back as the same model.

use std::path::Path;

use claymill_exchange::{Group, WriteError, read, write_iges, write_step};
use claymill_nurbs::{
    Curve2, Face, KnotVector, Model, NurbsSurface, Point2, Point3, Source, SurfaceKind, TrimEdge, TrimLoop,
};
use claymill_tests::corpus_file;

fn bowl(rational: bool) -> NurbsSurface {
    let (nu, nv) = (5, 4);
    let points = (0..nu * nv).map(|k| {
        let (x, y) = (f64::from(k / nv) * 31.7, f64::from(k % nv) * 17.3);
        Point3::new(x, y, ((x * 0.03).sin() + (y * 0.05).cos()) * 12.345)
    });
    let weights = rational.then(|| (0..nu * nv).map(|k| 1.0 + 0.1 * f64::from(k % 3)).collect());
    NurbsSurface::new(
        KnotVector::new(3, vec![0., 0., 0., 0., 0.3, 1., 1., 1., 1.]).unwrap(),
        KnotVector::clamped_uniform(3, 4),
        points.collect(),
        weights,
    )
    .unwrap()
}

fn ring(centre: (f64, f64), radius: f64, clockwise: bool) -> TrimLoop {
    // Four quarter circles, anticlockwise.
    let s = std::f64::consts::FRAC_1_SQRT_2;
    let corner = |i: i32| {
        let angle = f64::from(i) * std::f64::consts::FRAC_PI_4;
        let reach = if i % 2 == 0 { radius } else { radius / s };
        Point2::new(centre.0 + reach * angle.cos(), centre.1 + reach * angle.sin())
    };
    let quarter = |q: i32| {
        let points = (2 * q..=2 * q + 2).map(corner).collect();
        Curve2::new(KnotVector::clamped_uniform(2, 3), points, Some(vec![1.0, s, 1.0])).unwrap()
    };
    let mut edges: Vec<_> = (0..4).map(|q| TrimEdge { pcurve: quarter(q), shared: None }).collect();
    if clockwise {
        edges.reverse();
        for edge in &mut edges {
            edge.pcurve = edge.pcurve.reversed();
        }
    }
    TrimLoop { edges }
}

fn face(surface: NurbsSurface, loops: Vec<TrimLoop>, name: &str) -> Face {
    Face {
        surface,
        loops,
        reversed: false,
        kind: SurfaceKind::Nurbs,
        source: Source { name: Some(name.into()), layer: Some("7".into()), ..Source::default() },
    }
}

fn sample() -> (Model, Vec<Group>) {
    let trimmed = vec![ring((0.5, 0.5), 0.4, false), ring((0.5, 0.6), 0.1, true)];
    let model = Model {
        faces: vec![
            face(bowl(false), vec![], "roof; left, front"),
            face(bowl(true), vec![], "dôme"),
            face(bowl(true), trimmed.clone(), "door"),
            Face { reversed: true, ..face(bowl(false), trimmed, "flap") },
        ],
        tolerance_mm: 0.002,
        coordinate_step_mm: 0.0,
    };
    let group = |name: &str, colour, faces| Group { name: name.into(), colour, faces };
    let groups = vec![group("upper", Some([255, 128, 3]), vec![0, 2]), group("lower", None, vec![1])];
    (model, groups)
}

type Write = fn(&Path, &Model, &[Group]) -> Result<(), WriteError>;
const WRITERS: [(&str, Write); 2] = [("sample.igs", write_iges), ("sample.stp", write_step)];

/// A point of an edge, by the share of its parameter.
fn on_edge(face: &Face, pcurve: &Curve2, share: f64) -> Point3 {
    let (a, b) = pcurve.domain();
    let p = pcurve.point(a + (b - a) * share);
    face.surface.point(p.x, p.y)
}

/// Distance of a point from an edge: samples, then the best interval narrowed down.
fn distance_to_edge(face: &Face, pcurve: &Curve2, p: &Point3) -> f64 {
    let steps = 24 * pcurve.knots().breaks().len() as u32;
    let distance = |share: f64| (on_edge(face, pcurve, share) - p).norm();
    let best = (0..=steps).min_by(|i, j| {
        distance(f64::from(*i) / f64::from(steps)).total_cmp(&distance(f64::from(*j) / f64::from(steps)))
    });
    let (at, step) = (f64::from(best.unwrap()) / f64::from(steps), 1.0 / f64::from(steps));
    let (mut low, mut high) = ((at - step).max(0.0), (at + step).min(1.0));
    for _ in 0..90 {
        let (a, b) = (low + (high - low) / 3.0, high - (high - low) / 3.0);
        if distance(a) < distance(b) { high = b } else { low = a }
    }
    [at, low, high].map(distance).into_iter().fold(f64::INFINITY, f64::min)
}

/// Largest distance of the boundary of `a`, at some of its points, from that of `b`.
fn boundaries_apart(a: &Face, b: &Face) -> f64 {
    let there = b.boundary();
    let distance = |p: Point3| {
        let edges = there.iter().flat_map(|l| &l.edges);
        edges.map(|e| distance_to_edge(b, &e.pcurve, &p)).fold(f64::INFINITY, f64::min)
    };
    let here = a.boundary();
    let points = here.iter().flat_map(|l| &l.edges);
    let points = points.flat_map(|e| [0.0, 0.3, 0.7].map(|x| on_edge(a, &e.pcurve, x)));
    points.map(distance).fold(0.0, f64::max)
}

#[test]
fn models_of_the_corpus_come_back_the_same() {
    let folder = tempfile::tempdir().unwrap();
    let mut worst = 0.0_f64;
    for name in [
        "prismatic_ctc01.stp",
        "race_car_nose_141.stp",
        "airliner_272.stp",
        "bracket_inch.iges",
        "ship_hull_55.iges",
        "helmet_928.igs",
    ] {
        let Some(path) = corpus_file(name) else { continue };
        let first = read(&path).unwrap();
        for (copy, write) in WRITERS {
            let path = folder.path().join(copy);
            write(&path, &first.model, &[]).unwrap();
            let second = read(&path).unwrap();
            assert_eq!(second.report.skipped, [], "{name} as {copy}");
            assert_eq!(second.model.faces.len(), first.model.faces.len(), "{name} as {copy}");
            let size = first.model.faces.iter().flat_map(|f| f.surface.net()).map(|h| (h / h.w).xyz().norm());
            let size = size.fold(0.0, f64::max);
            let (mut surfaces, mut boundaries) = (0.0_f64, 0.0_f64);
            for (a, b) in first.model.faces.iter().zip(&second.model.faces) {
                let ((u0, u1), (v0, v1)) = a.surface.domain();
                let turned = copy == "sample.igs" && a.reversed;
                for k in 0..25 {
                    let (x, y) = (f64::from(k % 5) / 4.0, f64::from(k / 5) / 4.0);
                    let (u, v) = (u0 + (u1 - u0) * x, v0 + (v1 - v0) * y);
                    let back = if turned { u0 + u1 - u } else { u };
                    surfaces = surfaces.max((a.surface.point(u, v) - b.surface.point(back, v)).norm());
                }
                if !(a.loops.is_empty() && b.loops.is_empty()) {
                    let apart = boundaries_apart(a, b);
                    if apart > 1e-9 * size {
                        eprintln!("   {} {:?}: {apart:.1e}", a.source.entity, a.kind);
                    }
                    boundaries = boundaries.max(apart);
                }
                assert_eq!(a.reversed != turned, b.reversed, "{name} as {copy}");
            }
            eprintln!(
                "{name} as {copy}: surfaces {surfaces:.1e}, boundaries {boundaries:.1e} of {size:.0} mm"
            );
            worst = worst.max(surfaces / size).max(boundaries / size);
        }
    }
    assert!(worst <= 1e-9, "{worst:.1e}");
}

#[test]
fn shells_are_sewn_where_the_model_knows_it() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("sewn.stp");
    let Some(real) = corpus_file("prismatic_ctc01.stp") else { return };
    let first = read(&real).unwrap();
    write_step(&path, &first.model, &[]).unwrap();
    let second = read(&path).unwrap();
    let uses = |model: &Model| {
        let mut uses = std::collections::BTreeMap::new();
        for id in model.faces.iter().flat_map(|f| &f.loops).flat_map(|l| &l.edges).filter_map(|e| e.shared) {
            *uses.entry(id).or_insert(0_usize) += 1;
        }
        (uses.len(), uses.values().filter(|n| **n == 2).count())
    };
    let (edges, double) = uses(&first.model);
    assert!(double > 100 && double == edges, "{edges} {double}");
    assert_eq!(uses(&second.model).1, double);
}

/// Files without topology (IGES) say nothing of shared edges: what lies on each other from end to end is one edge.
#[test]
fn patches_that_meet_are_sewn_without_the_files_word() {
    let patch = |x: f64, flipped: bool| {
        let corner =
            |i: u32, j: u32| Point3::new(x + 10.0 * f64::from(i), 8.0 * f64::from(j), f64::from(i * j));
        let (rows, columns) = if flipped { ([1, 0], [1, 0]) } else { ([0, 1], [0, 1]) };
        let points = rows.iter().flat_map(|i| columns.map(|j| corner(*i, j))).collect();
        let knots = || KnotVector::clamped_uniform(1, 2);
        face(NurbsSurface::new(knots(), knots(), points, None).unwrap(), Vec::new(), "patch")
    };
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("patches.stp");
    // The second patch begins where the first ends, at its height; the third is half a millimetre off.
    let mut second = patch(10.0, true);
    let net = [[20.0, 8.0, 0.0], [20.0, 0.0, 0.0], [10.0, 8.0, 1.0], [10.0, 0.0, 0.0]].map(Point3::from);
    let knots = || KnotVector::clamped_uniform(1, 2);
    second.surface = NurbsSurface::new(knots(), knots(), net.to_vec(), None).unwrap();
    let model = Model { faces: vec![patch(0.0, false), second, patch(20.5, false)], ..Model::default() };
    write_step(&path, &model, &[]).unwrap();
    let text = std::fs::read_to_string(&path).unwrap();
    assert_eq!(text.matches("=EDGE_CURVE(").count(), 11);
    assert_eq!(text.matches("=VERTEX_POINT(").count(), 10);
    let back = read(&path).unwrap();
    let area = |m: &Model| m.faces.iter().map(Face::area_mm2).sum::<f64>();
    assert_eq!((back.model.faces.len(), back.report.warnings.len()), (3, 0));
    approx::assert_relative_eq!(area(&back.model), area(&model), max_relative = 1e-9);
}

#[test]
fn geometry_names_colours_and_layers_survive_in_step() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("sample.stp");
    let (model, groups) = sample();
    write_step(&path, &model, &groups).unwrap();
    let import = read(&path).unwrap();
    assert_eq!(import.report.skipped, []);
    assert_eq!(import.report.warnings, Vec::<String>::new());
    assert_eq!(import.model.tolerance_mm, 0.002);
    // Shells come in the order of their groups.
    let found: Vec<_> = import.model.faces.iter().map(|f| f.source.name.as_deref().unwrap()).collect();
    assert_eq!(found, ["roof; left, front", "door", "dôme", "flap"]);
    let colours: Vec<_> = import.model.faces.iter().map(|f| f.source.colour).collect();
    assert_eq!(colours, [Some([255, 128, 3]), Some([255, 128, 3]), None, None]);
    for (b, id) in import.model.faces.iter().zip([0, 2, 1, 3]) {
        let a = &model.faces[id];
        assert_eq!(b.source.layer.as_deref(), Some("7"));
        assert_eq!(a.reversed, b.reversed);
        assert!(boundaries_apart(a, b) < 1e-9 && boundaries_apart(b, a) < 1e-9);
        approx::assert_relative_eq!(a.area_mm2(), b.area_mm2(), max_relative = 1e-9);
    }
}

#[test]
fn geometry_names_colours_and_levels_survive() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("sample.igs");
    let (model, groups) = sample();
    write_iges(&path, &model, &groups).unwrap();
    let import = read(&path).unwrap();
    assert_eq!(import.report.skipped, []);
    assert_eq!(import.report.warnings, Vec::<String>::new());
    assert_eq!(import.report.faces_read, model.faces.len());
    assert_eq!(import.model.tolerance_mm, 0.002);
    for (id, (a, b)) in model.faces.iter().zip(&import.model.faces).enumerate() {
        assert_eq!(a.loops.len(), b.loops.len());
        assert!(!b.reversed);
        let ((u0, u1), (v0, v1)) = a.surface.domain();
        for k in 0..100 {
            let (u, v) = (u0 + (u1 - u0) * f64::from(k % 10) / 9.0, v0 + (v1 - v0) * f64::from(k / 10) / 9.0);
            let back = if a.reversed { u0 + u1 - u } else { u };
            approx::assert_abs_diff_eq!(a.surface.point(u, v), b.surface.point(back, v), epsilon = 1e-9);
        }
        let outside = |f: &Face| f.surface.normal(0.5, 0.5).unwrap().0 * if f.reversed { -1.0 } else { 1.0 };
        approx::assert_abs_diff_eq!(outside(a), outside(b), epsilon = 1e-9);
        // Loops may start at another edge but run through the same points.
        for (la, lb) in a.loops.iter().zip(&b.loops) {
            assert_eq!(la.edges.len(), lb.edges.len());
            for edge in &la.edges {
                let p = edge.pcurve.point(0.3);
                let p = a.surface.point(p.x, p.y);
                let nearest = (lb.edges.iter())
                    .flat_map(|e| [0.3, 0.7].map(|t| e.pcurve.point(t)))
                    .map(|q| (b.surface.point(q.x, q.y) - p).norm())
                    .fold(f64::INFINITY, f64::min);
                assert!(nearest < 1e-9, "face {id}: {nearest}");
            }
        }
        assert_eq!(b.source.layer.as_deref(), Some("7"));
    }
    let sources: Vec<_> = import.model.faces.iter().map(|f| &f.source).collect();
    assert_eq!(sources[0].name.as_deref(), Some("roof; left, front"));
    assert_eq!(sources[1].name.as_deref(), Some("d_me"));
    assert_eq!(sources[0].colour, Some([255, 128, 3]));
    assert_eq!(sources[1].colour, None);
    assert_eq!(sources[2].colour, Some([255, 128, 3]));
}

#[test]
fn the_same_model_gives_the_same_bytes_and_nothing_is_left_beside() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("sample.igs");
    let (model, groups) = sample();
    write_iges(&path, &model, &groups).unwrap();
    let first = std::fs::read(&path).unwrap();
    write_iges(&path, &model, &groups).unwrap();
    assert_eq!(first, std::fs::read(&path).unwrap());
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
    assert!(first.split(|b| *b == b'\n').all(|line| line.is_empty() || line.len() == 80));
}

#[test]
fn a_group_with_an_unknown_face_writes_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("sample.igs");
    let (model, mut groups) = sample();
    groups[0].faces.push(99);
    assert!(write_iges(&path, &model, &groups).is_err());
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
}
