//! A job goes to a machine only when these very moves passed verification, or when somebody says otherwise; then the program
//! says so too.

use std::fs;
use std::path::Path;

use claymill_tests::{Need, leave_out};

use crate::run::{Run, panel_job, run, run_without_adapter};
use crate::scratch;

const DIALECTS: [&str; 10] = [
    "fanuc",
    "mitsubishi",
    "siemens",
    "heidenhain",
    "linuxcnc",
    "beckhoff",
    "g1",
    "apt",
    "apt-creo",
    "step-nc",
];

fn post(folder: &Path, more: &[&str]) -> Run {
    run(folder, ["post", "job", "--to", "g1", "-o", "x.nc"].iter().chain(more))
}

/// Neither a program nor a stream, and the reason.
fn refused(folder: &Path, why: &str) {
    let made = post(folder, &[]);
    assert_eq!(made.code, Some(1), "{why}: {made:?}");
    assert!(made.stderr.contains(why) && made.stderr.contains("--unverified"), "{why}: {}", made.stderr);
    assert!(!folder.join("x.nc").exists() && !folder.join("x.nc.totals.json").exists());
    let streamed = run(folder, ["stream", "job", "--to", "shm:queue"]);
    assert_eq!(streamed.code, Some(1), "{why}: {streamed:?}");
    assert!(streamed.stderr.contains(why) && !folder.join("queue").exists(), "{}", streamed.stderr);
}

/// Lowers one control point of a cut in the middle of the job by 2 mm.
fn lower_one_point(folder: &Path) {
    let path = folder.join("job/toolpaths.jsonl");
    let text = fs::read_to_string(&path).unwrap();
    let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
    let middle = lines.len() / 2;
    let cut = (middle..).find(|&i| lines[i].contains("\"kind\":\"cut\"")).unwrap();
    let mut m: serde_json::Value = serde_json::from_str(&lines[cut]).unwrap();
    let z = m["points"][1][2].as_f64().unwrap();
    m["points"][1][2] = (z - 2.0).into();
    lines[cut] = m.to_string();
    fs::write(path, lines.join("\n") + "\n").unwrap();
}

#[test]
fn only_these_very_moves_that_passed_go_to_a_machine() {
    let place = scratch();
    let folder = place.path();
    panel_job(folder);
    let other = ["plan", "panel.igs", "--tool", "ball:10", "--scallop", "2", "--angle", "30", "-o", "other"];
    let made = run_without_adapter(folder, other);
    assert_eq!(made.code, Some(0), "{made:?}");
    let job = folder.join("job");
    let verdict = fs::read(job.join("verify.json")).unwrap();
    let judged: serde_json::Value = serde_json::from_slice(&verdict).unwrap();
    assert_eq!(judged["judged"]["toolpaths_sha256"].as_str().map(str::len), Some(64), "{judged}");
    let sound = post(folder, &[]);
    assert_eq!(sound.code, Some(0), "{sound:?}");
    let text = fs::read_to_string(folder.join("x.nc")).unwrap();
    assert!(!text.contains("UNVERIFIED") && !sound.stderr.contains("UNVERIFIED"));
    fs::remove_file(folder.join("x.nc")).unwrap();
    fs::remove_file(folder.join("x.nc.totals.json")).unwrap();

    // No verdict, and one of another job.
    fs::remove_file(job.join("verify.json")).unwrap();
    refused(folder, "not verified: there is no verify.json");
    fs::copy(folder.join("other/verify.json"), job.join("verify.json")).unwrap();
    refused(folder, "the verdict in verify.json belongs to other moves");
    fs::write(job.join("verify.json"), &verdict).unwrap();
    // The job says something else than was judged; what only says where and when does not matter.
    let record = fs::read_to_string(job.join("job.json")).unwrap();
    fs::write(
        job.join("job.json"),
        record.replace("\"feed_mm_per_min\": 6000.0", "\"feed_mm_per_min\": 600.0"),
    )
    .unwrap();
    refused(folder, "belongs to another job.json");
    let mut moved: serde_json::Value = serde_json::from_str(&record).unwrap();
    moved["model"]["path"] = "elsewhere/panel.igs".into();
    moved["timings"] = serde_json::json!([]);
    fs::write(job.join("job.json"), moved.to_string()).unwrap();
    assert_eq!(post(folder, &[]).code, Some(0));
    fs::remove_file(folder.join("x.nc")).unwrap();
    fs::remove_file(folder.join("x.nc.totals.json")).unwrap();
    fs::write(job.join("job.json"), &record).unwrap();

    // One point 2 mm too deep: refused as long as nobody has looked, and after that for what was found.
    let sound = fs::read(job.join("toolpaths.jsonl")).unwrap();
    lower_one_point(folder);
    refused(folder, "belongs to other moves");
    let verified = run(folder, ["verify", "job"]);
    assert_eq!(verified.code, Some(3), "{verified:?}");
    refused(folder, "did not pass verification: ");
    for dialect in DIALECTS {
        let made = run(folder, ["post", "job", "--to", dialect, "-o", dialect, "--unverified"]);
        assert_eq!(made.code, Some(0), "{dialect}: {made:?}");
        assert!(made.stderr.contains("UNVERIFIED"), "{dialect}: {}", made.stderr);
        let text = fs::read_to_string(folder.join(dialect)).unwrap();
        let head: Vec<&str> = text.lines().take(12).collect();
        assert!(head.join("\n").contains("UNVERIFIED JOB, did not pass verification"), "{dialect}: {head:?}");
    }
    // The right moves are judged anew, and stand again.
    fs::write(job.join("toolpaths.jsonl"), sound).unwrap();
    refused(folder, "belongs to other moves");
    assert_eq!(run(folder, ["verify", "job"]).code, Some(0));
    assert_eq!(fs::read(job.join("verify.json")).unwrap(), verdict);
    assert_eq!(post(folder, &[]).code, Some(0));
}

#[test]
fn nobody_shows_a_verdict_on_other_moves() {
    let place = scratch();
    let folder = place.path();
    panel_job(folder);
    lower_one_point(folder);
    let shown = run(folder, ["view", "job", "--picture", "w.png", "--size", "800x500"]);
    if shown.stderr.contains("graphics adapter") {
        return leave_out(Need::Vulkan, "no graphics adapter");
    }
    assert_eq!(shown.code, Some(0), "{shown:?}");
    assert!(shown.stderr.contains("belongs to other moves"), "{}", shown.stderr);
    // A report is judged anew, and so is what it leaves behind.
    let report = run(folder, ["report", "job"]);
    assert_eq!(report.code, Some(3), "{report:?}");
    let page = fs::read_to_string(folder.join("job/report.html")).unwrap();
    assert!(page.contains("Verification failed: do not run this job"));
    refused(folder, "did not pass verification");
    let shown = run(folder, ["view", "job", "--picture", "w.png", "--size", "800x500"]);
    assert!(!shown.stderr.contains("belongs to"), "{}", shown.stderr);

    // A model that changed since is nobody's to be drawn on.
    let mut text = fs::read_to_string(folder.join("panel.igs")).unwrap();
    text.push('\n');
    fs::write(folder.join("panel.igs"), text).unwrap();
    for command in
        [&["render", "job", "-o", "p.png"][..], &["report", "job"], &["view", "job", "--picture", "w.png"]]
    {
        let changed = run(folder, command);
        assert_eq!(changed.code, Some(1), "{changed:?}");
        assert!(changed.stderr.contains("has changed since the job was planned"), "{}", changed.stderr);
    }
}
