//! `claymill view` in a real window of an X server that nobody sees, with a real pointer and keys.

use std::f64::consts::{FRAC_PI_2, PI};
use std::io::{BufRead, BufReader, Read};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::Duration;

use claymill_nurbs::analytic::{Frame, plane_patch, sphere};
use claymill_nurbs::{Point3, Vector3};
use claymill_tests::{Need, leave_out, model_of};
use serde_json::Value;

use crate::run::claymill;

const CENTRE: [f64; 3] = [300.0, -120.0, 60.0];
const RADIUS_MM: f64 = 40.0;
/// Longer than anything takes on a busy machine.
const PATIENCE: Duration = Duration::from_secs(60);

/// A ball over the middle of a plate.
fn write_model(path: &Path) {
    let frame = |at: Point3| Frame::new(at, Vector3::z(), Vector3::x()).unwrap();
    let ball = sphere(&frame(CENTRE.into()), RADIUS_MM, (0.0, 2.0 * PI), (-FRAC_PI_2, FRAC_PI_2)).unwrap();
    let foot = Point3::new(CENTRE[0], CENTRE[1], 0.0);
    let plate = plane_patch(&frame(foot), (-100.0, 100.0), (-100.0, 100.0)).unwrap();
    claymill_exchange::write_iges(path, &model_of([ball, plate]), &[]).unwrap();
}

/// An X server of its own; gone when dropped.
struct Screen {
    server: Child,
    display: String,
}

impl Screen {
    /// `None` where a tool is missing: the calling test is left out.
    #[track_caller]
    fn new() -> Option<Self> {
        let missing = |name: &&&str| {
            let tried =
                Command::new(name).arg("-version").stdout(Stdio::null()).stderr(Stdio::null()).status();
            tried.is_err()
        };
        if let Some(name) = ["Xvfb", "xdotool"].iter().find(missing) {
            let packages = "xvfb xdotool libxkbcommon-x11-0 libxcursor1 libxi6";
            leave_out(Need::Xvfb, format_args!("no {name} (apt-get install {packages})"));
            return None;
        }
        let mut server = Command::new("Xvfb")
            .args(["-displayfd", "1", "-screen", "0", "1280x800x24", "-nolisten", "tcp"])
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        let mut number = String::new();
        BufReader::new(server.stdout.take().unwrap()).read_line(&mut number).unwrap();
        Some(Screen { server, display: format!(":{}", number.trim()) })
    }

    fn hand(&self, what: &[&str]) {
        let done = Command::new("xdotool").args(what).env("DISPLAY", &self.display).status().unwrap();
        assert!(done.success(), "xdotool {what:?}");
    }
}

impl Drop for Screen {
    fn drop(&mut self) {
        let _ = self.server.kill();
        let _ = self.server.wait();
    }
}

/// A window; closed when dropped.
struct Window(Child);

impl Drop for Window {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// Lines of a program as they come.
fn lines(from: impl Read + Send + 'static) -> Receiver<String> {
    let (sender, receiver) = channel();
    std::thread::spawn(move || {
        for line in BufReader::new(from).lines().map_while(Result::ok) {
            if sender.send(line).is_err() {
                return;
            }
        }
    });
    receiver
}

fn vector(v: &Value) -> Vector3 {
    Vector3::from([0, 1, 2].map(|i| v[i].as_f64().expect("a number")))
}

#[test]
fn a_hand_on_a_real_window_picks_the_exact_surface() {
    let Some(screen) = Screen::new() else { return };
    let folder = crate::scratch();
    let model = folder.path().join("ball.igs");
    write_model(&model);
    let started = claymill()
        .args(["view", "--json", "--size", "1100x700", "--up", "+z", "--length", "-y"])
        .arg(&model)
        .env("DISPLAY", &screen.display)
        .env_remove("WAYLAND_DISPLAY")
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn();
    let mut window = Window(started.unwrap());
    let said = lines(window.0.stdout.take().unwrap());
    let Ok(opened) = said.recv_timeout(PATIENCE) else {
        let _ = window.0.kill();
        let mut why = String::new();
        window.0.stderr.take().unwrap().read_to_string(&mut why).unwrap();
        assert!(why.contains("no graphics adapter") || why.contains("no window can be opened"), "{why}");
        let need = if why.contains("no graphics adapter") { Need::Vulkan } else { Need::Xvfb };
        return leave_out(need, why);
    };
    let opened: Value = serde_json::from_str(&opened).unwrap();
    let [x, y, width, height] =
        [0, 1, 2, 3].map(|i| opened["window"]["picture_px"][i].as_f64().expect("a picture"));
    let middle = [x + 0.5 * width, y + 0.5 * height];
    let go = |at: [f64; 2]| {
        let [x, y] = at.map(|c| c.round().to_string());
        screen.hand(&["mousemove", &x, &y]);
    };
    // Without a window manager keys go where the focus is put by hand.
    screen.hand(&["search", "--sync", "--name", "ball.igs", "windowfocus", "--sync"]);
    go(middle);
    screen.hand(&["key", "t"]);
    let mut scale = None;
    for off in [[0.0, 0.0], [37.0, -21.0], [-60.0, 44.0], [0.0, 120.0]] {
        std::thread::sleep(Duration::from_millis(700));
        let at = [0, 1].map(|i| (middle[i] + off[i]).round());
        go(at);
        screen.hand(&["click", "1"]);
        let line = said.recv_timeout(PATIENCE).expect("the click is answered");
        let said: Value = serde_json::from_str(&line).unwrap();
        let place = [0, 1].map(|i| said["at_px"][i].as_f64().unwrap());
        assert!((place[0] - (at[0] - x)).abs() < 1.0 && (place[1] - (at[1] - y)).abs() < 1.0, "{line}");
        // From above, and the line of sight meets ball or plate just there.
        let (from, along) = (vector(&said["sight"]["from_mm"]), vector(&said["sight"]["along"]));
        assert!((along + Vector3::z()).norm() < 1e-12, "{line}");
        let centre = Vector3::from(CENTRE);
        let off_axis = (from - centre).xy().norm();
        let expected_z = if off_axis < RADIUS_MM {
            CENTRE[2] + (RADIUS_MM * RADIUS_MM - off_axis * off_axis).sqrt()
        } else {
            0.0
        };
        let surface = &said["picked"]["surface"];
        let found = vector(&surface["point_mm"]);
        assert!((found - Vector3::new(from.x, from.y, expected_z)).norm() < 1e-6, "{line}");
        assert_eq!(surface["face"].as_u64(), Some(u64::from(off_axis >= RADIUS_MM)), "{line}");
        // The middle of the picture is the middle of the model, and pixels are evenly wide.
        match (off, scale) {
            ([0.0, 0.0], _) => assert!((found - centre).xy().norm() < 1.0, "{line}"),
            (_, None) => scale = Some(off_axis / off[0].hypot(off[1])),
            (_, Some(scale)) => {
                assert!((off_axis / off[0].hypot(off[1]) - scale).abs() < 0.03 * scale, "{line}")
            }
        }
    }
    screen.hand(&["key", "ctrl+q"]);
    let code = window.0.wait().unwrap();
    assert!(code.success(), "{code}");
}

#[test]
fn without_a_display_the_command_says_so_and_fails() {
    let folder = crate::scratch();
    let model = folder.path().join("ball.igs");
    write_model(&model);
    let tried = claymill()
        .arg("view")
        .arg(&model)
        .env_remove("DISPLAY")
        .env_remove("WAYLAND_DISPLAY")
        .env_remove("WAYLAND_SOCKET")
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&tried.stderr);
    assert_eq!(tried.status.code(), Some(1), "{said}");
    assert!(said.contains("no window can be opened") && said.contains("claymill render"), "{said}");
}

#[test]
fn a_job_without_moves_is_shown_as_a_model_and_a_broken_one_is_refused() {
    let folder = crate::scratch();
    let panel = crate::run::panel(folder.path());
    let job = folder.path().join("job");
    let mut plan = claymill();
    plan.arg("plan").arg(&panel).arg("-o").arg(&job).args(["--tool", "ball:20", "--scallop", "1"]);
    // Its pictures are not looked at.
    plan.env("WGPU_ADAPTER_NAME", "none");
    let planned: crate::run::Run = plan.output().unwrap().into();
    assert_eq!(planned.code, Some(0), "{planned:?}");
    let view = || {
        let picture = folder.path().join("window.png");
        crate::run::run(
            folder.path(),
            [
                "view".as_ref(),
                job.as_os_str(),
                "--picture".as_ref(),
                picture.as_os_str(),
                "--size".as_ref(),
                "800x500".as_ref(),
                "--json".as_ref(),
            ],
        )
    };
    let seen = view();
    if seen.stderr.contains("no graphics adapter was found") {
        return leave_out(Need::Vulkan, seen.stderr);
    }
    assert_eq!(seen.code, Some(0), "{seen:?}");
    assert!(seen.json()["segments"].as_u64() > Some(0), "{seen:?}");
    std::fs::write(job.join("toolpaths.jsonl"), "").unwrap();
    let seen = view();
    assert_eq!(seen.code, Some(0), "{seen:?}");
    assert!(seen.stderr.contains("holds no moves") && seen.json()["segments"] == 0, "{seen:?}");
    std::fs::write(job.join("toolpaths.jsonl"), "{}").unwrap();
    let seen = view();
    assert_eq!(seen.code, Some(1), "{seen:?}");
    assert!(seen.stderr.contains("toolpaths.jsonl"), "{seen:?}");
}

#[test]
fn a_picture_of_the_window_needs_no_display() {
    let folder = crate::scratch();
    let (model, picture) = (folder.path().join("ball.igs"), folder.path().join("window.png"));
    write_model(&model);
    let run = |adapter: &str| {
        let mut command = claymill();
        command.args(["view", "--size", "900x600", "--picture"]).arg(&picture).arg(&model);
        command.env_remove("DISPLAY").env("WGPU_ADAPTER_NAME", adapter).output().unwrap()
    };
    let tried = run("no such adapter");
    let said = String::from_utf8_lossy(&tried.stderr);
    assert_eq!(tried.status.code(), Some(1), "{said}");
    assert!(said.contains("no graphics adapter was found") && !picture.exists(), "{said}");
    let tried = run("");
    let said = String::from_utf8_lossy(&tried.stderr);
    if said.contains("no graphics adapter was found") {
        return leave_out(Need::Vulkan, said);
    }
    assert!(tried.status.success(), "{said}");
    let mut reader =
        png::Decoder::new(BufReader::new(std::fs::File::open(&picture).unwrap())).read_info().unwrap();
    let mut rgb = vec![0; reader.output_buffer_size().unwrap()];
    let info = reader.next_frame(&mut rgb).unwrap();
    assert_eq!((info.width, info.height), (900, 600));
    // Panels on both sides are of one colour, the ball in the middle is none of the backdrop's.
    let pixel = |x: usize, y: usize| [0, 1, 2].map(|c| rgb[3 * (y * 900 + x) + c]);
    assert_eq!(pixel(230, 580), pixel(890, 580));
    let spread = |c: [u8; 3]| c.iter().max().unwrap() - c.iter().min().unwrap();
    assert!(spread(pixel(422, 280)) > 25, "{:?}", pixel(422, 280));
}
