//! The reference controller at the end of a queue: set points on the curves, time as planned, hold, abort and
//! resume without a gap or a repetition.

mod job;

use claymill_controller::{
    Consumer, Dynamics, Ended, Machine, Motion, Order, Path, Producer, Record, Reference, SetPoint,
};
use claymill_nurbs::{Curve3, Vector3};
use claymill_toolpath::MoveKind;

fn paths() -> Vec<Path> {
    let job = job::job(&job::curves(), &Machine::default());
    let strokes = job.sections.iter().flat_map(|s| &s.strokes);
    strokes
        .map(|s| Path {
            kind: s.kind,
            curve: s.curve.clone(),
            axis_start: Vector3::z(),
            axis_end: Vector3::z(),
            feed: s.feed,
        })
        .filter(|p| p.curve.knots().degree() > 1 || p.curve.points().len() == 2)
        .collect()
}

fn filled(queue: &std::path::Path, paths: &[Path]) -> Producer {
    let mut producer = Producer::open(queue, 1 << 20).unwrap();
    let mut bytes = Vec::new();
    for (seq, path) in paths.iter().enumerate() {
        bytes.clear();
        Record::Path(Box::new(path.clone())).encode(seq as u64, &mut bytes);
        producer.push(&bytes).unwrap();
    }
    for (extra, record) in [Record::Coolant(false), Record::Spindle(0.0), Record::End].iter().enumerate() {
        bytes.clear();
        record.encode((paths.len() + extra) as u64, &mut bytes);
        producer.push(&bytes).unwrap();
    }
    producer.flush().unwrap();
    producer
}

fn reference() -> Reference {
    let limits = Dynamics { acceleration_mm_per_s2: 3000.0, jerk_mm_per_s3: 60_000.0, cycle_s: 1e-3 };
    Reference { limits, real_time: false, single_step: false }
}

fn far(curve: &Curve3, p: &SetPoint) -> f64 {
    (curve.point(p.parameter) - p.tip).norm()
}

#[test]
fn set_points_are_on_the_curves_and_in_time() {
    let folder = tempfile::tempdir().unwrap();
    let queue = folder.path().join("queue");
    let paths = paths();
    let _producer = filled(&queue, &paths);
    let mut consumer = Consumer::open(&queue, 1 << 20).unwrap();
    let mut points = Vec::new();
    let reference = reference();
    let (ended, tally) = reference.run(&mut consumer, &mut || Order::Run, &mut |p| points.push(p)).unwrap();
    assert_eq!((ended, tally.paths), (Ended::Done, paths.len() as u64));
    let planned: f64 = paths.iter().map(|p| Motion::plan(&p.curve, p.feed, &reference.limits).time_s()).sum();
    let executed = tally.cycles as f64 * reference.limits.cycle_s;
    eprintln!("{} set points, {executed:.3} s executed, {planned:.3} s planned", points.len());
    assert!((executed - planned).abs() <= 0.01 * planned, "{executed} {planned}");
    let worst = points.iter().map(|p| far(&paths[p.seq as usize].curve, p)).fold(0.0, f64::max);
    assert!(worst <= 1e-4, "{worst}");
    for (seq, path) in paths.iter().enumerate() {
        let own: Vec<_> = points.iter().filter(|p| p.seq == seq as u64).collect();
        assert!(own.windows(2).all(|w| w[1].parameter >= w[0].parameter), "record {seq} runs backwards");
        assert!((own[own.len() - 1].tip - path.curve.end()).norm() < 1e-9 && own[own.len() - 1].last);
        // Speed between set points stays below the feed.
        let fastest = own.windows(2).map(|w| (w[1].tip - w[0].tip).norm()).fold(0.0, f64::max) / 1e-3;
        assert!(fastest <= path.feed / 60.0 * 1.0001, "record {seq}: {fastest} mm/s");
    }
}

#[test]
fn hold_abort_and_resume() {
    let folder = tempfile::tempdir().unwrap();
    let queue = folder.path().join("queue");
    let paths = paths();
    let _producer = filled(&queue, &paths);
    let mut seen: Vec<SetPoint> = Vec::new();
    let cycle = std::cell::Cell::new(0u32);
    let reference = reference();
    // Held from cycle 300 to 1000, aborted at 2000: comes to rest, then leaves.
    let mut consumer = Consumer::open(&queue, 1 << 20).unwrap();
    let mut order = || {
        cycle.set(cycle.get() + 1);
        match cycle.get() {
            300..1000 => Order::Hold,
            2000.. => Order::Abort,
            _ => Order::Run,
        }
    };
    let (ended, _) = reference.run(&mut consumer, &mut order, &mut |p| seen.push(p)).unwrap();
    assert_eq!(ended, Ended::Aborted);
    let still = seen.windows(2).filter(|w| (w[1].tip - w[0].tip).norm() == 0.0).count();
    assert!(still > 300, "{still} cycles at rest");
    drop(consumer);
    // Another process takes it up.
    let at = *seen.last().unwrap();
    let mut consumer = Consumer::open(&queue, 1 << 20).unwrap();
    let (ended, _) = reference.run(&mut consumer, &mut || Order::Run, &mut |p| seen.push(p)).unwrap();
    assert_eq!(ended, Ended::Done);
    let resumed = seen.iter().skip_while(|p| **p != at).nth(1).unwrap();
    assert_eq!(resumed.seq, if at.last { at.seq + 1 } else { at.seq });
    assert!((resumed.tip - at.tip).norm() < 0.2, "{resumed:?} after {at:?}");
    let numbers: Vec<u64> = seen.iter().map(|p| p.seq).collect();
    assert!(
        numbers.windows(2).all(|w| w[1] == w[0] || w[1] == w[0] + 1),
        "a record is missing or comes twice"
    );
    assert_eq!(*numbers.last().unwrap(), paths.len() as u64 - 1);
    assert_eq!(paths.iter().filter(|p| p.kind == MoveKind::Cut).count(), 9);
}
