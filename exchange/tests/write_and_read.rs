//! What is written reads back as the same model.

use claymill_exchange::{Group, read, write_iges};
use claymill_nurbs::{
    Curve2, Face, KnotVector, Model, NurbsSurface, Point2, Point3, Source, SurfaceKind, TrimEdge, TrimLoop,
};

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
