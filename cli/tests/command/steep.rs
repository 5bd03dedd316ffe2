//! Waterlines and what is handed over to them, on shapes whose passes are known.

use std::f64::consts::{FRAC_PI_2, PI, TAU};
use std::path::Path;

use claymill_exchange::write_iges;
use claymill_nurbs::analytic::{Frame, cone, cylinder, sphere, torus};
use claymill_nurbs::{NurbsSurface, Point3, Vector3};
use claymill_tests::model_of;
use claymill_toolpath::{Job, MoveKind, read_job, read_moves};

use crate::run::run;
use crate::scratch;

const R: f64 = 6.0;
const SCALLOP_MM: f64 = 0.05;
/// Bias and tolerance of the fit, docs of the accuracy chain.
const FIT_MM: f64 = 4e-3;

fn upright() -> Frame {
    Frame::new(Point3::origin(), Vector3::z(), Vector3::x()).unwrap()
}

/// Plans the model's first face and verifies it; the job and its verification.
pub(crate) fn planned(
    folder: &Path,
    surfaces: Vec<NurbsSurface>,
    more: &[&str],
    out: &str,
) -> (Job, serde_json::Value) {
    write_iges(&folder.join("model.igs"), &model_of(surfaces), &[]).unwrap();
    let plan = ["plan", "model.igs", "--tool", "ball:6", "--scallop", "0.05", "--up", "+z", "--length", "+x"];
    // Bowls are cut from within here, domes from outside.
    let sides = ["--material-side", "both"];
    let made = run(folder, plan.iter().chain(&sides).chain(more).chain(&["-o", out]));
    assert_eq!(made.code, Some(0), "{made:?}");
    let found = std::fs::read_to_string(folder.join(out).join("verify.json")).unwrap();
    (read_job(&folder.join(out)).unwrap(), serde_json::from_str(&found).unwrap())
}

/// Heights of the ball's centre on the waterlines, ascending, one a pass; the other cuts are left out.
fn levels(folder: &Path) -> Vec<f64> {
    let program = read_moves(&folder.join("out")).unwrap();
    let cuts = program.moves.iter().filter(|m| m.kind == MoveKind::Cut && m.setup == "top");
    let mut found: Vec<f64> = Vec::new();
    for m in cuts {
        let z = m.points.iter().map(|p| p[2] + R);
        let (low, high) = z.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), z| (a.min(z), b.max(z)));
        // Rows of the shallow part climb and fall, or are short.
        if high - low < FIT_MM {
            found.push(0.5 * (low + high));
        }
    }
    found.sort_by(f64::total_cmp);
    found
}

/// A bowl stands in a can, so that it is cut from above.
fn in_a_can(bowl: NurbsSurface) -> Vec<NurbsSurface> {
    vec![bowl, cylinder(&upright(), 90.0, (0.0, TAU), (-80.0, 90.0)).unwrap()]
}

#[test]
fn on_a_funnel_levels_are_a_step_over_apart_along_the_slope() {
    let folder = scratch();
    // Its side rises at 60°.
    let slope = 60f64.to_radians();
    let funnel = cone(&upright(), 20.0, FRAC_PI_2 - slope, (0.0, TAU), (0.0, 70.0)).unwrap();
    let more = ["--strategy", "waterline", "--only", "face:0"];
    let (job, found) = planned(folder.path(), in_a_can(funnel), &more, "out");
    assert_eq!(job.regions.iter().map(|r| r.strategy.as_str()).collect::<Vec<_>>(), ["waterline"]);
    let levels = levels(folder.path());
    let step_mm = claymill_paths::flat_mm(R, SCALLOP_MM) * slope.sin();
    assert!(levels.len() as u32 >= job.totals.passes - 1, "{} of {}", levels.len(), job.totals.passes);
    // The outermost are closer: they run right beside the rims.
    for w in levels[1..levels.len() - 1].windows(2) {
        let apart = w[1] - w[0];
        assert!(apart > 0.9 * step_mm && apart < step_mm, "{apart} instead of {step_mm}");
    }
    assert!(found["scallop"]["crests"]["p99_mm"].as_f64().unwrap() < 1.05 * SCALLOP_MM);
    assert!(found["scallop"]["crests"]["even_share"].as_f64().unwrap() > 0.95, "{found}");
    assert_eq!(found["gouge"]["deepest_mm"].as_f64().unwrap().max(1e-3), 1e-3);
}

#[test]
fn a_bowl_and_a_gutter_are_finished_from_the_level_to_the_steep() {
    let to_slope = 78f64.to_radians();
    let bowl = sphere(&upright(), 60.0, (0.0, TAU), (-FRAC_PI_2, to_slope - FRAC_PI_2)).unwrap();
    let gutter = torus(&upright(), 40.0, 25.0, (0.0, TAU), (1.5 * PI, 1.5 * PI + to_slope)).unwrap();
    for (surface, least) in [(bowl, 20), (gutter, 8)] {
        let folder = scratch();
        let more = ["--strategy", "waterline", "--only", "face:0"];
        let (job, found) = planned(folder.path(), in_a_can(surface), &more, "out");
        let top = job.regions.iter().find(|r| r.setup == "top").unwrap();
        assert_eq!(top.strategy, "waterline");
        assert!(levels(folder.path()).len() > least);
        assert!(found["scallop"]["crests"]["p99_mm"].as_f64().unwrap() < 1.05 * SCALLOP_MM, "{found}");
        assert!(found["gouge"]["deepest_mm"].as_f64().unwrap() < 1e-3);
    }
}

#[test]
fn a_dome_with_a_straight_wall_is_shorter_with_waterlines_on_its_wall() {
    // From above the dome is seen down to its wall of 76°; a can hides it from all sides.
    let slope = 76f64.to_radians();
    let dome = sphere(&upright(), 40.0, (0.0, TAU), (FRAC_PI_2 - slope, FRAC_PI_2)).unwrap();
    let (radius, foot) = (40.0 * slope.sin(), 40.0 * slope.cos());
    let below = Frame::new(Point3::new(0.0, 0.0, foot), -Vector3::z(), Vector3::x()).unwrap();
    let wall = cone(&below, radius, FRAC_PI_2 - slope, (0.0, TAU), (0.0, 50.0)).unwrap();
    let can = cylinder(&upright(), 90.0, (0.0, TAU), (-80.0, 90.0)).unwrap();
    let folder = scratch();
    let (mut cut_mm, mut left_mm2) = (Vec::new(), Vec::new());
    for strategy in ["planar", "steep-shallow"] {
        let more = ["--strategy", strategy, "--only", "face:0-1"];
        let surfaces = vec![dome.clone(), wall.clone(), can.clone()];
        let (job, found) = planned(folder.path(), surfaces, &more, strategy);
        let areas = &found["coverage"]["by_state_mm2"];
        assert!(areas["cut"].as_f64().unwrap() > 5000.0, "{strategy}: {areas}");
        left_mm2.push(areas.get("reachable_left").and_then(serde_json::Value::as_f64).unwrap_or(0.0));
        assert!(found["scallop"]["crests"]["p99_mm"].as_f64().unwrap() < 1.05 * SCALLOP_MM, "{strategy}");
        cut_mm.push(job.totals.length.cut_mm);
    }
    assert!(cut_mm[1] < 0.95 * cut_mm[0], "{cut_mm:?}");
    assert!(left_mm2[1] < 1.0, "{left_mm2:?}");
}

#[test]
fn limits_that_are_no_slopes_are_refused() {
    let folder = scratch();
    for steep in ["5", "85", "nan", "-45"] {
        let made = run(folder.path(), ["plan", "x.igs", "--steep", steep, "-o", "out"]);
        assert_eq!(made.code, Some(2), "{made:?}");
        assert!(made.stderr.contains("--steep 45"), "{made:?}");
    }
}

#[test]
fn steep_and_shallow_do_not_depend_on_the_number_of_threads() {
    let folder = scratch();
    let bowl = sphere(&upright(), 60.0, (0.0, TAU), (-FRAC_PI_2, -0.2)).unwrap();
    let mut bytes = Vec::new();
    for threads in ["1", "2", "3"] {
        let more = ["--strategy", "steep-shallow", "--only", "face:0", "--threads", threads];
        planned(folder.path(), in_a_can(bowl.clone()), &more, "out");
        bytes.push(std::fs::read(folder.path().join("out/toolpaths.jsonl")).unwrap());
    }
    assert!(bytes[0] == bytes[1] && bytes[1] == bytes[2]);
}

#[test]
fn nothing_is_left_where_one_setup_takes_over_from_another() {
    // A barrel, from the top cut to about 53° on either side, from the left and the right below that.
    let lying = Frame::new(Point3::origin(), Vector3::x(), Vector3::z()).unwrap();
    let (from, to) = (-72f64.to_radians(), 75f64.to_radians());
    let barrel = cylinder(&lying, 150.0, (from, to), (0.0, 450.0)).unwrap();
    for strategy in ["flow", "scallop"] {
        let folder = scratch();
        let (job, found) = planned(folder.path(), vec![barrel.clone()], &["--strategy", strategy], "out");
        assert_eq!(
            job.regions.iter().map(|r| r.setup.as_str()).collect::<Vec<_>>(),
            ["top", "left", "right"]
        );
        let crest_mm = found["scallop"]["crests"]["max_mm"].as_f64().unwrap();
        assert!(crest_mm < 1.25 * SCALLOP_MM, "{strategy}: {crest_mm}");
        let left_mm2 = found["coverage"]["by_state_mm2"]["reachable_left"].as_f64().unwrap_or(0.0);
        assert_eq!(left_mm2, 0.0, "{strategy}");
    }
}
