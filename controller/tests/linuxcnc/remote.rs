//! LinuxCNC over its own remote protocol: curves and straight moves, as a file and block by block into the running
//! control, beside the time that the virtual control says. Left out where it is not installed. `CLAYMILL_JOB`
//! names the folder of a job of one setup to be run in place of one pass.

use std::fs;
use std::io::Write;
use std::net::TcpStream;
use std::os::unix::fs::PermissionsExt;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use claymill_controller::{
    Dialect, Dynamics, Feed, Machine, MachineJob, Remote, Route, blocks_of, post, retreat_of, simulate,
};
use claymill_nurbs::{Curve3, Point3};
use claymill_tests::{Need, is_installed};
use claymill_toolpath::{Move, MoveKind, Program};

use crate::{alone, job};

const INI: &str = include_str!("../linuxcnc_sim/machine.ini");
const HAL: &str = include_str!("../linuxcnc_sim/machine.hal");

/// A control that listens; it is shut down at the end.
struct Control(Child);

impl Drop for Control {
    fn drop(&mut self) {
        if let Ok(mut stream) = TcpStream::connect("127.0.0.1:5007") {
            let _ = stream.write_all(b"hello EMC claymill 1.0\r\nset enable EMCTOO\r\nshutdown\r\n");
        }
        let begun = Instant::now();
        while self.0.try_wait().is_ok_and(|s| s.is_none()) && begun.elapsed() < Duration::from_secs(20) {
            std::thread::sleep(Duration::from_millis(50));
        }
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

fn control(folder: &Path) -> Control {
    let ini = INI.replace("./run.py", "linuxcncrsh -n claymill");
    fs::write(folder.join("machine.ini"), ini).unwrap();
    fs::write(folder.join("machine.hal"), HAL).unwrap();
    fs::write(folder.join("tool.tbl"), "T1 P1 Z0 D12 ;ball\n").unwrap();
    fs::write(folder.join("sim.var"), "").unwrap();
    fs::set_permissions(folder, fs::Permissions::from_mode(0o777)).unwrap();
    let log = fs::File::create(folder.join("said.txt")).unwrap();
    let mut linuxcnc = Command::new("linuxcnc");
    linuxcnc.current_dir(folder).args(["-r", "machine.ini"]).stdin(Stdio::null());
    linuxcnc.env("RTAPI_UID", "65534").env("RTAPI_FIFO_PATH", folder.join("fifo"));
    Control(linuxcnc.stdout(log.try_clone().unwrap()).stderr(log).spawn().unwrap())
}

#[test]
fn curves_and_straight_moves_arrive() {
    if !is_installed(Need::LinuxCnc, "linuxcncrsh", "linuxcnc-uspace") {
        return;
    }
    let _alone = alone();
    let folder = tempfile::tempdir().unwrap();
    let _control = control(folder.path());
    let begun = Instant::now();
    let mut remote = loop {
        match Remote::connect("127.0.0.1:5007") {
            Ok(remote) => break remote,
            Err(e) => assert!(begun.elapsed() < Duration::from_secs(60), "{e}"),
        }
        std::thread::sleep(Duration::from_millis(250));
    };
    let passes = vec![job::curves().swap_remove(0)];
    let mut table = Vec::new();
    for (form, nurbs, arcs) in [("NURBS", true, true), ("biarcs", false, true), ("straight", false, false)] {
        let machine =
            Machine { nurbs, arcs, comments: false, feed: FEED, dynamics: DYNAMICS, ..Machine::default() };
        let job = match std::env::var("CLAYMILL_JOB") {
            Ok(folder) => MachineJob::read(Path::new(&folder), &machine).unwrap(),
            // One pass of constant height, which 2.9 takes as NURBS.
            Err(_) => job::job(&passes, &machine),
        };
        let strokes = &job.sections[0].strokes;
        let cuts = strokes.iter().filter(|s| s.kind == MoveKind::Cut);
        let top = cuts.flat_map(|s| s.curve.points()).map(|p| p.z).fold(f64::NEG_INFINITY, f64::max);
        let curves: Vec<Vec<Point3>> = strokes.iter().map(|s| samples(&s.curve)).collect();
        // Leads are above the passes. Before the first one, the tool changer may be anywhere.
        let begin = strokes[0].curve.start();
        let far = |positions: &[Point3]| {
            let there = |p: &&Point3| p.z > top + 1.0 && (*p - begin).xy().norm() < 0.01;
            let on_the_way = positions.iter().skip_while(|p| !there(p));
            let mut seen: Vec<&Point3> = on_the_way.filter(|p| p.z <= top + 1e-6).collect();
            seen.dedup_by(|b, a| (*b - *a).norm() < 0.1);
            let worst = seen.iter().map(|p| distance(&curves, p)).fold(0.0, f64::max);
            (seen.len(), worst)
        };
        let out = folder.path().join(format!("{form}.ngc"));
        let totals = post(&job, Dialect::LinuxCnc29, &machine, &out, &|_| ()).unwrap();
        let virtual_s =
            simulate(&job, std::slice::from_ref(&out), Dialect::LinuxCnc29, &machine).unwrap().time_s;
        // As a file that the control reads by itself.
        let (begun, mut positions) = (Instant::now(), Vec::new());
        remote.run_file(&out, Duration::from_secs(600), |p| positions.push(p)).unwrap();
        let file_s = begun.elapsed().as_secs_f64();
        assert_eq!(remote.error().unwrap(), None);
        let (seen, worst) = far(&positions);
        assert!(seen >= 5 && worst < BAR_MM, "{form} as a file: {seen} seen, {worst} mm");
        // Block by block.
        let blocks = blocks_of(&job, Dialect::LinuxCnc29, &machine).unwrap();
        let (begun, mut positions) = (Instant::now(), Vec::new());
        for block in &blocks {
            remote.mdi(block).unwrap_or_else(|e| panic!("{block}: {e}"));
            positions.extend(remote.position().unwrap());
        }
        remote.settle(Duration::from_secs(60), |p| positions.push(p)).unwrap();
        let streamed_s = begun.elapsed().as_secs_f64() - STANDS_S;
        let (streamed_seen, streamed_worst) = far(&positions);
        assert!(
            streamed_seen >= 5 && streamed_worst < BAR_MM,
            "{form}: {streamed_seen} seen, {streamed_worst} mm"
        );
        assert_eq!(remote.error().unwrap(), None);
        table.push(format!(
            "| {form} | {} | {:.0} | {virtual_s:.1} | {file_s:.1} | {streamed_s:.1} | {} | {:.4} |",
            blocks.len(),
            totals.files[0].bytes as f64 / 1e3,
            seen + streamed_seen,
            worst.max(streamed_worst)
        ));
    }
    eprintln!(
        "| as | blocks | file, kB | virtual control, s | file, s | streamed, s | positions | distance, mm |"
    );
    table.iter().for_each(|row| eprintln!("{row}"));
    begins_again(&mut remote);
}

/// Stopped in the middle of a pass, the machine goes up, over and down to another one, and cuts that.
fn begins_again(remote: &mut Remote) {
    let machine = Machine { comments: false, feed: FEED, dynamics: DYNAMICS, ..Machine::default() };
    let curves = job::curves();
    let (job, program) = (job::record(), job::program(&curves[..2]));
    let [first, last] = [0, 1].map(|i| {
        let mut cuts = program.moves.iter().filter(|m| m.kind == MoveKind::Cut);
        let cut = cuts.nth(i).unwrap();
        let wanted = |m: &Move| if i == 0 { m.seq <= cut.seq } else { m.seq >= cut.seq };
        let route = Route::new(&job, &program, wanted, None, None);
        let chosen = Program { moves: route.moves };
        (cut.curve().unwrap(), MachineJob::new(job.clone(), &chosen, &machine).unwrap())
    });
    let top = first.1.sections[0].clearance_mm;
    for block in blocks_of(&first.1, Dialect::LinuxCnc29, &machine).unwrap() {
        remote.mdi(&block).unwrap_or_else(|e| panic!("{block}: {e}"));
        if remote.position().unwrap().is_some_and(|p| p.z < 10.5) {
            break;
        }
    }
    remote.abort(Duration::from_secs(20)).unwrap();
    let stopped = remote.work_position().unwrap().expect("a position");
    assert!(stopped.z < top - 20.0, "{stopped:?} is no place in a cut");
    let mut blocks = retreat_of(&last.1, Dialect::LinuxCnc29, &machine, stopped.z, None);
    blocks.extend(blocks_of(&last.1, Dialect::LinuxCnc29, &machine).unwrap());
    let mut seen = vec![stopped];
    for block in &blocks {
        remote.mdi(block).unwrap_or_else(|e| panic!("{block}: {e}"));
        seen.extend(remote.position().unwrap());
    }
    remote.settle(Duration::from_secs(60), |p| seen.push(p)).unwrap();
    assert_eq!(remote.error().unwrap(), None);
    let frame = last.1.sections[0].frame;
    let [begin, end] = [last.0.start(), last.0.end()].map(|p| frame.to_machine(&p));
    let aside = |p: &Point3, q: &Point3| (p - q).xy().norm();
    let left = seen.iter().position(|p| aside(p, &stopped) > 0.01).expect("it goes elsewhere");
    assert!(
        seen[left..].iter().take_while(|p| aside(p, &begin) > 0.01).all(|p| p.z > top - 0.01),
        "{seen:?}"
    );
    let curve =
        vec![samples(&last.1.sections[0].strokes.iter().find(|s| s.kind == MoveKind::Cut).unwrap().curve)];
    let highest = curve[0].iter().map(|p| p.z).fold(f64::NEG_INFINITY, f64::max);
    // Down to it and up from it, the machine is straight above its ends.
    let between = |p: &&Point3| aside(p, &begin).min(aside(p, &end)) > 0.01;
    let low = seen[left..].iter().filter(|p| p.z <= highest).filter(between);
    let worst = low.map(|p| distance(&curve, p)).fold(0.0, f64::max);
    assert!(worst < BAR_MM, "{worst} mm from the pass");
}

/// What the control's definition allows.
const FEED: Feed = Feed { max_mm_per_min: 30_000.0, rapid_mm_per_min: 30_000.0 };
const DYNAMICS: Dynamics = Dynamics { acceleration_mm_per_s2: 5000.0, jerk_mm_per_s3: 1e9, cycle_s: 0.001 };
/// How long the machine stands still before it counts as at rest, s.
const STANDS_S: f64 = 0.4;
/// 0.01 mm, the tolerances of program and path, and the chords between samples of the curves.
const BAR_MM: f64 = 0.01 + 0.004 + 0.001;

/// Points no more than 0.1 mm apart.
fn samples(curve: &Curve3) -> Vec<Point3> {
    let (a, b) = curve.domain();
    let length: f64 = curve.points().windows(2).map(|w| (w[1] - w[0]).norm()).sum();
    let count = (length / 0.1).ceil().clamp(1.0, 1e6) as u32;
    (0..=count).map(|i| curve.point(a + (b - a) * f64::from(i) / f64::from(count))).collect()
}

/// Distance of a position from the nearest of the curves.
fn distance(curves: &[Vec<Point3>], p: &Point3) -> f64 {
    let chord = |w: &[Point3]| {
        let d = w[1] - w[0];
        let s = ((p - w[0]).dot(&d) / d.norm_squared().max(1e-300)).clamp(0.0, 1.0);
        (p - (w[0] + d * s)).norm()
    };
    curves.iter().flat_map(|points| points.windows(2).map(chord)).fold(f64::INFINITY, f64::min)
}
