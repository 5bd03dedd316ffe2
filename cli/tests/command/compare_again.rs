//! A comparison's jobs are those that `plan` makes, and those that lie there are not planned again.

use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use serde_json::Value;

use crate::obstacle::block;
use crate::run::{Run, claymill, panel, run, run_without_adapter};
use crate::scratch;

const MILL: &str = "name = \"gantry\"\n[feed]\nmax_mm_per_min = 8000\nrapid_mm_per_min = 15000\n\
                    [dynamics]\nacceleration_mm_per_s2 = 800\njerk_mm_per_s3 = 9000\n";

/// `job.json` without what may differ between two equal jobs.
fn job(folder: &Path) -> Value {
    let mut job: Value = serde_json::from_slice(&fs::read(folder.join("job.json")).unwrap()).unwrap();
    let fields = job.as_object_mut().unwrap();
    fields.remove("timings");
    fields.remove("peak_memory_mb");
    job
}

/// The names of combinations that were kept.
fn kept(run: &Run) -> Vec<String> {
    let mut names = Vec::new();
    let mut name = "";
    for line in run.stderr.lines() {
        if line.starts_with("kept ") {
            names.push(name.to_owned());
        }
        if !line.contains(' ') && !line.is_empty() {
            name = line;
        }
    }
    names
}

#[test]
fn jobs_are_those_of_plan_and_are_kept() {
    let folder = scratch();
    let folder = folder.path();
    panel(folder);
    fs::write(folder.join("mill.toml"), MILL).unwrap();
    fs::write(folder.join("post.stl"), block([-20.0, -15.0, -40.0], [20.0, 15.0, 120.0])).unwrap();
    let shared = "--link one-way --preset tangent --feed 5000 --machine mill.toml --holder auto:33-42x54,63x26 \
                  --holder-clearance 2 --tool-number 7 --check post.stl --check-clearance 2 --rapid-clearance 8 \
                  --angle 20 --pencil --material-side both --joint-angle 0.7 --within -280,,:280,, --avoid face:3 \
                  --avoid-margin 2 --skip face:5";
    let shared: Vec<&str> = shared.split_whitespace().collect();
    // Nobody looks at the pictures of jobs that are planned to be compared, byte by byte or by being kept.
    let with =
        |first: &[&str], last: &[&str]| run_without_adapter(folder, [first, &shared[..], last].concat());
    let line = [
        "compare",
        "panel.igs",
        "--strategies",
        "planar,isoparametric",
        "--scallop",
        "1",
        "--tool",
        "ball:8",
    ];
    let compare = || run(folder, [&line, &shared[..], &["--lines", "4", "-o", "side", "--json"]].concat());
    let made = compare();
    assert!(matches!(made.code, Some(0 | 3)), "{made:?}");
    assert!(kept(&made).is_empty(), "{made:?}");
    let names = ["planar", "isoparametric"];
    for name in names {
        let (out, ours) = (format!("alone/{name}"), folder.join("side").join(name));
        let own = if name == "planar" { &[][..] } else { &["--lines", "4"] };
        let first =
            ["plan", "panel.igs", "--strategy", name, "--scallop", "1", "--tool", "ball:8", "-o", &out];
        let planned = with(&first, own);
        assert!(matches!(planned.code, Some(0 | 3)), "{planned:?}");
        let alone = folder.join(out);
        let same = |file: &str| fs::read(alone.join(file)).unwrap() == fs::read(ours.join(file)).unwrap();
        for file in ["toolpaths.jsonl", "job.toml", "regions.json", "verify.json"] {
            assert!(same(file), "{name}: {file}");
        }
        assert_eq!(job(&alone), job(&ours), "{name}");
    }

    // Again: nothing is planned, and the comparison is the same.
    let side = folder.join("side");
    let files = ["compare.json", "compare.csv", "compare.svg", "compare.html", "compare.toml"];
    let read = || files.map(|file| fs::read(side.join(file)).unwrap());
    let before = read();
    let again = compare();
    assert_eq!((again.code, kept(&again)), (made.code, names.map(str::to_owned).to_vec()), "{again:?}");
    assert_eq!(again.stdout, made.stdout);
    assert!(before == read(), "the comparison differs");
    // The command that the page tells makes the same, and so do the same bytes elsewhere.
    fs::copy(folder.join("panel.igs"), folder.join("copy.igs")).unwrap();
    let told = "compare copy.igs --job side/compare.toml --strategies planar,isoparametric --scallop 1 --tool ball:8 -o side";
    let again = run(folder, told.split(' '));
    assert_eq!(kept(&again), names, "{again:?}");
    // What is not whole any more is planned again, and nothing else.
    fs::remove_file(side.join("planar/verify.json")).unwrap();
    let again = compare();
    assert_eq!((again.code, kept(&again)), (made.code, vec!["isoparametric".to_owned()]), "{again:?}");
    assert_eq!(again.stdout, made.stdout);
    // The same names of other files, and other options.
    fs::write(folder.join("mill.toml"), MILL.replace("800\n", "900\n")).unwrap();
    let again = with(&line, &["--lines", "4", "-o", "side"]);
    assert!(matches!(again.code, Some(0 | 3)) && kept(&again).is_empty(), "{again:?}");
    let again = with(&line, &["--lines", "3", "-o", "side"]);
    assert_eq!(kept(&again), ["planar"], "{again:?}");
    let made = run(folder, ["sample", "panel", "--patches", "200", "--seed", "5", "-o", "panel.igs"]);
    assert_eq!(made.code, Some(0), "{made:?}");
    let again = with(&line, &["--lines", "3", "-o", "side"]);
    assert!(matches!(again.code, Some(0 | 3)) && kept(&again).is_empty(), "{again:?}");
}

#[test]
fn after_an_interruption_the_same_command_goes_on() {
    let folder = scratch();
    let folder = folder.path();
    panel(folder);
    let line = "compare panel.igs --strategies planar,flow,scallop --scallop 0.3 -o side";
    let mut first = claymill();
    let mut first = first.args(line.split(' ')).current_dir(folder).stderr(Stdio::piped()).spawn().unwrap();
    let patience = Instant::now();
    while !folder.join("side/planar/report.html").exists() || !folder.join("side/.flow.partial").exists() {
        assert!(patience.elapsed() < Duration::from_secs(120), "the first job never ended");
        assert!(first.try_wait().unwrap().is_none(), "it ended before it could be interrupted");
        std::thread::sleep(Duration::from_millis(5));
    }
    assert!(Command::new("kill").args(["-INT", &first.id().to_string()]).status().unwrap().success());
    let first = Run::from(first.wait_with_output().unwrap());
    assert_eq!(first.code, Some(130), "{first:?}");
    assert!(first.stderr.contains("interrupted: 1 of 3 combinations done: planar\n"), "{first:?}");
    assert!(first.stderr.contains("The same command goes on from there"), "{first:?}");
    let names = |folder: &Path| {
        let entries = fs::read_dir(folder).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap());
        let mut names: Vec<String> = entries.collect();
        names.sort();
        names
    };
    assert_eq!(names(&folder.join("side")), ["planar"]);
    assert!(names(folder).iter().all(|name| !name.starts_with('.')), "{:?}", names(folder));

    let planned = fs::read(folder.join("side/planar/job.json")).unwrap();
    let second = run(folder, line.split(' '));
    assert_eq!((second.code, kept(&second)), (Some(0), vec!["planar".to_owned()]), "{second:?}");
    assert_eq!(fs::read(folder.join("side/planar/job.json")).unwrap(), planned);
    let told: Value = serde_json::from_slice(&fs::read(folder.join("side/compare.json")).unwrap()).unwrap();
    let strategies: Vec<&Value> =
        told["entries"].as_array().unwrap().iter().map(|e| &e["strategy"]).collect();
    assert_eq!(strategies, ["planar", "flow", "scallop"]);
}
