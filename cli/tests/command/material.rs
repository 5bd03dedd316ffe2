//! Only the side of a sheet without material is cut.

use std::f64::consts::{FRAC_PI_2, TAU};
use std::path::Path;

use claymill_exchange::write_iges;
use claymill_nurbs::analytic::{Frame, sphere};
use claymill_nurbs::{Point3, Vector3};
use claymill_tests::model_of;
use claymill_toolpath::{FreeSide, MoveKind, read_job, read_moves};

use crate::run::{Run, run};
use crate::scratch;

const RADIUS_MM: f64 = 40.0;
const BALL_MM: f64 = 4.0;

/// Half a ball, open towards −y, planned.
fn planned(folder: &Path, more: &[&str]) -> Run {
    let along = Frame::new(Point3::origin(), Vector3::y(), Vector3::x()).unwrap();
    let half = sphere(&along, RADIUS_MM, (0.0, TAU), (0.0, FRAC_PI_2)).unwrap();
    write_iges(&folder.join("half.igs"), &model_of([half]), &[]).unwrap();
    let plan = ["plan", "half.igs", "--tool", "ball:4", "--scallop", "0.2", "--up", "+z", "--length", "+x"];
    run(folder, plan.iter().chain(more).chain(&["-o", "out"]))
}

/// The least and the largest distance of the ball's centre from the middle, on passes.
fn from_middle_mm(folder: &Path) -> [f64; 2] {
    let program = read_moves(&folder.join("out")).unwrap();
    let mut range = [f64::INFINITY, 0.0f64];
    for m in program.moves.iter().filter(|m| m.kind == MoveKind::Cut) {
        let (curve, up) = (m.curve().unwrap(), Vector3::from(m.axis_start));
        let (from, to) = curve.domain();
        for k in 0..=20 {
            let centre = curve.point(from + (to - from) * f64::from(k) / 20.0) + up * BALL_MM;
            range = [range[0].min(centre.coords.norm()), range[1].max(centre.coords.norm())];
        }
    }
    range
}

#[test]
fn half_a_ball_is_cut_from_outside_unless_it_is_said_to_be_hollow() {
    let folder = scratch();
    let made = planned(folder.path(), &[]);
    assert_eq!(made.code, Some(0), "{made:?}");
    assert!(made.stderr.contains("1 sheet: 1 by what encloses"), "{made:?}");
    let [least, most] = from_middle_mm(folder.path());
    assert!(least > RADIUS_MM && most < RADIUS_MM + BALL_MM + 0.02, "{least} {most}");

    // The job says which side was cut; said the other way round, the same moves are in the material.
    let path = folder.path().join("out/job.json");
    let mut job = read_job(&folder.path().join("out")).unwrap();
    assert!(job.faces[0].free_side != FreeSide::Both);
    job.faces[0].free_side = FreeSide::one(job.faces[0].free_side == FreeSide::Against);
    std::fs::write(&path, serde_json::to_string(&job).unwrap()).unwrap();
    let found = run(folder.path(), ["--json", "verify", "out"]);
    assert_eq!(found.code, Some(3), "{found:?}");
    let found = found.json();
    let codes: Vec<&str> = found["verdict"]["findings"]
        .as_array()
        .unwrap()
        .iter()
        .filter(|f| f["severity"] == "error")
        .filter_map(|f| f["code"].as_str())
        .collect();
    assert!(codes.contains(&"wrong_side"), "{codes:?}");
    let cut_mm2 = job.area.cut_mm2;
    let wrong_mm2 = found["sides"]["wrong_mm2"].as_f64().unwrap();
    assert!((wrong_mm2 / cut_mm2 - 1.0).abs() < 0.05, "{wrong_mm2} of {cut_mm2}");

    // What was changed by hand is not replaced.
    std::fs::remove_dir_all(folder.path().join("out")).unwrap();
    let made = planned(folder.path(), &["--material-side", "outside"]);
    assert_eq!(made.code, Some(0), "{made:?}");
    let [least, most] = from_middle_mm(folder.path());
    assert!(most < RADIUS_MM && least > RADIUS_MM - BALL_MM - 0.02, "{least} {most}");
    // What was asked for can be asked for again.
    let job = read_job(&folder.path().join("out")).unwrap();
    assert_eq!(job.request.material_side, ["outside"]);
    let again = ["plan", "half.igs", "--job", "out/job.toml", "-o", "again"];
    assert_eq!(run(folder.path(), again).code, Some(0));
    let moves = |job: &str| std::fs::read(folder.path().join(job).join("toolpaths.jsonl")).unwrap();
    assert!(moves("out") == moves("again"));
}

#[test]
fn sides_that_are_none_are_refused() {
    let folder = scratch();
    for (wrong, said) in
        [("up", "does not say"), ("face:7=inside", "only 1 faces"), ("face:0=-w", "does not say")]
    {
        let made = planned(folder.path(), &["--material-side", wrong]);
        assert_eq!(made.code, Some(2), "{made:?}");
        assert!(made.stderr.contains(said), "{made:?}");
        assert!(!folder.path().join("out").exists());
    }
}
