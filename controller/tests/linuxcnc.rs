//! Programs on a real control: LinuxCNC 2.9, headless. Skipped, visibly, where it is not installed
//! (`apt-get install linuxcnc-uspace`).

mod job;

use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use claymill_controller::{Arc, Dialect, Machine, MachineJob, Plane, Shape, post};
use claymill_nurbs::{Curve3, Point3};
use claymill_toolpath::MoveKind;

const INI: &str = include_str!("linuxcnc_sim/geometry.ini");
const HAL: &str = include_str!("linuxcnc_sim/geometry.hal");
const RUNNER: &str = include_str!("linuxcnc_sim/run.py");
const TOOLS: &str = "T1 P1 Z0 D12 ;ball\n";
/// What the control may add to its path tolerance, mm.
const BAR_MM: f64 = 0.01;

fn installed(program: &str) -> bool {
    let found = Command::new("which").arg(program).stdout(Stdio::null()).status().is_ok_and(|s| s.success());
    if !found {
        eprintln!("skipped: {program} is not installed (Debian package linuxcnc-uspace)");
    }
    found
}

fn program(folder: &Path, machine: &Machine) -> (MachineJob, std::path::PathBuf) {
    let top: Vec<_> = job::curves().into_iter().filter(|(setup, _)| *setup == "top").collect();
    let job = job::job(&top, machine);
    let out = folder.join("part.ngc");
    post(&job, Dialect::LinuxCnc29, machine, &out, &|_| ()).unwrap();
    (job, out)
}

#[test]
fn the_interpreter_takes_every_program() {
    if !installed("rs274") {
        return;
    }
    for machine in [Machine::default(), Machine { arcs: false, nurbs: false, ..Machine::default() }] {
        let folder = tempfile::tempdir().unwrap();
        let (_, out) = program(folder.path(), &machine);
        fs::write(folder.path().join("tool.tbl"), TOOLS).unwrap();
        fs::write(folder.path().join("sim.var"), "").unwrap();
        let mut rs274 = Command::new("rs274");
        rs274.current_dir(folder.path()).args(["-g", "-t", "tool.tbl", "-v", "sim.var"]).arg(&out);
        let run = rs274.output().unwrap();
        let said = String::from_utf8_lossy(&run.stdout).into_owned() + &String::from_utf8_lossy(&run.stderr);
        assert!(run.status.success() && said.contains("PROGRAM_END"), "{said}");
        assert_eq!(machine.nurbs, said.contains("NURBS_FEED"), "{said}");
        // What is wrong for us is wrong for the control too.
        let bad = fs::read_to_string(&out).unwrap().replace("G5.3", "G5.3 X1.").replace("G1 ", "G1 R1. ");
        let path = folder.path().join("bad.ngc");
        fs::write(&path, bad).unwrap();
        let mut rs274 = Command::new("rs274");
        rs274.current_dir(folder.path()).args(["-g", "-t", "tool.tbl", "-v", "sim.var"]).arg(&path);
        assert!(!rs274.output().unwrap().status.success());
    }
}

/// Shapes of a motion log, one for each SET_LINE and SET_CIRCLE.
fn logged(text: &str) -> Vec<Shape> {
    let value = |line: &str, key: &str| -> f64 {
        let rest = &line[line.find(key).unwrap_or_else(|| panic!("{key} in {line}")) + key.len()..];
        let end = rest.find([',', ' ', '\n']).unwrap_or(rest.len());
        rest[..end].parse().unwrap_or_else(|e| panic!("{e}: {line}"))
    };
    let point = |line: &str| Point3::new(value(line, "x="), value(line, "y="), value(line, "z="));
    let mut shapes = Vec::new();
    let mut last: Option<Point3> = None;
    let lines: Vec<&str> = text.lines().collect();
    for (i, line) in lines.iter().enumerate() {
        let circle = line.starts_with("SET_CIRCLE");
        if !circle && !line.starts_with("SET_LINE") {
            continue;
        }
        let at = if line.contains("x=") { i } else { i + 1 };
        let to = point(lines[at]);
        if let Some(from) = last {
            shapes.push(if circle {
                let normal = point(lines[at + 2]);
                let plane = [Plane::Yz, Plane::Zx, Plane::Xy][normal.coords.iamax()];
                // A negative number of turns, or a negative normal, is clockwise.
                let along: f64 = normal.coords.sum();
                let clockwise = (value(lines[at + 3], "turn=") < 0.0) != (along < 0.0);
                let arc = Arc::through(from, to, point(lines[at + 1]), plane, clockwise);
                arc.map_or(Shape::Line { from, to }, Shape::Arc)
            } else {
                Shape::Line { from, to }
            });
        }
        last = Some(to);
    }
    shapes
}

/// Distance of a point from a curve, by many samples and the chords between them.
fn distance(curve: &[Point3], p: &Point3) -> f64 {
    let chord = |w: &[Point3]| {
        let d = w[1] - w[0];
        let s = ((p - w[0]).dot(&d) / d.norm_squared().max(1e-300)).clamp(0.0, 1.0);
        (p - (w[0] + d * s)).norm()
    };
    curve.windows(2).map(chord).fold(f64::INFINITY, f64::min)
}

fn samples(curve: &Curve3) -> Vec<Point3> {
    let (a, b) = curve.domain();
    (0..=4000).map(|i| curve.point(a + (b - a) * f64::from(i) / 4000.0)).collect()
}

#[test]
fn the_motion_log_runs_along_the_curves() {
    if !installed("linuxcnc") {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let machine = Machine::default();
    let (job, out) = program(folder.path(), &machine);
    let at = |name: &str| folder.path().join(name);
    fs::write(at("geometry.ini"), INI).unwrap();
    fs::write(at("geometry.hal"), HAL).unwrap();
    fs::write(at("run.py"), RUNNER).unwrap();
    fs::write(at("tool.tbl"), TOOLS).unwrap();
    fs::write(at("sim.var"), "").unwrap();
    fs::set_permissions(at("run.py"), fs::Permissions::from_mode(0o755)).unwrap();
    // The control's real-time part runs under another user.
    fs::set_permissions(folder.path(), fs::Permissions::from_mode(0o777)).unwrap();
    let mut linuxcnc = Command::new("linuxcnc");
    linuxcnc.current_dir(folder.path()).args(["-r", "geometry.ini"]);
    linuxcnc.env("NGC", &out).env("RTAPI_UID", "65534").env("RTAPI_FIFO_PATH", at("fifo"));
    let log = fs::File::create(at("said.txt")).unwrap();
    let mut control = linuxcnc.stdout(log.try_clone().unwrap()).stderr(log).spawn().unwrap();
    let begun = Instant::now();
    while control.try_wait().unwrap().is_none() {
        assert!(
            begun.elapsed() < Duration::from_secs(120),
            "{}",
            fs::read_to_string(at("said.txt")).unwrap()
        );
        std::thread::sleep(Duration::from_millis(100));
    }
    let said = fs::read_to_string(at("said.txt")).unwrap();
    assert!(said.contains("done ok"), "{said}");
    let shapes = logged(&fs::read_to_string(at("motion.log")).unwrap());
    assert!(shapes.len() > 100, "{} moves\n{said}", shapes.len());

    let strokes: Vec<_> = job.sections.iter().flat_map(|s| &s.strokes).collect();
    let mut next = 0;
    let mut worst: f64 = 0.0;
    for stroke in strokes.iter().filter(|s| s.kind == MoveKind::Cut) {
        let (start, end) = (stroke.curve.start(), stroke.curve.end());
        let near = |p: &Point3, q: &Point3| (p - q).norm() < 2e-3;
        let first =
            next + shapes[next..].iter().position(|s| near(&s.start(), &start)).expect("the pass begins");
        let count = shapes[first..].iter().position(|s| near(&s.end(), &end)).expect("the pass ends");
        next = first + count + 1;
        let curve = samples(&stroke.curve);
        let mut far: f64 = 0.0;
        let mut length = 0.0;
        for shape in &shapes[first..next] {
            shape.visit(|p| far = far.max(distance(&curve, &p)));
            length += shape.length_mm();
        }
        let whole: f64 = curve.windows(2).map(|w| (w[1] - w[0]).norm()).sum();
        assert!((length - whole).abs() < 1e-3 * whole + 0.01, "move {}: {length} of {whole} mm", stroke.seq);
        eprintln!("move {}: {} log entries, {far:.6} mm from the curve", stroke.seq, next - first);
        worst = worst.max(far);
    }
    eprintln!("LinuxCNC's motion log is within {worst:.6} mm of the curves");
    assert!(worst <= BAR_MM + machine.tolerance_mm, "{worst}");
}
