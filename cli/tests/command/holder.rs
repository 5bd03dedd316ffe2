//! Holders: the least stick-out is taken, it does, and a shorter one is found.

use std::fs;
use std::path::Path;

use serde_json::Value;

use crate::obstacle::block;
use crate::run::{Run, panel, run};
use crate::scratch;

fn read(folder: &Path, file: &str) -> Value {
    serde_json::from_slice(&fs::read(folder.join(file)).unwrap()).unwrap()
}

/// What was said, whatever its line breaks.
fn said(run: &Run) -> String {
    run.stderr.split_whitespace().collect::<Vec<_>>().join(" ")
}

#[test]
fn beside_a_post_the_holder_stays_above_it() {
    let folder = scratch();
    let folder = folder.path();
    panel(folder);
    let top = 120.0;
    fs::write(folder.join("post.stl"), block([-20.0, -15.0, -40.0], [20.0, 15.0, top])).unwrap();
    let sections = "33-42x54,63x26";
    let auto = format!("auto:{sections}");
    let job = ["plan", "panel.igs", "--tool", "ball:10", "--scallop", "0.3", "--check", "post.stl"];
    let planned = run(folder, job.iter().chain(&["--holder", &auto, "-o", "out"]));
    assert_eq!(planned.code, Some(0), "{planned:?}");
    assert!(said(&planned).contains("of stick-out are needed"), "{planned:?}");

    let (job, found) = (read(folder, "out/job.json"), read(folder, "out/verify.json"));
    let regions = found["holder"]["regions"].as_array().unwrap();
    let needed: Vec<f64> = regions.iter().map(|r| r["stick_out_needed_mm"].as_f64().unwrap()).collect();
    let most = needed.iter().copied().fold(0.0, f64::max);
    assert_eq!(job["tools"][0]["holder"]["stick_out_mm"].as_f64(), Some(most.ceil()));
    assert_eq!((&found["holder"]["touching"], &found["holder"]["near"]), (&0.into(), &0.into()));
    // Right beside the post the lower end has to be 1 mm above it.
    let moves = claymill_toolpath::read_moves(&folder.join("out")).unwrap().moves;
    let lowest_beside = moves
        .iter()
        .filter(|m| m.setup == "top")
        .flat_map(|m| &m.points)
        .filter(|p| p[0].abs() < 20.0 + 16.0 && p[1].abs() < 15.0 + 16.0)
        .map(|p| p[2])
        .fold(f64::INFINITY, f64::min);
    let expected = top + 1.0 - lowest_beside;
    assert!((most - expected).abs() < 1.0, "{most} for about {expected}");
    let by_region = read(folder, "out/regions.json");
    assert!(by_region["regions"][0]["stick_out_needed_mm"]["top"].as_f64().unwrap() > 100.0);
    let text = fs::read_to_string(folder.join("out/job.toml")).unwrap();
    assert!(text.contains(&format!("holder = \"{}:{sections}\"", most.ceil())), "{text}");
    let report = fs::read_to_string(folder.join("out/report.html")).unwrap();
    assert!(report.contains("keep the holder 1 mm away") && report.contains("Stick-out needed"));

    let shorter = format!("{}:{sections}", most.ceil() - 3.0);
    let touched = run(folder, ["verify", "out", "--holder", &shorter]);
    assert_eq!(touched.code, Some(3), "{touched:?}");
    assert!(said(&touched).contains("the holder touches"), "{touched:?}");
    let farther = run(folder, ["verify", "out", "--holder-clearance", "4"]);
    assert_eq!(farther.code, Some(0), "{farther:?}");
    assert!(said(&farther).contains("asked for were 4 mm"), "{farther:?}");
    let refused = run(folder, ["verify", "out", "--holder-clearance", "-1"]);
    assert_eq!(refused.code, Some(2), "{refused:?}");
}
