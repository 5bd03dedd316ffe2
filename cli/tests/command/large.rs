//! Files of tens of thousands of patches: their reading is shown as a stage, and interrupted at once; millions of points of
//! tool paths are drawn soon.

use std::fs;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use crate::run::{claymill, run};
use crate::scratch;

/// The command ends this soon after Ctrl-C.
const SOON: Duration = Duration::from_millis(100);
/// A machine with other work may be late once.
const TRIES: usize = 5;
/// Points of tool paths of a whole vehicle; the first picture of them, the others, and the memory they may take.
const POINTS: u64 = 2_000_000;
const FIRST_S: f64 = 10.0;
const FURTHER_S: f64 = 2.0;
const MEMORY_MB: f64 = 1500.0;

#[test]
fn reading_a_large_file_is_interrupted_at_once() {
    let folder = scratch();
    let folder = folder.path();
    for name in ["large.igs", "large.stp"] {
        assert_eq!(run(folder, ["sample", "roadster", "--patches", "40000", "-o", name]).code, Some(0));
        let mib = fs::metadata(folder.join(name)).unwrap().len() >> 20;
        let mut soonest = Duration::MAX;
        for wait_ms in (0..TRIES).map(|k| 60 + 10 * k as u64) {
            let mut reading = claymill()
                .args(["inspect", name])
                .current_dir(folder)
                .stdout(Stdio::null())
                .stderr(Stdio::null())
                .spawn()
                .unwrap();
            std::thread::sleep(Duration::from_millis(wait_ms));
            assert!(reading.try_wait().unwrap().is_none(), "{name} was read within {wait_ms} ms");
            let sent = Command::new("sh").args(["-c", &format!("kill -INT {}", reading.id())]).status();
            let start = Instant::now();
            assert!(sent.unwrap().success());
            assert_eq!(reading.wait().unwrap().code(), Some(130));
            soonest = soonest.min(start.elapsed());
        }
        eprintln!("{name}, {mib} MiB: ended {soonest:.1?} after the interruption");
        assert!(soonest <= SOON, "{name}: {soonest:?}");
    }
}

/// The moves of the job that `JOB` names, again and again, each time a little aside.
#[test]
#[ignore = "takes the folder of a planned vehicle in JOB, and a machine without other work"]
fn two_million_points_of_paths_are_drawn_soon_and_in_little_memory() {
    let job = std::path::PathBuf::from(std::env::var_os("JOB").expect("JOB names a job folder"));
    let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let folder = scratch();
    let many = folder.path().join("many");
    fs::create_dir(&many).unwrap();
    for name in ["job.json", "regions.json"] {
        fs::copy(root.join(&job).join(name), many.join(name)).unwrap();
    }
    let drawn = |what: &std::path::Path, views: &str| {
        let line = ["render", "--json", "--size", "1920x1080", "--view", views, "-o"];
        let out = folder.path().join("out.png");
        let made =
            run(&root, line.iter().map(std::ffi::OsStr::new).chain([out.as_os_str(), what.as_os_str()]));
        assert_eq!(made.code, Some(0), "{made:?}");
        made.json()
    };
    let once = drawn(&job, "iso")["path_points"].as_u64().unwrap();
    let moves = fs::read_to_string(root.join(&job).join("toolpaths.jsonl")).unwrap();
    let mut seq = 0;
    let mut written = String::new();
    for copy in 0..POINTS.div_ceil(once) {
        for line in moves.lines() {
            let mut one: serde_json::Value = serde_json::from_str(line).unwrap();
            one["seq"] = seq.into();
            seq += 1;
            for point in one["points"].as_array_mut().unwrap() {
                point[0] = (point[0].as_f64().unwrap() + 0.3 * copy as f64).into();
            }
            written += &format!("{one}\n");
        }
    }
    fs::write(many.join("toolpaths.jsonl"), written).unwrap();
    let told = drawn(&many, "iso,top,left");
    eprintln!("{told}");
    assert!(told["path_points"].as_u64().unwrap() >= POINTS);
    let seconds: Vec<f64> = told["seconds"].as_array().unwrap().iter().map(|s| s.as_f64().unwrap()).collect();
    assert!(seconds[0] < FIRST_S && seconds[1..].iter().all(|s| *s < FURTHER_S), "{told}");
    assert!(told["peak_memory_mb"].as_f64().unwrap() < MEMORY_MB, "{told}");
}
