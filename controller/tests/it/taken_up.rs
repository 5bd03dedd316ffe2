//! A controller that is started again tells the machine again what an earlier one had told it, before anything moves.

use crate::records::{encoded, line};
use claymill_controller::{Consumer, Dynamics, Ended, Event, Order, Producer, Record, Reference};

const CAPACITY: u64 = 1 << 16;

fn reference() -> Reference {
    let limits = Dynamics { acceleration_mm_per_s2: 1000.0, jerk_mm_per_s3: 10_000.0, cycle_s: 1e-3 };
    Reference { limits, real_time: false, single_step: false }
}

/// Runs until so many cycles have passed, then leaves.
fn run(queue: &std::path::Path, cycles: usize) -> (Ended, Vec<Event>) {
    let mut consumer = Consumer::open(queue, CAPACITY).unwrap();
    let (mut events, mut count) = (Vec::new(), 0);
    let mut order = || {
        count += 1;
        if count > cycles { Order::Abort } else { Order::Run }
    };
    let (ended, _) = reference().run(&mut consumer, &mut order, &mut |e| events.push(e)).unwrap();
    (ended, events)
}

#[test]
fn tool_spindle_coolant_and_outputs_are_told_again_before_motion() {
    let folder = tempfile::tempdir().unwrap();
    let queue = folder.path().join("queue");
    let output = |number, on| Record::Output { number, on };
    let records = [
        Record::Tool(3),
        Record::Spindle(12_000.0),
        Record::Coolant(true),
        output(4, true),
        output(4, false),
        output(9, true),
        line(0.0, 100.0, 3000.0),
        Record::Spindle(9000.0),
        line(100.0, 200.0, 3000.0),
        Record::End,
    ];
    let mut producer = Producer::open(&queue, CAPACITY).unwrap();
    producer.resume(7).unwrap();
    for (seq, record) in records.iter().enumerate() {
        producer.push(&encoded(seq as u64, record)).unwrap();
    }
    producer.flush().unwrap();
    let again = |events: &[Event]| -> Vec<Record> {
        let moved = |e: &Event| matches!(e, Event::At(p) if p.speed > 0.0);
        let first = events.iter().position(moved).unwrap_or(events.len());
        let told = |e: &Event| if let Event::ToldAgain(r) = e { Some(r.clone()) } else { None };
        assert!(events[first..].iter().all(|e| told(e).is_none()), "told again in motion");
        events[..first].iter().filter_map(told).collect()
    };
    // The first one tells nothing again.
    let (ended, events) = run(&queue, 500);
    assert_eq!((ended, again(&events)), (Ended::Aborted, Vec::new()));
    // In the middle of the first path: everything, as it was last.
    let (ended, events) = run(&queue, 500);
    assert_eq!(ended, Ended::Aborted);
    let mut all =
        vec![records[0].clone(), records[1].clone(), records[2].clone(), output(4, false), output(9, true)];
    assert_eq!(again(&events), all);
    // Twice is as once; this one comes to the second path.
    let (_, events) = run(&queue, 2000);
    assert_eq!(again(&events), all);
    assert!(events.contains(&Event::Executed(7, records[7].clone())));
    // Behind the second spindle, that one.
    all[1] = records[7].clone();
    let (ended, events) = run(&queue, usize::MAX);
    assert_eq!((ended, again(&events)), (Ended::Done, all));
    // A stream from its beginning tells all that it needs itself; what it does not tell is told again.
    producer.resume(8).unwrap();
    for (seq, record) in
        [Record::Tool(5), Record::Spindle(100.0), line(0.0, 5.0, 600.0), Record::End].iter().enumerate()
    {
        producer.push(&encoded(seq as u64, record)).unwrap();
    }
    producer.flush().unwrap();
    let (_, events) = run(&queue, usize::MAX);
    assert_eq!(again(&events), [Record::Coolant(true), output(4, false), output(9, true)]);
}

#[test]
fn a_machine_that_is_held_is_told_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let queue = folder.path().join("queue");
    let mut producer = Producer::open(&queue, CAPACITY).unwrap();
    for (seq, record) in [Record::Tool(3), line(0.0, 100.0, 3000.0), Record::End].iter().enumerate() {
        producer.push(&encoded(seq as u64, record)).unwrap();
    }
    producer.flush().unwrap();
    run(&queue, 300);
    let mut consumer = Consumer::open(&queue, CAPACITY).unwrap();
    let (mut events, mut count) = (Vec::new(), 0);
    let mut order = || {
        count += 1;
        if count > 100 { Order::Abort } else { Order::Hold }
    };
    reference().run(&mut consumer, &mut order, &mut |e| events.push(e)).unwrap();
    assert!(events.iter().all(|e| matches!(e, Event::At(p) if p.speed == 0.0)), "{events:?}");
}
