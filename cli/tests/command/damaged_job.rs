//! Job folders of which a file is damaged: every command that reads one ends soon, with a message and without a panic.

use std::fs;
use std::path::Path;
use std::process::Stdio;
use std::time::{Duration, Instant};

use claymill_tests::mutate;
use rand::seq::IndexedRandom;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::run::{claymill, panel_job, run};
use crate::scratch;

/// Damages in a test run, and in the measurement.
const FEW: u64 = 24;
const MANY: u64 = 600;
/// Commands that read a job folder, without what they write to.
const COMMANDS: [&[&str]; 5] = [
    &["verify", "job"],
    &["post", "job", "--to", "fanuc", "-o", "out.nc"],
    &["simulate", "job", "--program", "sound.nc"],
    &["report", "job"],
    &["render", "job", "-o", "out.png"],
];
/// None of them takes longer; the machine may have other work.
const LONGEST: Duration = Duration::from_secs(60);
const NUMBERS: [&str; 12] =
    ["1e300", "-1e300", "1e9", "-1e9", "1e-300", "0", "-1", "4294967296", "1e15", "null", "1e999", "\"x\""];

/// Runs a command; panics when it does not end or panics itself.
fn ends(folder: &Path, args: &[&str], what: &str) -> Option<i32> {
    let output = fs::File::create(folder.join("said")).unwrap();
    let mut child = claymill()
        .current_dir(folder)
        .args(args)
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(output)
        .spawn()
        .unwrap();
    let begun = Instant::now();
    let status = loop {
        if let Some(status) = child.try_wait().unwrap() {
            break status;
        }
        if begun.elapsed() > LONGEST {
            child.kill().unwrap();
            child.wait().unwrap();
            panic!("{args:?} does not end: {what}");
        }
        std::thread::sleep(Duration::from_millis(5));
    };
    let said = fs::read_to_string(folder.join("said")).unwrap();
    assert!(!said.contains("panicked"), "{args:?}: {what}: {said}");
    let code = status.code();
    assert!(matches!(code, Some(0..=2)), "{args:?} ended with {status}: {what}: {said}");
    if code != Some(0) && !said.contains("NOT PASSED") && args[0] != "verify" {
        assert!(said.contains("error: ") && said.contains("help: "), "{args:?}: {what}: {said}");
    }
    code
}

/// A job on a panel, and a program of it.
fn planned(folder: &Path) {
    panel_job(folder);
    let made = run(folder, ["post", "job", "--to", "linuxcnc", "-o", "sound.nc"]);
    assert_eq!(made.code, Some(0), "{made:?}");
}

/// Changes one number of a JSON text to one that makes no sense.
fn with_a_number(text: &mut Vec<u8>, random: &mut ChaCha8Rng) {
    let is_number = |b: &u8| b.is_ascii_digit() || matches!(b, b'.' | b'-' | b'e');
    let from = random.random_range(0..text.len());
    let starts =
        |at: usize| text[at].is_ascii_digit() && matches!(text[at - 1], b' ' | b':' | b'[' | b',' | b'-');
    let Some(start) = (from.max(1)..text.len()).find(|at| starts(*at)) else { return };
    let end = (start..text.len()).find(|at| !is_number(&text[*at])).unwrap_or(text.len());
    let number = NUMBERS.choose(random).copied().unwrap_or("0");
    text.splice(start..end, number.bytes());
}

fn damage(rounds: std::ops::Range<u64>) {
    let folder = scratch();
    let folder = folder.path();
    planned(folder);
    fs::rename(folder.join("job"), folder.join("sound")).unwrap();
    let files = ["job.json", "toolpaths.jsonl", "regions.json", "verify.json"];
    let sound = files.map(|name| fs::read(folder.join("sound").join(name)).unwrap());
    let (mut passed, mut refused) = (0, 0);
    for round in rounds {
        let mut random = ChaCha8Rng::seed_from_u64(round);
        // Most of a job is in two of its files.
        let victim = [0, 0, 1, 1, 1, 2, 3][random.random_range(0..7)];
        let mut bytes = sound[victim].clone();
        for _ in 0..random.random_range(1..4) {
            if random.random_bool(0.7) {
                with_a_number(&mut bytes, &mut random);
            } else {
                mutate(
                    &mut bytes,
                    &sound[(victim + 1) % 4],
                    &[b"{", b"]", b"\xff", b"-1", b"\"\""],
                    &mut random,
                );
            }
        }
        let _ = fs::remove_dir_all(folder.join("job"));
        fs::create_dir(folder.join("job")).unwrap();
        for (name, sound) in files.iter().zip(&sound) {
            fs::write(folder.join("job").join(name), sound).unwrap();
        }
        fs::write(folder.join("job").join(files[victim]), &bytes).unwrap();
        for args in COMMANDS {
            let code = ends(folder, args, &format!("round {round}, {}", files[victim]));
            passed += u32::from(code == Some(0));
            refused += u32::from(code != Some(0));
            for made in ["out.nc", "out.png"] {
                let _ = fs::remove_file(folder.join(made));
            }
        }
    }
    eprintln!("{passed} runs went through, {refused} were refused");
    assert!(passed > 0 && refused > 0);
}

#[test]
fn commands_end_with_a_message() {
    damage(0..FEW);
}

#[test]
#[ignore = "a measurement of many minutes"]
fn commands_end_with_a_message_six_hundred_times() {
    damage(0..MANY);
}

#[test]
#[cfg(unix)]
fn what_is_no_file_is_refused_at_once() {
    let folder = scratch();
    let folder = folder.path();
    planned(folder);
    assert!(std::process::Command::new("mkfifo").arg(folder.join("pipe")).status().unwrap().success());
    for special in ["/dev/zero", "pipe"] {
        for args in [
            &["verify", "job", "--model", special][..],
            &["verify", "job", "--check", special],
            &["verify", "job", "--program", special, "--dialect", "fanuc"],
            &["simulate", "job", "--program", "sound.nc", "--machine", special],
            &["post", "job", "--to", "fanuc", "--machine", special, "-o", "made"],
            &["plan", "panel.igs", "--job", special, "-o", "made"],
        ] {
            assert!(matches!(ends(folder, args, special), Some(1 | 2)), "{args:?}");
        }
        for command in ["inspect", "merge", "plan"] {
            assert_eq!(ends(folder, &[command, special, "-o", "made"], special), Some(1), "{command}");
        }
    }
    for name in ["job.json", "toolpaths.jsonl"] {
        let sound = fs::read(folder.join("job").join(name)).unwrap();
        fs::remove_file(folder.join("job").join(name)).unwrap();
        std::os::unix::fs::symlink("/dev/zero", folder.join("job").join(name)).unwrap();
        for args in COMMANDS {
            assert_eq!(ends(folder, args, name), Some(1), "{args:?}");
        }
        fs::remove_file(folder.join("job").join(name)).unwrap();
        fs::write(folder.join("job").join(name), sound).unwrap();
    }
}

/// Each of these was taken for what it says.
#[test]
fn values_that_no_job_has_are_refused_by_name() {
    let folder = scratch();
    let folder = folder.path();
    planned(folder);
    let path = folder.join("job/job.json");
    let sound: serde_json::Value = serde_json::from_slice(&fs::read(&path).unwrap()).unwrap();
    for (pointer, value, told) in [
        ("/setups/0/clearance_mm", 1e9, "clearance_mm of the setup"),
        ("/request/holder_clearance_mm", 1e9, "request.holder_clearance_mm"),
        ("/tools/0/radius_mm", 1e9, "tool radius"),
        ("/tools/0/radius_mm", 1e-300, "tool radius"),
        ("/request/tool/radius_mm", 1e9, "tool radius"),
        ("/request/feed_mm_per_min", 1e12, "request.feed_mm_per_min"),
        ("/request/scallop_mm", 0.0, "request.scallop_mm"),
        ("/request/machine/jerk_mm_per_s3", 1e-12, "jerk_mm_per_s3"),
        ("/model/box_mm/3", 1e12, "model.box_mm"),
        ("/setups/0/axis/2", 7.0, "unit vector"),
        ("/totals/time_s", 1e300, "1e300"),
        ("/setups/0/clearance_mm", 1e300, "1e300"),
    ] {
        let mut job = sound.clone();
        *job.pointer_mut(pointer).unwrap_or_else(|| panic!("no {pointer}")) = value.into();
        fs::write(&path, serde_json::to_vec(&job).unwrap()).unwrap();
        for args in COMMANDS {
            let refused = run(folder, args);
            assert_eq!(refused.code, Some(1), "{args:?} {pointer}: {refused:?}");
            assert!(refused.stderr.contains(told), "{args:?} {pointer}: {}", refused.stderr);
        }
    }
    fs::write(&path, serde_json::to_vec(&sound).unwrap()).unwrap();
    // A move to the moon: verified, it would be sampled millimetre by millimetre.
    let moves = fs::read_to_string(folder.join("job/toolpaths.jsonl")).unwrap();
    let (first, rest) = moves.split_once('\n').unwrap();
    let mut first: serde_json::Value = serde_json::from_str(first).unwrap();
    for (far, told) in [(9e6, "away from the model"), (3.8e11, "10 km away")] {
        first["points"][0][0] = far.into();
        fs::write(folder.join("job/toolpaths.jsonl"), format!("{first}\n{rest}")).unwrap();
        let refused = run(folder, ["verify", "job"]);
        assert_eq!(refused.code, Some(1), "{refused:?}");
        assert!(refused.stderr.contains(told), "{}", refused.stderr);
    }
}
