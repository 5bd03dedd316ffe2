//! Vehicles of which a file holds one half.

use std::path::Path;

use claymill_exchange::write_step;
use claymill_nurbs::Model;
use claymill_toolpath::{Mirror, read_job, read_regions};

use crate::run::{Run, run, run_without_adapter};
use crate::scratch;

/// Faces on one side of the plane y = 0.
fn half_of(whole: &Model) -> Model {
    let faces = whole.faces.iter().filter(|face| face.bounds().min.y > -1e-6).cloned().collect();
    Model { faces, ..*whole }
}

fn length_mm(folder: &Path) -> f64 {
    read_job(folder).unwrap().totals.length.cut_mm
}

#[test]
fn images_are_planned_and_verified_from_the_half_in_the_file() {
    let folder = scratch();
    let folder = folder.path();
    let made = run(folder, ["sample", "ribbon", "--patches", "200", "-o", "whole.stp"]);
    assert_eq!(made.code, Some(0), "{made:?}");
    let whole = claymill_exchange::read(&folder.join("whole.stp")).unwrap().model;
    let half = half_of(&whole);
    let whole_faces = whole.faces.len();
    assert_eq!(2 * half.faces.len(), whole_faces);
    write_step(&folder.join("half.stp"), &half, &[]).unwrap();
    let plan = |model: &str, more: &[&str], out: &str| -> Run {
        let told = ["plan", model, "--tool", "ball:10", "--scallop", "1", "--no-store", "-o", out];
        run_without_adapter(folder, told.iter().chain(more))
    };
    for (model, more, out) in [
        ("whole.stp", &[][..], "whole"),
        ("half.stp", &["--mirror", "y:both"], "both"),
        ("half.stp", &[], "half"),
        ("half.stp", &["--mirror", "y"], "image"),
    ] {
        let made = plan(model, more, out);
        assert_eq!(made.code, Some(0), "{out}: {made:?}");
        assert!(!made.stderr.contains("both sides"), "{out}: {made:?}");
    }
    let [whole, both, half, image] =
        ["whole", "both", "half", "image"].map(|out| length_mm(&folder.join(out)));
    assert!((both / whole - 1.0).abs() < 1e-3, "{both} {whole}");
    assert!((image / half - 1.0).abs() < 1e-3, "{image} {half}");

    // From its file alone, and again from its own job file.
    let verified = run(folder, ["verify", "both"]);
    assert_eq!(verified.code, Some(0), "{verified:?}");
    let job = read_job(&folder.join("both")).unwrap();
    assert_eq!(job.model.mirror, Some(Mirror { axis: 1, keeps_model: true }));
    assert_eq!(job.model.faces(), whole_faces);
    assert_eq!(read_regions(&folder.join("both")).unwrap().regions.len(), 1);
    let again = plan("half.stp", &["--job", "both/job.toml"], "again");
    assert_eq!(again.code, Some(0), "{again:?}");
    let moves = |out: &str| std::fs::read(folder.join(out).join("toolpaths.jsonl")).unwrap();
    assert!(moves("again") == moves("both"), "a job file does not make its job again");

    // A whole body and its image lie in each other.
    let twice = plan("whole.stp", &["--mirror", "y:both"], "twice");
    assert!(twice.stderr.contains("both sides"), "{twice:?}");
    let refused = plan("half.stp", &["--mirror", "w"], "none");
    assert_eq!(refused.code, Some(2), "{refused:?}");
}
