//! A reference controller that runs, and orders to it over a connection: hold, go on, step, abort, restart elsewhere.

use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

use serde_json::Value;

use crate::run::{Run, claymill, panel_job, run};
use crate::scratch;

/// Longer than anything here takes.
const PATIENCE: Duration = Duration::from_secs(60);

/// `claymill control`, with the lines that it prints.
pub(crate) struct Machine {
    process: Child,
    pub(crate) address: String,
    lines: Receiver<Value>,
    folder: PathBuf,
}

impl Drop for Machine {
    fn drop(&mut self) {
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

impl Machine {
    /// Starts on a port of its own choice.
    pub(crate) fn start(folder: &Path, more: &[&str]) -> Machine {
        Machine::start_by(claymill(), folder, more)
    }

    /// Starts by a command that runs claymill with its own arguments.
    pub(crate) fn start_by(mut command: Command, folder: &Path, more: &[&str]) -> Machine {
        command.current_dir(folder).args([
            "control",
            "--queue",
            "queue",
            "--listen",
            "127.0.0.1:0",
            "--json",
        ]);
        command.args(["--secret", "secret", "--machine", "quick.toml"]).args(more);
        let mut process =
            command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("the command starts");
        let (send, lines) = channel();
        let out = BufReader::new(process.stdout.take().expect("a pipe"));
        std::thread::spawn(move || {
            for line in out.lines().map_while(Result::ok) {
                let Ok(value) = serde_json::from_str(&line) else { break };
                if send.send(value).is_err() {
                    break;
                }
            }
        });
        let mut said = BufReader::new(process.stderr.take().expect("a pipe")).lines().map_while(Result::ok);
        let address = said
            .by_ref()
            .find_map(|line| line.split_once("listening ").map(|(_, a)| a.trim().to_owned()))
            .expect("an address");
        std::thread::spawn(move || said.for_each(drop));
        Machine { process, address, lines, folder: folder.to_owned() }
    }

    pub(crate) fn order(&self, order: &str) -> Value {
        let made = self.try_order(order);
        assert_eq!(made.code, Some(0), "{order}: {made:?}");
        made.json()
    }

    pub(crate) fn try_order(&self, order: &str) -> Run {
        run(&self.folder, ["order", order, "--to", &self.address, "--secret", "secret", "--json"])
    }

    pub(crate) fn stream(&self, more: &[&str]) -> Child {
        let mut command = claymill();
        command.current_dir(&self.folder).args(["stream", "job", "--secret", "secret"]);
        command.args(["--to", &format!("tcp:{}", self.address)]).args(more);
        command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("the command starts")
    }

    /// Set points up to the first one that is `wanted`.
    pub(crate) fn until(&self, what: &str, mut wanted: impl FnMut(&Value) -> bool) -> Vec<Value> {
        let begun = Instant::now();
        let mut seen = Vec::new();
        loop {
            let line = self.lines.recv_timeout(PATIENCE).unwrap_or_else(|e| panic!("{what}: {e}"));
            assert!(begun.elapsed() < PATIENCE, "{what} never came");
            let found = wanted(&line);
            seen.push(line);
            if found {
                return seen;
            }
        }
    }

    fn ends(&mut self) -> bool {
        self.code() == Some(0)
    }

    /// Its exit code, when it has come to its end.
    pub(crate) fn code(&mut self) -> Option<i32> {
        let begun = Instant::now();
        while begun.elapsed() < PATIENCE {
            if let Some(status) = self.process.try_wait().expect("a process") {
                return status.code();
            }
            std::thread::sleep(Duration::from_millis(20));
        }
        None
    }

    pub(crate) fn id(&self) -> u32 {
        self.process.id()
    }
}

pub(crate) fn tip(value: &Value) -> [f64; 3] {
    [0, 1, 2].map(|i| value[i].as_f64().expect("a coordinate"))
}

pub(crate) fn far(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|i| (a[i] - b[i]).powi(2)).sum::<f64>().sqrt()
}

/// A secret that its owner alone may read.
fn secret(path: &Path, bytes: &str) {
    use std::os::unix::fs::PermissionsExt;
    std::fs::write(path, bytes).unwrap();
    std::fs::set_permissions(path, std::fs::Permissions::from_mode(0o600)).unwrap();
}

/// A planned job, a secret, and a machine that is quick.
pub(crate) fn workshop(folder: &Path) -> Vec<Value> {
    panel_job(folder);
    secret(&folder.join("secret"), "sixteen bytes or more");
    std::fs::write(
        folder.join("quick.toml"),
        "[dynamics]\nacceleration_mm_per_s2 = 4000\njerk_mm_per_s3 = 80000\n",
    )
    .unwrap();
    let moves = std::fs::read_to_string(folder.join("job/toolpaths.jsonl")).unwrap();
    moves.lines().map(|l| serde_json::from_str(l).unwrap()).collect()
}

/// The number of one of the last cuts that have no lead-in, and where it begins.
fn a_cut(moves: &[Value]) -> (u64, [f64; 3]) {
    let inner = moves.windows(2).rev().filter(|w| w[0]["kind"] == "link" && w[1]["kind"] == "cut");
    let cut = &inner.map(|w| &w[1]).nth(3).expect("a cut");
    (cut["seq"].as_u64().unwrap(), tip(&cut["points"][0]))
}

#[test]
fn hold_step_go_on_and_abort() {
    let folder = scratch();
    let folder = folder.path();
    workshop(folder);
    let mut machine = Machine::start(folder, &["--hold"]);
    assert_eq!(machine.order("status")["order"], "hold");
    let mut stream = machine.stream(&[]);
    // Told to begin at rest, it does; then one path, up to its end, and one more.
    let stepped = machine.order("step");
    assert_eq!((stepped["order"].as_str(), stepped["paths"].as_u64()), (Some("hold"), Some(1)));
    assert_eq!(machine.order("step")["paths"], 2);
    // In the middle of a path: it stays where it is.
    machine.order("run");
    machine.until("motion", |p| p["mm_per_s"].as_f64().is_some_and(|v| v > 20.0));
    let held = machine.order("hold");
    assert_eq!((held["order"].as_str(), held["mm_per_s"].as_f64()), (Some("hold"), Some(0.0)));
    std::thread::sleep(Duration::from_millis(100));
    let still = machine.order("status");
    assert_eq!(held["tip_mm"], still["tip_mm"]);
    // A step from there ends with the path; then on.
    assert_eq!(machine.order("step")["paths"].as_u64(), held["paths"].as_u64().map(|p| p + 1));
    machine.order("resume");
    machine.until("motion again", |p| p["mm_per_s"].as_f64().is_some_and(|v| v > 20.0));
    let aborted = machine.order("abort");
    assert_eq!(aborted["order"], "abort");
    assert!(machine.ends());
    assert_eq!(machine.try_order("status").code, Some(1), "nobody is there");
    // Another one takes up what was left where it stopped.
    let mut last = None;
    while let Ok(line) = machine.lines.try_recv() {
        last = line.get("tip").map(tip).or(last);
    }
    let last = last.expect("set points");
    drop(machine);
    let machine = Machine::start(folder, &["--hold"]);
    machine.until("a set point", |p| p.get("tip").is_some());
    let found = tip(&machine.order("status")["tip_mm"]);
    assert!(far(found, last) < 1e-3, "{found:?} after {last:?}");
    let _ = stream.kill();
    let _ = stream.wait();
}

/// What a restart did: set points behind the order, the way down to the cut among them, and what it said.
fn restarted(folder: &Path, mut machine: Machine, moves: &[Value], mut first: Child, mut again: Child) {
    let (_, start) = a_cut(moves);
    // It comes to rest, goes up and over to the chosen path, and on to the job's end.
    let seen = machine.until("the end", |p| p["executed"] == "End");
    assert!(again.wait().unwrap().success());
    assert!(machine.ends());
    let _ = first.kill();
    let _ = first.wait();
    let tips: Vec<[f64; 3]> = seen.iter().filter_map(|p| p.get("tip").map(tip)).collect();
    let near = tips.iter().position(|t| far(*t, start) < 0.05).expect("the chosen path's start");
    let end = tip(moves.last().unwrap()["points"].as_array().unwrap().last().unwrap());
    assert!(far(tips[tips.len() - 1], end) < 1e-3);
    // No set point is far from the one before it: nothing was jumped over on the way.
    let cycle_s = 1e-3;
    let farthest = tips.windows(2).map(|w| far(w[0], w[1])).fold(0.0, f64::max);
    assert!(farthest <= 60_000.0 / 60.0 * cycle_s * 1.01, "{farthest} mm in one cycle");
    // It was at the clearance height on the way over, and from there straight above the cut it went down at the feed of
    // leads; no lead-in of the job ends there.
    let job: Value = serde_json::from_slice(&std::fs::read(folder.join("job/job.json")).unwrap()).unwrap();
    let clearance = job["setups"][0]["clearance_mm"].as_f64().unwrap();
    let top = tips[..near].iter().rposition(|t| (t[2] - clearance).abs() < 1e-3);
    let top = top.unwrap_or_else(|| panic!("never at {clearance}"));
    let leads = moves.iter().find(|m| m["kind"] == "lead_in").unwrap()["feed"].as_f64().unwrap();
    let (mut fastest, mut aside) = (0.0_f64, 0.0_f64);
    for w in tips[top..=near].windows(2) {
        fastest = fastest.max(far(w[0], w[1]) / cycle_s * 60.0);
        aside = aside.max((w[1][0] - start[0]).hypot(w[1][1] - start[1]));
    }
    assert!(fastest <= leads * 1.001 && fastest > 0.5 * leads, "{fastest} mm/min down");
    assert!(aside < 0.05, "{aside} mm aside on the way down");
    // The spindle turns before the way down begins, and nothing is switched where it stood in the cut.
    let place = |i: &usize| seen[..*i].iter().filter(|p| p.get("tip").is_some()).count();
    let restart =
        (0..seen.len()).rev().find(|i| seen[*i]["executed"].as_str().is_some_and(|e| e.starts_with("Tool")));
    let restart = restart.as_ref().map(place).expect("a tool");
    assert!((tips[restart][2] - clearance).abs() < 1e-3 && restart <= top, "{:?}", tips[restart]);
}

#[test]
fn restart_at_a_chosen_path() {
    let folder = scratch();
    let folder = folder.path();
    let moves = workshop(folder);
    let machine = Machine::start(folder, &[]);
    let first = machine.stream(&[]);
    machine.until("motion", |p| p["mm_per_s"].as_f64().is_some_and(|v| v > 20.0));
    let (seq, _) = a_cut(&moves);
    let again = machine.stream(&["--restart", "--from", &seq.to_string()]);
    restarted(folder, machine, &moves, first, again);
}

#[test]
fn restart_at_a_chosen_path_over_a_queue_in_memory() {
    let folder = scratch();
    let folder = folder.path();
    let moves = workshop(folder);
    let machine = Machine::start(folder, &[]);
    let stream = |more: &[&str]| {
        let mut command = claymill();
        command.current_dir(folder).args(["stream", "job", "--to", "shm:queue"]).args(more);
        command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("the command starts")
    };
    let mut first = stream(&[]);
    machine.until("motion", |p| p["mm_per_s"].as_f64().is_some_and(|v| v > 20.0));
    let (seq, _) = a_cut(&moves);
    let again = stream(&["--restart", "--from", &seq.to_string()]);
    // Whoever streamed before is told that nobody waits for it any more.
    assert_eq!(first.wait().unwrap().code(), Some(1));
    restarted(folder, machine, &moves, first, again);
}

#[test]
fn orders_need_the_secret() {
    let folder = scratch();
    let folder = folder.path();
    workshop(folder);
    let machine = Machine::start(folder, &["--hold"]);
    secret(&folder.join("other"), "another sixteen bytes");
    let refused = run(folder, ["order", "run", "--to", &machine.address, "--secret", "other"]);
    assert_eq!(refused.code, Some(1), "{refused:?}");
    // What others could have read is refused before it is used.
    std::fs::write(folder.join("open"), "sixteen bytes or more").unwrap();
    let open = run(folder, ["order", "run", "--to", &machine.address, "--secret", "open"]);
    assert_eq!(open.code, Some(2), "{open:?}");
    assert!(open.stderr.contains("others than its owner"), "{open:?}");
    assert_eq!(machine.order("status")["order"], "hold");
    for (order, to) in [("stop", machine.address.as_str()), ("run", "10.0.0.1:5000")] {
        let wrong = run(folder, ["order", order, "--to", to, "--secret", "secret"]);
        assert_eq!(wrong.code, Some(2), "{wrong:?}");
    }
}
