//! Both sides of a stream are killed at any moment, in turns: every record is executed once, in order, and the machine goes
//! on from where it was.

#[path = "it/records/mod.rs"]
mod records;

use std::fs::{self, File, OpenOptions};
use std::io::{Read, Write};
use std::net::TcpListener;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::Arc;
use std::time::{Duration, Instant};

use claymill_controller::{
    Consumer, Dynamics, Event, Order, Panel, Port, Producer, QueueError, Record, Reference, Sender, WireError,
};
use rand::{Rng, SeedableRng};
use records::{encoded, line};

const ROLE: &str = "CLAYMILL_KILLS_ROLE";
const PLACE: &str = "CLAYMILL_KILLS_PLACE";
const SECRET: &[u8] = b"a secret of both sides";
const NAME: u64 = 77;
/// Room for some twenty records: both sides are at work all the time.
const CAPACITY: u64 = 4096;
const LIMITS: Dynamics = Dynamics { acceleration_mm_per_s2: 4000.0, jerk_mm_per_s3: 80_000.0, cycle_s: 1e-3 };
const FEED: f64 = 3000.0;
const PIECE_MM: f64 = 2.0;
/// A side is killed when it has lived for less than this, ms.
const LIVES_MS: u64 = 80;

/// More records than are ever on their way between a sender and the machine's last one.
const ON_THE_WAY: u64 = 80;

/// How many records the stream has, once that is known: it goes on while there are kills.
fn count(place: &Path) -> u64 {
    fs::read_to_string(place.join("count")).ok().and_then(|c| c.parse().ok()).unwrap_or(u64::MAX)
}

/// Record `seq` of a stream of `count`: pieces of a straight line, and orders between them.
fn record(seq: u64, count: u64) -> Record {
    let x = (0..seq).filter(|s| is_path(*s)).count() as f64 * PIECE_MM;
    match seq {
        0 => Record::Tool(3),
        1 => Record::Spindle(9000.0),
        2 => Record::Coolant(true),
        _ if seq.checked_add(1) == Some(count) => Record::End,
        _ if seq.is_multiple_of(40) => Record::Spindle(seq as f64),
        _ if seq.is_multiple_of(10) => Record::Output { number: (seq / 10 % 64) as u16, on: true },
        _ => line(x, x + PIECE_MM, FEED),
    }
}

fn is_path(seq: u64) -> bool {
    seq > 2 && !seq.is_multiple_of(10)
}

/// Not a test of its own: what a killed process was doing.
#[test]
fn one_side() {
    let (Ok(role), Ok(place)) = (std::env::var(ROLE), std::env::var(PLACE)) else { return };
    let place = PathBuf::from(place);
    match role.as_str() {
        "produce" => produce(&place),
        "send" => send(&place),
        "control" => control(&place),
        _ => {
            let listener = listen(&place);
            let port = place.clone();
            // The port comes up with the panel that the controller heeds.
            let panel = Arc::new(Panel::new(Order::Run, false));
            let queue = Producer::open(&port.join("queue"), CAPACITY).unwrap();
            let port = Arc::new(Port::new(queue, Arc::clone(&panel)));
            std::thread::spawn(move || port.listen(&listener, &Arc::from(SECRET), |_| ()));
            control(&place);
        }
    }
}

fn listen(place: &Path) -> TcpListener {
    let address = fs::read_to_string(place.join("address")).unwrap();
    TcpListener::bind(address).unwrap()
}

fn produce(place: &Path) {
    let mut queue = Producer::open(&place.join("queue"), CAPACITY).unwrap();
    let patiently = |result: Result<(), QueueError>| match result {
        Ok(()) => true,
        Err(QueueError::Silent(_)) => false,
        Err(e) => panic!("{e}"),
    };
    for seq in queue.resume(NAME).unwrap().. {
        if seq == count(place) {
            break;
        }
        let bytes = encoded(seq, &record(seq, count(place)));
        while !patiently(queue.push(&bytes)) {}
        // What is small goes at once: a kill is to find records in every state.
        while !patiently(queue.flush()) {}
    }
    while queue.done().unwrap() < count(place) {
        queue.beat().unwrap();
        std::thread::sleep(Duration::from_millis(5));
    }
}

fn send(place: &Path) {
    let address = fs::read_to_string(place.join("address")).unwrap();
    loop {
        let sent = Sender::connect(&address, SECRET, NAME).and_then(|mut sender| {
            for seq in sender.next().. {
                if seq == count(place) {
                    break;
                }
                sender.send(&encoded(seq, &record(seq, count(place))))?;
                if seq % 7 == 0 {
                    sender.confirm()?;
                }
            }
            sender.confirm()
        });
        match sent {
            Ok(()) => return,
            Err(WireError::Io(_)) => std::thread::sleep(Duration::from_millis(3)),
            Err(e) => panic!("{e}"),
        }
    }
}

/// What the machine writes down of an event: its kind, a number and another one.
fn entry(kind: u8, seq: u64, value: f64) -> [u8; 17] {
    let mut bytes = [kind; 17];
    bytes[1..9].copy_from_slice(&seq.to_le_bytes());
    bytes[9..].copy_from_slice(&value.to_le_bytes());
    bytes
}

const STARTED: u8 = 0;
const AT: u8 = 1;
const DONE: u8 = 2;
const REPEATED: u8 = 3;
const TOLD_AGAIN: u8 = 4;
const FAULT: u8 = 5;

fn entries(place: &Path) -> Vec<(u8, u64, f64)> {
    let mut bytes = Vec::new();
    File::open(place.join("log")).unwrap().read_to_end(&mut bytes).unwrap();
    let eight = |b: &[u8]| <[u8; 8]>::try_from(b).unwrap();
    let entry = |e: &[u8]| (e[0], u64::from_le_bytes(eight(&e[1..9])), f64::from_le_bytes(eight(&e[9..])));
    bytes.chunks_exact(17).map(entry).collect()
}

/// A machine that writes down what it does, before it says that it was done; what it finds there it does not do again.
fn control(place: &Path) {
    let mut consumer = Consumer::open(&place.join("queue"), CAPACITY).unwrap();
    let mut log = OpenOptions::new().create(true).append(true).open(place.join("log")).unwrap();
    let whole = log.metadata().unwrap().len() / 17 * 17;
    log.set_len(whole).unwrap();
    let mut last = entries(place).iter().rev().find(|e| e.0 == DONE).map(|e| e.1);
    log.write_all(&entry(STARTED, 0, 0.0)).unwrap();
    let mut report = |event: Event| {
        let bytes = match event {
            Event::At(p) => entry(AT, p.seq, p.tip.x),
            Event::PathDone(seq) | Event::Executed(seq, _) => {
                let kind = if last.is_some_and(|l| seq <= l) { REPEATED } else { DONE };
                last = last.max(Some(seq));
                entry(kind, seq, 0.0)
            }
            Event::ToldAgain(record) => entry(TOLD_AGAIN, u64::from(matches!(record, Record::Tool(3))), 0.0),
            Event::Fault(why) => panic!("{why}"),
            Event::Stands | Event::Discarded | Event::NotDiscarded => entry(FAULT, 0, 0.0),
        };
        log.write_all(&bytes).unwrap();
    };
    let reference = Reference { limits: LIMITS, real_time: true, single_step: false };
    reference.run(&mut consumer, &mut || Order::Run, &mut report).unwrap();
}

fn child(role: &str, place: &Path) -> Child {
    let mut command = Command::new(std::env::current_exe().unwrap());
    command.args(["--exact", "one_side", "--nocapture"]);
    command.env(ROLE, role).env(PLACE, place);
    let said = OpenOptions::new().create(true).append(true).open(place.join("said")).unwrap();
    command.stdout(Stdio::null()).stderr(said).spawn().unwrap()
}

/// Kills each side in turns while a stream goes from one to the other.
fn kill(roles: [&str; 2], kills: u64) {
    let folder = tempfile::tempdir_in("/dev/shm").or_else(|_| tempfile::tempdir()).unwrap();
    let place = folder.path();
    let free = TcpListener::bind("127.0.0.1:0").unwrap();
    fs::write(place.join("address"), free.local_addr().unwrap().to_string()).unwrap();
    drop(free);
    let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(kills);
    let mut sides = roles.map(|role| child(role, place));
    let begun = Instant::now();
    let said = || fs::read_to_string(place.join("said")).unwrap_or_default();
    for i in 0..kills {
        std::thread::sleep(Duration::from_millis(rng.random_range(1..LIVES_MS)));
        let side = (i % 2) as usize;
        let before = sides[side].try_wait().unwrap();
        assert!(before.is_none(), "{} left before kill {i}: {before:?}\n{}", roles[side], said());
        sides[side].kill().unwrap();
        sides[side].wait().unwrap();
        sides[side] = child(roles[side], place);
    }
    let killed = begun.elapsed();
    // Now in peace to the end, which is written down at once, for a file is read while it is written.
    let done = entries(place).iter().filter(|e| e.0 == DONE).count() as u64;
    let count = done + ON_THE_WAY;
    fs::write(place.join("count~"), count.to_string()).unwrap();
    fs::rename(place.join("count~"), place.join("count")).unwrap();
    let patience = Duration::from_secs(60 + kills);
    while sides[1].try_wait().unwrap().is_none() {
        assert!(begun.elapsed() < killed + patience, "it never ends\n{}", said());
        std::thread::sleep(Duration::from_millis(20));
    }
    let [mut producer, mut machine] = sides;
    assert!(machine.wait().unwrap().success(), "{}", said());
    // It may not have heard of the end before the machine had gone.
    let _ = producer.kill();
    let _ = producer.wait();

    let log = entries(place);
    let done: Vec<u64> = log.iter().filter(|e| e.0 == DONE).map(|e| e.1).collect();
    assert_eq!(done, (0..count).collect::<Vec<_>>(), "not every record once, in order");
    assert!(log.iter().all(|e| e.0 != FAULT));
    // A kill between what was done and its note tells the last record again; no other.
    let starts = log.iter().filter(|e| e.0 == STARTED).count();
    let repeated = log.iter().filter(|e| e.0 == REPEATED).count();
    assert!(repeated < starts, "{repeated} records told twice in {starts} starts");
    // No set point is left out, and none comes again but the last one before a kill.
    let tips: Vec<f64> = log.iter().filter(|e| e.0 == AT).map(|e| e.2).collect();
    let step_mm = FEED / 60.0 * LIMITS.cycle_s * 1.001 + 1e-9;
    let most = tips.windows(2).map(|w| w[1] - w[0]).fold(0.0, f64::max);
    let least = tips.windows(2).map(|w| w[1] - w[0]).fold(0.0, f64::min);
    assert!(most <= step_mm && least >= -step_mm, "{least} to {most} mm in a cycle");
    let end_mm = (0..count - 1).filter(|s| is_path(*s)).count() as f64 * PIECE_MM;
    assert!((tips[tips.len() - 1] - end_mm).abs() < 1e-6);
    // Whoever took up in the middle had the tool told again before the first motion.
    let mut taken_up = 0;
    for part in log.split(|e| e.0 == STARTED) {
        let moves = part.windows(2).position(|w| w[0].0 == AT && w[1].0 == AT && w[1].2 > w[0].2);
        let Some(moves) = moves else { continue };
        let tool = |e: &(u8, u64, f64)| e.0 == TOLD_AGAIN && e.1 == 1 || (e.0 == DONE && e.1 == 0);
        assert!(part[..moves].iter().any(tool), "it moves, and nobody told it the tool");
        taken_up += 1;
    }
    eprintln!(
        "{roles:?}: {count} records, {kills} kills in {killed:?}, {starts} starts of the machine, {taken_up} of them \
         moved, {repeated} records told twice; done after {:?}",
        begun.elapsed()
    );
}

#[test]
fn a_few_kills_over_a_queue_in_memory() {
    kill(["produce", "control"], 10);
}

#[test]
fn a_few_kills_over_a_connection() {
    kill(["send", "machine"], 10);
}

#[test]
#[ignore = "100 kills, and what they take: half a minute on a machine without other work"]
fn a_hundred_kills_over_a_queue_in_memory() {
    kill(["produce", "control"], 100);
}

#[test]
#[ignore = "100 kills, and what they take: half a minute on a machine without other work"]
fn a_hundred_kills_over_a_connection() {
    kill(["send", "machine"], 100);
}
