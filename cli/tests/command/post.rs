//! Programs for controls, and the check of a program as its control will see it.

use std::fs;
use std::path::Path;

use crate::run::{Run, panel, run, run_without_adapter};
use crate::scratch;

fn planned(folder: &Path) {
    panel(folder);
    let job = ["plan", "panel.igs", "--tool", "ball:10", "--scallop", "0.5", "-o", "job"];
    let made = run_without_adapter(folder, job);
    assert_eq!(made.code, Some(0), "{made:?}");
}

fn post(folder: &Path, dialect: &str, out: &str, more: &[&str]) -> Run {
    run(folder, ["post", "job", "--to", dialect, "-o", out, "--json"].iter().chain(more))
}

#[test]
fn every_dialect_is_written_and_verified_from_its_file() {
    let folder = scratch();
    let folder = folder.path();
    planned(folder);
    let dialects = [
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
    for dialect in dialects {
        let made = post(folder, dialect, &format!("{dialect}.nc"), &[]);
        assert_eq!(made.code, Some(0), "{dialect}: {made:?}");
        let totals = made.json();
        let found = totals["read_back"]["largest_mm"].as_f64().unwrap();
        assert!(found <= totals["stated_mm"].as_f64().unwrap(), "{dialect}: {totals}");
        assert!(folder.join(format!("{dialect}.nc.totals.json")).exists());
    }
    assert_eq!(post(folder, "linuxcnc", "new.ngc", &["--version", "2.10"]).code, Some(0));
    for dialect in ["siemens", "g1"] {
        let verified = run(folder, ["verify", "job", "--program", &format!("{dialect}.nc"), "--json"]);
        assert_eq!(verified.code, Some(0), "{dialect}: {verified:?}");
    }
    // One block in the middle of a pass runs half a millimetre too deep.
    let text = fs::read_to_string(folder.join("g1.nc")).unwrap();
    let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
    let deep = (lines.len() / 2..).find(|&i| {
        let plain = |l: &str| l.starts_with("G1 X") && !l.contains('F');
        plain(&lines[i]) && plain(&lines[i + 1])
    });
    let deep = deep.expect("two plain blocks in a row");
    let (head, z) = lines[deep].rsplit_once('Z').unwrap();
    lines[deep] = format!("{head}Z{:.4}", z.parse::<f64>().unwrap() - 0.5);
    fs::write(folder.join("deep.nc"), lines.join("\n") + "\n").unwrap();
    let verified = run(folder, ["verify", "job", "--program", "deep.nc", "--json"]);
    assert_eq!(verified.code, Some(3), "{verified:?}");
    let depth = verified.json()["gouge"]["deepest_mm"].as_f64().unwrap();
    assert!((0.3..0.6).contains(&depth), "{depth}");
    // A block that the control would not execute as it looks is named with its line.
    lines[deep] = "G41 D1".into();
    fs::write(folder.join("comp.nc"), lines.join("\n") + "\n").unwrap();
    let refused = run(folder, ["verify", "job", "--program", "comp.nc"]);
    assert_eq!(refused.code, Some(1));
    let place = format!("line {}: radius-compensation", deep + 1);
    assert!(refused.stderr.contains(&place), "{refused:?}");
}

#[test]
fn wrong_orders_are_answered_with_advice() {
    let folder = scratch();
    let folder = folder.path();
    planned(folder);
    for (args, said) in [
        (vec!["post", "job", "--to", "okuma", "-o", "x.nc"], "no dialect"),
        (vec!["post", "job", "--to", "fanuc", "--version", "2.9", "-o", "x.nc"], "LinuxCNC only"),
        (vec!["post", "job", "--to", "fanuc", "--machine", "none.toml", "-o", "x.nc"], "none.toml"),
        (vec!["stream", "job", "--to", "linuxcnc:10.0.0.1:5007"], "--remote"),
        (vec!["stream", "job", "--to", "tcp:localhost:5"], "--secret"),
        (vec!["stream", "job", "--to", "somewhere"], "shm:FILE"),
    ] {
        let answer = run(folder, &args);
        assert_eq!(answer.code, Some(2), "{args:?}: {answer:?}");
        assert!(answer.stderr.contains(said), "{args:?}: {answer:?}");
    }
    fs::write(folder.join("small.toml"), "[axes]\nx = [0, 100]\n").unwrap();
    let refused = run(folder, ["post", "job", "--to", "fanuc", "--machine", "small.toml", "-o", "x.nc"]);
    assert!(refused.code == Some(1) && refused.stderr.contains("axis-limit"), "{refused:?}");
    let left: Vec<_> = fs::read_dir(folder).unwrap().map(|e| e.unwrap().file_name()).collect();
    assert!(left.iter().all(|n| !n.to_string_lossy().contains("x.nc")), "{left:?}");
}
