//! Whose a queue is, and what comes of bad records in one: files of others, second controllers, second streams, strangers.

use std::io::{BufRead, BufReader, Write};
use std::os::unix::fs::{PermissionsExt, symlink};
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use claymill_controller::Producer;
use serde_json::Value;

use crate::machine::{Machine, far, tip, workshop};
use crate::records::{changed, encoded, line, plant};
use crate::run::{claymill, run};
use crate::scratch;

const PATIENCE: Duration = Duration::from_secs(60);

#[test]
fn files_that_are_no_queue_stay_what_they_are() {
    let folder = scratch();
    let folder = folder.path();
    workshop(folder);
    let notes = folder.join("notes.txt");
    std::fs::write(&notes, "half a page").unwrap();
    symlink(&notes, folder.join("link")).unwrap();
    symlink(folder.join("nothing"), folder.join("dangling")).unwrap();
    for mode in [0o644, 0o600] {
        std::fs::set_permissions(&notes, std::fs::Permissions::from_mode(mode)).unwrap();
        for file in ["notes.txt", "link", "dangling", "."] {
            let target = format!("shm:{file}");
            for refused in [
                run(folder, ["control", "--fast", "--queue", file]),
                run(folder, ["stream", "job", "--to", &target]),
                run(folder, ["stream", "job", "--restart", "--to", &target]),
            ] {
                assert_eq!(refused.code, Some(1), "{file}: {refused:?}");
                assert!(refused.stderr.contains("the file "), "{refused:?}");
            }
        }
    }
    assert_eq!(std::fs::read_to_string(&notes).unwrap(), "half a page");
    assert!(!folder.join("nothing").exists());
}

#[test]
fn one_controller_and_one_stream_at_a_time() {
    let folder = scratch();
    let folder = folder.path();
    workshop(folder);
    let machine = Machine::start(folder, &[]);
    for second in [
        run(folder, ["control", "--queue", "queue", "--fast"]),
        run(
            folder,
            ["control", "--queue", "queue", "--fast", "--listen", "127.0.0.1:0", "--secret", "secret"],
        ),
    ] {
        assert_eq!(second.code, Some(1), "{second:?}");
        assert!(second.stderr.contains("another controller"), "{second:?}");
    }
    // A stream of other moves, from the same job, while one is under way.
    let to = format!("tcp:{}", machine.address);
    let stream = || {
        let mut command = claymill();
        command.current_dir(folder).args(["stream", "job", "--to", "shm:queue"]);
        command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().expect("the command starts")
    };
    let mut first = stream();
    machine.until("motion", |p| p["mm_per_s"].as_f64().is_some_and(|v| v > 20.0));
    let by_tcp = run(folder, ["stream", "job", "--to", &to, "--secret", "secret", "--from", "2"]);
    let by_queue = || run(folder, ["stream", "job", "--to", "shm:queue", "--from", "2"]);
    for (refused, why) in [(by_tcp, "does not take this stream"), (by_queue(), "another program writes")] {
        assert_eq!(refused.code, Some(1), "{refused:?}");
        assert!(refused.stderr.contains(why) && refused.stderr.contains("--restart"), "{refused:?}");
    }
    assert!(first.try_wait().unwrap().is_none(), "the first one goes on");
    first.kill().unwrap();
    first.wait().unwrap();
    // Not even then; but the same one may go on.
    let begun = Instant::now();
    while by_queue().stderr.contains("another program writes") {
        assert!(begun.elapsed() < PATIENCE);
    }
    assert!(by_queue().stderr.contains("has not ended"));
    // The machine is killed: the queue is free for the next one at once.
    drop(machine);
    let machine = Machine::start(folder, &[]);
    let mut again = stream();
    machine.until("motion", |p| p["mm_per_s"].as_f64().is_some_and(|v| v > 20.0));
    again.kill().unwrap();
    again.wait().unwrap();
}

/// A queue with a path of a metre at 20 m/min and a spindle behind it that is no number.
fn poisoned(folder: &Path) {
    let mut producer = Producer::open(&folder.join("queue"), 1 << 20).unwrap();
    producer.resume(99).unwrap();
    producer.push(&encoded(0, &line(0.0, 1000.0, 20_000.0))).unwrap();
    producer.flush().unwrap();
    drop(producer);
    let spindle = encoded(1, &claymill_controller::Record::Spindle(1.0));
    let bad = changed(&spindle, 12, &f64::NAN.to_le_bytes());
    plant(&folder.join("queue"), &bad, bad.len() as u32);
}

#[test]
fn a_bad_record_is_told_and_can_be_dropped() {
    let folder = scratch();
    let folder = folder.path();
    workshop(folder);
    poisoned(folder);
    // Nobody can give an order: it comes to rest, says why, and leaves; as often as it is started.
    for _ in 0..2 {
        let alone = run(folder, ["control", "--queue", "queue", "--fast", "--json"]);
        assert_eq!(alone.code, Some(1), "{alone:?}");
        assert!(alone.stderr.contains("record 1: a number is not finite"), "{}", alone.stderr);
        assert!(alone.stderr.contains("discard"), "{}", alone.stderr);
        let lines: Vec<Value> = alone.stdout.lines().map(|l| serde_json::from_str(l).unwrap()).collect();
        assert!(lines.iter().any(|l| l["fault"].is_string()));
        // The first one runs the path to its end; the second one finds only what is bad.
        if let Some(last) = lines.iter().rev().find(|l| l.get("tip").is_some()) {
            assert!(far(tip(&last["tip"]), [1000.0, 0.0, 0.0]) < 1e-6, "{last}");
            assert_eq!(last["mm_per_s"], 0.0);
        }
    }
    // By a line on standard input.
    let mut command = claymill();
    command.current_dir(folder).args(["control", "--queue", "queue", "--fast", "--json"]);
    let mut control =
        command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::null()).spawn().unwrap();
    let mut orders = control.stdin.take().unwrap();
    writeln!(orders, "discard").unwrap();
    let output = BufReader::new(control.stdout.take().unwrap());
    let (tell, said) = std::sync::mpsc::channel();
    std::thread::spawn(move || output.lines().map_while(Result::ok).try_for_each(|line| tell.send(line)));
    while !said.recv_timeout(PATIENCE).expect("the queue is discarded").contains("discarded") {}
    writeln!(orders, "abort").unwrap();
    assert!(control.wait().unwrap().success());
    // Over a connection.
    std::fs::remove_file(folder.join("queue")).unwrap();
    poisoned(folder);
    let machine = Machine::start(folder, &[]);
    machine.until("the fault", |l| l["fault"].is_string());
    machine.until("rest", |l| l.get("tip").is_some_and(|t| far(tip(t), [1000.0, 0.0, 0.0]) < 1e-6));
    let status = machine.order("status");
    assert!(status["fault"].as_str().is_some_and(|f| f.starts_with("record 1")), "{status}");
    let refused = machine.try_order("run");
    assert_eq!(refused.code, Some(1), "{refused:?}");
    assert!(refused.stderr.contains("record 1") && refused.stderr.contains("discard"), "{refused:?}");
    assert_eq!(machine.order("discard")["fault"], Value::Null);
    let mut stream = machine.stream(&["--restart"]);
    machine.until("motion", |l| l["mm_per_s"].as_f64().is_some_and(|v| v > 20.0));
    stream.kill().unwrap();
    stream.wait().unwrap();
}

#[test]
fn strangers_that_drip_do_not_use_the_machine_up() {
    let folder = scratch();
    let folder = folder.path();
    workshop(folder);
    // A machine that may open few files, and many more connections than that.
    let mut few = Command::new("sh");
    few.args(["-c", "ulimit -n 200 && exec \"$0\" \"$@\"", env!("CARGO_BIN_EXE_claymill")])
        .stdin(Stdio::null());
    let machine = Machine::start_by(few, folder, &["--hold"]);
    let stop = std::sync::atomic::AtomicBool::new(false);
    std::thread::scope(|scope| {
        for _ in 0..4 {
            scope.spawn(|| {
                let mut streams: Vec<std::net::TcpStream> = Vec::new();
                while !stop.load(std::sync::atomic::Ordering::SeqCst) {
                    streams.retain_mut(|s| s.write_all(&[1]).is_ok());
                    while streams.len() < 100 {
                        let Ok(stream) = std::net::TcpStream::connect(&machine.address) else { break };
                        streams.push(stream);
                    }
                    std::thread::sleep(Duration::from_millis(100));
                }
            });
        }
        std::thread::sleep(Duration::from_millis(500));
        for order in ["hold", "status", "hold"] {
            let begun = Instant::now();
            let made = machine.try_order(order);
            if made.code != Some(0) || begun.elapsed() > Duration::from_secs(6) {
                stop.store(true, std::sync::atomic::Ordering::SeqCst);
                panic!("{order} after {:?}: {made:?}", begun.elapsed());
            }
        }
        stop.store(true, std::sync::atomic::Ordering::SeqCst);
    });
}

#[test]
fn an_interrupt_brings_the_machine_to_rest_before_it_ends_the_process() {
    let folder = scratch();
    let folder = folder.path();
    workshop(folder);
    let mut machine = Machine::start(folder, &[]);
    let mut stream = machine.stream(&[]);
    let moves = |l: &Value| l["mm_per_s"].as_f64().is_some_and(|v| v > 20.0);
    machine.until("motion", moves);
    let interrupted = Command::new("kill").args(["-INT", &machine.id().to_string()]).status().unwrap();
    assert!(interrupted.success());
    machine.until("rest", |l| l["mm_per_s"] == 0.0);
    assert_eq!(machine.code(), Some(130));
    stream.kill().unwrap();
    stream.wait().unwrap();
}
