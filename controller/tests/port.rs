//! A machine's port: orders beside a stream, and a stream that is dropped in the middle.

use std::net::TcpListener;
use std::path::PathBuf;
use std::sync::Arc;
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use claymill_controller::{
    Consumer, Dynamics, Ended, Event, Order, Panel, Path, Port, Producer, QueueError, Record, Reference,
    Sender, Tally, WireError, tell,
};
use claymill_nurbs::{Curve3, Point3, Vector3};
use claymill_toolpath::MoveKind;

const SECRET: &[u8] = b"sixteen bytes or more";
/// Room for some four hundred lines.
const CAPACITY: u64 = 1 << 16;

/// Line `i` of a staircase that begins at `from`.
fn line(from: Point3, i: u64) -> Vec<u8> {
    let at = |i: u64| from + Vector3::new(i.div_ceil(2) as f64, (i / 2) as f64, 0.0);
    let axis = Vector3::z();
    let curve = Curve3::line(at(i), at(i + 1));
    let path = Path { kind: MoveKind::Cut, curve, axis_start: axis, axis_end: axis, feed: 6000.0 };
    let mut bytes = Vec::new();
    Record::Path(Box::new(path)).encode(i, &mut bytes);
    bytes
}

fn sent(address: &str, name: u64, from: Point3, count: u64) -> Result<(), WireError> {
    let mut sender = Sender::connect(address, SECRET, name)?;
    for i in sender.next()..count {
        sender.send(&line(from, i))?;
    }
    sender.confirm()
}

/// A port into a queue; its address.
fn port(queue: &std::path::Path, panel: &Arc<Panel>) -> String {
    let port = Arc::new(Port::new(Producer::open(queue, CAPACITY).unwrap(), Arc::clone(panel)));
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = listener.local_addr().unwrap().to_string();
    std::thread::spawn(move || port.listen(&listener, &Arc::from(SECRET), |_| ()));
    address
}

/// Asks until the machine's status is as wanted.
fn until(address: &str, wanted: impl Fn(&claymill_controller::Status) -> bool) {
    let begun = Instant::now();
    while !wanted(&tell(address, SECRET, None).unwrap()) {
        assert!(begun.elapsed() < Duration::from_secs(30));
        std::thread::sleep(Duration::from_millis(5));
    }
}

/// A machine that does what the panel says with what is in a queue; in the end, how it ended and where its tip was.
fn machine(queue: PathBuf, panel: &Arc<Panel>, real_time: bool) -> JoinHandle<((Ended, Tally), Vec<Point3>)> {
    let shown = Arc::clone(panel);
    std::thread::spawn(move || {
        let limits = Dynamics { acceleration_mm_per_s2: 1000.0, jerk_mm_per_s3: 10_000.0, cycle_s: 1e-3 };
        let reference = Reference { limits, real_time, single_step: false };
        let mut consumer = Consumer::open(&queue, CAPACITY).unwrap();
        let mut tips = Vec::new();
        let mut report = |event: Event| {
            shown.saw(&event);
            tips.extend(if let Event::At(p) = event { Some(p.tip) } else { None });
        };
        let ended = reference.run(&mut consumer, &mut || shown.status().order, &mut report);
        (ended.unwrap(), tips)
    })
}

#[test]
fn a_stream_that_is_dropped_does_not_come_again() {
    let folder = tempfile::tempdir().unwrap();
    let queue = folder.path().join("queue");
    let panel = Arc::new(Panel::new(Order::Hold, false));
    let address = port(&queue, &panel);
    let machine = machine(queue, &panel, false);
    // Far more than the queue holds: the sender waits.
    let old = {
        let address = address.clone();
        std::thread::spawn(move || sent(&address, 7, Point3::origin(), 2000))
    };
    // Three paths, step by step; a connection that waits for a full queue does not keep orders out.
    for paths in 1..=3 {
        tell(&address, SECRET, Some(Order::Step)).unwrap();
        until(&address, |s| s.order == Order::Hold && s.paths == paths);
    }
    let status = tell(&address, SECRET, Some(Order::Discard)).unwrap();
    assert_eq!((status.order, status.discards, status.paths, status.speed), (Order::Hold, 1, 3, 0.0));
    let (tip, axis) = status.place.unwrap();
    assert!((tip - Point3::new(2.0, 1.0, 0.0)).norm() < 1e-9 && axis == Vector3::z(), "{tip:?}");
    // The sender's connection is gone; when it comes back, it is told why.
    assert!(old.join().unwrap().is_err());
    assert!(matches!(sent(&address, 7, Point3::origin(), 2000), Err(WireError::Dropped)));
    // Another stream begins where the machine stands; one that begins elsewhere would be refused.
    let mut sender = Sender::connect(&address, SECRET, 8).unwrap();
    assert_eq!(sender.next(), 0);
    for i in 0..10 {
        sender.send(&line(tip, i)).unwrap();
    }
    let mut end = Vec::new();
    Record::End.encode(10, &mut end);
    sender.send(&end).unwrap();
    sender.confirm().unwrap();
    tell(&address, SECRET, Some(Order::Run)).unwrap();
    let ((ended, tally), tips) = machine.join().unwrap();
    assert_eq!((ended, tally.paths), (Ended::Done, 13));
    let farthest = tips.windows(2).map(|w| (w[1] - w[0]).norm()).fold(0.0, f64::max);
    assert!(farthest <= 0.1 + 1e-9, "{farthest} mm in a cycle");
    assert!((tips[tips.len() - 1] - (tip + Vector3::new(5.0, 5.0, 0.0))).norm() < 1e-6);
}

#[test]
fn what_was_dropped_stays_dropped_when_the_machine_is_started_again() {
    let folder = tempfile::tempdir().unwrap();
    let queue = folder.path().join("queue");
    let mut producer = Producer::open(&queue, CAPACITY).unwrap();
    assert_eq!(producer.resume(7).unwrap(), 0);
    for i in 0..20 {
        producer.push(&line(Point3::origin(), i)).unwrap();
    }
    producer.flush().unwrap();
    assert_eq!(producer.abandon().unwrap(), 7);
    drop(producer);
    let mut consumer = Consumer::open(&queue, CAPACITY).unwrap();
    assert!(consumer.look().unwrap().is_some());
    consumer.discard().unwrap();
    assert_eq!(consumer.next(), 20);
    assert!(consumer.look().unwrap().is_none());
    let mut again = Producer::open(&queue, CAPACITY).unwrap();
    assert!(again.resume(7).is_err());
    assert_eq!(again.resume(8).unwrap(), 0);
    again.push(&line(Point3::origin(), 0)).unwrap();
    again.flush().unwrap();
    drop(consumer);
    let mut consumer = Consumer::open(&queue, CAPACITY).unwrap();
    assert_eq!(consumer.peek().unwrap().unwrap(), line(Point3::origin(), 0));
}

/// Two processes in one: a machine in the middle of a path, a producer that goes on writing, and one that recalls it.
#[test]
fn a_stream_that_is_recalled_ends_and_the_machine_says_where_it_stands() {
    let folder = tempfile::tempdir().unwrap();
    let queue = folder.path().join("queue");
    let panel = Arc::new(Panel::new(Order::Run, false));
    let old = {
        let queue = queue.clone();
        std::thread::spawn(move || -> Result<(), QueueError> {
            let mut producer = Producer::open(&queue, CAPACITY)?;
            producer.resume(7)?;
            for i in 0..100_000 {
                while let Err(error) = producer.push(&line(Point3::origin(), i)) {
                    let QueueError::Silent(_) = error else { return Err(error) };
                }
            }
            producer.flush()
        })
    };
    let machine = machine(queue.clone(), &panel, true);
    let begun = Instant::now();
    while panel.status().paths < 3 || panel.status().speed < 10.0 {
        assert!(begun.elapsed() < Duration::from_secs(30));
        std::thread::sleep(Duration::from_millis(1));
    }
    let mut producer = Producer::open(&queue, CAPACITY).unwrap();
    let (tip, axis) = producer.recall().unwrap().expect("it has moved");
    assert!(matches!(old.join().unwrap(), Err(QueueError::Dropped)));
    assert_eq!((axis, panel.status().speed, panel.status().discards), (Vector3::z(), 0.0, 1));
    // It goes on without an order, with what begins where it stands.
    assert_eq!(producer.resume(8).unwrap(), 0);
    for i in 0..10 {
        producer.push(&line(tip, i)).unwrap();
    }
    let mut end = Vec::new();
    Record::End.encode(10, &mut end);
    producer.push(&end).unwrap();
    producer.flush().unwrap();
    let ((ended, _), tips) = machine.join().unwrap();
    assert_eq!(ended, Ended::Done);
    let farthest = tips.windows(2).map(|w| (w[1] - w[0]).norm()).fold(0.0, f64::max);
    assert!(farthest <= 0.1 + 1e-9, "{farthest} mm in a cycle");
    assert!((tips[tips.len() - 1] - (tip + Vector3::new(5.0, 5.0, 0.0))).norm() < 1e-6);
    // Nobody is there any more: that is said, not waited for.
    assert!(matches!(producer.recall(), Err(QueueError::Silent(_))));
}

#[test]
fn a_second_stream_is_turned_away_and_the_first_one_goes_on() {
    let folder = tempfile::tempdir().unwrap();
    let queue = folder.path().join("queue");
    let panel = Arc::new(Panel::new(Order::Run, false));
    let address = port(&queue, &panel);
    let machine = machine(queue.clone(), &panel, false);
    let turned_away = |name| match Sender::connect(&address, SECRET, name) {
        Err(WireError::Busy(why)) => why,
        other => panic!("{other:?}"),
    };
    let mut first = Sender::connect(&address, SECRET, 7).unwrap();
    first.send(&line(Point3::origin(), 0)).unwrap();
    first.confirm().unwrap();
    assert!(turned_away(8).contains("being received"));
    first.send(&line(Point3::origin(), 1)).unwrap();
    first.confirm().unwrap();
    // Beside it, a program on this side is turned away too.
    let mut beside = Producer::open(&queue, CAPACITY).unwrap();
    assert!(matches!(beside.resume(9), Err(QueueError::Written)));
    drop(first);
    // Gone in the middle: still nobody takes its place without a word.
    let begun = Instant::now();
    while turned_away(8).contains("being received") {
        assert!(begun.elapsed() < Duration::from_secs(10));
    }
    assert!(turned_away(8).contains("not ended"));
    assert!(matches!(beside.resume(9), Err(QueueError::Unfinished)));
    let mut again = Sender::connect(&address, SECRET, 7).unwrap();
    assert_eq!(again.next(), 2);
    let mut end = Vec::new();
    Record::End.encode(2, &mut end);
    again.send(&end).unwrap();
    again.confirm().unwrap();
    let ((ended, tally), _) = machine.join().unwrap();
    assert_eq!((ended, tally.paths), (Ended::Done, 2));
}

#[test]
fn strangers_that_drip_do_not_keep_orders_out() {
    let folder = tempfile::tempdir().unwrap();
    let panel = Arc::new(Panel::new(Order::Run, false));
    let address = port(&folder.path().join("queue"), &panel);
    let mut strangers = Vec::new();
    for _ in 0..300 {
        let stream = std::net::TcpStream::connect(&address).unwrap();
        stream.set_nonblocking(true).unwrap();
        strangers.push((stream, Instant::now()));
    }
    let begun = Instant::now();
    let mut lived = Duration::ZERO;
    let mut most = 0;
    while !strangers.is_empty() {
        // Each says a byte now and then, and looks whether it was sent away.
        strangers.retain_mut(|(stream, since)| {
            use std::io::{Read, Write};
            let _ = stream.write(&[1]);
            let mut bytes = [0; 64];
            let gone = loop {
                match stream.read(&mut bytes) {
                    Ok(0) => break true,
                    Ok(_) => {}
                    Err(e) => break e.kind() != std::io::ErrorKind::WouldBlock,
                }
            };
            if gone {
                lived = lived.max(since.elapsed());
            }
            !gone
        });
        most = most.max(strangers.len());
        let asked = Instant::now();
        assert_eq!(tell(&address, SECRET, Some(Order::Hold)).unwrap().order, Order::Hold);
        assert!(asked.elapsed() < Duration::from_secs(3), "{:?}", asked.elapsed());
        assert!(begun.elapsed() < Duration::from_secs(20), "{} never go", strangers.len());
        std::thread::sleep(Duration::from_millis(100));
    }
    eprintln!("the last of 300 was sent away after {lived:?}, of at most {most} at once");
    assert!(lived < Duration::from_secs(6), "{lived:?}");
}
