//! Holders: the least stick-out is taken, it does, and a shorter one is found.

use std::fs;
use std::path::Path;

use serde_json::Value;

use crate::iges_text::{Entity, entity, file};
use crate::obstacle::block;
use crate::run::{Run, panel, run, run_without_adapter};
use crate::scratch;

fn read(folder: &Path, file: &str) -> Value {
    serde_json::from_slice(&fs::read(folder.join(file)).unwrap()).unwrap()
}

/// What was said, whatever its line breaks.
fn said(run: &Run) -> String {
    run.stderr.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// A plane from `at` along two of its sides, which is seen from `u × v`.
fn plane(at: [f64; 3], u: [f64; 3], v: [f64; 3]) -> Entity {
    let corner = |a: f64, b: f64| [0, 1, 2].map(|k| format!("{:?}", at[k] + a * u[k] + b * v[k])).join(",");
    let corners = [corner(0.0, 0.0), corner(1.0, 0.0), corner(0.0, 1.0), corner(1.0, 1.0)].join(",");
    let knots = "0.,0.,1.,1.,0.,0.,1.,1.";
    entity(128, format!("1,1,1,1,0,0,1,0,0,{knots},1.,1.,1.,1.,{corners},0.,1.,0.,1."))
}

/// A floor of 100 mm before a wall of 60 mm.
fn corner() -> String {
    let floor = plane([0.0, 0.0, 0.0], [80.0, 0.0, 0.0], [0.0, 100.0, 0.0]);
    let wall = plane([0.0, 100.0, 0.0], [80.0, 0.0, 0.0], [0.0, 0.0, 60.0]);
    file(&[floor, wall])
}

#[test]
fn passes_keep_clear_of_a_holder_and_what_it_keeps_them_from_is_named() {
    let folder = scratch();
    let folder = folder.path();
    fs::write(folder.join("corner.igs"), corner()).unwrap();
    let left_mm2 = |setups: &str, holder: &str| {
        let job = format!(
            "plan corner.igs --tool ball:5 --scallop 0.5 --up +z --length=-y --material-side file --setups {setups} \
             --holder {holder} -o out --force"
        );
        let planned = run_without_adapter(folder, job.split_whitespace());
        assert_eq!(planned.code, Some(0), "{planned:?}");
        let found = read(folder, "out/verify.json");
        assert_eq!((&found["holder"]["touching"], &found["holder"]["near"]), (&0.into(), &0.into()), "{job}");
        let named = said(&planned).contains("are out of reach for the holder");
        let left_mm2 = found["coverage"]["by_state_mm2"]["holder_in_the_way"].as_f64();
        assert_eq!(named, left_mm2.is_some(), "{planned:?}");
        left_mm2.unwrap_or_default()
    };
    // Straight, 15 mm in radius: where it is lower than the wall the ball comes no nearer than 16 mm to it. From the front it comes
    // no lower than 16 mm over the floor.
    let straight = "40:30-30x100";
    let from_top_mm2 = left_mm2("top", straight);
    let floor_mm2 = 80.0 * 16.0;
    assert!((floor_mm2..floor_mm2 + 80.0 * 30.0).contains(&from_top_mm2), "{from_top_mm2}");
    let from_both_mm2 = left_mm2("top,front", straight);
    assert!(0.0 < from_both_mm2 && from_both_mm2 < 0.8 * from_top_mm2, "{from_both_mm2} of {from_top_mm2}");
    assert_eq!(left_mm2("top", "70:30-30x100"), 0.0);
    let touching_mm2 = left_mm2("top", "40:30-30x100 --holder-clearance 0");
    assert!((80.0 * 14.8..from_top_mm2).contains(&touching_mm2), "{touching_mm2} of {from_top_mm2}");
}

#[test]
fn every_setup_has_the_least_stick_out_that_does_there() {
    let folder = scratch();
    let folder = folder.path();
    // From above the holder stays over the wall, from the front before the floor.
    fs::write(folder.join("corner.igs"), corner()).unwrap();
    let job = "plan corner.igs --tool ball:5 --scallop 0.5 --up +z --length=-y --material-side file --holder auto -o out";
    let planned = run(folder, job.split(' '));
    assert_eq!(planned.code, Some(0), "{planned:?}");
    let (job, found) = (read(folder, "out/job.json"), read(folder, "out/verify.json"));
    let tool = &job["tools"][0];
    let stick_outs = tool["setup_stick_out_mm"].as_object().unwrap();
    let regions = found["holder"]["regions"].as_array().unwrap();
    let report = fs::read_to_string(folder.join("out/report.html")).unwrap();
    for (setup, expected) in [("top", 61.0), ("front", 101.0)] {
        let taken = stick_outs[setup].as_f64().unwrap();
        let mine = || regions.iter().filter(|r| r["setup"] == setup);
        let needed = mine().map(|r| r["stick_out_needed_mm"].as_f64().unwrap()).fold(0.0, f64::max);
        assert!((needed - expected).abs() < 1.0, "{setup}: {needed} for {expected}");
        assert_eq!(taken, needed.ceil(), "{setup}");
        assert!(mine().all(|r| r["stick_out_mm"].as_f64() == Some(taken)), "{setup}: {regions:?}");
        for told in [&said(&planned), &report] {
            assert!(
                told.contains(&format!("{needed:.2} mm")) && told.contains(&format!("{taken} mm")),
                "{setup}"
            );
        }
        assert!(said(&planned).contains(&format!("{setup} {needed:.2} of {taken} mm")), "{planned:?}");
        assert!(report.contains(&format!("{taken} mm: {needed:.2} mm keep the holder 1 mm away")), "{setup}");
        assert!(report.contains(&format!("{taken} mm out of its holder")), "{setup}");
    }
    // Whoever reads one holder for the job has one that does everywhere.
    assert_eq!(tool["holder"]["stick_out_mm"], stick_outs["front"]);
    assert_eq!((&found["holder"]["touching"], &found["holder"]["near"]), (&0.into(), &0.into()));
    // The job file makes the same again.
    let again = run_without_adapter(folder, ["plan", "corner.igs", "--job", "out/job.toml", "-o", "again"]);
    assert_eq!(again.code, Some(0), "{again:?}");
    assert_eq!(read(folder, "again/job.json")["tools"], job["tools"]);

    // Each setup is judged with its own.
    let edited = |edit: &dyn Fn(&mut Value)| {
        let mut job = job.clone();
        edit(&mut job["tools"][0]);
        fs::write(folder.join("out/job.json"), serde_json::to_vec_pretty(&job).unwrap()).unwrap();
        run(folder, ["verify", "out", "--json"])
    };
    let short = edited(&|tool| tool["setup_stick_out_mm"]["front"] = stick_outs["top"].clone());
    assert_eq!(short.code, Some(3), "{short:?}");
    let findings = short.json()["verdict"]["findings"].to_string();
    assert!(findings.contains("mm or more in front") && !findings.contains("more in top"), "{findings}");
    // A job with one holder for all setups is read as before.
    let old = edited(&|tool| drop(tool.as_object_mut().unwrap().remove("setup_stick_out_mm")));
    assert_eq!(old.code, Some(0), "{old:?}");
    let found = old.json();
    let all = found["holder"]["regions"].as_array().unwrap().iter();
    assert!(all.clone().all(|r| r["stick_out_mm"] == stick_outs["front"]), "{found}");
    let none = edited(&|tool| tool["setup_stick_out_mm"]["top"] = 0.into());
    assert_eq!(none.code, Some(1), "{none:?}");
    assert!(none.stderr.contains("sticks out 0 mm in top"), "{none:?}");
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
    let planned = run_without_adapter(folder, job.iter().chain(&["--holder", &auto, "-o", "out"]));
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
    assert!(text.contains(&format!("holder = \"{auto}\"")), "{text}");
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
