//! Rest passes: what a larger ball could not cut, and nothing else.

use std::path::Path;

use claymill_exchange::write_iges;
use claymill_nurbs::analytic::{Frame, cylinder, plane_patch};
use claymill_nurbs::{Point3, Vector3};
use claymill_tests::model_of;
use claymill_toolpath::{MoveKind, UncutReason, read_job, read_moves};

use crate::run::run;
use crate::scratch;

const LENGTH_MM: f64 = 200.0;
const WALL_MM: f64 = 60.0;
const FILLET_MM: f64 = 4.0;
const EARLIER_MM: f64 = 10.0;

/// Two walls that rise at 30° from a fillet along y.
fn groove(path: &Path) {
    let (sine, cosine) = 30f64.to_radians().sin_cos();
    let wall = |side: f64| {
        let foot = Point3::new(side * FILLET_MM * sine, 0.0, FILLET_MM * (1.0 - cosine));
        let along = Vector3::new(cosine, 0.0, side * sine);
        let frame = Frame::new(foot, along.cross(&Vector3::y()), along).unwrap();
        let range = if side > 0.0 { (0.0, WALL_MM) } else { (-WALL_MM, 0.0) };
        plane_patch(&frame, range, (0.0, LENGTH_MM)).unwrap()
    };
    let axis = Frame::new(Point3::new(0.0, 0.0, FILLET_MM), -Vector3::y(), Vector3::x()).unwrap();
    let angles = (240f64.to_radians(), 300f64.to_radians());
    let fillet = cylinder(&axis, FILLET_MM, angles, (-LENGTH_MM, 0.0)).unwrap();
    let model = model_of([wall(-1.0), fillet, wall(1.0)]);
    write_iges(path, &model, &[]).unwrap();
}

#[test]
fn a_groove_is_cut_where_the_earlier_ball_bridged_it() {
    let folder = scratch();
    groove(&folder.path().join("groove.igs"));
    let plan = ["plan", "groove.igs", "--tool", "ball:3", "--rest-of", "ball:10", "--scallop", "0.05"];
    let made = run(folder.path(), plan.into_iter().chain(["--up", "+z", "--length", "+y", "-o", "out"]));
    assert_eq!(made.code, Some(0), "{made:?}");

    // The large ball touches the walls R·tan 30° from where they would meet.
    let strip_mm = (EARLIER_MM - FILLET_MM) * 30f64.to_radians().tan();
    let bridged_mm2 = (2.0 * strip_mm + FILLET_MM * std::f64::consts::FRAC_PI_3) * LENGTH_MM;
    let job = read_job(&folder.path().join("out")).unwrap();
    let cut = job.area.cut_mm2;
    // Close to where it touched it left less than matters; triangles of 3 mm overlap what is finished.
    assert!(
        cut > bridged_mm2 - 2.0 * LENGTH_MM && cut < bridged_mm2 + 7.0 * LENGTH_MM,
        "{cut} of {bridged_mm2}"
    );
    let done = job.area.uncut_mm2[&UncutReason::EarlierTool];
    assert!((cut + done - job.area.total_mm2).abs() < 1e-6 * job.area.total_mm2);

    let program = read_moves(&folder.path().join("out")).unwrap();
    let cosine = 30f64.to_radians().cos();
    let farthest = FILLET_MM * 0.5 + (strip_mm + 4.0) * cosine;
    for m in program.moves.iter().filter(|m| m.kind == MoveKind::Cut) {
        assert!(m.points.iter().all(|p| p[0].abs() < farthest), "move {} leaves the groove", m.seq);
    }
    // The large ball has left material up to its tip, which no rapid may enter.
    let tip_mm = FILLET_MM + (EARLIER_MM - FILLET_MM) / cosine - EARLIER_MM;
    for m in program.moves.iter().filter(|m| m.kind == MoveKind::Rapid) {
        assert!(m.points.iter().all(|p| p[2] > tip_mm + 4.0), "move {} runs through what is left", m.seq);
    }
}

#[test]
fn rest_passes_are_for_a_smaller_tool() {
    let folder = scratch();
    groove(&folder.path().join("groove.igs"));
    let made =
        run(folder.path(), ["plan", "groove.igs", "--tool", "ball:6", "--rest-of", "ball:6", "-o", "out"]);
    assert_eq!(made.code, Some(2), "{made:?}");
    assert!(made.stderr.contains("leaves no rest"), "{made:?}");
    assert!(!folder.path().join("out").exists());
    // Where every radius is larger than the earlier ball's nothing is left to do.
    let made =
        run(folder.path(), ["plan", "groove.igs", "--tool", "ball:1", "--rest-of", "ball:3", "-o", "out"]);
    assert_eq!(made.code, Some(1), "{made:?}");
    assert!(made.stderr.contains("left nothing"), "{made:?}");
}
