//! Passes between sides that were chosen, and as many as were asked for.

use std::path::Path;

use claymill_exchange::write_iges;
use claymill_nurbs::analytic::{Frame, plane_patch};
use claymill_nurbs::{Point3, Vector3};
use claymill_tests::model_of;
use claymill_toolpath::{MoveKind, read_job, read_moves};

use crate::run::{Run, run, run_without_adapter};
use crate::scratch;

const PLAN: [&str; 10] =
    ["plan", "model.igs", "--tool", "ball:6", "--scallop", "0.05", "--up", "+z", "--length", "+x"];

/// A plate of 180 × 70 mm in two patches, planned.
fn planned(folder: &Path, more: &[&str]) -> Run {
    let frame = Frame::new(Point3::origin(), Vector3::z(), Vector3::x()).unwrap();
    let patch = |x: (f64, f64)| plane_patch(&frame, x, (0.0, 70.0)).unwrap();
    write_iges(&folder.join("model.igs"), &model_of(vec![patch((0.0, 60.0)), patch((60.0, 180.0))]), &[])
        .unwrap();
    run(folder, PLAN.iter().chain(more).chain(&["-o", "out"]))
}

/// How long the passes are along x and y, and where they run across, mm.
fn passes(folder: &Path) -> Vec<([f64; 2], [f64; 2])> {
    let program = read_moves(&folder.join("out")).unwrap();
    let cuts = program.moves.iter().filter(|m| m.kind == MoveKind::Cut);
    let of_cut = |m: &claymill_toolpath::Move| {
        let (a, b) = (m.points[0], m.points[m.points.len() - 1]);
        ([0, 1].map(|k: usize| (b[k] - a[k]).abs()), [0, 1].map(|k: usize| 0.5 * (a[k] + b[k])))
    };
    cuts.map(of_cut).collect()
}

#[test]
fn a_plate_is_swept_from_the_side_that_was_chosen() {
    for strategy in ["flow", "scallop"] {
        let folder = scratch();
        let made = planned(folder.path(), &["--strategy", strategy]);
        assert_eq!(made.code, Some(0), "{made:?}");
        assert!(passes(folder.path()).iter().all(|(along, _)| along[0] > 150.0 && along[1] < 0.01));

        let made = planned(folder.path(), &["--strategy", strategy, "--guide", "-4,30,2"]);
        assert_eq!(made.code, Some(0), "{made:?}");
        assert!(passes(folder.path()).iter().all(|(along, _)| along[1] > 60.0 && along[0] < 0.01));
        let job = read_job(&folder.path().join("out")).unwrap();
        assert_eq!(job.request.guides, [[-4.0, 30.0, 2.0]]);
        // What was asked for can be asked for again.
        let again = ["plan", "model.igs", "--job", "out/job.toml", "-o", "again"];
        assert_eq!(run_without_adapter(folder.path(), again).code, Some(0));
        let moves = |job: &str| std::fs::read(folder.path().join(job).join("toolpaths.jsonl")).unwrap();
        assert!(moves("out") == moves("again"));
    }
}

#[test]
fn places_that_choose_no_side_are_refused() {
    let folder = scratch();
    let refused = |more: &[&str], code: i32, said: &str| {
        let made = planned(folder.path(), more);
        assert_eq!(made.code, Some(code), "{made:?}");
        assert!(made.stderr.contains(said), "{made:?}");
        assert!(!folder.path().join("out").exists());
    };
    refused(&["--guide", "0,0,0"], 2, "only flow, scallop and auto");
    refused(&["--strategy", "flow", "--guide", "0,0"], 2, "three coordinates");
    refused(&["--strategy", "flow", "--guide", "90,250,0"], 1, "the nearest is 180.0 mm away");
    let beside = ["--strategy", "flow", "--guide", "40,-1,0", "--guide", "90,-1,0"];
    refused(&beside, 1, "both places are beside the same one");
    let three = [&beside[..], &["--guide", "90,71,0"]].concat();
    refused(&three, 1, "three places or more");
}

#[test]
fn a_patch_has_as_many_parameter_lines_as_were_asked_for() {
    let folder = scratch();
    let made = planned(folder.path(), &["--strategy", "isoparametric", "--lines", "20"]);
    // 3.5 mm apart leave more than was asked for, and the proof says how much.
    assert_eq!(made.code, Some(3), "{made:?}");
    assert!(made.stderr.contains("NOT PASSED"), "{made:?}");
    let found = std::fs::read_to_string(folder.path().join("out/verify.json")).unwrap();
    let found: serde_json::Value = serde_json::from_str(&found).unwrap();
    let (crest_mm, ball_mm) = (found["scallop"]["crests"]["p99_mm"].as_f64().unwrap(), 6.0f64);
    let exact_mm = ball_mm - (ball_mm.powi(2) - 1.75f64.powi(2)).sqrt();
    // And the fit keeps on the safe side by 2 µm, its tolerance is 2 more.
    assert!(crest_mm > exact_mm && crest_mm < exact_mm + 4e-3, "{crest_mm} {exact_mm}");
    let mut across: Vec<f64> =
        passes(folder.path()).iter().filter(|(_, at)| at[0] > 60.0).map(|(_, at)| at[1]).collect();
    across.sort_by(f64::total_cmp);
    assert_eq!(across.len(), 20);
    for (k, y) in across.iter().enumerate() {
        assert!((y - 3.5 * (k as f64 + 0.5)).abs() < 1e-4, "{across:?}");
    }

    for wrong in [&["--lines", "20"][..], &["--strategy", "isoparametric", "--lines", "0"]] {
        let made = planned(folder.path(), wrong);
        assert_eq!(made.code, Some(2), "{made:?}");
        assert!(made.stderr.contains("--strategy isoparametric --lines 20"), "{made:?}");
    }
}
