//! What is wrong is said, with what to do about it, and nothing is left behind.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::{Duration, Instant};

use claymill_tests::{Need, leave_out};
use claymill_toolpath::read_job;

use crate::iges_text::{Entity, entity, file, flat, line};
use crate::run::{Run, claymill, panel, run};
use crate::scratch;

/// Everything below a folder.
fn content(folder: &Path) -> BTreeSet<PathBuf> {
    let mut found = BTreeSet::new();
    let mut open = vec![folder.to_owned()];
    while let Some(next) = open.pop() {
        for entry in fs::read_dir(next).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                open.push(path.clone());
            }
            found.insert(path);
        }
    }
    found
}

/// Runs a command that must be refused with `code`, a message that holds `parts` and advice, and no trace.
fn refused(folder: &Path, args: &[&str], code: i32, parts: &[&str]) -> Run {
    let before = content(folder);
    let run = run(folder, args);
    assert_eq!(run.code, Some(code), "{args:?}: {run:?}");
    for part in parts.iter().chain(&["error: ", "help: "]) {
        assert!(run.stderr.contains(part), "{args:?} does not say `{part}`: {}", run.stderr);
    }
    assert!(!run.stderr.contains("panicked"), "{}", run.stderr);
    assert_eq!(content(folder), before, "{args:?} left something behind");
    run
}

#[test]
fn files_that_are_no_models() {
    let folder = scratch();
    let folder = folder.path();
    fs::write(folder.join("empty.igs"), "").unwrap();
    fs::write(folder.join("letter.igs"), "Dear colleague,\nplease find the model attached.\n").unwrap();
    fs::write(folder.join("lines.igs"), file(&[line([0.; 3], [1.; 3])])).unwrap();
    for (name, what) in [
        ("missing.igs", "No such file"),
        ("empty.igs", "is empty"),
        ("letter.igs", "not an IGES, STEP or 3dm file"),
        ("lines.igs", "no usable face"),
        (".", "directory"),
    ] {
        refused(folder, &["plan", name, "-o", "new/parent/job"], 1, &[name, what]);
        refused(folder, &["inspect", name], 1, &[name, what]);
        refused(folder, &["merge", name, "-o", "regions"], 1, &[name, what]);
    }
    refused(folder, &["verify", "missing"], 1, &["missing/job.json"]);
    refused(folder, &["render", "missing.igs", "-o", "picture.png"], 1, &["missing.igs"]);
}

#[test]
fn a_file_cut_off_anywhere_is_refused_or_its_missing_faces_named() {
    let folder = scratch();
    let whole = fs::read(panel(folder.path())).unwrap();
    let faces = 202;
    for percent in [0, 1, 5, 10, 11, 12, 13, 15, 20, 35, 50, 80, 99] {
        let kept = (whole.len() * percent / 100).max(90);
        fs::write(folder.path().join("cut.igs"), &whole[..kept]).unwrap();
        let args = ["inspect", "cut.igs", "--json"];
        let found = run(folder.path(), args);
        if found.code == Some(0) {
            let json = found.json();
            let (read, skipped) = (json["faces"].as_u64().unwrap(), json["skipped"].as_array().unwrap());
            assert_eq!(read + skipped.len() as u64, json["faces_in_file"].as_u64().unwrap());
            assert!(
                read < faces && !json["report"]["warnings"].as_array().unwrap().is_empty(),
                "{percent} %"
            );
            assert!(found.stderr.contains("warning: ") && found.stderr.contains("skipped DE "), "{found:?}");
        } else {
            refused(folder.path(), &args, 1, &["cut.igs", "breaks off"]);
            refused(folder.path(), &["plan", "cut.igs", "-o", "job"], 1, &["cut.igs", "breaks off"]);
        }
    }
}

/// A flat surface of which one parameter is replaced.
fn altered(from: &str, to: &str) -> Entity {
    let mut surface = flat(10.0, 8.0);
    assert!(surface.parameters.contains(from));
    surface.parameters = surface.parameters.replacen(from, to, 1);
    surface
}

#[test]
fn damaged_faces_are_skipped_by_name_and_the_rest_is_cut() {
    let folder = scratch();
    let corners = [[1.0, 1.0, 0.0], [9.0, 1.0, 0.0], [9.0, 7.0, 0.0], [1.0, 3.0, 0.0]];
    let mut entities = vec![flat(100.0, 80.0)];
    // DE 3: a face whose loop does not close.
    entities.extend([entity(144, "5,1,0,7"), flat(10.0, 8.0), entity(142, "0,5,0,15,2")]);
    entities.extend(corners.windows(2).map(|w| line(w[0], w[1])));
    entities.push(entity(102, "3,9,11,13"));
    // DE 17, 19 and 21.
    entities.push(altered("0.,0.,0.,10.0,0.", "nan,0.,0.,10.0,0."));
    entities.push(altered("0.,0.,0.,10.0,0.", "1E300,0.,0.,10.0,0."));
    entities.push(flat(10.0, 0.0));
    fs::write(folder.path().join("damaged.igs"), file(&entities)).unwrap();
    let made = run(folder.path(), ["plan", "damaged.igs", "-o", "job"]);
    assert_eq!(made.code, Some(0), "{}", made.stderr);
    let job = read_job(&folder.path().join("job")).unwrap();
    assert_eq!((job.model.faces_in_file, job.model.faces_read), (5, 1));
    for (entity, reason) in [
        ("DE 3", "does not close"),
        ("DE 17", "not a number"),
        ("DE 19", "finite"),
        ("DE 21", "empty domain"),
    ] {
        let skipped = job.model.skipped.iter().find(|s| s.entity == entity);
        assert!(skipped.is_some_and(|s| s.reason.contains(reason)), "{entity}: {:?}", job.model.skipped);
        assert!(made.stderr.contains(&format!("skipped {entity} ")), "{}", made.stderr);
    }
    assert!((job.area.total_mm2 - 8000.0).abs() < 1e-6);
    assert!(job.area.cut_mm2 > 0.99 * 8000.0, "{:?}", job.area);
}

#[test]
fn wrong_options() {
    let folder = scratch();
    let folder = folder.path();
    fs::write(folder.join("flat.igs"), file(&[flat(100.0, 80.0)])).unwrap();
    fs::write(folder.join("job.toml"), "scalop = 0.1\n").unwrap();
    let plan = |more: &[&'static str]| [&["plan", "flat.igs", "-o", "new/job"], more].concat();
    for (options, code, parts) in [
        (vec!["--scallop", "10.5"], 2, vec!["scallop height 10.5 mm", "smaller than the ball radius 10 mm"]),
        (vec!["--scallop", "-0.1"], 2, vec!["scallop height -0.1 mm", "positive"]),
        (vec!["--scallop", "0"], 2, vec!["scallop height 0 mm"]),
        (vec!["--scallop", "nan"], 2, vec!["scallop height NaN mm"]),
        (vec!["--tool", "flat:5", "--strategy", "scallop"], 2, vec!["flat:5", "strategy scallop"]),
        (vec!["--rest-of", "bull:20:3"], 2, vec!["bull:20:3", "ball ends only"]),
        (vec!["--tool", "ball"], 2, vec!["`ball` is not a tool"]),
        (vec!["--tool", "ball:-3"], 2, vec!["tool radius -3 mm"]),
        (vec!["--feed", "0"], 2, vec!["feed 0 mm/min"]),
        (vec!["--tool", "ball:200"], 1, vec!["radius 200 mm", "too big for a model of 100.0 mm"]),
        (vec!["--only", "region:7"], 2, vec!["`region:7`", "only 1 regions"]),
        (vec!["--skip", "bonnet"], 2, vec!["`bonnet`"]),
        (vec!["--skip", "face:0"], 1, vec!["no setup reaches"]),
        (vec!["--up", "q"], 2, vec!["`q` is not an axis"]),
        (vec!["--up", "+z", "--length", "-z"], 2, vec!["parallel"]),
        (vec!["--job", "missing.toml"], 1, vec!["missing.toml"]),
        (vec!["--job", "job.toml"], 1, vec!["job.toml", "scalop"]),
    ] {
        refused(folder, &plan(&options), code, &parts);
    }
    refused(folder, &["sample", "lorry", "-o", "lorry.igs"], 2, &["`lorry`", "roadster, panel"]);
    refused(folder, &["sample", "panel", "--patches", "3", "-o", "new/panel.igs"], 2, &["3 patches"]);
    refused(folder, &["render", "flat.igs", "--view", "below", "-o", "new.png"], 2, &["`below`"]);
    for camera in ["30", "30/95", "1,2,3", "nan/0", "1,2,3,1,2,3"] {
        refused(folder, &["render", "flat.igs", "--camera", camera, "-o", "new.png"], 2, &[camera]);
    }
    let unknown = run(folder, ["plan", "flat.igs", "-o", "job", "--depth", "3"]);
    assert_eq!(unknown.code, Some(2));
    assert!(unknown.stderr.contains("--depth"));
    let unknown = run(folder, ["render", "flat.igs", "--show", "dreams", "-o", "new.png"]);
    assert_eq!(unknown.code, Some(2));
    assert!(unknown.stderr.contains("dreams") && !folder.join("new.png").exists());
}

#[test]
fn output_folders_that_cannot_be_written() {
    let folder = scratch();
    let folder = folder.path();
    fs::write(folder.join("flat.igs"), file(&[flat(100.0, 80.0)])).unwrap();
    fs::write(folder.join("note.txt"), "a file").unwrap();
    fs::create_dir(folder.join("photos")).unwrap();
    fs::write(folder.join("photos/summer.jpg"), "holidays").unwrap();
    let to = |out| ["plan", "flat.igs", "-o", out];
    refused(folder, &to("note.txt"), 1, &["note.txt", "A file is in the way"]);
    refused(folder, &to("note.txt/job"), 1, &["note.txt", "A file is in the way"]);
    refused(folder, &to("photos"), 1, &["photos exists and is not a claymill job folder"]);
    refused(folder, &to("/proc/claymill"), 1, &["/proc/"]);
    refused(folder, &["sample", "panel", "-o", "note.txt/panel.igs"], 1, &["note.txt"]);
    refused(folder, &["render", "flat.igs", "-o", "note.txt/a.png"], 1, &["note.txt"]);
    assert_eq!(fs::read_to_string(folder.join("photos/summer.jpg")).unwrap(), "holidays");
}

/// A small file system in memory, unmounted at the end.
struct SmallDisk(PathBuf);

impl SmallDisk {
    #[track_caller]
    fn mount(at: &Path, size: &str) -> Option<Self> {
        fs::create_dir_all(at).unwrap();
        let option = format!("size={size}");
        let mounted = Command::new("mount").args(["-t", "tmpfs", "-o", &option, "tmpfs"]).arg(at).output();
        if !mounted.is_ok_and(|o| o.status.success()) {
            leave_out(Need::Mount, "no small file system can be mounted here");
            return None;
        }
        Some(SmallDisk(at.to_owned()))
    }
}

impl Drop for SmallDisk {
    fn drop(&mut self) {
        let _ = Command::new("umount").arg(&self.0).status();
    }
}

#[test]
fn a_disk_that_fills() {
    let folder = scratch();
    let folder = folder.path();
    fs::write(folder.join("flat.igs"), file(&[flat(100.0, 80.0)])).unwrap();
    // Full at the moves, at the pictures, at the report.
    for size in ["8k", "64k", "400k"] {
        let Some(_disk) = SmallDisk::mount(&folder.join("disk"), size) else { return };
        refused(folder, &["plan", "flat.igs", "-o", "disk/job"], 1, &["disk/", "The disk is full"]);
        refused(folder, &["sample", "panel", "-o", "disk/panel.igs"], 1, &["disk/panel.igs"]);
    }
}

/// Starts a job, waits until `ready`, interrupts it: it must end soon, and nothing of it may be left.
fn interrupted(folder: &Path, model: &str, ready: impl Fn(&BTreeSet<PathBuf>) -> bool) {
    let before = content(folder);
    let mut job =
        claymill().args(["plan", model, "--quiet", "-o", "job"]).current_dir(folder).spawn().unwrap();
    let patience = Instant::now();
    while !ready(&content_while_changing(folder)) {
        assert!(patience.elapsed() < Duration::from_secs(60), "the moment to interrupt never came");
        assert!(job.try_wait().unwrap().is_none(), "the job ended before it could be interrupted");
        std::thread::sleep(Duration::from_millis(1));
    }
    let start = Instant::now();
    let sent = Command::new("sh").args(["-c", &format!("kill -INT {}", job.id())]).status().unwrap();
    assert!(sent.success());
    let status = job.wait().unwrap();
    let elapsed = start.elapsed();
    eprintln!("{model}: ended {elapsed:?} after the interruption");
    assert_eq!(status.code(), Some(130), "{status}");
    assert!(elapsed < Duration::from_secs(1), "{elapsed:?}");
    assert_eq!(content(folder), before, "left behind");
}

/// The content of a folder in which files come and go.
fn content_while_changing(folder: &Path) -> BTreeSet<PathBuf> {
    let below =
        |f: &Path| fs::read_dir(f).into_iter().flatten().flatten().map(|e| e.path()).collect::<Vec<_>>();
    below(folder).into_iter().flat_map(|f| [below(&f), vec![f]].concat()).collect()
}

#[test]
fn an_interruption_ends_the_job_at_once_and_leaves_nothing() {
    let folder = scratch();
    let folder = folder.path();
    panel(folder);
    fs::write(folder.join("flat.igs"), file(&[flat(100.0, 80.0)])).unwrap();
    let has = |name: &'static str| {
        move |found: &BTreeSet<PathBuf>| found.iter().any(|f| f.to_string_lossy().contains(name))
    };
    interrupted(folder, "panel.igs", has(".partial"));
    let begun = Instant::now();
    interrupted(folder, "panel.igs", |_| begun.elapsed() > Duration::from_secs(2));
    interrupted(folder, "flat.igs", has("toolpaths.jsonl"));
    // An earlier job at the same place stays.
    assert_eq!(run(folder, ["plan", "flat.igs", "-o", "job"]).code, Some(0));
    let earlier = fs::read(folder.join("job/job.json")).unwrap();
    interrupted(folder, "flat.igs", |found| {
        found.iter().filter(|f| f.ends_with("preview-iso.png")).count() == 2
    });
    assert_eq!(fs::read(folder.join("job/job.json")).unwrap(), earlier);
}
