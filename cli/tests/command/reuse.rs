//! Parts of plans are kept and taken again, and nothing follows from that but time.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;
use std::process::{Child, Stdio};
use std::time::Duration;

use rand::{Rng, SeedableRng};
use serde_json::Value;

use crate::run::{Run, claymill, run, run_without_adapter};
use crate::scratch;

/// What must be the same bytes.
const FILES: [&str; 3] = ["toolpaths.jsonl", "regions.json", "verify.json"];
const JOB: [&str; 6] = ["--tool", "ball:10", "--scallop", "0.4", "--json", "--quiet"];

/// A ribbon of two regions.
pub(crate) fn ribbon(folder: &Path) {
    let made = run(folder, ["sample", "ribbon", "--patches", "200", "--flaw", "kink:20", "-o", "ribbon.igs"]);
    assert_eq!(made.code, Some(0), "{made:?}");
}

fn plan(folder: &Path, model: &str, out: &str, more: &[&str]) -> Run {
    let planned = run_without_adapter(folder, ["plan", model, "-o", out].iter().chain(&JOB).chain(more));
    assert!(matches!(planned.code, Some(0 | 3)), "{planned:?}");
    planned
}

fn parts(planned: &Run) -> [u64; 2] {
    let json = planned.json();
    ["reused", "of"].map(|key| json["parts"][key].as_u64().unwrap_or_else(|| panic!("{json}")))
}

fn files(job: &Path) -> [Vec<u8>; 3] {
    FILES.map(|name| fs::read(job.join(name)).unwrap())
}

pub(crate) fn assert_same(folder: &Path, a: &str, b: &str) {
    for ((a, b), name) in files(&folder.join(a)).iter().zip(&files(&folder.join(b))).zip(FILES) {
        assert!(a == b, "{name} differs");
    }
}

pub(crate) fn names(folder: &Path) -> Vec<String> {
    let names = fs::read_dir(folder).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap());
    let mut names: Vec<String> = names.collect();
    names.sort();
    names
}

fn names_if_there(folder: &Path) -> Vec<String> {
    if folder.is_dir() { names(folder) } else { Vec::new() }
}

#[test]
fn a_plan_has_the_same_bytes_with_a_store_and_without_for_any_number_of_threads() {
    let folder = scratch();
    let folder = folder.path();
    ribbon(folder);
    let without = plan(folder, "ribbon.igs", "without", &["--no-store"]);
    assert_eq!(without.json()["parts"], Value::Null);
    assert!(!folder.join(".claymill-store").exists());
    let cold = plan(folder, "ribbon.igs", "cold", &["--threads", "2", "--store", ".claymill-store"]);
    let [reused, of] = parts(&cold);
    assert!(reused == 0 && of > 5, "{reused} of {of}");
    assert_same(folder, "without", "cold");
    // One that lies beside the job is used.
    for threads in ["1", "3"] {
        let warm = plan(folder, "ribbon.igs", "warm", &["--threads", threads]);
        // The whole plan, its verification and its pictures.
        assert_eq!(parts(&warm), [3, 3]);
        for name in names(&folder.join("cold")).iter().filter(|name| name.ends_with(".png")) {
            let [cold, warm] = ["cold", "warm"].map(|job| fs::read(folder.join(job).join(name)).unwrap());
            assert!(cold == warm, "{name} differs");
        }
        assert_same(folder, "without", "warm");
    }
    // Other links make other passes.
    let other = plan(folder, "ribbon.igs", "other", &["--link", "one-way"]);
    assert_eq!(parts(&other)[0], 0);

    // Damaged parts are named, and computed again.
    let store = folder.join(".claymill-store");
    for name in names(&store).iter().filter(|name| name.ends_with(".part")) {
        let mut bytes = fs::read(store.join(name)).unwrap();
        let middle = bytes.len() / 2;
        bytes[middle] ^= 1;
        fs::write(store.join(name), bytes).unwrap();
    }
    let args = ["plan", "ribbon.igs", "-o", "again"].iter().chain(&JOB[..4]);
    let again = run_without_adapter(folder, args);
    assert!(again.stderr.contains(&format!("parts     0 of {of} reused")), "{}", again.stderr);
    let warnings = again.stderr.replace("\n          ", " ");
    assert_eq!(warnings.matches("its content is not what was written").count() as u64, of, "{warnings}");
    assert_same(folder, "without", "again");
    assert_eq!(parts(&plan(folder, "ribbon.igs", "again", &[])), [3, 3]);
}

#[test]
fn a_plan_that_is_killed_again_and_again_goes_on() {
    let folder = scratch();
    let folder = folder.path();
    ribbon(folder);
    plan(folder, "ribbon.igs", "whole", &["--no-store"]);
    let start = || -> Child {
        let mut command = claymill();
        command
            .current_dir(folder)
            .env("WGPU_ADAPTER_NAME", "none")
            .stdout(Stdio::null())
            .stderr(Stdio::null());
        command
            .args(["plan", "ribbon.igs", "-o", "job", "--store", "parts", "--threads", "2"])
            .args(&JOB[..4]);
        command.spawn().unwrap()
    };
    let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(5);
    let kept =
        || names_if_there(&folder.join("parts")).iter().filter(|name| name.ends_with(".part")).count() as u64;
    let mut killed = 0;
    for _ in 0..5 {
        // However slow the machine is, each one comes a little further than the one before.
        let (before, mut child) = (kept(), start());
        while kept() == before && child.try_wait().unwrap().is_none() {
            std::thread::sleep(Duration::from_millis(5));
        }
        std::thread::sleep(Duration::from_millis(rng.random_range(0..60)));
        killed += u32::from(child.try_wait().unwrap().is_none());
        let _ = child.kill();
        child.wait().unwrap();
    }
    assert!(killed > 1, "{killed}");
    let kept = kept();
    let last = plan(folder, "ribbon.igs", "job", &["--store", "parts", "--threads", "2"]);
    let [reused, of] = parts(&last);
    // One that was killed after all passes were laid has kept the whole plan, too.
    assert!(reused > 0 && reused <= kept, "{reused} of {of}, {kept} kept");
    assert_same(folder, "whole", "job");
    let left = names(&folder.join("parts"));
    // A part that was killed before its first byte is not known to be dead for a minute.
    let is_empty =
        |name: &str| folder.join("parts").join(name).metadata().is_ok_and(|about| about.len() == 0);
    let is_kept = |name: &String| name == "STORE" || name.ends_with(".part") || is_empty(name);
    assert!(left.iter().all(is_kept), "{left:?}");
}

/// The curves of all passes of a job.
fn passes(job: &Path) -> Vec<String> {
    let text = fs::read_to_string(job.join(FILES[0])).unwrap();
    let moves = text.lines().map(|line| serde_json::from_str::<Value>(line).unwrap());
    let cut = moves.filter(|m| m["kind"] == "cut");
    cut.map(|m| format!("{} {} {}", m["setup"], m["points"], m["knots"])).collect()
}

#[test]
fn a_model_that_was_changed_reuses_what_the_change_does_not_reach() {
    let folder = scratch();
    let folder = folder.path();
    for (name, more) in [("car.igs", &[][..]), ("edited.igs", &["--edit"])] {
        let made = ["sample", "roadster", "--patches", "200", "--scale", "0.2", "-o", name];
        let made = run(folder, made.iter().chain(more));
        assert_eq!(made.code, Some(0), "{made:?}");
    }
    // Three regions, of which the wing that was moved is under none, but beside one.
    let some = ["--up=+z", "--length=-x", "--setups", "top", "--only", "region:0,region:3,region:6"];
    let some = [&["--tool", "ball:20", "--scallop", "1", "--json", "--quiet", "--store", "parts"], &some[..]]
        .concat();
    let plan = |model: &str, out: &str| {
        let planned = run_without_adapter(folder, ["plan", model, "-o", out].iter().chain(&some));
        assert_eq!(planned.code, Some(0), "{planned:?}");
        parts(&planned)
    };
    assert_eq!(plan("car.igs", "job")[0], 0);
    let [reused, of] = plan("edited.igs", "edited");
    assert!(reused > 0 && reused < of, "{reused} of {of}");
    let before: BTreeSet<String> = passes(&folder.join("job")).into_iter().collect();
    let after = passes(&folder.join("edited"));
    let same = after.iter().filter(|pass| before.contains(*pass)).count();
    assert!(2 * same > after.len(), "{same} of {} passes are as before", after.len());

    let diff = |model: &str| {
        let found = run(folder, ["diff", "job", model, "--json", "--quiet"]);
        assert_eq!(found.code, Some(0), "{found:?}");
        found.json()
    };
    let count = |found: &Value, key: &str| found[key].as_array().unwrap().len();
    let found = diff("edited.igs");
    assert!(
        count(&found, "changed") > 0 && count(&found, "added") == 0 && count(&found, "removed") == 0,
        "{found}"
    );
    let moved_mm = found["moved_mm"].as_f64().unwrap();
    // It is moved along an axis, and slants.
    assert!((1.0..=2.0).contains(&moved_mm), "{moved_mm}");
    assert_eq!(count(&found, "regions"), 1);
    assert_eq!(count(&diff("car.igs"), "changed"), 0);
}

#[test]
fn what_is_no_store_is_refused_by_name() {
    let folder = scratch();
    let folder = folder.path();
    ribbon(folder);
    let refused = |store: &str, code: i32, what: &str| {
        let run = run(folder, ["plan", "ribbon.igs", "-o", "job", "--store", store]);
        assert_eq!(run.code, Some(code), "{run:?}");
        assert!(run.stderr.contains(what), "{}", run.stderr);
    };
    fs::create_dir(folder.join("letters")).unwrap();
    fs::write(folder.join("letters/a.txt"), "dear reader").unwrap();
    refused("letters", 1, "letters is not empty and is no store");
    refused("job/parts", 2, "inside of the job folder");
    assert_eq!(names(&folder.join("letters")), ["a.txt"]);
    assert!(!folder.join("job").exists());
    let status = run(folder, ["store", "status", "letters"]);
    assert_eq!(status.code, Some(1), "{status:?}");
}

#[test]
fn a_store_says_what_it_holds_and_is_emptied() {
    let folder = scratch();
    let folder = folder.path();
    ribbon(folder);
    let [_, of] = parts(&plan(folder, "ribbon.igs", "job", &["--store", "parts"]));
    let status = run(folder, ["store", "status", "parts", "--json"]).json();
    assert_eq!(status["parts"], of);
    assert!(status["bytes"].as_u64().unwrap() > 1000);
    let cleaned = run(folder, ["store", "clean", "parts", "--json"]).json();
    assert_eq!([&cleaned["parts"], &cleaned["removed_parts"]], [&Value::from(0), &Value::from(of)]);
    assert_eq!(names(&folder.join("parts")), ["STORE"]);
}

#[test]
fn a_watched_model_is_planned_again_after_each_change() {
    let folder = scratch();
    let folder = folder.path();
    let sample = |shape: &str, out: &str| {
        let made = run(folder, ["sample", shape, "--patches", "200", "-o", out]);
        assert_eq!(made.code, Some(0), "{made:?}");
    };
    sample("panel", "model.igs");
    sample("ribbon", "edited.igs");
    let mut watching = claymill()
        .args(["plan", "model.igs", "-o", "job", "--watch", "--tool", "ball:10", "--scallop", "2", "--quiet"])
        .current_dir(folder)
        .env("WGPU_ADAPTER_NAME", "none")
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let mut seen = Vec::new();
    let mut wait_for_another_job = |watching: &mut Child| {
        for _ in 0..1200 {
            assert!(watching.try_wait().unwrap().is_none(), "it ended by itself");
            let moves = fs::read(folder.join("job/toolpaths.jsonl")).unwrap_or_default();
            if !moves.is_empty() && moves != seen {
                seen = moves;
                return;
            }
            std::thread::sleep(Duration::from_millis(100));
        }
        panic!("nothing was planned");
    };
    wait_for_another_job(&mut watching);
    // A file that cannot be read is most often half an edit: the job stays, and the next change is waited for.
    fs::write(folder.join("model.igs"), "no model").unwrap();
    std::thread::sleep(Duration::from_secs(2));
    fs::copy(folder.join("edited.igs"), folder.join("model.igs")).unwrap();
    wait_for_another_job(&mut watching);
    assert!(folder.join(".claymill-store").is_dir());
    let sent =
        std::process::Command::new("sh").args(["-c", &format!("kill -INT {}", watching.id())]).status();
    assert!(sent.unwrap().success());
    assert_eq!(watching.wait().unwrap().code(), Some(130));
}
