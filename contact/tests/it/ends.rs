//! Ends of all kinds on real models, held against the exact closest point and against points of the faces.

use claymill_contact::{BallDrop, Covering, CutterDrop, Frame, March, Support};
use claymill_nurbs::{ClosestPoints, FaceMesh, MeshOptions, Point3, tessellate};
use claymill_tests::corpus;
use claymill_toolpath::Tool;

/// Lowest height of a tool above its tip at a distance from its axis.
fn outline(tool: &Tool, d: f64) -> Option<f64> {
    let (radius, corner) = (tool.radius_mm(), tool.corner_radius_mm());
    let out = (d - radius + corner).max(0.0);
    let end = (d <= radius).then(|| corner - (corner * corner - out * out).max(0.0).sqrt());
    let sides = tool.sides().into_iter().filter_map(|[[low, lower], [high, upper]]| match d {
        _ if d <= lower => Some(low),
        _ if d <= upper => Some(low + (high - low) * (d - lower) / (upper - lower)),
        _ => None,
    });
    sides.chain(end).reduce(f64::min)
}

#[test]
fn ends_touch_the_faces_and_no_point_of_a_fine_mesh_enters_them() {
    let Some(folder) = corpus() else { return };
    for (file, tools) in [
        ("sports_car_1399.igs", ["flat:10", "bull:10:2", "ball:5,taper:3,length:30,shank:20"]),
        ("race_car_nose_141.stp", ["flat:6", "bull:6:5", "ball:3,taper:6,length:20,shank:16"]),
        ("bracket_inch.iges", ["flat:4", "bull:4:1", "bull:2:0.5,length:4,shank:12"]),
        ("helmet_928.igs", ["flat:5", "bull:8:2", "ball:4,length:12,shank:20"]),
    ] {
        let model = claymill_exchange::read(&folder.join(file)).unwrap().model;
        let area_mm2: f64 = model.faces.iter().map(|f| f.area_mm2()).sum();
        let covering = Covering::new(&model, &vec![false; model.faces.len()], area_mm2, 6.0).unwrap();
        let [frame, ..] = Frame::five("+z".parse().unwrap(), "-x".parse().unwrap()).unwrap();
        let closest = ClosestPoints::new(&model);
        // Corners of fine triangles lie on the faces.
        let fine = MeshOptions { deviation_mm: 0.02, longest_edge_mm: 2.5 };
        let meshes: Vec<FaceMesh> = model.faces.iter().map(|f| tessellate(f, &fine).unwrap()).collect();
        let points: Vec<Point3> = meshes.iter().flat_map(|m| &m.points).map(|p| frame.to_setup(p)).collect();
        let places: Vec<Point3> = points.iter().step_by(points.len() / 11).copied().collect();
        for name in tools {
            let tool: Tool = name.parse().unwrap();
            let end = CutterDrop::new(&model, &covering, &frame, &tool);
            for place in &places {
                // Beside a point of the model, so that something is met.
                let (x, y) = (place.x + 0.3, place.y - 0.2);
                let Some(at) = end.drop(x, y) else { continue };
                assert!(at.gap_mm < 1e-3, "{file} {name}: gap {}", at.gap_mm);
                // What it touches is of the model, and holds it there.
                let p = frame.to_model(&at.contact);
                assert!(closest.closest(&p, 1e-6).is_some(), "{file} {name}: {p} is not on the model");
                // At the rim, but for rounding.
                let from_axis = (at.contact.x - x).hypot(at.contact.y - y) - 1e-12;
                let rise = outline(&tool, from_axis).unwrap();
                assert!(at.contact.z - rise >= at.tip.z - at.gap_mm - 1e-9, "{file} {name}: {at:?} floats");
                // And nothing enters it.
                for q in &points {
                    if let Some(rise) = outline(&tool, (q.x - x).hypot(q.y - y)) {
                        assert!(q.z - rise <= at.tip.z + 1e-9, "{file} {name}: {q} enters {at:?}");
                    }
                }
            }
        }
    }
}

/// What begins near the last contact, by Newton, comes to the heights of the search, which knows of no other place.
#[test]
fn a_march_of_an_end_is_where_the_search_alone_finds_it() {
    let Some(folder) = corpus() else { return };
    for (file, tools) in
        [("race_car_nose_141.stp", ["bull:12:3", "flat:6"]), ("helmet_928.igs", ["bull:8:2", "flat:5"])]
    {
        let model = claymill_exchange::read(&folder.join(file)).unwrap().model;
        let area_mm2: f64 = model.faces.iter().map(|f| f.area_mm2()).sum();
        let covering = Covering::new(&model, &vec![false; model.faces.len()], area_mm2, 8.0).unwrap();
        let [frame, ..] = Frame::five("+z".parse().unwrap(), "-x".parse().unwrap()).unwrap();
        let middle = model.faces[0].bounds();
        let start = frame.to_setup(&nalgebra::center(&middle.min, &middle.max));
        for name in tools {
            let tool: Tool = name.parse().unwrap();
            let fast = BallDrop::of_tool(&model, &covering, &frame, &tool);
            let alone = CutterDrop::new(&model, &covering, &frame, &tool);
            let mut march = March::new(&fast);
            let mut exact = 0;
            for k in 0..60 {
                let (x, y) = (start.x + 0.7 * f64::from(k), start.y + 0.3 * f64::from(k));
                let (found, expected) = (march.drop(x, y), alone.drop(x, y));
                let (Some(found), Some(expected)) = (found, expected) else {
                    assert_eq!(found.is_some(), expected.is_some(), "{file} {name} at {x}, {y}");
                    continue;
                };
                let tip = found.centre.z - fast.end().corner_mm;
                // A location may be too low by 0.1 µm, and a bound too high where nobody passes.
                assert!(
                    tip > expected.tip.z - expected.gap_mm - 1.5e-4,
                    "{file} {name} {k}: {tip} {expected:?}"
                );
                if matches!(found.support, Support::Face { .. } | Support::Edge) {
                    assert!(tip < expected.tip.z + 1.5e-4, "{file} {name} {k}: {tip} {expected:?}");
                    exact += 1;
                }
            }
            assert!(exact > 20, "{file} {name}: {exact}");
        }
    }
}
