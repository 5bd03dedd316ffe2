//! What is written as glTF is read by the reference crate, with the same faces, colours and lines.

use claymill_exchange::{Group, Lines, write_glb};
use claymill_nurbs::analytic::{Frame, cylinder, plane_patch};
use claymill_nurbs::{Face, Model, NurbsSurface, Point3, Source, SurfaceKind, Vector3};

fn face(surface: NurbsSurface, reversed: bool) -> Face {
    Face { surface, loops: Vec::new(), reversed, kind: SurfaceKind::Nurbs, source: Source::default() }
}

#[test]
fn faces_and_lines_open_in_the_reference_reader() {
    let frame = Frame::new(Point3::new(100.0, 0.0, 50.0), Vector3::z(), Vector3::x()).unwrap();
    let tube = cylinder(&frame, 20.0, (0.0, 3.0), (0.0, 30.0)).unwrap();
    let flat = plane_patch(&frame, (0.0, 40.0), (0.0, 10.0)).unwrap();
    let model = Model { faces: vec![face(tube, false), face(flat, true)], ..Model::default() };
    let groups = [Group { name: "tube".into(), colour: Some([255, 0, 0]), faces: vec![0] }];
    let path_of = |y: f64| (0..5).map(|i| Point3::new(f64::from(i) * 10.0, y, 0.0)).collect();
    let lines =
        [Lines { name: "passes".into(), colour: [0, 0, 255], lines: vec![path_of(0.0), path_of(5.0)] }];
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("model.glb");
    write_glb(&path, &model, &groups, &lines, 0.05).unwrap();
    let bytes = std::fs::read(&path).unwrap();
    let file = gltf::Gltf::from_slice(&bytes).unwrap();
    let binary = file.blob.as_deref().unwrap();
    let names: Vec<_> = file.meshes().map(|m| m.name().unwrap().to_owned()).collect();
    assert_eq!(names, ["tube", "faces", "passes"]);
    let mut lengths = 0.0;
    for mesh in file.meshes() {
        let primitive = mesh.primitives().next().unwrap();
        let reader = primitive.reader(|_| Some(binary));
        let points: Vec<Point3> =
            reader.read_positions().unwrap().map(|p| Point3::from(p.map(f64::from))).collect();
        let indices: Vec<usize> = reader.read_indices().unwrap().into_u32().map(|i| i as usize).collect();
        if primitive.mode() == gltf::mesh::Mode::Lines {
            lengths += indices.chunks(2).map(|c| (points[c[1]] - points[c[0]]).norm()).sum::<f64>();
            continue;
        }
        let normals: Vec<Vector3> =
            reader.read_normals().unwrap().map(|n| Vector3::from(n.map(f64::from))).collect();
        let mut area = 0.0;
        for t in indices.chunks(3) {
            let turn = (points[t[1]] - points[t[0]]).cross(&(points[t[2]] - points[t[0]]));
            assert!(turn.dot(&normals[t[0]]) > 0.0, "a triangle is seen from behind");
            area += 0.5 * turn.norm();
        }
        let (name, expected) =
            (mesh.name().unwrap(), if mesh.name() == Some("tube") { 1800.0 } else { 400.0 });
        assert!((area / expected - 1.0).abs() < 5e-3, "{name}: {area}");
        if name == "tube" {
            assert_eq!(
                primitive.material().pbr_metallic_roughness().base_color_factor(),
                [1.0, 0.0, 0.0, 1.0]
            );
            for p in &points {
                let l = frame.local(p);
                assert!((l.x.hypot(l.y) - 20.0).abs() < 1e-4);
            }
        }
    }
    assert!((lengths - 80.0).abs() < 1e-3);
    // Millimetres and z up become metres and y up.
    let node = file.scenes().next().unwrap().nodes().next().unwrap();
    let m = node.transform().matrix();
    let up: Vec<f32> = (0..3).map(|k| m[2][k]).collect();
    assert_eq!(up, [0.0, 1e-3, 0.0]);
}
