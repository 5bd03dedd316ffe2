//! Faces with analytic answers.
#![allow(dead_code, reason = "every test file uses its own part")]

use std::f64::consts::{FRAC_1_SQRT_2, PI};

use claymill_nurbs::analytic::{self, Frame};
use claymill_nurbs::{
    Curve2, Face, KnotVector, NurbsSurface, Point2, Point3, Source, SurfaceKind, TrimEdge, TrimLoop, Vector3,
};

pub(crate) fn world() -> Frame {
    Frame::new(Point3::origin(), Vector3::z(), Vector3::x()).unwrap()
}

pub(crate) fn plane(half: f64) -> NurbsSurface {
    analytic::plane_patch(&world(), (-half, half), (-half, half)).unwrap()
}

pub(crate) fn cylinder(radius: f64, height: f64) -> NurbsSurface {
    analytic::cylinder(&world(), radius, (0.0, 2.0 * PI), (0.0, height)).unwrap()
}

pub(crate) fn sphere(radius: f64) -> NurbsSurface {
    analytic::sphere(&world(), radius, (0.0, 2.0 * PI), (-PI / 2.0, PI / 2.0)).unwrap()
}

pub(crate) fn torus(major: f64, minor: f64) -> NurbsSurface {
    analytic::torus(&world(), major, minor, (0.0, 2.0 * PI), (0.0, 2.0 * PI)).unwrap()
}

/// A doubly curved car-like panel of 3 × 2 bicubic pieces.
pub(crate) fn panel() -> NurbsSurface {
    let (ku, kv) = (KnotVector::clamped_uniform(3, 6), KnotVector::clamped_uniform(3, 5));
    let net = (0..6).flat_map(|i| {
        (0..5).map(move |j| {
            let (x, y) = (f64::from(i) * 120.0, f64::from(j) * 90.0);
            Point3::new(x, y, 40.0 * (x / 300.0).sin() + 30.0 * (y / 200.0).cos())
        })
    });
    NurbsSurface::new(ku, kv, net.collect(), None).unwrap()
}

pub(crate) fn face(surface: NurbsSurface, loops: Vec<TrimLoop>) -> Face {
    Face { surface, loops, reversed: false, kind: SurfaceKind::Nurbs, source: Source::default() }
}

pub(crate) fn trim_loop(curves: impl IntoIterator<Item = Curve2>) -> TrimLoop {
    let edge = |pcurve| TrimEdge { pcurve, shared: None };
    TrimLoop { edges: curves.into_iter().map(edge).collect() }
}

/// An ellipse as one exact quadratic pcurve of four arcs, anticlockwise.
pub(crate) fn ellipse(centre: (f64, f64), a: f64, b: f64) -> TrimLoop {
    let w = FRAC_1_SQRT_2;
    let corners = [(1, 0), (1, 1), (0, 1), (-1, 1), (-1, 0), (-1, -1), (0, -1), (1, -1), (1, 0)];
    let points = corners.map(|(x, y)| Point2::new(centre.0 + a * f64::from(x), centre.1 + b * f64::from(y)));
    let knots = vec![0., 0., 0., 1., 1., 2., 2., 3., 3., 4., 4., 4.];
    let weights = vec![1.0, w, 1.0, w, 1.0, w, 1.0, w, 1.0];
    let curve = Curve2::new(KnotVector::new(2, knots).unwrap(), points.to_vec(), Some(weights));
    trim_loop([curve.unwrap()])
}

pub(crate) fn circle(centre: (f64, f64), r: f64) -> TrimLoop {
    ellipse(centre, r, r)
}

pub(crate) fn polygon(corners: &[(f64, f64)]) -> TrimLoop {
    let at = |i: usize| Point2::new(corners[i % corners.len()].0, corners[i % corners.len()].1);
    trim_loop((0..corners.len()).map(|i| Curve2::line(at(i), at(i + 1))))
}

pub(crate) fn backwards(mut ring: TrimLoop) -> TrimLoop {
    ring.edges.reverse();
    for edge in &mut ring.edges {
        edge.pcurve = edge.pcurve.reversed();
    }
    ring
}

/// Reproducible points in the unit square.
pub(crate) fn random_points(count: usize) -> impl Iterator<Item = (f64, f64)> {
    let mut state = 0x9E37_79B9_7F4A_7C15_u64;
    let mut next = move || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state >> 11) as f64 / (1u64 << 53) as f64
    };
    (0..count).map(move |_| (next(), next()))
}
