//! Holder distances against clouds of points, for random surfaces, paths and triangles.

use claymill_nurbs::{Curve3, KnotVector, MeshOptions, NurbsSurface, Point3, Vector3};
use claymill_toolpath::{Holder, Move, MoveKind, Tool};
use proptest::prelude::*;

use super::aims::{Nearest, Raise, SAME_MM};
use super::body::{Frustum, of_holder, of_sides};
use super::gap::Prism;
use super::patch::Patches;
use super::sweep::Sweep;
use crate::drop::DropMesh;
use crate::mesh::{Mesh, face_meshes};
use crate::track::Track;

/// Points of the surface and of the path along one direction.
const POINTS: usize = 160;
const PLACES: usize = 60;

fn surface(heights: &[f64]) -> NurbsSurface {
    let points = (0..16).map(|k| Point3::new(20.0 * (k / 4) as f64, 20.0 * (k % 4) as f64, heights[k]));
    let knots = || KnotVector::clamped_uniform(3, 4);
    NurbsSurface::new(knots(), knots(), points.collect(), None).unwrap()
}

/// Heights above the tip and distances from the axis of a cloud of points, for tips all along a path.
fn cloud(surface: &NurbsSurface, path: &Curve3) -> Vec<[f64; 2]> {
    let ((u0, u1), (v0, v1)) = surface.domain();
    let (t0, t1) = path.domain();
    let share = |k: usize, n: usize| k as f64 / (n - 1) as f64;
    let tips: Vec<Point3> = (0..PLACES).map(|k| path.point(t0 + (t1 - t0) * share(k, PLACES))).collect();
    let grid = (0..POINTS).flat_map(|i| (0..POINTS).map(move |j| (share(i, POINTS), share(j, POINTS))));
    let points = grid.map(|(s, r)| surface.point(u0 + (u1 - u0) * s, v0 + (v1 - v0) * r));
    let seen = |p: Point3| tips.iter().map(move |tip| [p.z - tip.z, (p.x - tip.x).hypot(p.y - tip.y)]);
    points.flat_map(|p| seen(p).collect::<Vec<_>>()).collect()
}

fn nearest(body: &[Frustum], cloud: &[[f64; 2]], raised_mm: f64) -> f64 {
    let one = |[height, from_axis]: &[f64; 2]| {
        body.iter().map(|f| f.distance(height - raised_mm, *from_axis)).fold(f64::INFINITY, f64::min)
    };
    cloud.iter().map(one).fold(f64::INFINITY, f64::min)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    /// Points and places are at most half a millimetre apart on these surfaces and paths, so the cloud cannot be nearer than
    /// what is found, nor much farther.
    #[test]
    fn a_cloud_of_points_is_as_near_as_is_found(
        heights in prop::collection::vec(0.0..40.0_f64, 16),
        ends in prop::collection::vec(5.0..55.0_f64, 6),
        sections in prop::sample::select(vec!["20x15,50x10", "12-36x20", "16-30x8,24x9,44-60x12"]),
        clearance_mm in 0.0..3.0_f64,
        lower_mm in 0.5..6.0_f64,
    ) {
        let model = claymill_tests::model_of([surface(&heights)]);
        let meshes = face_meshes(&model, &MeshOptions { deviation_mm: 0.1, longest_edge_mm: 40.0 });
        let mesh = Mesh::joined(&model, &meshes, &[]);
        let view = DropMesh::new(&mesh, &Vector3::z());
        let points = ends.chunks(2).map(|p| Point3::new(p[0], p[1], 0.5 * p[0])).collect();
        let path = Curve3::new(KnotVector::new(2, vec![0.0, 0.0, 0.0, 30.0, 30.0, 30.0]).unwrap(), points, None).unwrap();
        let track = Track::of(&Move::along(MoveKind::Cut, &path, Vector3::z(), 1000.0), 2.0).unwrap();
        let holder = Holder::parse(&format!("30:{sections}"), &Tool::ball(2.0)).unwrap();
        let body = of_holder(&holder);
        let sweep = Sweep { patches: Patches { model: &model, meshes: &meshes, view: &view }, body: &body };
        let seen = cloud(&model.faces[0].surface, &path);

        let mut raise = Raise { clearance_mm, raised_mm: -100.0, spot: None };
        sweep.along(&track, &mut raise);
        let needed_mm = raise.raised_mm + SAME_MM;
        prop_assert!(nearest(&body, &seen, needed_mm) > clearance_mm - 1e-9, "{needed_mm}");
        let just_below = nearest(&body, &seen, needed_mm - 0.05);
        prop_assert!(just_below < clearance_mm + 0.5, "{needed_mm}: {just_below} for {clearance_mm}");

        let raised_mm = needed_mm + lower_mm;
        let mut least = Nearest { raised_mm, within_mm: 100.0, distance_mm: f64::INFINITY, spot: None };
        sweep.along(&track, &mut least);
        let brute = nearest(&body, &seen, raised_mm);
        let found = least.distance_mm;
        prop_assert!((found - SAME_MM..found + 0.5).contains(&brute), "{found}, the cloud says {brute}");
    }
}

proptest! {
    /// Triangles and ways of the tip as a cloud of points, half of the triangles upright.
    #[test]
    fn a_triangle_keeps_its_distance_from_a_shank_where_its_points_do(
        corners in prop::collection::vec(-8.0..8.0_f64, 9),
        way in prop::collection::vec(-3.0..3.0_f64, 3),
        (upright, level) in (any::<bool>(), any::<bool>()),
        distance in 0.01..2.0_f64,
    ) {
        let mut triangle = [0, 3, 6].map(|k| Point3::new(corners[k], corners[k + 1], 2.0 * corners[k + 2]));
        if upright {
            let beside = nalgebra::center(&triangle[0], &triangle[1]);
            (triangle[2].x, triangle[2].y) = (beside.x, beside.y);
        }
        let to = Point3::new(way[0], way[1], if level { 0.0 } else { 0.3 * way[2] });
        let shank = of_sides(&Tool::ball(2.0), 0.0)[0];
        let share = |k: i32| f64::from(k) / 40.0;
        let mut nearest = f64::INFINITY;
        for (i, j) in (0..=40).flat_map(|i| (0..=40 - i).map(move |j| (i, j))) {
            let [a, b, c] = triangle.map(|p| p.coords);
            let point = a * share(i) + b * share(j) + c * share(40 - i - j);
            for k in 0..=10 {
                let arm = point - to.coords * (f64::from(k) / 10.0);
                nearest = nearest.min(shank.distance(arm.z, arm.x.hypot(arm.y)));
            }
        }
        let keeps = Prism::new(&triangle, &Point3::origin(), &to).keeps(&shank, 0.0, distance);
        prop_assert!(!keeps || nearest >= distance - 1e-9, "{nearest} {distance}");
        prop_assert!(keeps || nearest < distance + 1.5, "{nearest} {distance}");
    }
}
