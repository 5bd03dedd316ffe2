//! Meshes over regions, and fields on them, against elementary geometry and real models.

use std::f64::consts::{FRAC_PI_2, PI};

use crate::scene::{self, frame, master, model, part, plate};
use claymill_models::{RoadsterOptions, roadster};
use claymill_nurbs::analytic::{cylinder, sphere, torus};
use claymill_nurbs::{ClosestPoints, Face, Model, NurbsSurface, Point3, Vector3};
use claymill_surface_merge::{
    DriveSurface, FieldError, GuideKind, Merge, MergeOptions, NoDriveSurface, RegionMesh, merge, quality,
};

fn sewn(surfaces: Vec<NurbsSurface>) -> (Model, Merge) {
    let model = model(surfaces);
    let merged = merge(&model, &MergeOptions::default()).unwrap();
    assert_eq!(merged.regions.len(), 1);
    (model, merged)
}

fn where_(mesh: &RegionMesh<'_>, is: impl Fn(&Point3) -> bool) -> Vec<u32> {
    let at = |v: &u32| is(&mesh.vertices()[*v as usize].point);
    let found: Vec<u32> = (0..mesh.vertices().len() as u32).filter(at).collect();
    assert!(!found.is_empty());
    found
}

/// Largest error of a field as a part of its largest value.
fn worst(mesh: &RegionMesh<'_>, values: &[f64], exact: impl Fn(&Point3) -> f64) -> f64 {
    let exact: Vec<f64> = mesh.vertices().iter().map(|v| exact(&v.point)).collect();
    let largest = exact.iter().fold(0.0f64, |m, x| m.max(x.abs()));
    values.iter().zip(&exact).fold(0.0f64, |m, (a, b)| m.max((a - b).abs())) / largest
}

/// A curved sheet in 3 × 3 patches.
fn patchwork() -> Vec<NurbsSurface> {
    let whole = master();
    let cuts = [0.0, 0.3, 0.55, 1.0];
    let column =
        |u: &[f64]| cuts.windows(2).map(|v| part(&whole, (u[0], u[1]), (v[0], v[1]))).collect::<Vec<_>>();
    cuts.windows(2).flat_map(column).collect()
}

/// A plate of 5 × 3 patches, each row cut elsewhere: T-junctions.
fn plates() -> Vec<NurbsSurface> {
    let rows =
        [[0.0, 31.0, 50.0, 77.0, 120.0], [0.0, 22.0, 60.0, 77.0, 120.0], [0.0, 35.0, 61.0, 88.0, 120.0]];
    let row = |k: usize| {
        let y = (20.0 * k as f64, 20.0 * (k + 1) as f64);
        rows[k].windows(2).map(move |w| plate((w[0], w[1]), y, 0.0)).collect::<Vec<_>>()
    };
    (0..3).flat_map(row).collect()
}

/// Lateral surface of a quarter cylinder of radius 100 and length 200 in patches.
fn quarter_cylinder() -> Vec<NurbsSurface> {
    let axis = frame([0.0; 3], Vector3::y(), Vector3::z());
    let angles = [0.0, 0.4, 0.9, FRAC_PI_2];
    let lengths = [0.0, 70.0, 110.0, 200.0];
    let patch = |a: &[f64], l: &[f64]| cylinder(&axis, 100.0, (a[0], a[1]), (l[0], l[1])).unwrap();
    angles.windows(2).flat_map(|a| lengths.windows(2).map(move |l| patch(a, l))).collect()
}

/// A hemisphere of radius 100 around the z axis: a pole, and a seam where the eight pieces meet.
fn hemisphere() -> Vec<NurbsSurface> {
    let z = frame([0.0; 3], Vector3::z(), Vector3::x());
    let patch = |k: usize, latitudes: (f64, f64)| {
        let from = FRAC_PI_2 * k as f64;
        sphere(&z, 100.0, (from, from + FRAC_PI_2), latitudes).unwrap()
    };
    (0..4).flat_map(|k| [patch(k, (0.0, 0.7)), patch(k, (0.7, FRAC_PI_2))]).collect()
}

#[test]
fn t_junctions_leave_no_cracks() {
    let (model, merged) = sewn(plates());
    for edge_mm in [3.0, 8.0, 500.0] {
        let mesh = RegionMesh::of_region(&model, &merged, 0, edge_mm).unwrap();
        approx::assert_relative_eq!(mesh.area_mm2(), 120.0 * 60.0, max_relative = 1e-12);
        assert_eq!(mesh.loops().len(), 1);
        approx::assert_relative_eq!(mesh.loops()[0].length_mm, 360.0, max_relative = 1e-12);
        assert!(mesh.skipped().is_empty());
    }
}

#[test]
fn gaps_within_the_tolerance_are_closed() {
    let mut surfaces = plates();
    for (k, surface) in surfaces.iter_mut().enumerate() {
        let shift = 0.004 * Vector3::new((k as f64).sin(), (2.0 * k as f64).sin(), (3.0 * k as f64).sin());
        *surface = scene::moved(surface, shift);
    }
    let (model, merged) = sewn(surfaces);
    let mesh = RegionMesh::of_region(&model, &merged, 0, 5.0).unwrap();
    assert_eq!(mesh.loops().len(), 1);
    approx::assert_relative_eq!(mesh.loops()[0].length_mm, 360.0, epsilon = 0.2);
}

#[test]
fn corners_of_triangles_are_points_of_their_faces() {
    let (model, merged) = sewn(patchwork());
    let mesh = RegionMesh::of_region(&model, &merged, 0, 7.0).unwrap();
    for ((triangle, uv), &face) in mesh.triangles().iter().zip(mesh.corners()).zip(mesh.face_of_triangle()) {
        for k in 0..3 {
            let point = model.faces[face].surface.point(uv[k].x, uv[k].y);
            assert!((point - mesh.vertices()[triangle[k] as usize].point).norm() < 1e-6);
        }
    }
    approx::assert_relative_eq!(mesh.area_mm2(), merged.regions[0].area_mm2, max_relative = 2e-3);
}

#[test]
fn a_plane_s_harmonic_field_is_linear_and_its_lines_are_straight() {
    let (model, merged) = sewn(plates());
    let mesh = RegionMesh::of_region(&model, &merged, 0, 8.0).unwrap();
    let guides = mesh.guides();
    assert_eq!(guides.kind, GuideKind::Sides);
    let y = |v: &u32| mesh.vertices()[*v as usize].point.y;
    let (low, high) = if y(&guides.from[0]) < 30.0 { (0.0, 60.0) } else { (60.0, 0.0) };
    assert!(guides.from.iter().all(|v| (y(v) - low).abs() < 1e-9));
    assert!(guides.to.iter().all(|v| (y(v) - high).abs() < 1e-9));
    let field = mesh.harmonic(&guides.from, &guides.to).unwrap();
    // Linear up to the share by which needles are thickened.
    assert!(worst(&mesh, field.values(), |p| (p.y - low) / (high - low)) < 1e-3);
    for k in 1..10 {
        let lines = field.iso_line(f64::from(k) / 10.0);
        assert_eq!(lines.len(), 1);
        approx::assert_relative_eq!(lines[0].length_mm(), 120.0, epsilon = 0.01);
        for p in &lines[0].points {
            approx::assert_relative_eq!(
                p.at.point.y,
                low + (high - low) * f64::from(k) / 10.0,
                epsilon = 0.06
            );
            approx::assert_relative_eq!(p.gradient.norm(), 1.0 / 60.0, max_relative = 0.03);
        }
    }
}

#[test]
fn lines_are_on_the_surfaces_and_keep_the_higher_side_on_their_left() {
    let (model, merged) = sewn(quarter_cylinder());
    let mesh = RegionMesh::of_region(&model, &merged, 0, 10.0).unwrap();
    let field =
        mesh.harmonic(&where_(&mesh, |p| p.y < 1e-9), &where_(&mesh, |p| p.y > 200.0 - 1e-9)).unwrap();
    assert!(worst(&mesh, field.values(), |p| p.y / 200.0) < 2e-3);
    for line in (1..20).flat_map(|k| field.iso_line(f64::from(k) / 20.0)) {
        assert!(!line.closed);
        approx::assert_relative_eq!(line.length_mm(), 100.0 * FRAC_PI_2, max_relative = 2e-3);
        for w in line.points.windows(2) {
            let p = w[0].at.point;
            // On the cylinder itself, not on a chord.
            approx::assert_relative_eq!(p.x.hypot(p.z), 100.0, epsilon = 1e-9);
            let surface = &model.faces[w[0].at.face].surface;
            assert_eq!(surface.point(w[0].at.uv.x, w[0].at.uv.y), p);
            let side = mesh_normal(&p).cross(&(w[1].at.point - p)).dot(&w[0].gradient);
            let outward = if model.faces[0].reversed { -1.0 } else { 1.0 };
            assert!(side * outside(&model, 0) * outward > 0.0);
        }
    }
}

fn mesh_normal(p: &Point3) -> Vector3 {
    Vector3::new(p.x, 0.0, p.z).normalize()
}

/// Whether `Su × Sv` points away from the y axis.
fn outside(model: &Model, face: usize) -> f64 {
    let surface = &model.faces[face].surface;
    let ((u0, u1), (v0, v1)) = surface.domain();
    let (n, _) = surface.normal(0.5 * (u0 + u1), 0.5 * (v0 + v1)).unwrap();
    n.dot(&mesh_normal(&surface.point(0.5 * (u0 + u1), 0.5 * (v0 + v1)))).signum()
}

#[test]
fn a_ring_s_harmonic_field_is_the_logarithm_of_the_radius() {
    // A flat ring of radii 40 and 100: a cone that is nearly a plane would do as well.
    let z = frame([0.0; 3], Vector3::z(), Vector3::x());
    let sector = |k: usize| {
        let from = FRAC_PI_2 * k as f64;
        let arc = |r: f64| claymill_nurbs::analytic::circle_arc(&z, r, (from, from + FRAC_PI_2)).unwrap();
        let (inner, outer) = (arc(40.0), arc(100.0));
        let net = inner.points().iter().zip(outer.points()).flat_map(|(a, b)| [*a, *b]).collect();
        let weights = inner.weights().unwrap().iter().flat_map(|&w| [w, w]).collect();
        let across = claymill_nurbs::KnotVector::clamped_uniform(1, 2);
        NurbsSurface::new(inner.knots().clone(), across, net, Some(weights)).unwrap()
    };
    let (model, merged) = sewn((0..4).map(sector).collect());
    for (edge_mm, bar) in [(5.0, 2e-3), (2.5, 1e-3)] {
        let mesh = RegionMesh::of_region(&model, &merged, 0, edge_mm).unwrap();
        let guides = mesh.guides();
        assert_eq!(guides.kind, GuideKind::Rings);
        let field = mesh.harmonic(&guides.to, &guides.from).unwrap();
        let error = worst(&mesh, field.values(), |p| (p.coords.norm() / 40.0).ln() / 2.5f64.ln());
        assert!(error < bar, "{edge_mm} mm: {error}");
        let [line] = &field.iso_line(0.5)[..] else { panic!("one line") };
        assert!(line.closed);
        approx::assert_relative_eq!(line.length_mm(), 2.0 * PI * 4000.0f64.sqrt(), max_relative = 2e-3);
    }
}

#[test]
fn distances_are_those_of_plane_cylinder_and_sphere() {
    let (model, merged) = sewn(plates());
    let mesh = RegionMesh::of_region(&model, &merged, 0, 6.0).unwrap();
    let side = where_(&mesh, |p| p.x < 1e-9);
    let field = mesh.distance(&side).unwrap();
    let plane = worst(&mesh, field.values(), |p| p.x);
    let corner = where_(&mesh, |p| p.coords.norm() < 1e-9);
    let point = worst(&mesh, mesh.distance(&corner).unwrap().values(), |p| p.coords.norm());
    // A quarter of a pass for each mm: the distance counts passes.
    let passes = mesh.distance_in(&side, |_, _, along| 0.25 * along.norm()).unwrap();
    assert!(worst(&mesh, passes.values(), |p| 0.25 * p.x) < 3e-3);

    let (model, merged) = sewn(quarter_cylinder());
    let mesh = RegionMesh::of_region(&model, &merged, 0, 10.0).unwrap();
    let along = |p: &Point3| p.x.atan2(p.z);
    let first = where_(&mesh, |p| p.x.abs() < 1e-6);
    let rolled = worst(&mesh, mesh.distance(&first).unwrap().values(), |p| 100.0 * along(p).abs());

    let (model, merged) = sewn(hemisphere());
    let mesh = RegionMesh::of_region(&model, &merged, 0, 8.0).unwrap();
    assert_eq!(mesh.loops().len(), 1);
    let pole = where_(&mesh, |p| p.z > 100.0 - 1e-9);
    assert_eq!(pole.len(), 1, "a pole is one vertex");
    let cap = mesh.distance(&pole).unwrap();
    let from_pole = worst(&mesh, cap.values(), |p| 100.0 * (p.z / 100.0).clamp(-1.0, 1.0).acos());
    let rim = mesh.distance(&mesh.loops()[0].vertices).unwrap();
    let from_rim = worst(&mesh, rim.values(), |p| 100.0 * (p.z / 100.0).clamp(-1.0, 1.0).asin());
    println!("plane {plane:.4} {point:.4}, cylinder {rolled:.4}, sphere {from_pole:.4} {from_rim:.4}");
    assert!(plane < 3e-3 && rolled < 3e-3 && from_rim < 3e-3, "{plane} {rolled} {from_rim}");
    // Around a single point the field is off by up to half an edge length.
    assert!(from_pole < 4e-3 && point * 120.0f64.hypot(60.0) < 0.6 * 6.0, "{from_pole} {point}");
    let [parallel] = &cap.iso_line(60.0)[..] else { panic!("one parallel") };
    assert!(parallel.closed);
    approx::assert_relative_eq!(parallel.length_mm(), 200.0 * PI * 0.6f64.sin(), max_relative = 0.01);
}

#[test]
fn an_arm_is_swept_from_its_border_to_its_far_end() {
    let z = frame([0.0; 3], Vector3::z(), Vector3::x());
    let guides_of = |surface: NurbsSurface| {
        let (model, merged) = sewn(vec![surface]);
        let mesh = RegionMesh::of_region(&model, &merged, 0, 6.0).unwrap();
        let guides = mesh.guides();
        let ends = |set: &[u32]| {
            let heights = || set.iter().map(|&v| mesh.vertices()[v as usize].point.z);
            (heights().fold(f64::INFINITY, f64::min), heights().fold(f64::NEG_INFINITY, f64::max))
        };
        (guides.kind, ends(&guides.from), ends(&guides.to))
    };
    // A finger, open below; its field would fade if both guides were at its root.
    let finger = |p: Point3| Point3::new(p.x, p.y, 10.0 * p.z);
    let closed = sphere(&z, 20.0, (0.0, 2.0 * PI), (0.0, FRAC_PI_2)).unwrap();
    let (kind, root, tip) = guides_of(closed.mapped(finger));
    assert_eq!(kind, GuideKind::Ends);
    assert!(root.1 < 1e-6 && tip.0 > 180.0, "{root:?} {tip:?}");
    // Its tip cut off: the border there is far too short for a ring, but no hole in a sheet.
    let open = sphere(&z, 20.0, (0.0, 2.0 * PI), (0.0, 1.4)).unwrap();
    let (kind, root, tip) = guides_of(open.mapped(finger));
    assert_eq!(kind, GuideKind::Rings);
    assert!(root.1 < 1e-6 && tip.0 > 190.0, "{root:?} {tip:?}");
    // A bowl is a sheet.
    assert_eq!(guides_of(closed).0, GuideKind::Halves);
}

#[test]
fn sides_are_chosen_by_places_beside_them() {
    let (model, merged) = sewn(plates());
    let mesh = RegionMesh::of_region(&model, &merged, 0, 6.0).unwrap();
    let (left, lower) = (Point3::new(-3.0, 31.0, 1.0), Point3::new(50.0, -2.0, 0.0));
    approx::assert_relative_eq!(mesh.from_border_mm(&lower).unwrap(), 2.0, max_relative = 0.3);
    let all = |vertices: &[u32], is: &dyn Fn(&Point3) -> bool| {
        vertices.len() > 5 && vertices.iter().all(|&v| is(&mesh.vertices()[v as usize].point))
    };
    // Its own choice would be the two long sides.
    let across = mesh.guides_near(&left, None).unwrap();
    assert_eq!(across.kind, GuideKind::Chosen);
    assert!(all(&across.from, &|p| p.x < 1e-9) && all(&across.to, &|p| p.x > 120.0 - 1e-9));
    // Two sides with a common corner: it belongs to the first.
    let beside = mesh.guides_near(&left, Some(&lower)).unwrap();
    assert!(all(&beside.from, &|p| p.x < 1e-9) && all(&beside.to, &|p| p.y < 1e-9 && p.x > 0.0));
    assert!(mesh.harmonic(&beside.from, &beside.to).is_ok());
    let twice = mesh.guides_near(&left, Some(&Point3::new(0.0, 12.0, 0.0)));
    assert!(matches!(twice, Err(FieldError::NoGuide { .. })));

    // A loop without corners is one side, and the pole lies across from it.
    let (model, merged) = sewn(hemisphere());
    let mesh = RegionMesh::of_region(&model, &merged, 0, 6.0).unwrap();
    let inwards = mesh.guides_near(&Point3::new(100.0, 0.0, 0.0), None).unwrap();
    let height = |v: &u32| mesh.vertices()[*v as usize].point.z;
    assert!(inwards.from.iter().all(|v| height(v) < 1e-6) && inwards.to.iter().all(|v| height(v) > 98.0));
    assert_eq!(inwards.from.len(), mesh.loops()[0].vertices.len());
}

#[test]
fn closed_surfaces_have_ends_and_parts_without_guides_no_values() {
    let z = frame([3.0, -2.0, 5.0], Vector3::z(), Vector3::x());
    let whole = sphere(&z, 25.0, (0.0, 2.0 * PI), (-FRAC_PI_2, FRAC_PI_2)).unwrap();
    let (model, merged) = sewn(vec![whole]);
    let mesh = RegionMesh::of_region(&model, &merged, 0, 3.0).unwrap();
    assert!(mesh.loops().is_empty());
    assert!(mesh.from_border_mm(&Point3::origin()).is_none());
    assert!(mesh.guides_near(&Point3::origin(), None).is_err());
    let guides = mesh.guides();
    assert_eq!(guides.kind, GuideKind::Ends);
    let field = mesh.harmonic(&guides.from, &guides.to).unwrap();
    let lines = field.iso_line(0.5);
    assert!(lines.len() == 1 && lines[0].closed);

    let apart =
        scene::model(vec![plate((0.0, 30.0), (0.0, 30.0), 0.0), plate((50.0, 80.0), (0.0, 30.0), 0.0)]);
    let mesh = RegionMesh::new(&apart, &[0, 1], &[], 5.0).unwrap();
    assert_eq!(mesh.loops().len(), 2);
    let field = mesh.distance(&where_(&mesh, |p| p.x < 1e-9)).unwrap();
    for (v, value) in mesh.vertices().iter().zip(field.values()) {
        assert_eq!(value.is_nan(), v.point.x > 40.0);
    }
    assert_eq!(field.iso_line(15.0).len(), 1);
}

/// A drive surface as a face of its own.
fn face_of(drive: &DriveSurface) -> Face {
    Face { loops: drive.loops.clone(), ..scene::face(drive.surface.clone()) }
}

#[test]
fn a_region_has_one_trimmed_drive_surface_whatever_its_outline() {
    let area = |model: &Model| model.faces.iter().map(Face::area_mm2).sum::<f64>();
    // Four sides; no corners at all; a hole.
    let z = frame([0.0; 3], Vector3::z(), Vector3::x());
    let quarters = [(0.0, 0.5), (0.5, 1.0), (1.0, 1.5), (1.5, 2.0)];
    let holed = quarters.map(|(a, b)| {
        // A quarter of a torus's outer ring: from 40 to 60 mm around the axis, rising like a brim.
        torus(&z, 60.0, 20.0, (a * PI, b * PI), (0.6 * PI, 0.9 * PI)).unwrap()
    });
    for (surfaces, edge_mm, tolerance_mm, loops) in
        [(patchwork(), 2.0, 0.02, 1), (hemisphere(), 4.0, 0.1, 1), (holed.to_vec(), 3.0, 0.05, 2)]
    {
        let (model, merged) = sewn(surfaces);
        let mesh = RegionMesh::of_region(&model, &merged, 0, edge_mm).unwrap();
        let drive = mesh.drive_surface(tolerance_mm).unwrap();
        assert!(drive.deviation_max_mm < tolerance_mm, "{}", drive.deviation_max_mm);
        assert!(drive.deviation_rms_mm < drive.deviation_max_mm);
        assert_eq!(drive.loops.len(), loops);
        // Trimmed, it is as large as the region, and its outline is the region's.
        let face = face_of(&drive);
        approx::assert_relative_eq!(face.area_mm2(), area(&model), max_relative = 2e-3);
        let closest = ClosestPoints::new(&model);
        for edge in drive.loops.iter().flat_map(|l| &l.edges) {
            let [from, to] = [edge.pcurve.start(), edge.pcurve.end()].map(|p| drive.surface.point(p.x, p.y));
            for p in [from, to] {
                let border = mesh.loops().iter().flat_map(|l| &l.vertices);
                let off = border.map(|&v| (mesh.vertices()[v as usize].point - p).norm());
                assert!(off.fold(f64::INFINITY, f64::min) < 2.0 * tolerance_mm);
            }
        }
        // It looks to the same side as the faces.
        let at = drive.loops[0].edges[0].pcurve.start();
        let (u, v) = (at.x, at.y);
        let p = drive.surface.point(u, v);
        let foot = closest.closest(&p, f64::INFINITY).unwrap();
        let (ours, _) = drive.surface.normal(u, v).unwrap();
        let (theirs, _) = model.faces[foot.face].surface.normal(foot.u, foot.v).unwrap();
        assert!(ours.dot(&theirs).abs() > 0.99);
    }
}

#[test]
fn regions_that_have_no_drive_surface_say_why() {
    let z = frame([0.0; 3], Vector3::z(), Vector3::x());
    let why = |surfaces: Vec<NurbsSurface>, tolerance_mm: f64| {
        let (model, merged) = sewn(surfaces);
        let mesh = RegionMesh::of_region(&model, &merged, 0, 4.0).unwrap();
        mesh.drive_surface(tolerance_mm).unwrap_err()
    };
    let tube = cylinder(&z, 20.0, (0.0, 2.0 * PI), (0.0, 200.0)).unwrap();
    assert!(matches!(why(vec![tube], 0.1), NoDriveSurface::Folded | NoDriveSurface::TooFar { .. }));
    let ball = sphere(&z, 20.0, (0.0, 2.0 * PI), (-FRAC_PI_2, FRAC_PI_2)).unwrap();
    assert_eq!(why(vec![ball], 0.1), NoDriveSurface::Closed);
    let NoDriveSurface::TooFar { deviation_max_mm, most_mm } = why(hemisphere(), 1e-9) else { panic!() };
    assert!(deviation_max_mm > most_mm);
}

#[test]
fn the_quality_of_plane_cylinder_and_sphere_is_elementary() {
    let (model, merged) = sewn(plates());
    let q = quality(&model, &merged, 0, 10.0).unwrap();
    assert_eq!((q.euler, q.loops, q.genus), (1, 1, Some(0)));
    assert_eq!((q.tightest_concave_radius_mm, q.rest_area_mm2), (None, 0.0));
    approx::assert_relative_eq!(q.length_mm, 120.0, epsilon = 1.0);
    approx::assert_relative_eq!(q.width_mm, 60.0, epsilon = 1.0);
    assert!(q.single_valued && q.total_curvature_sr < 1e-9);

    // A tube seen from its outside is convex, from its inside a valley.
    let z = frame([0.0; 3], Vector3::z(), Vector3::x());
    let tube = cylinder(&z, 8.0, (0.0, 2.0 * PI), (0.0, 50.0)).unwrap();
    for reversed in [false, true] {
        let (mut model, _) = sewn(vec![tube.clone()]);
        model.faces[0].reversed = reversed;
        let merged = merge(&model, &MergeOptions::default()).unwrap();
        let q = quality(&model, &merged, 0, 10.0).unwrap();
        assert_eq!((q.euler, q.loops, q.genus), (0, 2, Some(0)));
        assert!(!q.single_valued && q.total_curvature_sr < 1e-9);
        let outside = outside(&model, 0) > 0.0;
        if outside == reversed {
            approx::assert_relative_eq!(q.tightest_concave_radius_mm.unwrap(), 8.0, max_relative = 1e-9);
            approx::assert_relative_eq!(q.rest_area_mm2, 2.0 * PI * 8.0 * 50.0, max_relative = 0.02);
        } else {
            assert_eq!(q.tightest_concave_radius_mm, None);
        }
    }

    let (model, merged) = sewn(hemisphere());
    let q = quality(&model, &merged, 0, 10.0).unwrap();
    assert_eq!((q.euler, q.loops, q.genus), (1, 1, Some(0)));
    approx::assert_relative_eq!(q.total_curvature_sr, 2.0 * PI, max_relative = 0.02);
    let whole = sphere(&z, 25.0, (0.0, 2.0 * PI), (-FRAC_PI_2, FRAC_PI_2)).unwrap();
    let (model, merged) = sewn(vec![whole]);
    let q = quality(&model, &merged, 0, 10.0).unwrap();
    assert_eq!((q.euler, q.loops, q.genus), (2, 0, Some(0)));
    let ring = torus(&z, 30.0, 8.0, (0.0, 2.0 * PI), (0.0, 2.0 * PI)).unwrap();
    let (model, merged) = sewn(vec![ring]);
    let q = quality(&model, &merged, 0, 10.0).unwrap();
    assert_eq!((q.euler, q.loops, q.genus), (0, 0, Some(1)));
    approx::assert_relative_eq!(q.total_curvature_sr, 8.0 * PI, max_relative = 0.03);
}

#[test]
fn the_number_of_threads_changes_no_bit() {
    let sample = roadster(&RoadsterOptions { patches: 300, seed: 5 });
    let merged = merge(&sample.model, &MergeOptions::default()).unwrap();
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let mesh = RegionMesh::of_region(&sample.model, &merged, 0, 25.0).unwrap();
            let guides = mesh.guides();
            let harmonic = mesh.harmonic(&guides.from, &guides.to).unwrap().values().to_vec();
            let distance = mesh.distance(&guides.from).unwrap();
            let lines = distance.iso_line(0.4 * distance.range()[1]);
            (mesh.vertices().to_vec(), mesh.triangles().to_vec(), harmonic, lines)
        })
    };
    assert!(on(1) == on(5));
}

#[test]
fn no_region_of_a_vehicle_has_cracks() {
    let sample = roadster(&RoadsterOptions { patches: 2000, seed: 1 });
    let merged = merge(&sample.model, &MergeOptions::default()).unwrap();
    let region = |face: usize| merged.region_of_face[face];
    let mut border_mm = vec![0.0; merged.regions.len()];
    for joint in &merged.joints {
        let [a, b] = joint.sides.map(|s| region(s.face));
        if a != b {
            border_mm[a] += joint.length_mm;
            border_mm[b] += joint.length_mm;
        }
    }
    merged.naked.iter().for_each(|n| border_mm[region(n.stretch.face)] += n.length_mm);
    for r in &merged.regions {
        let mesh = RegionMesh::of_region(&sample.model, &merged, r.id, 10.0).unwrap();
        let around: f64 = mesh.loops().iter().map(|l| l.length_mm).sum();
        approx::assert_relative_eq!(around, border_mm[r.id], max_relative = 0.01, epsilon = 1e-9);
        assert_eq!(mesh.loops().len(), r.boundary_loops, "region {}", r.id);
        approx::assert_relative_eq!(mesh.area_mm2(), r.area_mm2, max_relative = 0.01);
        assert!(mesh.skipped().is_empty());
        let guides = mesh.guides();
        let field = mesh.harmonic(&guides.from, &guides.to).unwrap();
        // No maximum or minimum inside.
        assert!(field.values().iter().all(|v| (-1e-6..=1.0 + 1e-6).contains(v)), "region {}", r.id);
        assert!(!field.iso_line(0.5).is_empty());
    }
}

#[test]
fn what_makes_no_sense_is_refused() {
    let (model, merged) = sewn(vec![plate((0.0, 30.0), (0.0, 30.0), 0.0)]);
    for edge_mm in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let refused = RegionMesh::of_region(&model, &merged, 0, edge_mm);
        assert!(matches!(refused, Err(FieldError::EdgeLength { .. })));
    }
    assert!(matches!(RegionMesh::of_region(&model, &merged, 7, 5.0), Err(FieldError::Empty { .. })));
    let mesh = RegionMesh::of_region(&model, &merged, 0, 5.0).unwrap();
    assert!(matches!(mesh.harmonic(&[], &[0]), Err(FieldError::NoGuide { .. })));
    assert!(matches!(mesh.distance(&[1_000_000]), Err(FieldError::NoGuide { .. })));
    assert!(matches!(mesh.distance_in(&[0], |_, _, _| -1.0), Err(FieldError::Metric { .. })));
    assert!(mesh.distance(&[0]).unwrap().iso_line(1e9).is_empty());
    assert!(mesh.distance(&[0]).unwrap().iso_line(f64::NAN).is_empty());
}
