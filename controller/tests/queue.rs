//! The queue between two processes that are killed at any moment: nothing lost, nothing doubled, order kept.

use std::fs::{self, OpenOptions};
use std::io::{Read, Seek, SeekFrom, Write};
use std::net::TcpListener;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use claymill_controller::{Consumer, Producer, QueueError, Record, SILENCE, Sender, WireError, serve};
use claymill_nurbs::{Curve3, KnotVector, Point3, Vector3};
use claymill_toolpath::MoveKind;
use rand::{Rng, SeedableRng};

const ROLE: &str = "CLAYMILL_QUEUE_ROLE";
const PLACE: &str = "CLAYMILL_QUEUE_PLACE";
const CAPACITY: u64 = 1 << 16;
const RECORDS: u64 = 1_000_000;
const ROUNDS: usize = 100;

/// A folder in memory where there is one.
fn folder() -> tempfile::TempDir {
    tempfile::tempdir_in("/dev/shm").or_else(|_| tempfile::tempdir()).unwrap()
}

/// A record that says its number: there and back again, by more or fewer points.
fn record(seq: u64) -> Vec<u8> {
    let count = 2 + (seq % 5) as usize;
    let along = |i: usize| i as f64 / (count - 1) as f64;
    let x = |i: usize| if seq.is_multiple_of(2) { along(i) } else { 1.0 - along(i) };
    let knots = [0.0].into_iter().chain((0..count).map(along)).chain([1.0]).collect();
    let points = (0..count).map(|i| Point3::new(x(i), 0.0, 0.0)).collect();
    let curve = Curve3::new(KnotVector::new(1, knots).unwrap(), points, None).unwrap();
    let axis = Vector3::z();
    let path = claymill_controller::Path {
        kind: MoveKind::Cut,
        curve,
        axis_start: axis,
        axis_end: axis,
        feed: 6000.0,
    };
    let mut bytes = Vec::new();
    Record::Path(Box::new(path)).encode(seq, &mut bytes);
    bytes
}

fn child(role: &str, place: &Path) -> Child {
    let mut command = Command::new(std::env::current_exe().unwrap());
    command.args(["--exact", "one_side", "--nocapture"]).env(ROLE, role).env(PLACE, place);
    command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap()
}

/// Not a test of its own: what a killed process was doing.
#[test]
fn one_side() {
    let (Ok(role), Ok(place)) = (std::env::var(ROLE), std::env::var(PLACE)) else { return };
    let place = PathBuf::from(place);
    match role.as_str() {
        "produce" => produce(&place),
        "send" => send(&place),
        "machine" => machine(&place),
        _ => consume(&place, RECORDS),
    }
}

const SECRET: &[u8] = b"a secret of both sides";
const SENT: u64 = 1_000_000;
const BREAKS: usize = 40;

fn address(place: &Path) -> String {
    fs::read_to_string(place.join("address")).unwrap()
}

/// Sends what the machine does not have yet, over as many connections as it takes.
fn send(place: &Path) {
    let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(u64::from(std::process::id()));
    loop {
        let sent = Sender::connect(&address(place), SECRET, 77).and_then(|mut sender| {
            for seq in sender.next()..SENT {
                sender.send(&record(seq))?;
                stall(&mut rng);
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

/// A machine: connections into the queue on one thread, the queue's consumer on the other.
fn machine(place: &Path) {
    let listener = TcpListener::bind(address(place)).unwrap();
    let queue = place.join("queue");
    std::thread::spawn(move || {
        let mut producer = Producer::open(&queue, CAPACITY).unwrap();
        for stream in listener.incoming() {
            match serve(stream.unwrap(), SECRET, &mut producer) {
                Ok(()) | Err(WireError::Io(_)) => {}
                Err(e) => panic!("{e}"),
            }
        }
    });
    consume(place, SENT);
}

fn stall(rng: &mut impl Rng) {
    if rng.random_ratio(1, 5_000) {
        std::thread::sleep(Duration::from_millis(rng.random_range(0..10)));
    }
}

fn produce(place: &Path) {
    let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(u64::from(std::process::id()));
    let mut queue = Producer::open(&place.join("queue"), CAPACITY).unwrap();
    for seq in queue.next()..RECORDS {
        let bytes = record(seq);
        loop {
            match queue.push(&bytes) {
                Ok(()) => break,
                Err(QueueError::Silent(_)) => {}
                Err(e) => panic!("{e}"),
            }
        }
        stall(&mut rng);
    }
    while let Err(QueueError::Silent(_)) = queue.flush() {}
}

/// "Cuts" a record by writing its number down; what was cut already is not cut again.
fn consume(place: &Path, count: u64) {
    let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(u64::from(std::process::id()));
    let mut queue = Consumer::open(&place.join("queue"), CAPACITY).unwrap();
    let mut log = OpenOptions::new().create(true).append(true).read(true).open(place.join("log")).unwrap();
    let size = log.metadata().unwrap().len() / 8 * 8;
    log.set_len(size).unwrap();
    let mut last = None;
    if size > 0 {
        let mut bytes = [0; 8];
        log.seek(SeekFrom::Start(size - 8)).unwrap();
        log.read_exact(&mut bytes).unwrap();
        last = Some(u64::from_le_bytes(bytes));
    }
    loop {
        match queue.peek() {
            Ok(Some(bytes)) => {
                let (seq, _) = Record::decode(bytes).unwrap();
                assert_eq!(bytes, record(seq), "record {seq} is another one");
                if last.is_none_or(|l| seq > l) {
                    log.write_all(&seq.to_le_bytes()).unwrap();
                    last = Some(seq);
                }
                queue.done().unwrap();
                if seq + 1 == count {
                    return;
                }
            }
            Ok(None) => std::thread::sleep(Duration::from_micros(50)),
            Err(QueueError::Silent(_)) => {}
            Err(e) => panic!("{e}"),
        }
        stall(&mut rng);
    }
}

#[test]
fn a_hundred_kills_lose_and_double_nothing() {
    let place = folder();
    let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(100);
    let mut sides = [child("produce", place.path()), child("consume", place.path())];
    let begun = Instant::now();
    let (mut kills, mut kept) = (0, 0);
    let done = |place: &Path| fs::metadata(place.join("log")).map_or(0, |m| m.len() / 8);
    while done(place.path()) < RECORDS {
        std::thread::sleep(Duration::from_millis(rng.random_range(1..12)));
        if kills < ROUNDS {
            let side = rng.random_range(0..2);
            sides[side].kill().unwrap();
            sides[side].wait().unwrap();
            sides[side] = child(["produce", "consume"][side], place.path());
            kills += 1;
            kept = done(place.path());
        }
        // A side that failed shows here.
        for (i, role) in ["produce", "consume"].into_iter().enumerate() {
            if sides[i].try_wait().unwrap().is_some_and(|s| !s.success()) {
                panic!("{role} failed after {} records", done(place.path()));
            }
        }
        assert!(begun.elapsed() < Duration::from_secs(240), "stuck at {} records", done(place.path()));
    }
    for mut side in sides {
        side.wait().unwrap();
    }
    let log = fs::read(place.path().join("log")).unwrap();
    assert_eq!(log.len() as u64, 8 * RECORDS);
    for (i, bytes) in log.chunks_exact(8).enumerate() {
        assert_eq!(u64::from_le_bytes(bytes.try_into().unwrap()), i as u64);
    }
    assert_eq!(kills, ROUNDS);
    assert!(fs::metadata(place.path().join("queue")).unwrap().len() <= 4096 + CAPACITY, "memory is bounded");
    eprintln!("{RECORDS} records, {kills} kills ({kept} records by the last one), {:?}", begun.elapsed());
}

#[test]
fn kills_on_either_side_of_a_connection_lose_and_double_nothing() {
    let place = folder();
    let free = TcpListener::bind("127.0.0.1:0").unwrap();
    fs::write(place.path().join("address"), free.local_addr().unwrap().to_string()).unwrap();
    drop(free);
    let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(7);
    let roles = ["send", "machine"];
    let mut sides = roles.map(|role| child(role, place.path()));
    let (begun, mut kills) = (Instant::now(), 0);
    let done = || fs::metadata(place.path().join("log")).map_or(0, |m| m.len() / 8);
    let mut kept = 0;
    while done() < SENT {
        std::thread::sleep(Duration::from_millis(rng.random_range(5..60)));
        if kills < BREAKS {
            let side = rng.random_range(0..2);
            sides[side].kill().unwrap();
            sides[side].wait().unwrap();
            sides[side] = child(roles[side], place.path());
            kills += 1;
            kept = done();
        }
        for (side, role) in sides.iter_mut().zip(roles) {
            assert!(side.try_wait().unwrap().is_none_or(|s| s.success()), "{role} failed after {}", done());
        }
        assert!(begun.elapsed() < Duration::from_secs(240), "stuck at {} records", done());
    }
    // The machine is done and gone, perhaps before the sender could hear of it.
    let [mut sender, mut machine] = sides;
    machine.wait().unwrap();
    let _ = sender.kill();
    sender.wait().unwrap();
    let log = fs::read(place.path().join("log")).unwrap();
    assert_eq!(log.len() as u64, 8 * SENT);
    for (i, bytes) in log.chunks_exact(8).enumerate() {
        assert_eq!(u64::from_le_bytes(bytes.try_into().unwrap()), i as u64);
    }
    assert_eq!(kills, BREAKS);
    eprintln!(
        "{SENT} records over TCP, {kills} kills ({kept} records by the last one), {:?}",
        begun.elapsed()
    );
}

#[test]
fn it_is_quick() {
    let place = folder();
    let path = place.path().join("queue");
    let count = 1_000_000u64;
    let records = [0, 1].map(|seq| Record::decode(&record(5 * seq)).unwrap().1);
    let mut bytes = Vec::new();
    records[0].encode(0, &mut bytes);
    let size = bytes.len();
    let mut producer = Producer::open(&path, 1 << 20).unwrap();
    let begun = Instant::now();
    let reader = std::thread::spawn(move || {
        let mut consumer = Consumer::open(&path, 1 << 20).unwrap();
        let mut next = 0;
        while next < count {
            if let Some(bytes) = consumer.peek().unwrap() {
                assert_eq!(bytes.len(), size);
                assert_eq!(bytes[4..12], next.to_le_bytes());
                consumer.done().unwrap();
                next += 1;
            }
        }
    });
    for seq in 0..count {
        bytes.clear();
        records[(seq % 2) as usize].encode(seq, &mut bytes);
        producer.push(&bytes).unwrap();
    }
    producer.flush().unwrap();
    reader.join().unwrap();
    let rate = count as f64 / begun.elapsed().as_secs_f64();
    eprintln!("{rate:.0} records of {size} bytes a second");
    assert!(rate > 200_000.0, "{rate}");
}

#[test]
fn silence_is_noticed_within_a_second() {
    let place = folder();
    let path = place.path().join("queue");
    let mut producer = Producer::open(&path, 4096).unwrap();
    let mut consumer = Consumer::open(&path, 4096).unwrap();
    // Nobody produces.
    let begun = Instant::now();
    let silent = loop {
        match consumer.peek() {
            Ok(None) => std::thread::sleep(Duration::from_millis(1)),
            other => break other.map(|_| ()),
        }
    };
    assert!(matches!(silent, Err(QueueError::Silent(_))));
    assert!(begun.elapsed() >= SILENCE && begun.elapsed() < Duration::from_secs(1), "{:?}", begun.elapsed());
    // Nobody consumes: the queue fills up, then blocks.
    let begun = Instant::now();
    let silent = (0..).map(|seq| producer.push(&record(seq))).find(Result::is_err);
    assert!(matches!(silent, Some(Err(QueueError::Silent(_)))));
    assert!(begun.elapsed() < Duration::from_secs(1), "{:?}", begun.elapsed());
}

#[test]
fn both_sides_may_be_the_first_at_the_same_time() {
    for _ in 0..ROUNDS {
        let folder = folder();
        let place = folder.path().join("queue");
        let together = std::sync::Barrier::new(2);
        std::thread::scope(|scope| {
            scope.spawn(|| {
                together.wait();
                Producer::open(&place, CAPACITY).unwrap();
            });
            scope.spawn(|| {
                together.wait();
                Consumer::open(&place, CAPACITY).unwrap();
            });
        });
    }
}
