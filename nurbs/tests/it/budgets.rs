//! Surfaces that no sampling and no bound does justice to: everything ends all the same, soon, and says so.

use std::time::{Duration, Instant};

use claymill_nurbs::analytic::{Frame, sphere};
use claymill_nurbs::{
    Aabb, ClosestPoints, Curve2, Face, KnotVector, MeshOptions, Model, NurbsSurface, Point2, Point3, Source,
    SurfaceKind, TrimEdge, TrimLoop, Vector3, tessellate,
};

/// What one face may take on a machine that does much else as well.
const PATIENCE: Duration = Duration::from_secs(120);

fn face(surface: NurbsSurface, loops: Vec<TrimLoop>) -> Face {
    Face { surface, loops, reversed: false, kind: SurfaceKind::Nurbs, source: Source::default() }
}

/// A bicubic patch of 40 × 30 mm with a bulge; `change` makes it bad.
fn patch(change: impl Fn(usize, &mut Point3, &mut f64)) -> NurbsSurface {
    let (mut points, mut weights) = (Vec::new(), Vec::new());
    for k in 0..16 {
        let (i, j) = ((k / 4) as f64, (k % 4) as f64);
        let mut point = Point3::new(40.0 * i / 3.0, 10.0 * j, 4.0 * (i * 1.3 + j).sin());
        let mut weight = 1.0;
        change(k, &mut point, &mut weight);
        points.push(point);
        weights.push(weight);
    }
    let knots = || KnotVector::clamped_uniform(3, 4);
    NurbsSurface::new(knots(), knots(), points, Some(weights)).unwrap()
}

/// A circle in the parameter plane.
fn round() -> TrimLoop {
    let at = |x: f64, y: f64| Point2::new(0.5 + 0.4 * x, 0.5 + 0.4 * y);
    let quarter = |a: (f64, f64), b: (f64, f64)| {
        let points = vec![at(a.0, a.1), at(a.0 + b.0, a.1 + b.1), at(b.0, b.1)];
        let weights = Some(vec![1.0, std::f64::consts::FRAC_1_SQRT_2, 1.0]);
        let pcurve = Curve2::new(KnotVector::clamped_uniform(2, 3), points, weights).unwrap();
        TrimEdge { pcurve, shared: None }
    };
    let corners = [(1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0)];
    TrimLoop { edges: (0..4).map(|k| quarter(corners[k], corners[(k + 1) % 4])).collect() }
}

/// Everything that is made of a face, within the time.
fn all_of(name: &str, face: &Face) {
    let begun = Instant::now();
    let within =
        |what: &str| assert!(begun.elapsed() < PATIENCE, "{name}: {what} after {:?}", begun.elapsed());
    let area = face.area();
    within("the area");
    assert!(area.mm2.is_finite(), "{name}");
    let bounds = face.bounds();
    within("the box");
    for (deviation_mm, longest_edge_mm) in [(0.25, 12.0), (0.01, 2.0)] {
        match tessellate(face, &MeshOptions { deviation_mm, longest_edge_mm }) {
            Ok(mesh) => {
                let kept =
                    Aabb { min: bounds.min, max: bounds.max }.inflated(1e-3 + 1e-9 * bounds.diagonal());
                assert!(mesh.points.iter().all(|p| kept.distance_squared(p) == 0.0), "{name}");
            }
            Err(reason) => eprintln!("{name}: {reason}"),
        }
        within("triangles");
    }
    let model = Model { faces: vec![face.clone()], ..Model::default() };
    let closest = ClosestPoints::new(&model);
    within("closest points prepared");
    for k in 0..20 {
        let at = Point3::new(2.0 * f64::from(k), 1.3 * f64::from(k), 8.0);
        assert!(closest.closest(&at, f64::INFINITY).is_some());
    }
    within("closest points");
    eprintln!("{name}: area {:.3} mm², to {:.0e}, {:?}", area.mm2, area.accuracy, begun.elapsed());
}

#[test]
fn one_large_weight() {
    for weight in [1e-6, 1e3, 1e6, 1e9] {
        for at in [0, 5, 15] {
            let surface = patch(|k, _, w| {
                if k == at {
                    *w = weight;
                }
            });
            all_of(&format!("weight {weight} at {at}"), &face(surface.clone(), vec![]));
            all_of(&format!("weight {weight} at {at}, trimmed"), &face(surface, vec![round()]));
        }
    }
}

#[test]
fn far_coordinates() {
    for far in [1e6, 1e9] {
        for count in [1, 3] {
            let surface = patch(|k, p, _| {
                if k % 5 == 0 && k / 5 < count {
                    p[k / 5 % 3] = far;
                }
            });
            all_of(&format!("{count} of {far} mm"), &face(surface.clone(), vec![]));
            all_of(&format!("{count} of {far} mm, trimmed"), &face(surface, vec![round()]));
        }
    }
}

#[test]
fn everything_far_away() {
    let surface = patch(|_, p, _| *p += Vector3::new(9e8, -9e8, 9e8));
    all_of("far away", &face(surface.clone(), vec![]));
    all_of("far away, trimmed", &face(surface, vec![round()]));
}

#[test]
fn the_box_of_a_face_that_cannot_be_triangulated_holds_it_and_not_all_of_its_surface() {
    let frame = Frame::new(Point3::origin(), Vector3::z(), Vector3::x()).unwrap();
    let surface = sphere(&frame, 50.0, (0.0, 1.0), (0.0, 1.0)).unwrap();
    let needle = |a: Point2, b: Point2| TrimLoop {
        edges: [[a, b], [b, a]].map(|[a, b]| TrimEdge { pcurve: Curve2::line(a, b), shared: None }).into(),
    };
    let ((u0, u1), (v0, v1)) = surface.domain();
    let at = |x: f64, y: f64| Point2::new(u0 + x * (u1 - u0), v0 + y * (v1 - v0));
    let bare = face(surface.clone(), vec![needle(at(0.2, 0.5), at(0.3, 0.5))]);
    assert!(tessellate(&bare, &MeshOptions { deviation_mm: 0.1, longest_edge_mm: 5.0 }).is_err());
    let (bounds, whole) = (bare.bounds(), face(surface.clone(), vec![]).bounds());
    for k in 0..=10 {
        let on = at(0.2 + 0.01 * f64::from(k), 0.5);
        assert_eq!(bounds.inflated(1e-9).distance_squared(&surface.point(on.x, on.y)), 0.0);
    }
    assert!(bounds.diagonal() < 0.3 * whole.diagonal(), "{bounds:?}");
}
