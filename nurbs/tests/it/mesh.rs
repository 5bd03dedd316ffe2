//! Triangulations against the surfaces they stand for.

use std::f64::consts::PI;

use crate::shapes::{circle, cylinder, ellipse, face, panel, plane, polygon, sphere, torus, trim_loop};
use claymill_nurbs::{Curve2, Face, FaceMesh, MeshOptions, Point2, Point3, tessellate, tessellate_polygons};

const FINE: MeshOptions = MeshOptions { deviation_mm: 0.01, longest_edge_mm: 1e9 };

fn area(mesh: &FaceMesh) -> f64 {
    let corner = |t: &[u32; 3], k: usize| mesh.points[t[k] as usize];
    let twice = |t: &[u32; 3]| (corner(t, 1) - corner(t, 0)).cross(&(corner(t, 2) - corner(t, 0))).norm();
    mesh.triangles.iter().map(|t| 0.5 * twice(t)).sum()
}

fn uv_area(mesh: &FaceMesh) -> f64 {
    let corner = |t: &[u32; 3], k: usize| mesh.uv[t[k] as usize];
    let twice = |t: &[u32; 3]| (corner(t, 1) - corner(t, 0)).perp(&(corner(t, 2) - corner(t, 0)));
    mesh.triangles.iter().map(|t| 0.5 * twice(t)).sum()
}

fn distance(p: Point3, [a, b, c]: [Point3; 3]) -> f64 {
    let segment = |a: Point3, b: Point3| {
        let s = ((p - a).dot(&(b - a)) / (b - a).norm_squared()).clamp(0.0, 1.0);
        (p - a - (b - a) * s).norm()
    };
    let n = (b - a).cross(&(c - a));
    let within = |a: Point3, b: Point3| n.cross(&(b - a)).dot(&(p - a)) >= 0.0;
    if within(a, b) && within(b, c) && within(c, a) {
        return ((p - a).dot(&n) / n.norm()).abs();
    }
    segment(a, b).min(segment(b, c)).min(segment(c, a))
}

/// Everything that must hold for any mesh; returns the worst true deviation as a share of the tolerance.
fn check(face: &Face, options: &MeshOptions) -> (FaceMesh, f64) {
    let mesh = tessellate(face, options).unwrap();
    assert_eq!(mesh.triangles.len(), mesh.deviation_mm.len());
    for (uv, p) in mesh.uv.iter().zip(&mesh.points) {
        let on = face.surface.point(uv.x, uv.y);
        assert!((on - p).norm() < 1e-11 * (1.0 + p.coords.norm()));
    }
    let mut worst = 0.0f64;
    for (t, &bound) in mesh.triangles.iter().zip(&mesh.deviation_mm) {
        let bound = f64::from(bound);
        assert!(bound <= options.deviation_mm * (1.0 + 1e-6), "bound {bound}");
        let uv = t.map(|i| mesh.uv[i as usize]);
        assert!((uv[1] - uv[0]).perp(&(uv[2] - uv[0])) > 0.0, "turned in the parameter plane");
        let corners = t.map(|i| mesh.points[i as usize]);
        for k in 0..3 {
            let edge = (corners[k] - corners[(k + 1) % 3]).norm();
            assert!(edge <= options.longest_edge_mm * (1.0 + 1e-6), "edge {edge}");
        }
        for i in 0..=4 {
            for j in 0..=4 - i {
                let (s, r) = (f64::from(i) / 4.0, f64::from(j) / 4.0);
                let at = uv[0] + (uv[1] - uv[0]) * s + (uv[2] - uv[0]) * r;
                let d = distance(face.surface.point(at.x, at.y), corners);
                assert!(d <= bound + 1e-9, "{d} from a triangle with bound {bound}");
                worst = worst.max(d / options.deviation_mm);
            }
        }
    }
    // Edges inside are shared by two triangles, and the boundary is the rings'.
    let mut open = std::collections::BTreeMap::new();
    for t in &mesh.triangles {
        for k in 0..3 {
            *open.entry((t[k], t[(k + 1) % 3])).or_insert(0) += 1;
        }
    }
    assert!(open.values().all(|&n| n == 1), "an edge is used twice in one direction");
    (mesh, worst)
}

fn boundary_length(mesh: &FaceMesh) -> f64 {
    let edges: std::collections::BTreeSet<_> =
        mesh.triangles.iter().flat_map(|t| (0..3).map(|k| (t[k], t[(k + 1) % 3]))).collect();
    let length = |&(a, b): &(u32, u32)| (mesh.uv[a as usize] - mesh.uv[b as usize]).norm();
    edges.iter().filter(|(a, b)| !edges.contains(&(*b, *a))).map(length).sum()
}

fn ring_length(mesh: &FaceMesh) -> f64 {
    let at = |i: u32| mesh.uv[i as usize];
    let length =
        |r: &Vec<u32>| -> f64 { (0..r.len()).map(|i| (at(r[i]) - at(r[(i + 1) % r.len()])).norm()).sum() };
    mesh.rings.iter().map(length).sum()
}

#[test]
fn whole_quadrics_are_within_their_bound() {
    for (surface, expected) in [
        (cylinder(50.0, 100.0), 2.0 * PI * 50.0 * 100.0),
        (sphere(40.0), 4.0 * PI * 1600.0),
        (torus(60.0, 20.0), 4.0 * PI * PI * 1200.0),
    ] {
        let (mesh, worst) = check(&face(surface, vec![]), &FINE);
        let loss = 1.0 - area(&mesh) / expected;
        assert!(loss > 0.0 && loss < 3e-3, "area off by {loss}");
        assert!(worst > 0.05, "wasteful: only {worst} of the tolerance is used");
        eprintln!("{} triangles, {worst:.2} of the tolerance", mesh.triangles.len());
    }
}

#[test]
fn edges_are_as_short_as_asked() {
    let short = MeshOptions { deviation_mm: 1.0, longest_edge_mm: 7.0 };
    for loops in [vec![], vec![circle((0.0, 0.0), 61.0), circle((10.0, 5.0), 20.0)]] {
        check(&face(plane(100.0), loops), &short);
    }
    check(&face(panel(), vec![ellipse((0.5, 0.5), 0.4, 0.3)]), &short);
}

#[test]
fn trimmed_planes_have_the_area_of_their_polygons() {
    let loops = vec![circle((0.0, 0.0), 90.0), ellipse((20.0, 0.0), 30.0, 60.0)];
    let (mesh, _) = check(&face(plane(100.0), loops), &FINE);
    let exact = PI * (90.0 * 90.0 - 30.0 * 60.0);
    assert!((area(&mesh) / exact - 1.0).abs() < 3e-4);
    approx::assert_relative_eq!(area(&mesh), uv_area(&mesh), max_relative = 1e-12);
    approx::assert_relative_eq!(boundary_length(&mesh), ring_length(&mesh), max_relative = 1e-12);
    for &i in &mesh.rings[0] {
        assert!((mesh.uv[i as usize].coords.norm() - 90.0).abs() < 1e-9);
    }
}

#[test]
fn trimmed_panels_and_tori_are_within_their_bound() {
    for (surface, loops) in [
        (panel(), vec![ellipse((0.5, 0.5), 0.45, 0.3), circle((0.5, 0.5), 0.12)]),
        (torus(60.0, 20.0), vec![circle((2.0, 3.0), 1.5)]),
        (sphere(40.0), vec![polygon(&[(0.1, -1.2), (6.0, -1.3), (3.0, 1.4)])]),
        (cylinder(5.0, 1000.0), vec![polygon(&[(0.5, 10.0), (1.5, 500.0), (0.6, 990.0)])]),
    ] {
        let (mesh, worst) = check(&face(surface, loops), &FINE);
        approx::assert_relative_eq!(boundary_length(&mesh), ring_length(&mesh), max_relative = 1e-9);
        assert!(worst > 0.05, "wasteful: {worst}");
        eprintln!("{} triangles, {worst:.2} of the tolerance", mesh.triangles.len());
    }
}

#[test]
fn a_loop_along_parameter_lines_gives_a_grid() {
    let rectangle = polygon(&[(0.25, 0.1), (0.9, 0.1), (0.9, 0.8), (0.25, 0.8)]);
    let (mesh, _) = check(&face(panel(), vec![rectangle]), &FINE);
    assert_eq!(mesh.rings.len(), 1);
    approx::assert_relative_eq!(uv_area(&mesh), 0.65 * 0.7, max_relative = 1e-12);
    let around = polygon(&[(1e-9, 0.0), (1.0, 1e-9), (1.0, 0.4), (1.0 - 1e-9, 1.0), (0.0, 1.0)]);
    let (mesh, _) = check(&face(panel(), vec![around]), &FINE);
    approx::assert_relative_eq!(uv_area(&mesh), 1.0, max_relative = 1e-12);
}

#[test]
fn bands_and_caps_of_closed_surfaces_are_meshed() {
    let t = 2.0 * PI;
    let around =
        |v: f64, from: f64| trim_loop([Curve2::line(Point2::new(from, v), Point2::new(from + t, v))]);
    let (mesh, _) = check(&face(cylinder(50.0, 100.0), vec![around(20.0, 1.0), around(70.0, 0.0)]), &FINE);
    assert!((area(&mesh) / (t * 50.0 * 50.0) - 1.0).abs() < 1e-3);
    let (mesh, _) = check(&face(sphere(40.0), vec![around(0.0, 0.0)]), &FINE);
    assert!((area(&mesh) / (t * 1600.0) - 1.0).abs() < 2e-3);
    let (mesh, _) = check(&face(cylinder(50.0, 100.0), vec![circle((0.0, 50.0), 1.0)]), &FINE);
    assert!((uv_area(&mesh) / PI - 1.0).abs() < 1e-2);
}

#[test]
fn creases_are_edges_of_the_mesh() {
    use claymill_nurbs::{KnotVector, NurbsSurface};
    // A ridge along u = 1, crossed by the trim loop.
    let net = [(0.0, 0.0), (10.0, 5.0), (20.0, 0.0)];
    let points = net.iter().flat_map(|&(x, z)| [Point3::new(x, 0.0, z), Point3::new(x, 20.0, z)]);
    let ku = KnotVector::new(1, vec![0.0, 0.0, 1.0, 2.0, 2.0]).unwrap();
    let roof = NurbsSurface::new(ku, KnotVector::clamped_uniform(1, 2), points.collect(), None).unwrap();
    let (mesh, worst) = check(&face(roof, vec![ellipse((1.0, 0.5), 0.8, 0.3)]), &FINE);
    assert!(worst < 1e-6, "a triangle crosses the ridge");
    assert!(mesh.triangles.len() > 10);
}

/// As where a file's edge curve is a few nanometres off the seam between two arcs of a fillet.
#[test]
fn a_loop_that_wavers_along_a_crease_is_refined_on_both_sides_of_it() {
    let knot = torus(60.0, 20.0).knots_u().breaks()[1];
    for waver in [1e-6, 1e-9, -1e-6, 1e-15] {
        let side = (0..=10).map(|k| (knot + waver * f64::from([0, 1, 2, 0, 3][k % 5]), 5.5 - 0.5 * k as f64));
        let outline: Vec<(f64, f64)> = [(2.8, 0.5), (2.8, 5.5)].into_iter().chain(side).collect();
        check(&face(torus(60.0, 20.0), vec![polygon(&outline)]), &FINE);
    }
}

/// In one process, too, hash sets have another order each time.
#[test]
fn the_same_face_gives_the_same_mesh() {
    let surface = face(plane(10.0), Vec::new()).surface;
    let options = MeshOptions { deviation_mm: 1.0, longest_edge_mm: 4.87 };
    for parts in 10..60 {
        // Spade puts vertices off where a side bends by hardly more than rounding.
        let [wide, high, bend] = [3.307, 3.542, 9.7e-7];
        let bent = |k: u32| -wide + 2.0 * wide * f64::from(k) / f64::from(parts);
        let side = (0..=parts).map(|k| Point2::new(bent(k), bend * bent(k)));
        let top = (0..=4).map(|k| Point2::new(wide - 0.5 * wide * f64::from(k), high));
        let ring: Vec<Point2> = side.chain(top).collect();
        let mesh = || tessellate_polygons(&surface, std::slice::from_ref(&ring), &options).unwrap();
        let meshes: Vec<FaceMesh> = (0..6).map(|_| mesh()).collect();
        assert!(meshes.windows(2).all(|w| w[0].triangles == w[1].triangles && w[0].uv == w[1].uv));
    }
}

#[test]
fn damaged_loops_do_not_panic() {
    let nan_free = [
        vec![circle((0.0, 0.0), 90.0), circle((80.0, 0.0), 20.0)],
        vec![circle((0.0, 0.0), 90.0), circle((70.0, 0.0), 20.0)],
        vec![polygon(&[(0.0, 0.0), (50.0, 50.0), (50.0, 0.0), (0.0, 50.0)])],
        vec![polygon(&[(0.0, 0.0), (50.0, 0.0), (0.0, 0.0)])],
        vec![polygon(&[(0.0, 0.0), (0.0, 0.0)])],
        vec![trim_loop([])],
        vec![circle((500.0, 0.0), 450.0)],
        vec![circle((0.0, 0.0), 1e-12)],
        vec![circle((0.0, 0.0), 50.0), circle((0.0, 0.0), 50.0)],
        vec![polygon(&[(-50.0, -50.0), (50.0, -50.0), (50.0, 50.0), (0.0, -50.0), (-50.0, 50.0)])],
    ];
    for loops in nan_free {
        if let Ok(mesh) = tessellate(&face(plane(100.0), loops), &FINE) {
            assert!(area(&mesh) <= 200.0 * 200.0 * (1.0 + 1e-9));
        }
    }
    let bad = MeshOptions { deviation_mm: 0.0, longest_edge_mm: f64::NAN };
    assert!(tessellate(&face(plane(1.0), vec![]), &bad).is_err());
}
