//! Pictures that cannot be made: a message, an exit code, and nothing left behind.

use std::fs;
use std::path::Path;
use std::process::Output;

use claymill_tests::{Need, leave_out};

use crate::run::claymill;
use crate::scratch;

/// A copy of the small kept job.
fn job(folder: &Path) {
    let kept = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/golden");
    fs::create_dir(folder.join("job")).unwrap();
    for name in ["job.json", "regions.json", "toolpaths.jsonl"] {
        fs::copy(kept.join("job").join(name), folder.join("job").join(name)).unwrap();
    }
    fs::copy(kept.join("little.igs"), folder.join("little.igs")).unwrap();
}

fn run(folder: &Path, line: &[&str], environment: &[(&str, &str)]) -> Output {
    claymill().args(line).current_dir(folder).envs(environment.iter().copied()).output().unwrap()
}

/// What lies in the folder beside the job and its model.
fn left(folder: &Path) -> Vec<String> {
    let names = fs::read_dir(folder).unwrap().map(|e| e.unwrap().file_name().to_string_lossy().into_owned());
    let mut names: Vec<String> = names.filter(|n| n != "job" && n != "little.igs").collect();
    names.sort();
    names
}

#[test]
fn every_reason_has_its_message_and_its_code_and_leaves_nothing() {
    let folder = scratch();
    let folder = folder.path();
    job(folder);
    // The backend of another system: no adapter answers on it.
    let none = [("WGPU_BACKEND", "dx12")];
    let drawn = run(folder, &["render", "job", "-o", "there.png", "--size", "60x40"], &[]);
    if drawn.status.code() != Some(0) {
        let said = String::from_utf8_lossy(&drawn.stderr);
        assert!(said.contains("no graphics adapter"), "{said}");
        return leave_out(Need::Vulkan, said);
    }
    fs::remove_file(folder.join("there.png")).unwrap();
    fs::create_dir(folder.join("taken.png")).unwrap();
    fs::create_dir(folder.join("empty")).unwrap();
    for name in ["job.json", "regions.json"] {
        fs::copy(folder.join("job").join(name), folder.join("empty").join(name)).unwrap();
    }
    fs::write(folder.join("empty/toolpaths.jsonl"), "").unwrap();

    type Case<'a> = (&'a [&'a str], &'a [(&'a str, &'a str)], i32, &'a str);
    let cases: [Case<'_>; 15] = [
        (&["render", "job", "-o", "a.png"], &none, 1, "apt-get install mesa-vulkan-drivers"),
        (
            &["animate", "job", "-o", "a.gif", "--seconds", "1", "--size", "60x40"],
            &none,
            1,
            "no graphics adapter",
        ),
        (&["render", "job", "-o", "a.png", "--size", "1000000x1000000"], &[], 2, "1000000 x 1000000 pixels"),
        (&["render", "job", "-o", "a.png", "--size", "0x10"], &[], 2, "0 x 10 pixels"),
        (&["render", "job", "-o", "a.png", "--size", "8000x8000", "--supersample"], &[], 2, "4096 pixels"),
        (&["render", "job", "-o", "a.png", "--size", "wide"], &[], 2, "--size 1920x1080"),
        (&["animate", "empty", "-o", "a.gif"], &[], 1, "holds no moves"),
        (&["render", "empty", "-o", "a.png", "--show", "tool"], &[], 1, "holds no moves"),
        (&["render", "job", "-o", "none/a.png", "--size", "60x40"], &[], 1, "none/a.png"),
        (&["render", "job", "-o", "taken.png", "--size", "60x40"], &[], 1, "taken.png"),
        (&["render", "little.igs", "-o", "a.png", "--show", "stock"], &[], 2, "stock is a layer of jobs"),
        (&["render", "job", "-o", "a.png", "--at", "noon"], &[], 2, "--at 40%"),
        (&["render", "job", "-o", "a.png", "--at", "999:00:00"], &[], 2, "after the end of the job"),
        (
            &["render", "job", "-o", "a.png", "--show", "tool", "--holder", "2"],
            &[],
            2,
            "leaves nothing of a ball",
        ),
        (&["render", "job", "-o", "a.png", "--focus", "region:77"], &[], 2, "only 4 regions"),
    ];
    for (line, environment, code, says) in cases {
        let refused = run(folder, line, environment);
        let stderr = String::from_utf8_lossy(&refused.stderr);
        assert_eq!(refused.status.code(), Some(code), "{line:?}: {stderr}");
        assert!(stderr.contains(says), "{line:?}: {stderr}");
        assert!(!stderr.contains("panicked"), "{line:?}: {stderr}");
        assert_eq!(left(folder), ["empty", "taken.png"], "{line:?}");
        assert_eq!(fs::read_dir(folder.join("taken.png")).unwrap().count(), 0);
    }
}

#[test]
fn a_job_is_not_worth_less_without_an_adapter() {
    let folder = scratch();
    let folder = folder.path();
    job(folder);
    let line = [
        "plan",
        "little.igs",
        "--up",
        "+z",
        "--length",
        "-x",
        "--tool",
        "ball:5",
        "--scallop",
        "1",
        "-o",
        "out",
    ];
    let made = run(folder, &line, &[("WGPU_BACKEND", "dx12")]);
    let stderr = String::from_utf8_lossy(&made.stderr);
    assert_eq!(made.status.code(), Some(0), "{stderr}");
    assert!(stderr.contains("warning: no pictures"), "{stderr}");
    assert!(folder.join("out/report.html").exists() && !folder.join("out/preview-iso.png").exists());
}
