//! Reading files of tens of thousands of patches: shown as a stage, and interrupted at once.

use std::fs;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use crate::run::{claymill, run};
use crate::scratch;

/// The command ends this soon after Ctrl-C.
const SOON: Duration = Duration::from_millis(100);
/// A machine with other work may be late once.
const TRIES: usize = 5;

#[test]
fn reading_a_large_file_is_interrupted_at_once() {
    let folder = scratch();
    let folder = folder.path();
    for name in ["large.igs", "large.stp"] {
        assert_eq!(run(folder, ["sample", "roadster", "--patches", "40000", "-o", name]).code, Some(0));
        let mib = fs::metadata(folder.join(name)).unwrap().len() >> 20;
        let mut soonest = Duration::MAX;
        for wait_ms in (0..TRIES).map(|k| 60 + 10 * k as u64) {
            let mut reading = claymill()
                .args(["inspect", name])
                .current_dir(folder)
                .stdout(Stdio::null())
                .stderr(Stdio::null())
                .spawn()
                .unwrap();
            std::thread::sleep(Duration::from_millis(wait_ms));
            assert!(reading.try_wait().unwrap().is_none(), "{name} was read within {wait_ms} ms");
            let sent = Command::new("sh").args(["-c", &format!("kill -INT {}", reading.id())]).status();
            let start = Instant::now();
            assert!(sent.unwrap().success());
            assert_eq!(reading.wait().unwrap().code(), Some(130));
            soonest = soonest.min(start.elapsed());
        }
        eprintln!("{name}, {mib} MiB: ended {soonest:.1?} after the interruption");
        assert!(soonest <= SOON, "{name}: {soonest:?}");
    }
}
