//! Small models with known answers.

use claymill_nurbs::analytic::{Frame, plane_patch};
use claymill_nurbs::{Face, KnotVector, Model, NurbsSurface, Point3, Source, SurfaceKind, Vector3};

pub(crate) fn face(surface: NurbsSurface) -> Face {
    Face { surface, loops: Vec::new(), reversed: false, kind: SurfaceKind::Nurbs, source: Source::default() }
}

pub(crate) fn model(surfaces: Vec<NurbsSurface>) -> Model {
    Model { faces: surfaces.into_iter().map(face).collect(), ..Model::default() }
}

pub(crate) fn frame(origin: [f64; 3], z: Vector3, x: Vector3) -> Frame {
    Frame::new(Point3::from(origin), z, x).unwrap()
}

/// The rectangle `x × y` at height `z`.
pub(crate) fn plate(x: (f64, f64), y: (f64, f64), z: f64) -> NurbsSurface {
    plane_patch(&frame([0.0, 0.0, z], Vector3::z(), Vector3::x()), x, y).unwrap()
}

/// A bicubic of 8 × 7 points over `[0, 1]²`, about 210 × 180 mm, with gentle waves.
pub(crate) fn master() -> NurbsSurface {
    let (rows, columns) = (8, 7);
    let points = (0..rows * columns).map(|k| {
        let (x, y) = (30.0 * (k / columns) as f64, 30.0 * (k % columns) as f64);
        let wave = |a: f64, b: f64| (0.021 * a + 0.3).sin() * (0.017 * b).cos();
        Point3::new(x + 4.0 * wave(y, x), y + 3.0 * wave(x, y), 20.0 * wave(x + y, x - y))
    });
    NurbsSurface::new(
        KnotVector::clamped_uniform(3, rows),
        KnotVector::clamped_uniform(3, columns),
        points.collect(),
        None,
    )
    .unwrap()
}

/// The part of `surface` over the given parameters, exactly.
pub(crate) fn part(surface: &NurbsSurface, u: (f64, f64), v: (f64, f64)) -> NurbsSurface {
    let above = |s: NurbsSurface, u: f64| s.split_u(u).map_or(s, |(_, b)| b);
    let below = |s: NurbsSurface, u: f64| s.split_u(u).map_or(s, |(a, _)| a);
    let s = below(above(surface.clone(), u.0), u.1).transposed();
    below(above(s, v.0), v.1).transposed()
}

/// The surface moved by `shift`.
pub(crate) fn moved(surface: &NurbsSurface, shift: Vector3) -> NurbsSurface {
    let (rows, columns) = surface.size();
    let indices = || (0..rows).flat_map(|i| (0..columns).map(move |j| (i, j)));
    let points = indices().map(|(i, j)| surface.control_point(i, j) + shift).collect();
    let weights = indices().map(|(i, j)| surface.weight(i, j)).collect();
    NurbsSurface::new(surface.knots_u().clone(), surface.knots_v().clone(), points, Some(weights)).unwrap()
}
