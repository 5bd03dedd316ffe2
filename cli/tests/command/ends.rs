//! Jobs of flat and bull-nosed ends, planned and verified from their files, and what is planted into these is found.

use std::f64::consts::{PI, TAU};
use std::path::Path;

use claymill_exchange::write_iges;
use claymill_nurbs::analytic::{Frame, plane_patch, torus};
use claymill_nurbs::{NurbsSurface, Point3, Vector3};
use claymill_tests::model_of;
use claymill_toolpath::{Job, read_job};

use crate::run::run_without_adapter;
use crate::scratch;

/// A plane of 90 by 60 mm that rises along x.
fn slope(deg: f64) -> NurbsSurface {
    let (sine, cosine) = deg.to_radians().sin_cos();
    let (normal, uphill) = (Vector3::new(-sine, 0.0, cosine), Vector3::new(cosine, 0.0, sine));
    let at = Frame::new(Point3::origin(), normal, uphill).unwrap();
    plane_patch(&at, (0.0, 90.0), (0.0, 60.0)).unwrap()
}

/// The upper half of a ring.
fn ring() -> NurbsSurface {
    let at = Frame::new(Point3::origin(), Vector3::z(), Vector3::x()).unwrap();
    torus(&at, 40.0, 16.0, (0.0, TAU), (0.25 * PI, 0.75 * PI)).unwrap()
}

/// Plans a model and verifies it from its files.
fn planned(folder: &Path, surface: NurbsSurface, tool: &str) -> (Job, serde_json::Value) {
    write_iges(&folder.join("model.igs"), &model_of([surface]), &[]).unwrap();
    let asked =
        ["plan", "model.igs", "--strategy", "planar", "--scallop", "0.1", "--setup", "top", "--up", "+z"];
    let made = run_without_adapter(folder, asked.iter().chain(&["--tool", tool, "-o", "job"]));
    assert_eq!(made.code, Some(0), "{tool}: {made:?}");
    let verified = run_without_adapter(folder, ["verify", "job", "--json"]);
    assert_eq!(verified.code, Some(0), "{tool}: {verified:?}");
    (read_job(&folder.join("job")).unwrap(), verified.json())
}

fn number(found: &serde_json::Value, path: &str) -> f64 {
    found.pointer(path).and_then(serde_json::Value::as_f64).unwrap_or_else(|| panic!("no {path} in {found}"))
}

/// Whether `verify` finds something of this kind in the job.
fn finds(folder: &Path, codes: &[&str]) {
    let verified = run_without_adapter(folder, ["verify", "job", "--json"]);
    assert_eq!(verified.code, Some(3), "{verified:?}");
    let found = verified.json();
    let findings = found.pointer("/verdict/findings").and_then(|f| f.as_array()).unwrap();
    let is_error = |f: &serde_json::Value| f["severity"] == "error" && codes.iter().any(|c| f["code"] == *c);
    assert!(findings.iter().any(is_error), "{codes:?}: {findings:?}");
}

#[test]
fn flat_and_bull_nosed_ends_are_planned_and_verified() {
    for (name, surface, tool) in [
        ("level", slope(0.0), "bull:10:2"),
        ("level flat", slope(0.0), "flat:10"),
        ("slope", slope(10.0), "bull:10:2"),
        ("slope flat", slope(15.0), "flat:6"),
        ("ring", ring(), "bull:8:3"),
    ] {
        let folder = scratch();
        let (job, found) = planned(folder.path(), surface, tool);
        assert_eq!(job.request.tool.to_string(), tool);
        assert!(number(&found, "/gouge/deepest_mm") < 1e-3, "{name}");
        assert!(number(&found, "/contact/within_limit_share") == 1.0, "{name}");
        let crests = number(&found, "/scallop/crests/p99_mm");
        assert!((0.0..=0.105).contains(&crests), "{name}: {crests}");
    }
}

/// On a shallow slope a bull is shorter than a ball of its size: rows go up and down.
#[test]
fn a_bull_is_shorter_than_a_ball_on_a_shallow_slope() {
    let cut_mm = |tool: &str| {
        let folder = scratch();
        planned(folder.path(), slope(10.0), tool).0.totals.length.cut_mm
    };
    let (bull, ball) = (cut_mm("bull:10:2"), cut_mm("ball:10"));
    // R_eff 48.07 mm against 10 mm: √4.807, less what the borders take.
    assert!(ball > 1.8 * bull, "{ball} mm with the ball, {bull} mm with the bull");
}

#[test]
fn a_move_lowered_by_20_um_and_another_tool_are_found() {
    let folder = scratch();
    planned(folder.path(), slope(10.0), "bull:10:2");
    let job = folder.path().join("job");
    let text = std::fs::read_to_string(job.join("toolpaths.jsonl")).unwrap();
    let mut lines: Vec<serde_json::Value> = text.lines().map(|l| serde_json::from_str(l).unwrap()).collect();
    let whole = lines.clone();
    let cuts: Vec<usize> = (0..lines.len()).filter(|&k| lines[k]["kind"] == "cut").collect();
    let lowered = cuts[cuts.len() / 2];
    for point in lines[lowered]["points"].as_array_mut().unwrap() {
        point[2] = (point[2].as_f64().unwrap() - 0.02).into();
    }
    let write = |lines: &[serde_json::Value]| {
        let text: String = lines.iter().map(|l| format!("{l}\n")).collect();
        std::fs::write(job.join("toolpaths.jsonl"), text).unwrap();
    };
    write(&lines);
    finds(folder.path(), &["gouge"]);
    write(&whole);
    let described = std::fs::read_to_string(job.join("job.json")).unwrap();
    for (tool, code) in [
        (serde_json::json!({"shape": "ball", "radius_mm": 10.0}), "nothing_cut"),
        (serde_json::json!({"shape": "bull", "radius_mm": 10.0, "corner_radius_mm": 1.0}), "gouge"),
    ] {
        let mut other: serde_json::Value = serde_json::from_str(&described).unwrap();
        other["request"]["tool"] = tool.clone();
        let record = other["tools"][0].as_object_mut().unwrap();
        record.remove("corner_radius_mm");
        record.extend(tool.as_object().unwrap().clone());
        std::fs::write(job.join("job.json"), other.to_string()).unwrap();
        finds(folder.path(), &[code]);
    }
}

#[test]
fn what_ends_are_not_planned_for_is_refused_by_name() {
    let folder = scratch();
    write_iges(&folder.path().join("model.igs"), &model_of([slope(0.0)]), &[]).unwrap();
    for (more, what) in [
        (&["--strategy", "scallop"][..], "strategy scallop"),
        (&["--strategy", "waterline"], "strategy waterline"),
        (&["--strategy", "planar", "--pencil"], "pencil passes"),
        (&["--strategy", "planar", "--rest-of", "ball:20"], "rest passes"),
        (&["--strategy", "planar", "--allowance", "1"], "an allowance"),
        (&["--strategy", "planar", "--extend", "5"], "bounds are kept"),
    ] {
        let asked = ["plan", "model.igs", "--tool", "bull:10:2", "--scallop", "0.1", "-o", "job"];
        let made = run_without_adapter(folder.path(), asked.iter().chain(more));
        assert_eq!(made.code, Some(2), "{made:?}");
        assert!(made.stderr.contains(what) && made.stderr.contains("help: "), "{what}: {made:?}");
        assert!(!folder.path().join("job").exists());
    }
}
