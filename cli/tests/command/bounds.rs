//! The tool is kept where it was asked to stay, and the verifier agrees.

use std::path::Path;

use claymill_exchange::write_iges;
use claymill_nurbs::analytic::{Frame, plane_patch};
use claymill_nurbs::{Point3, Vector3};
use claymill_tests::model_of;
use claymill_toolpath::{Contain, MoveKind, UncutReason, read_job, read_moves};

use crate::run::{Run, run, run_without_adapter};
use crate::scratch;

/// A plate of 120 × 70 mm with a kerb 15 mm high across its end, planned.
fn planned(folder: &Path, more: &[&str]) -> Run {
    let frame = |origin, z, x| Frame::new(origin, z, x).unwrap();
    let plate =
        plane_patch(&frame(Point3::origin(), Vector3::z(), Vector3::x()), (0.0, 120.0), (0.0, 70.0)).unwrap();
    let end = frame(Point3::new(120.0, 0.0, 0.0), Vector3::x(), Vector3::y());
    let kerb = plane_patch(&end, (0.0, 70.0), (0.0, 15.0)).unwrap();
    write_iges(&folder.join("model.igs"), &model_of(vec![plate, kerb]), &[]).unwrap();
    let plan = ["plan", "model.igs", "--tool", "ball:6", "--scallop", "0.05", "--up", "+z", "--length", "+x"];
    run(folder, plan.iter().chain(more).chain(&["-o", "out"]))
}

/// Ranges of the tip along x and y on cuts from above.
fn tips(folder: &Path) -> [[f64; 2]; 2] {
    let program = read_moves(&folder.join("out")).unwrap();
    let cuts = program.moves.iter().filter(|m| m.kind == MoveKind::Cut && m.setup == "top");
    let start = [[f64::INFINITY, f64::NEG_INFINITY]; 2];
    cuts.flat_map(|m| m.points.clone())
        .fold(start, |r, p| [0, 1].map(|k: usize| [r[k][0].min(p[k]), r[k][1].max(p[k])]))
}

#[test]
fn a_box_an_edge_and_faces_to_avoid_are_kept_and_verified() {
    let folder = scratch();
    let made = planned(folder.path(), &["--within", "20,,:90,50,", "--contain", "edge", "--only", "face:0"]);
    assert_eq!(made.code, Some(0), "{made:?}");
    let [x, y] = tips(folder.path());
    assert!(x[0] >= 25.99 && x[0] < 26.1 && x[1] <= 84.01 && x[1] > 83.9, "{x:?}");
    assert!(y[0] >= 5.99 && y[0] < 7.0 && y[1] <= 44.01 && y[1] > 43.0, "{y:?}");
    let job = read_job(&folder.path().join("out")).unwrap();
    assert_eq!(job.request.bounds.contain, Contain::Edge);
    assert!(job.area.uncut_mm2[&UncutReason::OutOfBounds] > 3000.0);
    // What was asked for can be asked for again.
    let again = ["plan", "model.igs", "--job", "out/job.toml", "-o", "again"];
    assert_eq!(run_without_adapter(folder.path(), again).code, Some(0));
    let moves = |job: &str| std::fs::read(folder.path().join(job).join("toolpaths.jsonl")).unwrap();
    assert!(moves("out") == moves("again"));

    let made = planned(folder.path(), &["--avoid", "face:1", "--avoid-margin", "2.5"]);
    assert_eq!(made.code, Some(0), "{made:?}");
    let [x, _] = tips(folder.path());
    assert!(x[1] <= 111.51 && x[1] > 111.4, "{x:?}");
    let job = read_job(&folder.path().join("out")).unwrap();
    assert_eq!((job.request.bounds.avoid, job.request.bounds.avoid_mm), (vec![1], 2.5));
}

#[test]
fn bounds_that_make_no_sense_are_refused() {
    let folder = scratch();
    for (asked, told) in [
        (&["--within", "20,0:90,50"][..], "is not two corners of three coordinates each"),
        (&["--within", "20,0,0,0:90,50,1,1"], "more than three coordinates"),
        (&["--within", "90,,:20,,"], "is empty"),
        (&["--avoid-margin", "2"], "--avoid-margin is for what --avoid names"),
        (&["--avoid", "face:1", "--avoid-margin", "-2"], "between 0 and 100"),
        (&["--avoid", "layer:GLASS"], "no face has this layer"),
        (&["--extend", "5000"], "between 0 and 100"),
        (&["--within", "500,,:600,,"], "no setup reaches any face"),
    ] {
        let made = planned(folder.path(), asked);
        assert_ne!(made.code, Some(0), "{asked:?}");
        assert!(made.stderr.contains(told), "{asked:?}: {made:?}");
        assert!(!folder.path().join("out").exists());
    }
}
