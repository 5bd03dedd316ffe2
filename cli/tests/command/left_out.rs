//! A face that cannot be triangulated is left out by name, its box is kept clear, and everything else goes on.

use std::fs;
use std::path::Path;

use claymill_nurbs::{Aabb, Point3, Vector3};

use crate::iges_text::{entity, file, flat};
use crate::run::{Run, run};
use crate::scratch;

const BALL_MM: f64 = 20.0;
/// Where the bad face lies over the plate, mm.
const AT: [f64; 3] = [400.0, 350.0, 5.0];

/// A plate of 900 × 800 mm and above it a patch of 4 × 3 mm with a weight of a millionth of its others: more triangles than
/// any machine holds would be needed for its corner.
fn plate_and_patch(folder: &Path) {
    let knots = "0.,0.,0.,0.,1.,1.,1.,1.";
    // Weights and points run along the first parameter first.
    let weights: String = (0..16).map(|k| if k == 0 { "1.E-6," } else { "1.," }).collect();
    let point = |k: usize| {
        let (i, j) = ((k % 4) as f64, (k / 4) as f64);
        let rise = 0.4 * (i * 1.3 + j).sin();
        format!("{:?},{:?},{:?},", AT[0] + 4.0 * i / 3.0, AT[1] + j, AT[2] + rise)
    };
    let points: String = (0..16).map(point).collect();
    let patch = entity(128, format!("3,3,3,3,0,0,0,0,0,{knots},{knots},{weights}{points}0.,1.,0.,1."));
    fs::write(folder.join("plate.igs"), file(&[flat(900.0, 800.0), patch])).unwrap();
}

/// How deep the ball comes into a box on any move, from samples of the written curves, mm.
fn depth_in(folder: &Path, bounds: &Aabb) -> f64 {
    let moves = claymill_toolpath::read_moves(folder).unwrap().moves;
    let mut deepest = f64::NEG_INFINITY;
    for m in moves {
        let curve = m.curve().unwrap();
        let (t0, t1) = curve.domain();
        for i in 0..=200 {
            let centre: Point3 =
                curve.point(t0 + (t1 - t0) * f64::from(i) / 200.0) + Vector3::from(m.axis_start) * BALL_MM;
            deepest = deepest.max(BALL_MM - bounds.distance_squared(&centre).sqrt());
        }
    }
    deepest
}

#[test]
fn a_face_that_cannot_be_triangulated_stops_neither_planning_nor_verification() {
    let folder = scratch();
    let folder = folder.path();
    plate_and_patch(folder);
    for (job, skip) in [("whole", None), ("skipped", Some("face:1"))] {
        let args = ["plan", "plate.igs", "--tool", "ball:20", "--scallop", "0.5", "--up", "+z", "-o", job];
        let planned: Run = run(folder, args.into_iter().chain(skip.into_iter().flat_map(|s| ["--skip", s])));
        assert_eq!(planned.code, Some(0), "{planned:?}");
        let told = format!("{}{}", planned.stdout, planned.stderr);
        assert!(told.contains("face 1 (DE 3, ") && told.contains("is left out"), "{told}");
        let record = claymill_toolpath::read_job(&folder.join(job)).unwrap();
        assert_eq!(record.left_out.len(), 1, "{record:?}");
        let left = &record.left_out[0];
        assert_eq!((left.face, left.entity.as_str()), (1, "DE 3"));
        assert!((5.0..20.0).contains(&left.area_mm2) && left.reason.contains("triangulated"), "{left:?}");
        let [x0, y0, z0, x1, y1, z1] = left.box_mm;
        let bounds = Aabb { min: Point3::new(x0, y0, z0), max: Point3::new(x1, y1, z1) };
        let middle = Point3::new(AT[0] + 2.0, AT[1] + 1.5, AT[2]);
        assert!(bounds.distance_squared(&middle) == 0.0 && bounds.diagonal() < 6.0, "{bounds:?}");
        // The box is kept clear, by no more than a pass may be too low.
        let depth_mm = depth_in(&folder.join(job), &bounds.inflated(-5e-4));
        assert!(depth_mm < 0.005, "{depth_mm}");
        // The plate beside it is cut, and nothing counts as left.
        assert!(record.area.cut_mm2 > 700_000.0, "{:?}", record.area);
        let verified = run(folder, ["verify", job, "--json"]);
        assert_eq!(verified.code, Some(0), "{verified:?}");
        let states = &verified.json()["coverage"]["by_state_mm2"];
        assert!(states["reachable_left"].as_f64().unwrap_or(0.0) < 200.0, "{states}");
    }
    // Nothing else stops at it either.
    for args in [["inspect", "plate.igs", "--json"], ["merge", "plate.igs", "--json"]] {
        let done = run(folder, args);
        assert_eq!(done.code, Some(0), "{done:?}");
    }
    let exported = run(folder, ["merge", "plate.igs", "--export", "plate.glb"]);
    assert_eq!(exported.code, Some(0), "{exported:?}");
}
