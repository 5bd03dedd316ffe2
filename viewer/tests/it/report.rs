//! The report's text: complete, self-contained, safe against what names may hold.

use claymill_toolpath::{Job, Program, RegionsFile};
use claymill_verify::Verification;
use claymill_viewer::{ReportInput, ReportPicture, report_html, write_report};
use serde_json::json;

fn job() -> Job {
    let length = json!({"cut_mm": 5.12e6, "lead_mm": 2.1e4, "link_mm": 6.3e4, "rapid_mm": 4.1e5});
    let totals = |region: usize, setup: &str| {
        json!({"region": region, "setup": setup, "area_mm2": 2.5e6, "pass_direction": [0.0, 1.0, 0.0], "passes": 620,
            "retracts": 14, "length": length, "control_points": 81234, "time_s": 3120.0})
    };
    let setup = |name: &str, axis: [f64; 3]| json!({"name": name, "axis": axis, "clearance_mm": 812.5, "area_mm2": 4.1e6, "time_s": 5210.0});
    serde_json::from_value(json!({
        "format_version": 1, "claymill_version": "0.1.0",
        "model": {"path": "cars/<roadster> & \"co\".igs", "sha256": "ab12", "units": "MM", "unit_mm": 1.0,
            "faces_in_file": 1401, "faces_read": 1399, "area_mm2": 1.187e7,
            "skipped": [{"entity": "DE 17", "reason": "a trim loop is open by 3 mm"},
                        {"entity": "DE 99", "reason": "a trim loop is open by 3 mm"}],
            "box_mm": [-805.0, -1863.0, 0.0, 805.0, 1863.0, 757.0]},
        "request": {"tool": {"shape": "ball", "radius_mm": 10.0}, "scallop_mm": 0.1, "strategy": "streamline",
            "link": "lace", "preset": "curvature", "up": "+z", "length": "-y", "only": [], "skip": ["layer 7"],
            "feed_mm_per_min": 6000.0, "rapid_mm_per_min": 20000.0},
        "tolerances": {"joint_gap_mm": 0.1, "refit_mm": 0.001},
        "tools": [{"id": "T1", "shape": "ball", "radius_mm": 10.0}],
        "setups": [setup("top", [0.0, 0.0, 1.0]), setup("left", [1.0, 0.0, 0.0])],
        "regions": [totals(0, "top"), totals(0, "left"), totals(1, "left")],
        "totals": {"moves": 9123, "passes": 1860, "retracts": 42, "length": length, "control_points": 243702,
            "time_s": 10420.0, "lifted_locations": 3},
        "area": {"total_mm2": 1.187e7, "cut_mm2": 8.2e6, "uncut_mm2": {"hidden": 3.5e6, "too_tight": 1.7e5}},
        "faces": [], "timings": [{"stage": "read", "seconds": 1.2}, {"stage": "paths", "seconds": 61.0}],
        "peak_memory_mb": 512.0
    }))
    .unwrap()
}

fn regions() -> RegionsFile {
    let region = |id: usize| {
        json!({"id": id, "faces": [id], "area_mm2": 5.0e6, "boundary_loops": 1, "normal_axis": [0, 0, 1],
            "normal_half_angle_deg": 40.0, "box_mm": [0, 0, 0, 1, 1, 1], "setup_area_mm2": {"top": 3.0e6, "left": 0.0}})
    };
    let joint = |faces: [usize; 2], length: f64, class: &str, verdict: &str, why: &str| {
        json!({"faces": faces, "length_mm": length, "class": class, "verdict": verdict, "why": why,
            "gap_max_mm": 0, "gap_normal_max_mm": 0, "angle_max_deg": 0, "angle_p95_deg": 0, "angle_rms_deg": 0,
            "angle_mid_deg": 0, "curvature_max": 0, "curvature_p95": 0, "curvature_rms": 0, "curvature_mid": 0,
            "curvature_relative_max": 0})
    };
    serde_json::from_value(json!({
        "format_version": 1, "preset": "curvature", "tolerance_mm": 0.1,
        "regions": (0..60).map(region).collect::<Vec<_>>(),
        "joints": [joint([0, 1], 120.0, "G2", "merged", "angle 0.01 degrees"),
                   joint([2, 3], 80.0, "C0", "split_angle", "angle 12.5 degrees where 1.0 is allowed"),
                   joint([4, 5], 30.0, "C0", "split_angle", "angle 3 degrees where 1.0 is allowed")],
        "boundary_total_mm": 1000.0, "boundary_matched_mm": 900.0, "boundary_naked_mm": 90.0,
        "boundary_non_manifold_mm": 10.0
    }))
    .unwrap()
}

fn verification(passed: bool) -> Verification {
    let place =
        json!({"point_mm": [1.0, 2.0, 3.0], "move_seq": 77, "parameter": 0.5, "face": 12, "entity": "DE 17"});
    let finding = json!({"code": "gouge", "severity": "error", "message": "The ball enters a face by 0.02 mm.",
        "place": place});
    serde_json::from_value(json!({
        "format_version": 1, "scallop_mm": 0.1,
        "gouge": {"samples": 5_000_000, "deepest_mm": 0.00042, "deepest_at": place, "deeper_than_1_um": 0,
            "deeper_than_2_um": 0, "deeper_than_5_um": 0},
        "contact": {"samples": 5_000_000, "excess_max_mm": 0.0011, "excess_max_at": place, "excess_p99_mm": 0.0002,
            "excess_mean_mm": 0.00001, "within_limit_share": 1.0, "on_edge_share": 0.01, "in_air_share": 0.0},
        "rapids": {"moves": 84, "clearance_min_mm": 5.0, "clearance_min_at": place, "touching": 0},
        "scallop": {"crests": {"samples": 1_000_000, "max_mm": 0.117, "max_at": place, "p99_mm": 0.1021,
                "mean_mm": 0.093, "out_of_reach": 51},
            "surface": {"samples": 250_000, "p99_mm": 0.1, "mean_mm": 0.034, "above_limit_share": 0.0004}},
        "coverage": {"total_mm2": 1.187e7, "by_state_mm2": {"cut": 8.2e6, "hidden": 3.5e6, "too_tight": 1.7e5},
            "reachable_left_at": [{"area_mm2": 120.0, "at": place}], "faces": [], "planner_difference_mm2": {}},
        "verdict": {"passed": passed, "findings": if passed { json!([]) } else { json!([finding]) }}
    }))
    .unwrap()
}

fn with_report<T>(verification: Option<&Verification>, test: impl FnOnce(&ReportInput<'_>) -> T) -> T {
    let (job, regions) = (job(), regions());
    let picture = ReportPicture {
        caption: "All regions".into(),
        alt: "The model from above".into(),
        png: vec![1, 2, 3],
    };
    test(&ReportInput {
        title: "Roadster <b>",
        command: "claymill plan car.igs -o out --tool ball:10",
        job: &job,
        regions: &regions,
        verification,
        region_colours: &[[1, 2, 3]; 60],
        pictures: &[picture],
        space: None,
        thumbnails: &[],
        program: &Program::default(),
        seconds: &[],
        sheets: &[],
    })
}

/// Elements that are opened are closed in the right order.
fn assert_well_formed(html: &str) {
    const VOID: [&str; 5] = ["meta", "img", "br", "input", "!DOCTYPE"];
    let mut open: Vec<&str> = Vec::new();
    let body = html.split_once("</style>").map(|(head, rest)| (head.split_once("<style>").unwrap().0, rest));
    let (head, rest) = body.unwrap();
    for tag in head.split('<').chain(rest.split('<')).filter_map(|t| t.split_once('>').map(|(t, _)| t)) {
        let name = tag.trim_start_matches('/').split_whitespace().next().unwrap_or("");
        if tag.starts_with('/') {
            assert_eq!(open.pop(), Some(name), "after {open:?}");
        } else if !VOID.contains(&name) {
            open.push(name);
        }
    }
    assert!(open.is_empty(), "never closed: {open:?}");
}

#[test]
fn the_report_is_well_formed_and_needs_nothing_else() {
    let checked = verification(true);
    let html = with_report(Some(&checked), report_html);
    assert_well_formed(&html);
    // Patterns of the page's own pictures are no files.
    let html = html.replace("url(#", "");
    for outside in ["http:", "https:", "<script", "<link", "@import", "url("] {
        assert!(!html.contains(outside), "{outside}");
    }
    assert!(html.contains("src=\"data:image/png;base64,AQID\""));
    assert!(!html.contains("Roadster <b>"), "text from outside is escaped");
    assert_eq!(html, with_report(Some(&checked), report_html).replace("url(#", ""));
}

#[test]
fn bounds_are_said_where_there_are_any() {
    let mut checked = verification(true);
    let said = |v: &Verification| with_report(Some(v), report_html);
    assert!(!said(&checked).contains("bounds"));
    let kept = json!({"samples": 1234, "beyond_max_mm": 0.987, "beyond_at": checked.gouge.deepest_at, "beyond": 7,
        "avoid_mm": null, "avoided_min_mm": null, "avoided_min_at": null, "too_near": 0});
    checked.bounds = Some(serde_json::from_value(kept).unwrap());
    let html = said(&checked);
    assert_well_formed(&html);
    assert!(html.contains("0.987 mm") && html.contains("Moves out of bounds") && !html.contains("avoided"));
    checked.bounds.as_mut().unwrap().avoid_mm = Some(2.5);
    let html = said(&checked);
    assert_well_formed(&html);
    assert!(html.contains("nothing near") && html.contains("asked for were 2.5 mm"));
}

#[test]
fn the_view_in_space_brings_all_it_needs_and_fetches_nothing() {
    let checked = verification(true);
    let html =
        with_report(Some(&checked), |input| report_html(&ReportInput { space: Some(b"glTF"), ..*input }));
    assert_eq!(html.matches("<script").count(), 4, "facts, model, library, program");
    assert_eq!(html.matches("</script").count(), 4);
    assert!(
        html.contains("default-src 'none'") && !html.contains("connect-src"),
        "the page may not ask for anything"
    );
    assert!(html.contains("Permission is hereby granted"), "the library's licence goes with it");
    let facts = html.split("type=\"application/json\">").nth(1).unwrap().split("</script").next().unwrap();
    let facts: serde_json::Value = serde_json::from_str(facts).unwrap();
    let rows = facts["regions"]["0"]["rows"].to_string();
    assert!(rows.contains("1\u{202f}240, 28 retracts"), "both setups of region 0: {rows}");
    assert_eq!(facts["heat"].as_array().unwrap().len(), 256);
    let (page, _) = html.split_once("<script").unwrap();
    assert_well_formed(&format!("{page}</body></html>"));
}

#[test]
fn the_verdict_comes_first_and_is_never_only_a_colour() {
    let passed = with_report(Some(&verification(true)), report_html);
    let failed = with_report(Some(&verification(false)), report_html);
    let open = with_report(None, report_html);
    let before_the_figures = |html: &str| html.split("class=\"facts\"").next().unwrap_or("").to_owned();
    assert!(before_the_figures(&passed).contains("Verified: passed"));
    assert!(before_the_figures(&failed).contains("do not run this job"));
    assert!(before_the_figures(&failed).contains("The ball enters a face by 0.02 mm."));
    assert!(before_the_figures(&open).contains("Not verified"));
    assert!(!open.contains("Verified: passed"));
}

#[test]
fn every_region_face_and_reason_is_accounted_for() {
    let html = with_report(Some(&verification(true)), report_html).replace('\u{202f}', " ");
    assert_eq!(html.matches("class=\"swatch\" style=\"background:#010203\"").count(), 60);
    assert!(html.contains("DE 17, DE 99"), "skipped entities");
    assert!(
        html.contains("angle 12.5 degrees where 1.0 is allowed"),
        "the longest joint of a verdict explains it"
    );
    assert!(html.contains("1 401 in the file, 1 399 read, 2 skipped"));
    assert!(html.contains("layer 7"));
    assert!(html.contains("3 locations could not be proven safe"));
    // Both setups of region 0: the region's row sums them.
    assert!(html.contains(">1 240<"), "passes of region 0");
}

#[test]
fn an_unwritable_report_leaves_nothing_behind() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("none/report.html");
    assert!(with_report(None, |input| write_report(&path, input)).is_err());
    assert!(with_report(None, |input| write_report(&folder.path().join("report.html"), input)).is_ok());
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
}
