//! A plan in shards is the plan, whoever lays them, how often and in which order; what cannot be joined is named.

use std::fs;
use std::path::Path;
use std::process::{Child, Stdio};
use std::time::{Duration, Instant};

use claymill_tests::{Need, is_installed};
use rand::seq::SliceRandom;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde_json::Value;

use crate::reuse::{assert_same, names, ribbon};
use crate::run::{Run, claymill, run, run_without_adapter};
use crate::scratch;

const JOB: [&str; 8] =
    ["--tool", "ball:10", "--scallop", "0.4", "--setups", "top,left", "--keep-apart", "face:0-2"];

/// A ribbon of some regions, its plan, and its shards, of one part each.
pub(crate) fn ribbon_in_shards(folder: &Path) -> usize {
    ribbon(folder);
    let plan =
        run_without_adapter(folder, ["plan", "ribbon.igs", "-o", "plan", "--no-store"].iter().chain(&JOB));
    assert!(matches!(plan.code, Some(0 | 3)), "{plan:?}");
    open(folder, "work")
}

fn open(folder: &Path, work: &str) -> usize {
    let asked = ["shard", "open", "ribbon.igs", "-o", work, "--minutes", "1e-6", "--json"];
    let opened = run(folder, asked.iter().chain(&JOB));
    assert_eq!(opened.code, Some(0), "{opened:?}");
    opened.json()["shards"].as_array().unwrap().len()
}

fn lay(folder: &Path, shards: &str) -> Run {
    run(folder, ["--quiet", "shard", "run", "work", shards])
}

fn start(folder: &Path, work: &str, shards: &str) -> Child {
    let mut command = claymill();
    command.current_dir(folder).args(["--quiet", "shard", "run", work, shards]);
    command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap()
}

fn join(folder: &Path, work: &str, out: &str) -> Run {
    run_without_adapter(folder, ["--quiet", "shard", "join", work, "-o", out])
}

fn missing(folder: &Path, form: &str) -> String {
    let found = run(folder, ["shard", "status", "work", "--missing", "--as", form]);
    assert_eq!(found.code, Some(0), "{found:?}");
    found.stdout.trim().to_owned()
}

#[test]
fn shards_in_any_order_on_any_number_of_workers_join_to_the_plan() {
    let folder = scratch();
    let folder = folder.path();
    let count = ribbon_in_shards(folder);
    assert!(count >= 3, "{count}");
    let mut rng = ChaCha8Rng::seed_from_u64(11);
    for workers in [1, 2, 7] {
        let work = format!("work-{workers}");
        assert_eq!(open(folder, &work), count);
        // Every shard twice: also at the same time, and once it is done.
        let mut shards: Vec<usize> = (0..count).chain(0..count).collect();
        shards.shuffle(&mut rng);
        while !shards.is_empty() {
            let some = shards.split_off(shards.len().saturating_sub(workers));
            let children: Vec<Child> =
                some.iter().map(|shard| start(folder, &work, &shard.to_string())).collect();
            for mut child in children {
                assert!(child.wait().unwrap().success());
            }
        }
        let out = format!("job-{workers}");
        let joined = join(folder, &work, &out);
        assert!(matches!(joined.code, Some(0 | 3)), "{joined:?}");
        assert_same(folder, "plan", &out);
    }
}

#[test]
fn a_shard_that_is_killed_or_ended_is_run_again() {
    let folder = scratch();
    let folder = folder.path();
    let all = format!("0-{}", ribbon_in_shards(folder) - 1);
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    for _ in 0..3 {
        let mut child = start(folder, "work", &all);
        std::thread::sleep(Duration::from_millis(rng.random_range(10..400)));
        let _ = child.kill();
        child.wait().unwrap();
    }
    // A scheduler whose time is over says so with SIGTERM: that is no fault of the shard's.
    #[cfg(unix)]
    {
        let fresh = open(folder, "other");
        let mut child = start(folder, "other", &format!("0-{}", fresh - 1));
        std::thread::sleep(Duration::from_millis(60));
        let asked = std::process::Command::new("kill").args(["-TERM", &child.id().to_string()]).status();
        assert!(asked.unwrap().success());
        let begun = Instant::now();
        let ended = child.wait().unwrap();
        assert!(matches!(ended.code(), Some(75 | 0)), "{ended:?}");
        assert!(begun.elapsed() < Duration::from_secs(2));
    }
    assert_eq!(lay(folder, &all).code, Some(0));
    assert_eq!(missing(folder, "ranges"), "");
    assert!(matches!(join(folder, "work", "job").code, Some(0 | 3)));
    assert_same(folder, "plan", "job");
    let left = names(&folder.join("work/parts"));
    assert!(left.iter().all(|name| name == "STORE" || name.ends_with(".part")), "{left:?}");
}

#[test]
fn what_cannot_be_joined_is_named_with_what_to_run() {
    let folder = scratch();
    let folder = folder.path();
    let count = ribbon_in_shards(folder);
    let last = count - 1;
    assert_eq!(lay(folder, "1").code, Some(0));
    let lines = missing(folder, "lines");
    assert_eq!(lines.lines().count(), last, "{lines}");
    assert!(!lines.lines().any(|line| line == "1"), "{lines}");
    let json: Vec<usize> = serde_json::from_str(&missing(folder, "json")).unwrap();
    assert_eq!(json.len(), last);
    let refused = |work: &str, what: &str| {
        let joined = join(folder, work, "job");
        assert_eq!(joined.code, Some(1), "{joined:?}");
        assert!(joined.stderr.contains(what), "{what}: {joined:?}");
        assert!(!folder.join("job").exists());
    };
    refused("work", &format!("claymill shard run work {}", missing(folder, "ranges")));
    assert_eq!(lay(folder, &format!("0-{last}")).code, Some(0));

    // A flipped byte in the part of a shard.
    let list: Value = serde_json::from_slice(&fs::read(folder.join("work/shards.json")).unwrap()).unwrap();
    assert_eq!(list["shards"].as_array().unwrap().len(), count);
    let parts: Vec<_> = fs::read_dir(folder.join("work/parts")).unwrap().map(|e| e.unwrap().path()).collect();
    let parts: Vec<_> = parts.iter().filter(|path| path.extension().is_some_and(|e| e == "part")).collect();
    // Others say what setups see and cut: who joins needs them no more than others do, and can make them again.
    assert!(parts.len() > count);
    for path in &parts {
        let mut bytes = fs::read(path).unwrap();
        let middle = bytes.len() / 2;
        bytes[middle] ^= 1;
        fs::write(path, bytes).unwrap();
    }
    refused("work", &format!("(damaged: 0-{last})"));
    assert_eq!(lay(folder, &format!("0-{last}")).code, Some(0));

    // Another version, another form, another model, no work folder.
    let path = folder.join("work/shards.json");
    let text = fs::read_to_string(&path).unwrap();
    let program = list["program"].as_str().unwrap();
    for (changed, what) in [
        (text.replace(program, "claymill 0.0.0"), "claymill 0.0.0 listed these shards"),
        (text.replace("\"format_version\": 1", "\"format_version\": 7"), "form 7 of the list"),
        (
            text.replacen(&list["shards"][0]["parts"][0].as_str().unwrap()[..8], "nonsense", 1),
            "is the key of no part",
        ),
        (text[..text.len() / 2].to_owned(), "shards.json"),
    ] {
        fs::write(&path, changed).unwrap();
        refused("work", what);
        assert_eq!(lay(folder, "0").code, Some(1));
    }
    fs::write(&path, text).unwrap();
    refused("plan", "shards.json");
    for wrong in [&["0-99"][..], &["x"], &[]] {
        let run = run(folder, ["shard", "run", "work"].iter().chain(wrong));
        assert_eq!(run.code, Some(2), "{run:?}");
    }
    let model = fs::read(folder.join("ribbon.igs")).unwrap();
    fs::write(folder.join("ribbon.igs"), [&model[..], b" "].concat()).unwrap();
    refused("work", "changed since the shards in work were listed");
    fs::write(folder.join("ribbon.igs"), model).unwrap();
    assert!(matches!(join(folder, "work", "job").code, Some(0 | 3)));
    assert_same(folder, "plan", "job");
    let beside = run(folder, ["shard", "open", "ribbon.igs", "-o", "plan"].iter().chain(&JOB));
    assert_eq!(beside.code, Some(1), "{beside:?}");
    assert!(beside.stderr.contains("is no work folder"), "{beside:?}");
}

#[test]
fn scripts_name_what_is_missing_and_one_is_run() {
    let folder = scratch();
    let folder = folder.path();
    let count = ribbon_in_shards(folder);
    assert_eq!(lay(folder, "0").code, Some(0));
    let range = if count == 2 { "1".to_owned() } else { format!("1-{}", count - 1) };
    for (engine, file, needle) in [
        ("slurm", "slurm.sh", format!("--array={range} ")),
        ("hyperqueue", "hyperqueue.sh", format!("--array={range} ")),
        ("snakemake", "Snakefile", format!("SHARDS = {:?}", (1..count).collect::<Vec<_>>())),
        ("openjd", "openjd.yaml", format!("range: \"{range}\"")),
        ("parallel", "parallel.sh", format!("for shard in 1{}", if count == 2 { ";" } else { " 2" })),
    ] {
        let written = run(folder, ["shard", "script", "work", "--for", engine, "-o", "by-script"]);
        assert_eq!(written.code, Some(0), "{written:?}");
        let text = fs::read_to_string(folder.join("work").join(file)).unwrap();
        assert!(text.contains(&needle), "{engine}: {needle}\n{text}");
        if file.ends_with(".sh") && cfg!(unix) {
            let checked =
                std::process::Command::new("bash").arg("-n").arg(folder.join("work").join(file)).output();
            assert!(checked.unwrap().status.success(), "{text}");
        }
    }
    if cfg!(unix) && is_installed(Need::UnixTools, "parallel", "parallel") {
        let script = folder.join("work/parallel.sh");
        let mut command = std::process::Command::new("bash");
        let run: Run = command.arg(script).env("WGPU_ADAPTER_NAME", "none").output().unwrap().into();
        assert!(matches!(run.code, Some(0 | 3)), "{run:?}");
        assert_same(folder, "plan", "by-script");
    }
}

/// The address space is limited as a scheduler limits memory.
#[cfg(target_os = "linux")]
#[test]
fn a_shard_without_enough_memory_asks_for_more() {
    let folder = scratch();
    let folder = folder.path();
    ribbon_in_shards(folder);
    let claymill = env!("CARGO_BIN_EXE_claymill");
    let limited = format!("ulimit -v 400000; exec '{claymill}' --threads 1 --quiet shard run work 0");
    let mut command = std::process::Command::new("sh");
    let run: Run = command.args(["-c", &limited]).current_dir(folder).output().unwrap().into();
    // A machine may do with less.
    assert!(matches!(run.code, Some(76 | 0)), "{run:?}");
}
