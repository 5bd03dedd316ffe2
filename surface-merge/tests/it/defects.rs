//! Each defect planted by itself in a sound model is found, at its place, and nothing else is.

use claymill_nurbs::analytic::{Frame, cylinder};
use claymill_nurbs::{
    Curve2, Face, KnotVector, Model, NurbsSurface, Point2, Point3, Source, SurfaceKind, TrimEdge, TrimLoop,
    Vector3,
};
use claymill_surface_merge::defects::{Defect, DefectCode, defects};
use claymill_surface_merge::{MergeOptions, merge};

fn face(surface: NurbsSurface) -> Face {
    Face { surface, loops: Vec::new(), reversed: false, kind: SurfaceKind::Nurbs, source: Source::default() }
}

/// `z = 0` over a rectangle.
fn flat((x0, x1): (f64, f64), (y0, y1): (f64, f64)) -> NurbsSurface {
    let k = || KnotVector::clamped_uniform(1, 2);
    let corners = [(x0, y0), (x0, y1), (x1, y0), (x1, y1)];
    let points = corners.map(|(x, y)| Point3::new(x, y, 0.0)).to_vec();
    NurbsSurface::new(k(), k(), points, None).unwrap()
}

fn find(faces: Vec<Face>) -> Vec<Defect> {
    let model = Model { faces, ..Model::default() };
    let merged = merge(&model, &MergeOptions::default()).unwrap();
    let areas: Vec<f64> = model.faces.iter().map(Face::area_mm2).collect();
    defects(&model, &merged, &areas)
}

/// The only defect.
#[track_caller]
fn one(faces: Vec<Face>, code: DefectCode) -> Defect {
    let found = find(faces);
    assert_eq!(found.iter().map(|d| d.code).collect::<Vec<_>>(), [code], "{found:#?}");
    found.into_iter().next().unwrap()
}

fn left() -> Face {
    face(flat((0.0, 50.0), (0.0, 50.0)))
}

fn looped(points: &[(f64, f64)]) -> TrimLoop {
    let p = |i: usize| Point2::new(points[i % points.len()].0, points[i % points.len()].1);
    let edge = |i: usize| TrimEdge { pcurve: Curve2::line(p(i), p(i + 1)), shared: None };
    TrimLoop { edges: (0..points.len()).map(edge).collect() }
}

#[test]
fn a_sound_model_has_none() {
    assert_eq!(find(vec![left(), face(flat((50.0, 90.0), (0.0, 50.0)))]), []);
    let frame = Frame::new(Point3::origin(), Vector3::z(), Vector3::x()).unwrap();
    assert_eq!(find(vec![face(cylinder(&frame, 20.0, (0.0, 6.0), (0.0, 30.0)).unwrap())]), []);
}

#[test]
fn gaps_and_turned_neighbours() {
    let mut model = vec![left(), face(flat((50.05, 90.0), (0.0, 50.0)))];
    let defect = {
        let model = Model { faces: model.clone(), ..Model::default() };
        let options = MergeOptions { tolerance_mm: Some(0.1), ..MergeOptions::default() };
        let merged = merge(&model, &options).unwrap();
        defects(&model, &merged, &[2500.0, 1997.5])
    };
    assert_eq!((defect.len(), defect[0].code), (1, DefectCode::Gap), "{defect:?}");
    assert!((defect[0].size - 0.05).abs() < 1e-9 && (defect[0].at.x - 50.0).abs() < 0.06);
    model[1] = face(flat((50.0, 90.0), (0.0, 50.0)));
    model[1].reversed = true;
    let defect = one(model, DefectCode::InconsistentNormals);
    assert_eq!(defect.faces, [0, 1]);
    approx::assert_relative_eq!(defect.size, 50.0, epsilon = 1e-6);
}

#[test]
fn the_same_face_twice_and_faces_that_overlap() {
    let twice = find(vec![left(), face(flat((0.0, 50.0), (0.0, 50.0)))]);
    let duplicates: Vec<_> = twice.iter().filter(|d| d.code == DefectCode::Duplicate).collect();
    assert_eq!((duplicates.len(), duplicates[0].faces.as_slice()), (1, [0, 1].as_slice()), "{twice:?}");
    let lapped = one(vec![left(), face(flat((30.0, 90.0), (10.0, 40.0)))], DefectCode::Overlap);
    assert!((30.0..50.0).contains(&lapped.at.x) && (10.0..40.0).contains(&lapped.at.y), "{lapped:?}");
}

#[test]
fn tiny_faces_edges_and_crossing_loops() {
    let sliver = one(vec![face(flat((0.0, 50.0), (0.0, 0.1)))], DefectCode::TinyFace);
    assert!((sliver.size - 0.1).abs() < 1e-3, "{sliver:?}");
    let square = |loops: Vec<TrimLoop>| Face { loops, ..left() };
    let nicked = [(0.1, 0.1), (0.9, 0.1), (0.9, 0.9), (0.1001, 0.9), (0.1, 0.8999)];
    let tiny = one(vec![square(vec![looped(&nicked)])], DefectCode::TinyEdge);
    assert!((tiny.size - 50.0 * 2.0_f64.sqrt() * 1e-4).abs() < 1e-9, "{tiny:?}");
    assert_eq!(find(vec![square(vec![looped(&[(0.1, 0.1), (0.9, 0.1), (0.9, 0.9), (0.1, 0.9)])])]), []);
    let bow = [(0.1, 0.1), (0.9, 0.1), (0.3, 0.9), (0.7, 0.9)];
    let crossing = find(vec![square(vec![looped(&bow)])]);
    let crossing: Vec<_> = crossing.iter().filter(|d| d.code == DefectCode::CrossingLoop).collect();
    // x = 0.9 − 0.75 (y − 0.1) and x = 0.1 + 0.75 (y − 0.1) meet at x = 0.5.
    assert_eq!(crossing.len(), 1);
    approx::assert_relative_eq!(crossing[0].at.x, 25.0, epsilon = 1e-6);
}

#[test]
fn folds_poles_knots_degrees_and_radii() {
    let cubic = |xs: [f64; 4]| {
        let points = xs.iter().flat_map(|&x| [0.0, 50.0].map(|y| Point3::new(x, y, 0.0)));
        NurbsSurface::new(
            KnotVector::clamped_uniform(3, 4),
            KnotVector::clamped_uniform(1, 2),
            points.collect(),
            None,
        )
        .unwrap()
    };
    let folded = find(vec![face(cubic([0.0, 90.0, -40.0, 50.0]))]);
    assert!(folded.iter().any(|d| d.code == DefectCode::Folded && d.size > 170.0), "{folded:?}");
    let k = || KnotVector::clamped_uniform(1, 2);
    let points = [(0., 0.), (0., 0.), (50., 0.), (50., 50.)].map(|(x, y)| Point3::new(x, y, 0.0)).to_vec();
    one(vec![face(NurbsSurface::new(k(), k(), points, None).unwrap())], DefectCode::Degenerate);
    let knots = KnotVector::new(1, vec![0.0, 0.0, 0.0002, 1.0, 1.0]).unwrap();
    let xs = [0.0, 0.01, 50.0];
    let points = xs.iter().flat_map(|&x| [0.0, 50.0].map(|y| Point3::new(x, y, 0.0))).collect();
    let close = one(vec![face(NurbsSurface::new(knots, k(), points, None).unwrap())], DefectCode::CloseKnots);
    assert!((close.size - 0.01).abs() < 1e-9);
    let points = (0..13).flat_map(|i| [0.0, 50.0].map(|y| Point3::new(f64::from(i) * 4.0, y, 0.0))).collect();
    let high = NurbsSurface::new(KnotVector::clamped_uniform(12, 13), k(), points, None).unwrap();
    assert_eq!(one(vec![face(high)], DefectCode::HighDegree).size, 12.0);
    let frame = Frame::new(Point3::origin(), Vector3::z(), Vector3::x()).unwrap();
    let needle = cylinder(&frame, 0.4, (0.0, 3.0), (0.0, 30.0)).unwrap();
    let tight = one(vec![face(needle)], DefectCode::SmallRadius);
    approx::assert_relative_eq!(tight.size, 0.4, epsilon = 1e-9);
}
