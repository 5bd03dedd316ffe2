//! Whatever is in a queue, the machine comes to rest within its limits, says why, and goes on when what waits was dropped.

use std::net::TcpListener;
use std::path::Path;

use crate::records::{bad, damage_word, encoded, line, plant};
use claymill_controller::{
    Consumer, Dynamics, Ended, Event, Order, Panel, Producer, QueueError, Record, Reference, ReferenceError,
    Sender, WireError, serve,
};

const CAPACITY: u64 = 1 << 16;
const LIMITS: Dynamics = Dynamics { acceleration_mm_per_s2: 1000.0, jerk_mm_per_s3: 10_000.0, cycle_s: 1e-3 };
const FEED: f64 = 20_000.0;
/// As long as it takes to gain that feed.
const LONG_MM: f64 = 1000.0;
/// The machine is in the middle of the path.
const MIDDLE: usize = 1500;

/// What a run gave.
struct Ran {
    ended: Result<Ended, ReferenceError>,
    events: Vec<Event>,
    /// What the panel showed when everything stood still.
    fault: Option<String>,
}

/// Runs what is in a queue; calls `meddle` in the middle of the path; when it rests with a fault, gives `last`, and calls
/// `behind` when what waits was dropped.
fn run(queue: &Path, last: Order, mut meddle: impl FnMut(), mut behind: impl FnMut(f64)) -> Ran {
    let panel = Panel::new(Order::Run, false);
    let mut consumer = Consumer::open(queue, CAPACITY).unwrap();
    let (mut fault, mut still, mut cycles) = (None, 0, 0);
    let mut discarded = false;
    let events = std::cell::RefCell::new(Vec::new());
    let mut report = |event: Event| {
        panel.saw(&event);
        events.borrow_mut().push(event);
    };
    let mut order = || {
        cycles += 1;
        if cycles == MIDDLE {
            meddle();
        }
        assert!(cycles < 100_000, "it never ends: {:?}", panel.status());
        let status = panel.status();
        if status.fault.is_some() {
            still = if status.speed == 0.0 { still + 1 } else { 0 };
            if still == 30 {
                fault = status.fault;
                panel.tell(last);
            }
        }
        if status.discards > 0 && !std::mem::replace(&mut discarded, true) {
            behind(status.place.map_or(0.0, |(tip, _)| tip.x));
            panel.tell(Order::Run);
        }
        panel.order()
    };
    let reference = Reference { limits: LIMITS, real_time: false, single_step: false };
    let ended = reference.run(&mut consumer, &mut order, &mut report).map(|(ended, _)| ended);
    Ran { ended, events: events.into_inner(), fault }
}

/// Checks every limit by differences of set points, with rest before the first and behind the last one; returns where that
/// is.
fn rests_within_limits(events: &[Event], what: &str) -> f64 {
    let points = events.iter().filter_map(|e| if let Event::At(p) = e { Some(p.tip.x) } else { None });
    let mut tips: Vec<f64> = [0.0; 3].into_iter().chain(points).collect();
    let end = tips[tips.len() - 1];
    tips.extend([end; 3]);
    let differences =
        |v: &[f64]| -> Vec<f64> { v.windows(2).map(|w| (w[1] - w[0]) / LIMITS.cycle_s).collect() };
    let velocity = differences(&tips);
    let acceleration = differences(&velocity);
    let jerk = differences(&acceleration);
    let most = |v: &[f64]| v.iter().fold(0.0_f64, |a, b| a.max(b.abs()));
    let found = [most(&velocity), most(&acceleration), most(&jerk)];
    assert!(found[0] <= FEED / 60.0 * 1.000_001, "{what}: {found:?}");
    assert!(found[1] <= LIMITS.acceleration_mm_per_s2 * 1.001, "{what}: {found:?}");
    assert!(found[2] <= LIMITS.jerk_mm_per_s3 * 1.001 + 1.0, "{what}: {found:?}");
    end
}

/// A queue that a producer has begun with a long path.
fn begun(queue: &Path) {
    let mut producer = Producer::open(queue, CAPACITY).unwrap();
    assert_eq!(producer.resume(7).unwrap(), 0);
    producer.push(&encoded(0, &line(0.0, LONG_MM, FEED))).unwrap();
    producer.flush().unwrap();
}

/// Another stream, from where the machine stands.
fn next_stream(queue: &Path, from_mm: f64) {
    let mut producer = Producer::open(queue, CAPACITY).unwrap();
    assert_eq!(producer.resume(8).unwrap(), 0);
    producer.push(&encoded(0, &line(from_mm, from_mm + 5.0, 600.0))).unwrap();
    producer.push(&encoded(1, &Record::End)).unwrap();
    producer.flush().unwrap();
}

#[test]
fn a_bad_record_ends_at_rest_before_it_and_is_dropped_by_an_order() {
    for late in [false, true] {
        for (what, bytes) in bad(1, LONG_MM) {
            let folder = tempfile::tempdir().unwrap();
            let queue = folder.path().join("queue");
            begun(&queue);
            let spoil = || plant(&queue, &bytes, bytes.len() as u32);
            if !late {
                spoil();
            }
            let ran = run(
                &queue,
                Order::Discard,
                || {
                    if late {
                        spoil()
                    }
                },
                |x| {
                    assert!((x - LONG_MM).abs() < 1e-6, "{what}: rests at {x}");
                    next_stream(&queue, x);
                },
            );
            assert_eq!(ran.ended.unwrap(), Ended::Done, "{what}");
            let fault = ran.fault.unwrap_or_else(|| panic!("{what}: nothing on the panel"));
            assert!(fault.starts_with("record 1: "), "{what}: {fault}");
            // Up to the drop; what follows is another motion from rest.
            assert!((rests_within_limits(&ran.events, what) - LONG_MM - 5.0).abs() < 1e-6, "{what}");
            let done: Vec<u64> = ran
                .events
                .iter()
                .filter_map(|e| if let Event::PathDone(seq) = e { Some(*seq) } else { None })
                .collect();
            assert_eq!(done, [0, 0], "{what}");
        }
    }
}

#[test]
fn a_bad_record_stays_for_whoever_starts_next_and_he_can_drop_it_too() {
    let folder = tempfile::tempdir().unwrap();
    let queue = folder.path().join("queue");
    begun(&queue);
    let (_, bytes) = bad(1, LONG_MM).into_iter().find(|(what, _)| what.starts_with("spindle")).unwrap();
    plant(&queue, &bytes, bytes.len() as u32);
    // Told to leave, it says what is wrong.
    let ran = run(&queue, Order::Abort, || (), |_| ());
    assert!(matches!(ran.ended, Err(ReferenceError::Record { seq: 1, .. })), "{:?}", ran.ended);
    assert!((rests_within_limits(&ran.events, "abort") - LONG_MM).abs() < 1e-6);
    let again = run(&queue, Order::Discard, || (), |_| next_stream(&queue, 40.0));
    assert_eq!(again.ended.unwrap(), Ended::Done);
}

#[test]
fn a_damaged_queue_brings_the_machine_to_rest_on_its_path() {
    type Damage = (&'static str, fn(&Path));
    let damages: [Damage; 4] = [
        ("a length that is a lie", |queue| plant(queue, &[1, 2, 3], 1 << 31)),
        ("a length beyond what was written", |queue| plant(queue, &[1, 2, 3], 5)),
        ("a word", damage_word),
        ("a word and a record", |queue| {
            plant(queue, &[0; 20], 20);
            damage_word(queue);
        }),
    ];
    for (what, damage) in damages {
        let folder = tempfile::tempdir().unwrap();
        let queue = folder.path().join("queue");
        begun(&queue);
        let ran = run(&queue, Order::Discard, || damage(&queue), |x| next_stream(&queue, x));
        assert_eq!(ran.ended.unwrap(), Ended::Done, "{what}");
        assert!(ran.fault.is_some(), "{what}");
        rests_within_limits(&ran.events, what);
    }
}

#[test]
fn a_queue_that_is_cut_off_cannot_be_cleared_but_the_machine_rests() {
    let folder = tempfile::tempdir().unwrap();
    let queue = folder.path().join("queue");
    begun(&queue);
    let cut = || {
        std::fs::OpenOptions::new().write(true).open(&queue).unwrap().set_len(10).unwrap();
        // The machine looks at the queue by the clock, and this one does not keep to real time.
        std::thread::sleep(std::time::Duration::from_millis(200));
    };
    let ran = run(&queue, Order::Abort, cut, |_| ());
    assert!(matches!(ran.ended, Err(ReferenceError::Queue(QueueError::Io(_)))), "{:?}", ran.ended);
    let x = rests_within_limits(&ran.events, "cut off");
    assert!(x > 100.0 && x < 0.9 * LONG_MM, "{x}");
}

#[test]
fn a_producer_does_not_take_a_bad_record() {
    for (what, bytes) in bad(1, LONG_MM) {
        let folder = tempfile::tempdir().unwrap();
        let queue = folder.path().join("queue");
        let mut producer = Producer::open(&queue, CAPACITY).unwrap();
        producer.resume(7).unwrap();
        producer.push(&encoded(0, &line(0.0, LONG_MM, FEED))).unwrap();
        assert!(matches!(producer.push(&bytes), Err(QueueError::Record { .. })), "{what}");
        // It is as if it had never come.
        producer.push(&encoded(1, &Record::End)).unwrap();
        producer.flush().unwrap();
        assert_eq!(run(&queue, Order::Abort, || (), |_| ()).ended.unwrap(), Ended::Done, "{what}");
    }
}

#[test]
fn a_machine_refuses_a_bad_record_before_it_acknowledges_it() {
    let secret = b"sixteen bytes or more";
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = listener.local_addr().unwrap().to_string();
    for (what, bytes) in bad(1, LONG_MM) {
        let folder = tempfile::tempdir().unwrap();
        let queue = folder.path().join("queue");
        let mut producer = Producer::open(&queue, CAPACITY).unwrap();
        std::thread::scope(|scope| {
            let served = scope.spawn(|| serve(listener.accept().unwrap().0, secret, &mut producer));
            let mut sender = Sender::connect(&address, secret, 7).unwrap();
            sender.send(&encoded(0, &line(0.0, LONG_MM, FEED))).unwrap();
            sender.confirm().unwrap();
            // Much more behind it: the sender still hears why.
            sender.send(&bytes).unwrap();
            let mut refused = Ok(());
            for seq in 2..1000 {
                refused = sender.send(&encoded(seq, &line(0.0, 1.0, 600.0)));
                if refused.is_err() {
                    break;
                }
            }
            match refused.and_then(|()| sender.confirm()) {
                Err(WireError::Refused(why)) => assert!(why.starts_with("record "), "{what}: {why}"),
                other => panic!("{what}: {other:?}"),
            }
            drop(sender);
            assert!(matches!(served.join().unwrap(), Err(WireError::Queue(_))), "{what}");
        });
        drop(producer);
        let mut consumer = Consumer::open(&queue, CAPACITY).unwrap();
        assert_eq!(consumer.peek().unwrap().unwrap(), encoded(0, &line(0.0, LONG_MM, FEED)), "{what}");
        consumer.done().unwrap();
        assert!(matches!(consumer.peek(), Ok(None)), "{what}: it is in the queue");
    }
}
