//! Obstacles: a post on a panel is milled around with `--check`, and into without.

use std::fs;
use std::path::Path;

use serde_json::Value;

use crate::run::{panel, run, run_without_adapter};
use crate::scratch;

/// A block as text STL.
pub(crate) fn block(low: [f64; 3], high: [f64; 3]) -> String {
    let corner = |k: usize| [0, 1, 2].map(|axis| if k >> axis & 1 == 0 { low[axis] } else { high[axis] });
    let sides = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let mut text = "solid post\n".to_owned();
    for [a, b, c, d] in sides {
        for triangle in [[a, b, c], [a, c, d]] {
            text += "facet normal 0 0 0 outer loop";
            for [x, y, z] in triangle.map(corner) {
                text += &format!(" vertex {x} {y} {z}");
            }
            text += " endloop endfacet\n";
        }
    }
    text + "endsolid post\n"
}

fn verified(folder: &Path, job: &str) -> Value {
    serde_json::from_slice(&fs::read(folder.join(job).join("verify.json")).unwrap()).unwrap()
}

/// Deepest that a ball of 10 mm enters the post on any move, from samples of the written curves.
fn depth(folder: &Path, job: &str, low: [f64; 3], high: [f64; 3]) -> f64 {
    let moves = claymill_toolpath::read_moves(&folder.join(job)).unwrap().moves;
    let mut deepest = f64::NEG_INFINITY;
    for m in moves {
        let curve = m.curve().unwrap();
        let (t0, t1) = curve.domain();
        for i in 0..=400 {
            let tip = curve.point(t0 + (t1 - t0) * f64::from(i) / 400.0);
            let centre = tip + claymill_nurbs::Vector3::from(m.axis_start) * 10.0;
            let outside: f64 = (0..3)
                .map(|k| (low[k] - centre[k]).max(centre[k] - high[k]).max(0.0).powi(2))
                .sum::<f64>()
                .sqrt();
            deepest = deepest.max(10.0 - outside);
        }
    }
    deepest
}

#[test]
fn a_post_is_milled_around_and_found_where_it_is_not() {
    let folder = scratch();
    let folder = folder.path();
    panel(folder);
    let (low, high) = ([-20.0, -15.0, -40.0], [20.0, 15.0, 120.0]);
    fs::write(folder.join("post.stl"), block(low, high)).unwrap();
    let job = ["plan", "panel.igs", "--tool", "ball:10", "--scallop", "0.3", "-o"];

    let around = run(folder, job.iter().chain(&["around", "--check", "post.stl"]));
    assert_eq!(around.code, Some(0), "{around:?}");
    let found = verified(folder, "around");
    let near = &found["obstacles"];
    assert_eq!((&near["triangles"], &near["touching"]), (&12.into(), &0.into()), "{near}");
    let clearance = near["clearance_min_mm"].as_f64().unwrap();
    assert!((0.98..1.1).contains(&clearance), "passes end a millimetre from the post: {clearance}");
    assert_eq!((&near["asked_mm"], &near["near"]), (&1.0.into(), &0.into()), "{near}");
    let measured = depth(folder, "around", low, high);
    // Both look at samples of the curves, at different ones.
    assert!(measured < 0.005 && -measured >= clearance - 5e-4, "{measured} {clearance}");
    // What the post covers is not counted as left by mistake, nor the post itself as a part of the model.
    let record: Value = serde_json::from_slice(&fs::read(folder.join("around/job.json")).unwrap()).unwrap();
    assert_eq!(record["faces"].as_array().unwrap().len(), 202);
    let covered: f64 = ["hidden", "too_tight", "out_of_bounds"]
        .iter()
        .map(|reason| record["area"]["uncut_mm2"][reason].as_f64().unwrap_or(0.0))
        .sum();
    assert!((covered / 2800.0 - 1.0).abs() < 0.3, "{covered} mm² covered");
    assert_eq!(record["request"]["check"][0]["path"], "post.stl");
    assert_eq!(record["request"]["check_clearance_mm"], 1.0);

    let through = run_without_adapter(folder, job.iter().chain(&["through"]));
    assert_eq!(through.code, Some(0), "{through:?}");
    assert_eq!(verified(folder, "through")["obstacles"], Value::Null);
    assert!(depth(folder, "through", low, high) > 5.0);
    let told = run(folder, ["verify", "through", "--check", "post.stl", "--json"]);
    assert_eq!(told.code, Some(3));
    let findings = told.json()["verdict"]["findings"].clone();
    assert_eq!(findings[0]["code"], "obstacle", "{findings}");

    // Near enough to touch, or farther away: what is asked for is kept, and what was not kept is found.
    for (asked, range) in [("0", -0.005..0.05), ("3", 2.98..3.1)] {
        let options = ["--check", "post.stl", "--check-clearance", asked, "--rapid-clearance", "12"];
        let made = run_without_adapter(folder, job.iter().chain(&[asked]).chain(&options));
        assert_eq!(made.code, Some(0), "{made:?}");
        let found = verified(folder, asked);
        let least = found["obstacles"]["clearance_min_mm"].as_f64().unwrap();
        assert!(
            range.contains(&least) && -depth(folder, asked, low, high) >= least - 5e-4,
            "{asked}: {least}"
        );
        let rapids = found["rapids"]["clearance_min_mm"].as_f64().unwrap();
        assert!((11.75..14.0).contains(&rapids), "{rapids}");
    }
    let closer = run(folder, ["verify", "0", "--check-clearance", "1", "--json"]);
    assert_eq!(
        (closer.code, &closer.json()["verdict"]["findings"][0]["code"]),
        (Some(3), &"obstacle".into())
    );
    let alone = run(folder, ["plan", "panel.igs", "-o", "x", "--check-clearance", "1"]);
    assert!(
        alone.code == Some(2) && alone.stderr.contains("--check-clearance is for what --check names"),
        "{alone:?}"
    );
    let program = run(folder, ["post", "3", "--to", "linuxcnc", "-o", "3.ngc"]);
    assert_eq!(program.code, Some(0), "{program:?}");
    let text = fs::read_to_string(folder.join("3.ngc")).unwrap();
    assert!(text.contains("rapids clear the finished model by 12 mm"), "{}", &text[..900]);
    assert!(text.contains("stock is not known: it must not stand out more than 12 mm"), "{}", &text[..900]);

    // A job knows its obstacles, and that they are still the same.
    assert_eq!(run(folder, ["verify", "around"]).code, Some(0));
    fs::write(folder.join("post.stl"), block(low, [20.0, 15.0, 140.0])).unwrap();
    let changed = run(folder, ["verify", "around"]);
    assert_eq!(changed.code, Some(1));
    assert!(changed.stderr.contains("post.stl: the file has changed"), "{}", changed.stderr);
}
