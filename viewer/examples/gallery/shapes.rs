use std::f64::consts::TAU;

use claymill_nurbs::{FaceMesh, KnotVector, Model, NurbsSurface, Point2, Point3, Vector3};
use claymill_toolpath::{Move, MoveKind, Program};

fn wave(x: f64, y: f64) -> f64 {
    12.0 * (x / 45.0).sin() * (y / 60.0).cos()
}

/// Bicubic patch through a function's Greville heights.
fn patch(x0: f64, y0: f64, size: f64) -> NurbsSurface {
    let n = 8;
    let knots = KnotVector::clamped_uniform(3, n);
    let at = |i: usize| {
        let k = knots.as_slice();
        (k[i + 1] + k[i + 2] + k[i + 3]) / 3.0
    };
    let points = (0..n * n)
        .map(|k| {
            let (x, y) = (x0 + size * at(k / n), y0 + size * at(k % n));
            Point3::new(x, y, wave(x, y))
        })
        .collect();
    NurbsSurface::new(knots.clone(), knots, points, None).expect("a sound patch")
}

/// A quarter of a torus in both directions would be exact with weights; a dense cubic net is near enough here.
fn torus(centre: Point3, big: f64, small: f64) -> NurbsSurface {
    let n = 40;
    let knots = KnotVector::clamped_uniform(3, n);
    let at = |i: usize| {
        let k = knots.as_slice();
        (k[i + 1] + k[i + 2] + k[i + 3]) / 3.0 * TAU
    };
    let points = (0..n * n)
        .map(|k| {
            let (a, b) = (at(k / n), at(k % n));
            let r = big + small * b.cos();
            centre + Vector3::new(r * a.cos(), r * a.sin(), small * b.sin())
        })
        .collect();
    NurbsSurface::new(knots.clone(), knots, points, None).expect("a sound torus")
}

/// The untrimmed surface on an even grid.
fn grid_mesh(surface: &NurbsSurface, n: u32) -> FaceMesh {
    let mut mesh = FaceMesh::default();
    let side = n + 1;
    for i in 0..side {
        for j in 0..side {
            let uv = Point2::new(f64::from(i) / f64::from(n), f64::from(j) / f64::from(n));
            mesh.uv.push(uv);
            mesh.points.push(surface.point(uv.x, uv.y));
        }
    }
    for i in 0..n {
        for j in 0..n {
            let k = i * side + j;
            mesh.triangles.push([k, k + side, k + side + 1]);
            mesh.triangles.push([k, k + side + 1, k + 1]);
        }
    }
    mesh.deviation_mm = vec![0.01; mesh.triangles.len()];
    let ring = (0..n).map(|j| j * side);
    let ring = ring.chain((0..n).map(|j| n * side + j));
    let ring = ring.chain((1..=n).rev().map(|j| j * side + n));
    mesh.rings = vec![ring.chain((1..=n).rev()).collect()];
    mesh
}

/// A panel of 6 x 4 patches in two regions, and a torus.
pub(crate) fn model() -> (Model, Vec<FaceMesh>, Vec<usize>) {
    let mut surfaces = Vec::new();
    let mut regions = Vec::new();
    for i in 0..6 {
        for j in 0..4 {
            surfaces.push(patch(f64::from(i) * 50.0 - 150.0, f64::from(j) * 50.0 - 100.0, 50.0));
            regions.push(usize::from(i > 3));
        }
    }
    surfaces.push(torus(Point3::new(-20.0, 10.0, 30.0), 50.0, 18.0));
    regions.push(2);
    let meshes = surfaces.iter().map(|s| grid_mesh(s, if s.size().0 > 10 { 120 } else { 24 })).collect();
    (claymill_tests::model_of(surfaces), meshes, regions)
}

/// Zig-zag strokes over the panel, 2 mm apart, with links and two rapids.
pub(crate) fn program() -> Program {
    let mut moves = Vec::new();
    let mut last: Option<Point3> = None;
    for region in 0..2_usize {
        let (from, to) = if region == 0 { (-149.0, 49.0) } else { (51.0, 149.0) };
        for pass in 0..99_u32 {
            let y = -98.0 + 2.0 * f64::from(pass);
            let line: Vec<Point3> = (0..=200)
                .map(|i| {
                    let s = f64::from(i) / 200.0;
                    let x = if pass % 2 == 0 { from + (to - from) * s } else { to - (to - from) * s };
                    Point3::new(x, y, wave(x, y) + 0.05)
                })
                .collect();
            let mut go = |kind, a: Point3, b: Point3| {
                moves.push(Move { region, pass, ..Move::straight(kind, a, b, Vector3::z(), 6000.0) });
            };
            match last {
                Some(end) if pass > 0 => go(MoveKind::Link, end, line[0]),
                Some(end) => {
                    let (a, b) = (Point3::new(end.x, end.y, 70.0), Point3::new(line[0].x, line[0].y, 70.0));
                    go(MoveKind::LeadOut, end, end + Vector3::z() * 8.0);
                    go(MoveKind::Rapid, end + Vector3::z() * 8.0, a);
                    go(MoveKind::Rapid, a, b);
                    go(MoveKind::Rapid, b, line[0] + Vector3::z() * 8.0);
                    go(MoveKind::LeadIn, line[0] + Vector3::z() * 8.0, line[0]);
                }
                None => go(MoveKind::Rapid, line[0] + Vector3::z() * 70.0, line[0]),
            }
            for ab in line.windows(2) {
                go(MoveKind::Cut, ab[0], ab[1]);
            }
            last = line.last().copied();
        }
    }
    Program { moves }
}
