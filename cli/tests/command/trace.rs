//! `--log`: where the time went.

use std::fs;

use serde_json::Value;

use crate::run::{panel, run_without_adapter};
use crate::scratch;

#[test]
fn a_log_says_what_took_how_long_on_which_thread() {
    let folder = scratch();
    let folder = folder.path();
    panel(folder);
    let plan = || {
        let args =
            ["plan", "panel.igs", "--tool", "ball:10", "--scallop", "2", "-o", "job", "--log", "log.json"];
        run_without_adapter(folder, args)
    };
    let planned = plan();
    assert_eq!(planned.code, Some(0), "{planned:?}");
    let text = fs::read_to_string(folder.join("log.json")).unwrap();
    // The list has no end, as the format allows: a job that is killed leaves what it did.
    let events: Vec<Value> =
        serde_json::from_str(&format!("{}]", text.trim_end().trim_end_matches(','))).unwrap();
    let named = |name: &str| -> Vec<&Value> { events.iter().filter(|e| e["name"] == name).collect() };
    for name in ["merging", "drop cutter", "part", "pattern", "fit", "link", "verify", "verifying"] {
        assert!(!named(name).is_empty(), "nothing says {name}");
    }
    let ends =
        |e: &Value| (e["ts"].as_f64().unwrap(), e["ts"].as_f64().unwrap() + e["dur"].as_f64().unwrap());
    for fit in named("fit") {
        let holds = |part: &&&Value| {
            let ((a, b), (c, d)) = (ends(part), ends(fit));
            part["tid"] == fit["tid"] && a <= c && d <= b
        };
        assert!(named("part").iter().any(|part| holds(&part)), "{fit} is in no part");
    }
    assert!(named("part").iter().all(|part| part["args"]["area_m2"].as_f64().unwrap() > 0.0));

    // An earlier log is replaced, and nothing else is.
    assert_eq!(plan().code, Some(0));
    let refused = run_without_adapter(folder, ["inspect", "panel.igs", "--log", "panel.igs"]);
    assert_eq!(refused.code, Some(1), "{refused:?}");
    assert!(refused.stderr.contains("only an earlier trace is replaced"), "{refused:?}");
}
