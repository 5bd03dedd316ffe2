//! Programs on a real control: LinuxCNC 2.9, headless. Left out where it is not installed
//! (`apt-get install linuxcnc-uspace`).

use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use claymill_controller::{Dialect, Machine, MachineJob, post};
use claymill_nurbs::{Curve3, Point3};
use claymill_tests::{Need, is_installed, leave_out};
use claymill_toolpath::MoveKind;

use crate::{alone, job};

pub(crate) const INI: &str = include_str!("../linuxcnc_sim/machine.ini");
pub(crate) const HAL: &str = include_str!("../linuxcnc_sim/machine.hal");
const RUNNER: &str = include_str!("../linuxcnc_sim/run.py");
const TOOLS: &str = "T1 P1 Z0 D12 ;ball\n";
/// What the control may add to its path tolerance, mm.
pub(crate) const BAR_MM: f64 = 0.01;

#[track_caller]
pub(crate) fn installed(program: &str) -> bool {
    is_installed(Need::LinuxCnc, program, "linuxcnc-uspace")
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

/// The whole program of the job in `$CLAYMILL_JOB`, if there is one.
#[test]
fn the_interpreter_takes_a_whole_job() {
    let Ok(folder) = std::env::var("CLAYMILL_JOB") else {
        return leave_out(Need::Job, "CLAYMILL_JOB names no job folder");
    };
    if !installed("rs274") {
        return;
    }
    let _alone = alone();
    let machine = Machine::default();
    let job = MachineJob::read(Path::new(&folder), &machine).unwrap();
    let place = tempfile::tempdir().unwrap();
    let out = place.path().join("job.ngc");
    let totals = post(&job, Dialect::LinuxCnc29, &machine, &out, &|_| ()).unwrap();
    fs::write(place.path().join("tool.tbl"), TOOLS).unwrap();
    fs::write(place.path().join("sim.var"), "").unwrap();
    let mut rs274 = Command::new("rs274");
    rs274
        .current_dir(place.path())
        .args(["-g", "-t", "tool.tbl", "-v", "sim.var"])
        .arg(&out)
        .stdout(Stdio::null());
    let run = rs274.output().unwrap();
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    eprintln!("{} lines, {} moves: taken", totals.files[0].lines, totals.read_back.moves);
}

/// Distance of a point from a curve, by many samples and the chords between them; `None` beyond its ends,
/// where the tool is on a lead.
pub(crate) fn distance(curve: &[Point3], p: &Point3) -> Option<f64> {
    let mut nearest = (f64::INFINITY, false);
    let last = curve.len() - 2;
    for (i, w) in curve.windows(2).enumerate() {
        let d = w[1] - w[0];
        let s = (p - w[0]).dot(&d) / d.norm_squared().max(1e-300);
        let far = (p - (w[0] + d * s.clamp(0.0, 1.0))).norm();
        if far < nearest.0 {
            nearest = (far, (i == 0 && s <= 0.0) || (i == last && s >= 1.0));
        }
    }
    (!nearest.1).then_some(nearest.0)
}

pub(crate) fn samples(curve: &Curve3) -> Vec<Point3> {
    let (a, b) = curve.domain();
    (0..=4000).map(|i| curve.point(a + (b - a) * f64::from(i) / 4000.0)).collect()
}

/// Runs a program on the control, with its own kinematics, and returns the samples that it wrote and what it said: line, X, Y,
/// Z, A and the tool's length.
pub(crate) fn executed(
    folder: &Path,
    out: &Path,
    ini: &str,
    hal: &str,
    tools: &str,
) -> (Vec<[f64; 6]>, String) {
    let at = |name: &str| folder.join(name);
    fs::write(at("machine.ini"), ini).unwrap();
    fs::write(at("machine.hal"), hal).unwrap();
    fs::write(at("run.py"), RUNNER).unwrap();
    fs::write(at("tool.tbl"), tools).unwrap();
    fs::write(at("sim.var"), "").unwrap();
    fs::set_permissions(at("run.py"), fs::Permissions::from_mode(0o755)).unwrap();
    // The control's real-time part runs under another user.
    fs::set_permissions(folder, fs::Permissions::from_mode(0o777)).unwrap();
    let mut linuxcnc = Command::new("linuxcnc");
    linuxcnc.current_dir(folder).args(["-r", "machine.ini"]);
    linuxcnc.env("NGC", out).env("RTAPI_UID", "65534").env("RTAPI_FIFO_PATH", at("fifo"));
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
    let trace = fs::read_to_string(at("trace.txt")).unwrap();
    let numbers = |line: &str| -> Vec<f64> { line.split(' ').map(|n| n.parse().unwrap()).collect() };
    (trace.lines().map(|line| numbers(line).try_into().unwrap()).collect(), said)
}

/// The move that each line of a program belongs to, by the comments between them; none where it is on its way.
pub(crate) fn moves_of_lines(out: &Path) -> Vec<Option<u64>> {
    let text = fs::read_to_string(out).unwrap();
    let mut line_of_move = Vec::new();
    let (mut current, mut first) = (None, false);
    // Only the first block of a move has a feed.
    for line in text.lines() {
        if let Some(rest) = line.strip_prefix("(move ") {
            current = rest.split(' ').next().and_then(|n| n.parse::<u64>().ok());
            first = true;
        } else if line.starts_with("G0") || line.contains(" F") && !std::mem::take(&mut first) {
            current = None;
        }
        line_of_move.push(current);
    }
    line_of_move
}

#[test]
fn executed_positions_are_on_the_curves() {
    let _alone = alone();
    if !installed("linuxcnc") {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let machine = Machine::default();
    let (job, out) = program(folder.path(), &machine);
    let (trace, said) = executed(folder.path(), &out, INI, HAL, TOOLS);
    let line_of_move = moves_of_lines(&out);
    let cuts: Vec<_> = (job.sections.iter().flat_map(|s| &s.strokes))
        .filter(|s| s.kind == MoveKind::Cut)
        .map(|s| (s.seq, samples(&s.curve)))
        .collect();
    let mut worst = vec![(0, 0.0f64, Point3::origin()); cuts.len()];
    for numbers in trace {
        let line = numbers[0] as usize;
        let Some(Some(seq)) = line.checked_sub(1).and_then(|l| line_of_move.get(l)) else { continue };
        let Some(i) = cuts.iter().position(|(s, _)| s == seq) else { continue };
        let p = Point3::new(numbers[1], numbers[2], numbers[3]);
        // The next pass is announced while the tool still comes down onto its start.
        let leads = [cuts[i].1[0], cuts[i].1[cuts[i].1.len() - 1]];
        if leads.iter().any(|end| (p - end).xy().norm() < 2e-3 && p.z > end.z) {
            continue;
        }
        let Some(far) = distance(&cuts[i].1, &p) else { continue };
        let (count, largest, place) = worst[i];
        worst[i] = (count + 1, largest.max(far), if far > largest { p } else { place });
    }
    for ((seq, _), (count, far, place)) in cuts.iter().zip(&worst) {
        eprintln!("move {seq}: {count} samples, {far:.6} mm from the curve at {place:?}");
    }
    for ((seq, _), (count, far, _)) in cuts.iter().zip(&worst) {
        assert!(*count >= 5, "move {seq} was hardly seen:\n{said}");
        assert!(*far <= BAR_MM + machine.tolerance_mm + machine.blend_mm, "move {seq}: {far} mm");
    }
}
