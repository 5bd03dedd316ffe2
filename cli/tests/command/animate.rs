//! The job in time.

use std::fs;
use std::time::{Duration, Instant};

use claymill_tests::{Need, leave_out};
use claymill_toolpath::read_job;

use crate::run::{claymill, run};
use crate::scratch;
use crate::whole_job::planned;

fn animate(out: &str, more: &[&str]) -> crate::run::Run {
    let line = ["animate", "lace", "--size", "160x90", "--json", "-o", out];
    run(planned(), line.iter().chain(more))
}

#[test]
fn an_animation_takes_the_time_of_the_job_and_shows_more_and_more_of_it() {
    let folder = scratch();
    let file = folder.path().join("panel.png");
    let made = animate(&file.to_string_lossy(), &["--seconds", "2", "--fps", "4"]);
    if made.stderr.contains("no graphics adapter") {
        return leave_out(Need::Vulkan, "no graphics adapter");
    }
    assert_eq!(made.code, Some(0), "{made:?}");
    let told = made.json();
    assert_eq!(told["frames"], 8);
    // The planner's account, and the same kinematics over what it wrote.
    let planned_s = read_job(&planned().join("lace")).unwrap().totals.time_s;
    let took_s = told["machining_s"].as_f64().unwrap();
    assert!((took_s - planned_s).abs() < 1e-3 * planned_s, "{took_s} s, planned {planned_s} s");

    let bytes = fs::read(&file).unwrap();
    let mut reader = png::Decoder::new(std::io::Cursor::new(&bytes)).read_info().unwrap();
    assert_eq!(reader.info().animation_control().unwrap().num_frames, 8);
    let mut buffer = vec![0; reader.output_buffer_size().unwrap()];
    let mut changed = 0;
    for k in 0..8 {
        reader.next_frame(&mut buffer).unwrap();
        let part = *reader.info().frame_control().unwrap();
        changed += u32::from(k > 0 && part.width > 3 && part.height > 3);
    }
    assert_eq!(changed, 7, "the tool moves in every frame");
}

#[test]
fn storyboards_and_gifs_are_pictures_too_and_what_cannot_be_made_is_refused() {
    let folder = scratch();
    let path = |name: &str| folder.path().join(name).to_string_lossy().into_owned();
    let sheet = animate(&path("sheet.png"), &["--storyboard"]);
    if sheet.stderr.contains("no graphics adapter") {
        return leave_out(Need::Vulkan, "no graphics adapter");
    }
    assert_eq!(sheet.code, Some(0), "{sheet:?}");
    let bytes = fs::read(path("sheet.png")).unwrap();
    let side = |at: usize| u32::from_be_bytes(bytes[at..at + 4].try_into().unwrap());
    assert_eq!((side(16), side(20)), (3 * 166 + 6, 4 * 96 + 6));
    let near = ["--seconds", "1", "--fps", "3", "--follow", "60", "--view", "top"];
    assert_eq!(animate(&path("near.gif"), &near).code, Some(0));
    assert_eq!(&fs::read(path("near.gif")).unwrap()[..6], b"GIF89a");

    for (out, more, code, says) in [
        ("a.avi", &[][..], 2, ".mp4 or .webm"),
        ("a.gif", &["--storyboard"], 2, "one picture"),
        ("a.gif", &["--fps", "0"], 2, "no animation"),
        ("a.gif", &["--follow=-3"], 2, "--follow 300"),
        ("none/a.gif", &["--seconds", "0.2"], 1, "a.gif"),
    ] {
        let refused = animate(&path(out), more);
        assert_eq!(refused.code, Some(code), "{out} {more:?}: {refused:?}");
        assert!(refused.stderr.contains(says), "{refused:?}");
    }
    let alone = claymill()
        .args(["animate", "lace", "-o", &path("a.mp4")])
        .current_dir(planned())
        .env("PATH", folder.path())
        .output()
        .unwrap();
    assert_eq!(alone.status.code(), Some(1));
    assert!(String::from_utf8_lossy(&alone.stderr).contains("there is no ffmpeg"));
    let mut left: Vec<_> = fs::read_dir(folder.path()).unwrap().map(|e| e.unwrap().file_name()).collect();
    left.sort();
    assert_eq!(left, ["near.gif", "sheet.png"]);
}

#[test]
fn an_interrupted_video_leaves_nothing_however_late_the_encoder_opens_its_file() {
    let folder = scratch();
    let folder = folder.path();
    // It reads everything, and is as late as it can be.
    let late = "#!/bin/sh\n[ \"$1\" = -version ] && exit 0\ntrap '' INT\nexec 2> /dev/null\necho > \"${0%/*}/begun\"\nfor last; do :; done\ncat > /dev/null\nsleep 0.5\necho late > \"$last\"\necho $? > \"${0%/*}/opened\"\n";
    let bin = folder.join("bin");
    fs::create_dir(&bin).unwrap();
    fake_ffmpeg(&bin, "");
    fs::write(bin.join("ffmpeg"), late).unwrap();
    let path = std::env::join_paths(
        [bin.clone()].into_iter().chain(std::env::split_paths(&std::env::var_os("PATH").unwrap())),
    )
    .unwrap();
    let line = ["animate", "lace", "--size", "100x60", "--seconds", "1", "--fps", "5", "-o"];
    let mut run = claymill()
        .args(line)
        .arg(folder.join("job.mp4"))
        .current_dir(planned())
        .env("PATH", &path)
        .spawn()
        .unwrap();
    let names = || -> Vec<String> {
        let entries = fs::read_dir(folder).unwrap();
        entries.map(|e| e.unwrap().file_name().to_string_lossy().into_owned()).collect()
    };
    let until = Instant::now() + Duration::from_secs(60);
    while !bin.join("begun").exists() {
        if run.try_wait().unwrap().is_some() {
            return leave_out(Need::Vulkan, "no graphics adapter");
        }
        assert!(Instant::now() < until, "the encoder never begins");
        std::thread::sleep(Duration::from_millis(2));
    }
    let killed = std::process::Command::new("kill").args(["-INT", &run.id().to_string()]).status().unwrap();
    assert!(killed.success());
    assert_eq!(run.wait().unwrap().code(), Some(130));
    while !bin.join("opened").exists() {
        assert!(Instant::now() < until, "the encoder never ends");
        std::thread::sleep(Duration::from_millis(20));
    }
    assert_ne!(fs::read_to_string(bin.join("opened")).unwrap().trim(), "0");
    assert_eq!(names(), ["bin"]);
}

/// A program in place of ffmpeg that keeps what it is told and what it is sent.
fn fake_ffmpeg(folder: &std::path::Path, ends: &str) {
    use std::os::unix::fs::PermissionsExt;
    let script = format!(
        "#!/bin/sh\n[ \"$1\" = -version ] && exit 0\ncd '{}'\necho \"$@\" > told\ncat > sent\nfor last; do :; done\n{ends}\n",
        folder.display()
    );
    let file = folder.join("ffmpeg");
    fs::write(&file, script).unwrap();
    fs::set_permissions(&file, fs::Permissions::from_mode(0o755)).unwrap();
}

#[test]
fn an_encoder_gets_every_frame_and_its_failure_leaves_no_file() {
    let folder = scratch();
    let folder = folder.path();
    fake_ffmpeg(folder, "echo video > \"$last\"");
    let path = std::env::join_paths(
        std::iter::once(folder.to_owned()).chain(std::env::split_paths(&std::env::var_os("PATH").unwrap())),
    )
    .unwrap();
    let out = folder.join("job.webm");
    let video = || {
        let line = ["animate", "lace", "--size", "100x60", "--seconds", "1", "--fps", "5", "-o"];
        claymill().args(line).arg(&out).current_dir(planned()).env("PATH", &path).output().unwrap()
    };
    let made = video();
    let stderr = String::from_utf8_lossy(&made.stderr);
    if stderr.contains("no graphics adapter") {
        return leave_out(Need::Vulkan, "no graphics adapter");
    }
    assert_eq!(made.status.code(), Some(0), "{stderr}");
    assert_eq!(fs::read_to_string(&out).unwrap(), "video\n");
    let told = fs::read_to_string(folder.join("told")).unwrap();
    for says in [
        "-f rawvideo",
        "-pixel_format rgb24",
        "-video_size 100x60",
        "-framerate 5",
        "yuv420p",
        "bt709",
        ".webm",
    ] {
        assert!(told.contains(says), "{told}");
    }
    let sent = fs::read(folder.join("sent")).unwrap();
    let frame = 3 * 100 * 60;
    assert_eq!(sent.len(), 5 * frame);
    let frames: Vec<&[u8]> = sent.chunks(frame).collect();
    for (k, pair) in frames.windows(2).enumerate() {
        let changed = pair[0].iter().zip(pair[1]).filter(|(a, b)| a != b).count();
        assert!((100..frame / 2).contains(&changed), "frame {k}: {changed} bytes");
    }
    // Rows are where they belong: the light backdrop above is bluer than below.
    assert!(frames[0][2] > frames[0][0] && frames[0][frame - 1] <= frames[0][frame - 3]);

    fs::remove_file(&out).unwrap();
    fake_ffmpeg(folder, "echo half > \"$last\"; echo 'no such codec' >&2; exit 3");
    let refused = video();
    assert_eq!(refused.status.code(), Some(1));
    assert!(String::from_utf8_lossy(&refused.stderr).contains("no such codec"));

    // One that takes nothing and talks a lot, longer than a pipe holds.
    fake_ffmpeg(folder, "");
    let script =
        "#!/bin/sh\n[ \"$1\" = -version ] && exit 0\nhead -c 300000 /dev/zero | tr '\\0' x >&2\nexit 1\n";
    fs::write(folder.join("ffmpeg"), script).unwrap();
    let refused = video();
    assert_eq!(refused.status.code(), Some(1));
    assert!(String::from_utf8_lossy(&refused.stderr).contains("ffmpeg could not write"));
    let mut left: Vec<_> = fs::read_dir(folder).unwrap().map(|e| e.unwrap().file_name()).collect();
    left.sort();
    assert_eq!(left, ["ffmpeg", "sent", "told"]);
}
