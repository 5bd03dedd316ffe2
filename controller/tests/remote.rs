//! LinuxCNC over its own remote protocol: curves and straight moves, block by block, into the running control.
//! Skipped, visibly, where it is not installed.

mod job;

use std::fs;
use std::io::Write;
use std::net::TcpStream;
use std::os::unix::fs::PermissionsExt;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use claymill_controller::{Dialect, Machine, Remote, blocks_of};
use claymill_nurbs::Point3;

const INI: &str = include_str!("linuxcnc_sim/machine.ini");
const HAL: &str = include_str!("linuxcnc_sim/machine.hal");

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
    if !Command::new("which").arg("linuxcncrsh").stdout(Stdio::null()).status().is_ok_and(|s| s.success()) {
        eprintln!("skipped: linuxcncrsh is not installed (Debian package linuxcnc-uspace)");
        return;
    }
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
    // One pass of constant height, which 2.9 takes as NURBS.
    let pass = vec![job::curves().swap_remove(0)];
    let mut table = Vec::new();
    for (form, nurbs, arcs) in [("NURBS", true, true), ("biarcs", false, true), ("straight", false, false)] {
        let machine = Machine { nurbs, arcs, comments: false, ..Machine::default() };
        let job = job::job(&pass, &machine);
        let blocks = blocks_of(&job, Dialect::LinuxCnc29, &machine).unwrap();
        let curve = &job.sections[0].strokes[1].curve;
        let begun = Instant::now();
        let mut positions = Vec::new();
        for block in &blocks {
            remote.mdi(block).unwrap_or_else(|e| panic!("{block}: {e}"));
            positions.extend(remote.position().unwrap());
        }
        let (mut seen, mut worst) = (0, 0.0f64);
        let (a, b) = curve.domain();
        let points: Vec<Point3> =
            (0..=4000).map(|i| curve.point(a + (b - a) * f64::from(i) / 4000.0)).collect();
        remote.settle(Duration::from_secs(60), |p| positions.push(p)).unwrap();
        let time = begun.elapsed().as_secs_f64() - 0.4;
        for p in positions {
            // On the pass, not on its leads.
            if (p.z - 10.0).abs() < 1e-6 {
                seen += 1;
                let chord = |w: &[Point3]| {
                    let d = w[1] - w[0];
                    let s = ((p - w[0]).dot(&d) / d.norm_squared()).clamp(0.0, 1.0);
                    (p - (w[0] + d * s)).norm()
                };
                worst = worst.max(points.windows(2).map(chord).fold(f64::INFINITY, f64::min));
            }
        }
        assert_eq!(remote.error().unwrap(), None);
        table.push((form, blocks.len(), time, seen, worst));
    }
    eprintln!("| form | blocks | s | positions seen | largest distance, mm |");
    for (form, blocks, time, seen, worst) in &table {
        eprintln!("| {form} | {blocks} | {time:.2} | {seen} | {worst:.4} |");
        // The samples of the curve stand 0.02 mm apart.
        assert!(*seen >= 5, "{form} was hardly seen");
        assert!(*worst < 0.01 + 0.004 + 0.01, "{form}: {worst}");
    }
    assert!(table[0].1 < table[2].1);
}
