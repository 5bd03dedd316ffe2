//! Times on a machine of one's own.

use std::fs;

use serde_json::Value;

use crate::run::{panel, run, run_without_adapter};
use crate::scratch;

#[test]
fn a_machine_s_own_limits_make_the_times() {
    let folder = scratch();
    let folder = folder.path();
    panel(folder);
    fs::write(
        folder.join("slow.toml"),
        "name = \"old gantry\"\n[feed]\nmax_mm_per_min = 3000\nrapid_mm_per_min = 9000\n\
         [dynamics]\nacceleration_mm_per_s2 = 250\njerk_mm_per_s3 = 1000\n[control]\ncorner_mm = 0.01\n",
    )
    .unwrap();
    let plan = |more: &[&str], out: &str| {
        let job = ["plan", "panel.igs", "--tool", "ball:10", "--scallop", "1", "-o", out];
        let planned = run_without_adapter(folder, job.iter().chain(more));
        assert_eq!(planned.code, Some(0), "{planned:?}");
        let text = fs::read(folder.join(out).join("job.json")).unwrap();
        serde_json::from_slice::<Value>(&text).unwrap()
    };
    let usual = plan(&[], "usual");
    let slow = plan(&["--machine", "slow.toml"], "slow");
    // At half the feed everything that is no turn takes twice as long.
    let time_s = |job: &Value| job["totals"]["time_s"].as_f64().unwrap();
    assert!(time_s(&slow) > 1.8 * time_s(&usual), "{} {}", time_s(&slow), time_s(&usual));
    let asked = &slow["request"];
    assert_eq!(asked["machine"]["name"], "old gantry");
    assert_eq!(asked["machine"]["jerk_mm_per_s3"], 1000.0);
    assert_eq!((&asked["feed_mm_per_min"], &asked["rapid_mm_per_min"]), (&3000.0.into(), &9000.0.into()));
    let report = fs::read_to_string(folder.join("slow/report.html")).unwrap();
    assert!(report.contains("on old gantry: 250 mm/s², 1000 mm/s³, corners within 0.01 mm"));
    // The job file makes the same again.
    let again = plan(&["--job", "slow/job.toml"], "again");
    assert_eq!((time_s(&again), &again["request"]), (time_s(&slow), &slow["request"]));

    let above = run(folder, ["plan", "panel.igs", "--machine", "slow.toml", "--feed", "4000", "-o", "above"]);
    assert_eq!(above.code, Some(2), "{above:?}");
    assert!(above.stderr.contains("3000") && above.stderr.contains("old gantry"), "{above:?}");
    let missing = run(folder, ["plan", "panel.igs", "--machine", "none.toml", "-o", "above"]);
    assert_eq!(missing.code, Some(2), "{missing:?}");
    assert!(missing.stderr.contains("none.toml") && !folder.join("above").exists(), "{missing:?}");
}
