//! Nothing of the user's is lost: not what lies in a folder, not what a name leads to, not what another process writes.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Stdio;
use std::time::{Duration, Instant};

use claymill_tests::{Need, leave_out};

use crate::run::{claymill, panel, panel_job, run, run_without_adapter};
use crate::scratch;

fn plan(folder: &Path, out: &str) -> crate::run::Run {
    run(folder, ["plan", "panel.igs", "--tool", "ball:10", "--scallop", "2", "-o", out])
}

/// Names in a folder, hidden ones too, in order.
fn names(folder: &Path) -> Vec<String> {
    let entries =
        fs::read_dir(folder).unwrap().map(|e| e.unwrap().file_name().to_string_lossy().into_owned());
    let mut names: Vec<String> = entries.collect();
    names.sort();
    names
}

#[test]
fn a_job_folder_is_replaced_only_where_nothing_is_lost() {
    let place = scratch();
    let folder = place.path();
    panel(folder);
    assert_eq!(plan(folder, "job").code, Some(0));
    // The list is one that everybody can check.
    let checked = std::process::Command::new("sha256sum")
        .args(["-c", "--quiet", "files.sha256"])
        .current_dir(folder.join("job"))
        .output();
    if let Ok(checked) = checked {
        assert!(checked.status.success(), "{checked:?}");
    }
    assert_eq!(plan(folder, "job").code, Some(0), "as it was written it may be replaced");

    let posted = run(folder, ["post", "job", "--to", "g1", "-o", "job/body.nc"]);
    assert_eq!(posted.code, Some(0), "{posted:?}");
    let before = names(&folder.join("job"));
    let refused = plan(folder, "job");
    assert_eq!(refused.code, Some(1), "{refused:?}");
    for part in ["body.nc", "body.nc.totals.json", "help: "] {
        assert!(refused.stderr.contains(part), "{}", refused.stderr);
    }
    assert_eq!(
        (names(&folder.join("job")), names(folder)),
        (before, vec!["job".into(), "panel.answers.json".into(), "panel.igs".into()])
    );
    fs::remove_file(folder.join("job/body.nc")).unwrap();
    fs::remove_file(folder.join("job/body.nc.totals.json")).unwrap();

    let mut options = fs::read_to_string(folder.join("job/job.toml")).unwrap();
    options.push_str("# my note\n");
    fs::write(folder.join("job/job.toml"), &options).unwrap();
    let refused = plan(folder, "job");
    assert_eq!(refused.code, Some(1), "{refused:?}");
    assert!(refused.stderr.contains("changed since claymill wrote them: job.toml"), "{}", refused.stderr);
    assert_eq!(fs::read_to_string(folder.join("job/job.toml")).unwrap(), options);
    // Regions of a merge do not replace a job, though a job has such a file too.
    let merged = run(folder, ["merge", "panel.igs", "-o", "job"]);
    assert_eq!(merged.code, Some(1), "{merged:?}");
    assert!(folder.join("job/toolpaths.jsonl").exists());
    // What is computed from the rest may be computed again.
    fs::write(folder.join("job/job.toml"), options.replace("# my note\n", "")).unwrap();
    let report = run(folder, ["report", "job"]);
    assert_eq!(report.code, Some(0), "{report:?}");
    assert_eq!(plan(folder, "job").code, Some(0));
}

#[test]
fn inputs_are_never_written_over() {
    let place = scratch();
    let folder = place.path();
    panel_job(folder);
    let model = fs::read(folder.join("panel.igs")).unwrap();
    let moves = fs::read(folder.join("job/toolpaths.jsonl")).unwrap();
    let record = fs::read(folder.join("job/job.json")).unwrap();
    for command in [
        &["merge", "panel.igs", "--export", "panel.igs"][..],
        &["merge", "panel.igs", "--drive-surfaces", "./panel.igs"],
        &["inspect", "panel.igs", "-o", "panel.igs"],
        &["render", "panel.igs", "-o", "panel.igs"],
        &["render", "job", "-o", "panel.igs"],
        &["render", "job", "-o", "job/job.json"],
        &["post", "job", "--to", "g1", "-o", "job/toolpaths.jsonl"],
        &["post", "job", "--to", "g1", "-o", "job/job.json"],
        &["animate", "job", "-o", "job/report.html.png"],
    ] {
        let last = command.last().unwrap();
        let named = last.strip_suffix(".png").unwrap_or(last);
        if *last != named {
            // A link of a fitting name leads there as well.
            #[cfg(unix)]
            std::os::unix::fs::symlink("report.html", folder.join(last)).unwrap();
        }
        for force in [&[][..], &["--force"]] {
            let made = run(folder, command.iter().chain(force));
            assert_eq!(made.code, Some(1), "{command:?}: {made:?}");
            assert!(made.stderr.contains("would be written over"), "{command:?}: {}", made.stderr);
        }
    }
    assert!(fs::read(folder.join("panel.igs")).unwrap() == model);
    assert!(fs::read(folder.join("job/toolpaths.jsonl")).unwrap() == moves);
    assert!(fs::read(folder.join("job/job.json")).unwrap() == record);
}

#[test]
fn what_claymill_did_not_write_is_replaced_on_request_only() {
    let place = scratch();
    let folder = place.path();
    panel_job(folder);
    for (command, to) in [
        (&["post", "job", "--to", "siemens", "-o"][..], "x.mpf"),
        (&["merge", "panel.igs", "--export"], "x.igs"),
        (&["merge", "panel.igs", "--export"], "x.stp"),
        (&["merge", "panel.igs", "--export"], "x.glb"),
        (&["render", "job", "--size", "320x200", "-o"], "x.png"),
        (&["animate", "job", "--size", "320x200", "--seconds", "0.3", "-o"], "x.gif"),
        (&["animate", "job", "--size", "320x200", "--seconds", "0.3", "-o"], "anim.png"),
        (&["sample", "roadster", "-o"], "sample.igs"),
    ] {
        let write = |more: &[&str]| run(folder, command.iter().chain(&[to]).chain(more));
        let first = write(&[]);
        if first.stderr.contains("graphics adapter") {
            leave_out(Need::Vulkan, format_args!("no graphics adapter for {to}"));
            continue;
        }
        assert_eq!(first.code, Some(0), "{to}: {first:?}");
        assert_eq!(write(&[]).code, Some(0), "{to}: one of ours may be written again");
        fs::write(folder.join(to), "by hand").unwrap();
        let refused = write(&[]);
        assert_eq!(refused.code, Some(1), "{to}: {refused:?}");
        assert!(refused.stderr.contains("claymill did not write it"), "{}", refused.stderr);
        assert_eq!(fs::read_to_string(folder.join(to)).unwrap(), "by hand");
        assert_eq!(write(&["--force"]).code, Some(0), "{to}");
        assert!(fs::metadata(folder.join(to)).unwrap().len() > 7);
    }
    assert!(names(folder).iter().all(|n| !n.starts_with('.')), "{:?}", names(folder));
}

#[test]
#[cfg(unix)]
fn links_lead_on_and_devices_stay() {
    use std::os::unix::fs::FileTypeExt;
    let place = scratch();
    let folder = place.path();
    panel_job(folder);
    let post = |to: &str| run(folder, ["post", "job", "--to", "g1", "-o", to]);
    assert_eq!(post("real.nc").code, Some(0));
    let program = fs::read_to_string(folder.join("real.nc")).unwrap();
    for to in ["-", "/dev/stdout"] {
        let made = post(to);
        assert_eq!(made.code, Some(0), "{made:?}");
        // The program's own name is not the file's.
        assert_eq!(made.stdout.lines().count(), program.lines().count(), "{to}");
        assert!(made.stdout.starts_with("%\n") && made.stdout.ends_with("M30\n%\n"), "{to}");
        let both = run(folder, ["post", "job", "--to", "g1", "-o", to, "--json"]);
        assert_eq!(both.code, Some(2), "{both:?}");
    }
    assert_eq!(post("/dev/null").code, Some(0));
    assert!(fs::metadata("/dev/null").unwrap().file_type().is_char_device());
    let link = folder.join("link.nc");
    fs::create_dir(folder.join("programs")).unwrap();
    std::os::unix::fs::symlink("programs/far.nc", &link).unwrap();
    for _ in 0..2 {
        assert_eq!(post("link.nc").code, Some(0));
    }
    assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
    assert!(folder.join("programs/far.nc").exists());
    // A folder that is a link stays one.
    fs::rename(folder.join("job"), folder.join("programs/job")).unwrap();
    std::os::unix::fs::symlink("programs/job", folder.join("job")).unwrap();
    assert_eq!(plan(folder, "job").code, Some(0));
    assert!(fs::symlink_metadata(folder.join("job")).unwrap().is_symlink());
    assert!(names(folder).iter().all(|n| !n.starts_with('.')), "{:?}", names(folder));
}

/// Starts a plan that takes a while, and waits until it has begun.
fn long_plan(folder: &Path, out: &str) -> std::process::Child {
    let mut command = claymill();
    command.current_dir(folder).args([
        "plan",
        "panel.igs",
        "--tool",
        "ball:10",
        "--scallop",
        "0.005",
        "-o",
        out,
    ]);
    let child = command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
    let partial = folder.join(format!(".{out}.partial"));
    let begun = Instant::now();
    while !partial.exists() {
        assert!(begun.elapsed() < Duration::from_secs(60), "it never began");
        std::thread::sleep(Duration::from_millis(5));
    }
    child
}

#[test]
fn one_run_at_a_time_and_what_the_killed_left_goes() {
    let place = scratch();
    let folder = place.path();
    panel(folder);
    let mut first = long_plan(folder, "job");
    let second = plan(folder, "job");
    assert_eq!(second.code, Some(1), "{second:?}");
    let owner = format!("is being written by another claymill (process {})", first.id());
    assert!(second.stderr.contains(&owner) && second.stderr.contains("help: "), "{}", second.stderr);
    assert!(folder.join(".job.partial").exists() && !folder.join("job").exists());
    first.kill().unwrap();
    first.wait().unwrap();
    assert_eq!(names(folder), [".job.lock", ".job.partial", "panel.answers.json", "panel.igs"]);
    // Whoever writes there next removes it, to the same place or another one.
    let mut other = long_plan(folder, "other");
    assert!(!folder.join(".job.partial").exists());
    other.kill().unwrap();
    other.wait().unwrap();
    let made = plan(folder, "other");
    assert_eq!(made.code, Some(0), "{made:?}");
    assert_eq!(names(folder), ["other", "panel.answers.json", "panel.igs"]);
}

#[test]
fn a_job_finds_its_model_from_anywhere() {
    let place = scratch();
    let folder = place.path().join("work");
    fs::create_dir_all(folder.join("models")).unwrap();
    panel(&folder);
    fs::rename(folder.join("panel.igs"), folder.join("models/panel.igs")).unwrap();
    let job = ["plan", "models/panel.igs", "--tool", "ball:10", "--scallop", "2", "-o", "job"];
    let made = run_without_adapter(&folder, job);
    assert_eq!(made.code, Some(0), "{made:?}");
    let verify = |from: &Path, job: &Path| {
        let verified = run(from, ["verify".as_ref(), job.as_os_str()]);
        assert_eq!(verified.code, Some(0), "{verified:?}");
    };
    let job = folder.join("job");
    verify(Path::new("/"), &job);
    verify(&job, Path::new("."));
    // The folder alone is moved, then all of it together.
    let away = place.path().join("away");
    fs::rename(&job, &away).unwrap();
    verify(Path::new("/"), &away);
    fs::rename(&away, &job).unwrap();
    let renamed = place.path().join("renamed");
    fs::rename(&folder, &renamed).unwrap();
    verify(Path::new("/"), &renamed.join("job"));
    let pictured = run(
        Path::new("/"),
        [
            "render".as_ref(),
            renamed.join("job").as_os_str(),
            "-o".as_ref(),
            renamed.join("x.glb").as_os_str(),
        ],
    );
    assert_eq!(pictured.code, Some(0), "{pictured:?}");
}

#[test]
#[cfg(target_os = "linux")]
fn names_need_not_be_utf_8() {
    use std::ffi::OsStr;
    use std::os::unix::ffi::OsStrExt;
    let place = scratch();
    let folder = place.path();
    panel(folder);
    let odd = |text: &[u8]| OsStr::from_bytes(text).to_owned();
    let (model, job, program) = (odd(b"p\xff.igs"), odd(b"j\xfe"), odd(b"x\xfd.nc"));
    fs::rename(folder.join("panel.igs"), folder.join(&model)).unwrap();
    let go = |words: &[&OsStr]| {
        let made = run(folder, words);
        assert_eq!(made.code, Some(0), "{words:?}: {made:?}");
        made
    };
    let o = OsStr::new;
    go(&[o("plan"), &model, o("--tool"), o("ball:10"), o("--scallop"), o("2"), o("-o"), &job]);
    go(&[o("verify"), &job]);
    go(&[o("post"), &job, o("--to"), o("fanuc"), o("-o"), &program, o("--json")]);
    go(&[o("verify"), &job, o("--program"), &program]);
    go(&[o("render"), &job, o("-o"), &odd(b"m\xfc.glb"), o("--json")]);
    go(&[o("merge"), &model, o("--export"), &odd(b"m\xfb.igs"), o("-o"), &odd(b"merged\xfa")]);
    let there: Vec<PathBuf> = fs::read_dir(folder).unwrap().map(|e| e.unwrap().file_name().into()).collect();
    assert_eq!(there.len(), 8, "{there:?}");
}

#[test]
fn no_library_speaks_where_there_is_no_display() {
    let place = scratch();
    let folder = place.path();
    panel_job(folder);
    for (name, value) in [("", ""), ("XDG_RUNTIME_DIR", ""), ("XDG_RUNTIME_DIR", "nowhere")] {
        let mut command = claymill();
        command.current_dir(folder).env_remove("XDG_RUNTIME_DIR").env_remove("WAYLAND_DISPLAY");
        command.env_remove("NODEVICE_SELECT");
        if !name.is_empty() {
            command.env(name, value);
        }
        let made = command.args(["render", "job", "--size", "320x200", "-o", "x.png"]).output().unwrap();
        let said = String::from_utf8_lossy(&made.stderr);
        assert!(!said.contains("XDG_RUNTIME_DIR"), "{value:?}: {said}");
    }
}
