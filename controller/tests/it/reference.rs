//! The reference controller at the end of a queue: set points on the curves, every limit between them, time as planned,
//! hold, abort and resume without a gap or a repetition.

use claymill_controller::{
    Consumer, Dynamics, Ended, Event, Machine, Order, Path, Producer, QueueError, Record, RecordError,
    Reference, SetPoint,
};
use claymill_motion::{JointRule, Limits, Looks, Rail, Schedule, Track};
use claymill_nurbs::{Curve3, Point3, Vector3};
use claymill_toolpath::MoveKind;

use crate::job;

fn paths() -> Vec<Path> {
    let job = job::job(&job::curves(), &Machine::default());
    // One setup: nothing is turned between the paths.
    let strokes = job.sections[0].strokes.iter();
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

/// Paths of one feed, or of two in turn.
fn cuts(curves: Vec<Curve3>, feeds: [f64; 2]) -> Vec<Path> {
    let path = |(i, curve): (usize, Curve3)| Path {
        kind: MoveKind::Cut,
        curve,
        axis_start: Vector3::z(),
        axis_end: Vector3::z(),
        feed: feeds[i % 2],
    };
    curves.into_iter().enumerate().map(path).collect()
}

/// A long wave cut into its pieces: curvature is continuous from path to path.
fn smooth(feeds: [f64; 2]) -> Vec<Path> {
    let points: Vec<[f64; 3]> =
        (0..24).map(f64::from).map(|i| [15.0 * i, 8.0 * (0.9 * i).sin(), 5.0 * (0.5 * i).cos()]).collect();
    cuts(job::curve(3, &points, None).bezier_pieces(), feeds)
}

/// The wave of the first path with a straight way on behind it: tangent, but the curvature jumps.
fn tangent() -> Vec<Path> {
    let whole = job::job(&job::curves(), &Machine::default());
    let curve = whole.sections[0].strokes[1].curve.clone();
    let end = curve.end();
    let on = curve.derivatives(curve.domain().1)[1].normalize();
    let ways =
        vec![curve, Curve3::line(end, end + on * 50.0), Curve3::line(end + on * 50.0, end + on * 90.0)];
    cuts(ways, [6000.0, 2000.0])
}

fn encoded(seq: u64, record: &Record) -> Vec<u8> {
    let mut bytes = Vec::new();
    record.encode(seq, &mut bytes);
    bytes
}

fn filled(queue: &std::path::Path, paths: &[Path]) -> Producer {
    let mut producer = Producer::open(queue, 1 << 20).unwrap();
    let records = paths.iter().map(|p| Record::Path(Box::new(p.clone())));
    for (seq, record) in
        records.chain([Record::Coolant(false), Record::Spindle(0.0), Record::End]).enumerate()
    {
        producer.push(&encoded(seq as u64, &record)).unwrap();
    }
    producer.flush().unwrap();
    producer
}

const LIMITS: Dynamics = Dynamics { acceleration_mm_per_s2: 1000.0, jerk_mm_per_s3: 10_000.0, cycle_s: 1e-3 };

fn reference() -> Reference {
    Reference { limits: LIMITS, real_time: false, single_step: false }
}

fn points_of(events: &[Event]) -> Vec<SetPoint> {
    events.iter().filter_map(|e| if let Event::At(p) = e { Some(*p) } else { None }).collect()
}

/// Every limit, by differences of set points one cycle apart; returns the largest of each.
fn check_limits(points: &[SetPoint], paths: &[Path], begin: Point3) -> [f64; 3] {
    let dt = LIMITS.cycle_s;
    let tips: Vec<Vector3> =
        std::iter::repeat_n(begin, 3).chain(points.iter().map(|p| p.tip)).map(|p| p.coords).collect();
    let differences = |v: &[Vector3]| -> Vec<Vector3> { v.windows(2).map(|w| (w[1] - w[0]) / dt).collect() };
    let velocity = differences(&tips);
    let acceleration = differences(&velocity);
    let jerk = differences(&acceleration);
    for (p, v) in points.iter().zip(&velocity[2..]) {
        let seq = p.seq as usize;
        let feed = paths[seq].feed.max(paths[seq.saturating_sub(1)].feed) / 60.0;
        assert!(v.norm() <= feed * (1.0 + 1e-9) + 1e-6, "{} mm/s in record {seq}", v.norm());
        assert!((paths[seq].curve.point(p.parameter) - p.tip).norm() <= 1e-4, "set point off its curve");
    }
    let most = |v: &[Vector3]| v.iter().map(Vector3::norm).fold(0.0, f64::max);
    let found = [most(&velocity), most(&acceleration), most(&jerk)];
    assert!(found[1] <= LIMITS.acceleration_mm_per_s2 * 1.001, "{found:?}");
    let worst = jerk.iter().position(|j| j.norm() == found[2]).unwrap_or(0);
    let at = &points[worst.saturating_sub(3)..(worst + 4).min(points.len())];
    assert!(found[2] <= LIMITS.jerk_mm_per_s3 * 1.001 + 1.0, "{found:?} at {at:?}");
    found
}

fn run(paths: &[Path]) -> (Vec<Event>, claymill_controller::Tally) {
    let folder = tempfile::tempdir().unwrap();
    let queue = folder.path().join("queue");
    let _producer = filled(&queue, paths);
    let mut consumer = Consumer::open(&queue, 1 << 20).unwrap();
    let mut events = Vec::new();
    let (ended, tally) = reference().run(&mut consumer, &mut || Order::Run, &mut |e| events.push(e)).unwrap();
    assert_eq!((ended, tally.paths), (Ended::Done, paths.len() as u64));
    let done: Vec<u64> =
        events.iter().filter_map(|e| if let Event::PathDone(seq) = e { Some(*seq) } else { None }).collect();
    assert_eq!(done, (0..paths.len() as u64).collect::<Vec<_>>());
    (events, tally)
}

/// How long the planner says that it takes.
fn planned_s(paths: &[Path]) -> f64 {
    let limits = Limits {
        acceleration_mm_per_s2: LIMITS.acceleration_mm_per_s2,
        jerk_mm_per_s3: LIMITS.jerk_mm_per_s3,
    };
    let mut track = Track::new(limits, JointRule::Within { mm: 0.005, stop_deg: 180.0 });
    for p in paths {
        track.add(&Rail::new(p.curve.clone(), Looks::COARSE), p.feed);
    }
    Schedule::new(&track, false).time_s()
}

#[test]
fn every_limit_is_kept_and_the_time_is_the_planned_one() {
    for (paths, stops, planner) in [
        (smooth([6000.0, 6000.0]), 1, true),
        (smooth([6000.0, 2000.0]), 1, true),
        (paths(), 29, true),
        // A control that rounds corners by 5 µm does not heed a jump of curvature; this one does.
        (tangent(), 1, false),
    ] {
        let (events, tally) = run(&paths);
        let points = points_of(&events);
        let found = check_limits(&points, &paths, paths[0].curve.start());
        let executed = tally.cycles as f64 * LIMITS.cycle_s;
        let planned = planned_s(&paths);
        eprintln!(
            "{} paths, {} stops, {executed:.3} s, planner {planned:.3} s; {found:?}",
            paths.len(),
            tally.stops
        );
        let waited = executed - tally.planned_s;
        assert!((-1e-9..=tally.stops as f64 * LIMITS.cycle_s).contains(&waited), "{waited}");
        assert!(!planner || (executed - planned).abs() <= 0.01 * planned, "{executed} {planned}");
        assert!(tally.stops <= stops, "{} stops", tally.stops);
        let end = points[points.len() - 1];
        assert!((end.tip - paths[paths.len() - 1].curve.end()).norm() < 1e-6);
    }
}

#[test]
fn what_arrives_late_is_run_without_a_stop_and_within_the_limits() {
    let folder = tempfile::tempdir().unwrap();
    let queue = folder.path().join("queue");
    let paths = smooth([6000.0, 2000.0]);
    let mut producer = Producer::open(&queue, 1 << 20).unwrap();
    let (mut next, mut cycle) = (0, 0u32);
    let mut consumer = Consumer::open(&queue, 1 << 20).unwrap();
    let mut points = Vec::new();
    let mut order = || {
        // One path every 150 cycles, though there were enough of them: the machine never knows what comes.
        if cycle % 150 == 0 && next <= paths.len() {
            let record = paths.get(next).map_or(Record::End, |p| Record::Path(Box::new(p.clone())));
            producer.push(&encoded(next as u64, &record)).unwrap();
            producer.flush().unwrap();
            next += 1;
        }
        cycle += 1;
        Order::Run
    };
    let mut report = |e: Event| points.extend(if let Event::At(p) = e { Some(p) } else { None });
    let (ended, tally) = reference().run(&mut consumer, &mut order, &mut report).unwrap();
    assert_eq!((ended, tally.paths), (Ended::Done, paths.len() as u64));
    let found = check_limits(&points, &paths, paths[0].curve.start());
    eprintln!("{} stops, {:.3} s; {found:?}", tally.stops, tally.cycles as f64 * 1e-3);
    assert!(tally.stops < paths.len() as u64, "{} stops", tally.stops);
}

#[test]
fn orders_between_paths_are_executed_in_their_place() {
    let folder = tempfile::tempdir().unwrap();
    let queue = folder.path().join("queue");
    let line = |a: f64, b: f64| {
        let curve = Curve3::line(Point3::new(a, 0.0, 0.0), Point3::new(b, 0.0, 0.0));
        let axis = Vector3::z();
        Record::Path(Box::new(Path {
            kind: MoveKind::Cut,
            curve,
            axis_start: axis,
            axis_end: axis,
            feed: 3000.0,
        }))
    };
    let records = [
        Record::Tool(3),
        Record::Spindle(12_000.0),
        line(0.0, 50.0),
        Record::Coolant(true),
        line(50.0, 100.0),
        Record::Output { number: 4, on: true },
        Record::Output { number: 5, on: true },
        line(100.0, 150.0),
        Record::Feed(0.5),
        line(150.0, 200.0),
        Record::Spindle(0.0),
        line(200.0, 210.0),
        Record::End,
    ];
    let mut producer = Producer::open(&queue, 1 << 20).unwrap();
    for (seq, record) in records.iter().enumerate() {
        producer.push(&encoded(seq as u64, record)).unwrap();
    }
    producer.flush().unwrap();
    let mut events = Vec::new();
    let mut consumer = Consumer::open(&queue, 1 << 20).unwrap();
    let (_, tally) = reference().run(&mut consumer, &mut || Order::Run, &mut |e| events.push(e)).unwrap();
    let order: Vec<u64> = (events.iter())
        .filter_map(|e| match e {
            Event::PathDone(seq) | Event::Executed(seq, _) => Some(*seq),
            _ => None,
        })
        .collect();
    assert_eq!(order, (0..records.len() as u64).collect::<Vec<_>>());
    let executed: Vec<_> = events
        .iter()
        .filter_map(|e| if let Event::Executed(_, r) = e { Some(r.clone()) } else { None })
        .collect();
    let others: Vec<_> = records.iter().filter(|r| !matches!(r, Record::Path(_))).cloned().collect();
    assert_eq!(executed, others);
    // Coolant and outputs are switched in passing; the spindle and another feed stop the machine.
    assert_eq!(tally.stops, 3);
    let where_was = |record: &Record| {
        let i = events.iter().position(|e| matches!(e, Event::Executed(_, r) if r == record)).unwrap();
        points_of(&events[..i]).last().copied()
    };
    let (coolant, feed) = (where_was(&records[3]).unwrap(), where_was(&records[8]).unwrap());
    assert!((coolant.tip.x - 50.0).abs() <= 0.051 && coolant.speed > 49.0, "{coolant:?}");
    assert!((feed.tip.x - 150.0).abs() < 1e-6 && feed.speed == 0.0, "{feed:?}");
    assert_eq!(where_was(&records[1]), None);
    let fastest =
        |seq: u64| points_of(&events).iter().filter(|p| p.seq == seq).map(|p| p.speed).fold(0.0, f64::max);
    approx::assert_relative_eq!(fastest(7), 50.0, max_relative = 1e-6);
    approx::assert_relative_eq!(fastest(9), 25.0, max_relative = 1e-6);
}

#[test]
fn a_path_that_begins_elsewhere_is_refused_unless_the_part_was_turned() {
    let away = |axis: Vector3| {
        let (a, b) = (Point3::new(50.0, 0.0, 0.0), Point3::new(60.0, 0.0, 0.0));
        let first =
            Path { feed: 6000.0, ..cuts(vec![Curve3::line(Point3::origin(), a)], [1.0; 2]).swap_remove(0) };
        let (curve, lift) = (Curve3::line(b, b + Vector3::y()), axis);
        let second = Path { curve, axis_start: lift, axis_end: lift, ..first.clone() };
        let folder = tempfile::tempdir().unwrap();
        let queue = folder.path().join("queue");
        let mut producer = Producer::open(&queue, 1 << 20).unwrap();
        for (seq, path) in [first, second].into_iter().enumerate() {
            producer.push(&encoded(seq as u64, &Record::Path(Box::new(path))))?;
        }
        producer.push(&encoded(2, &Record::End))?;
        producer.flush().unwrap();
        let mut consumer = Consumer::open(&queue, 1 << 20).unwrap();
        Ok(reference().run(&mut consumer, &mut || Order::Run, &mut |_| ()).unwrap().1.stops)
    };
    match away(Vector3::z()) {
        Err(QueueError::Record { seq: 1, source }) => assert_eq!(*source, RecordError::Gap { gap_mm: 10.0 }),
        other => panic!("{other:?}"),
    }
    assert_eq!(away(Vector3::x()).unwrap(), 2);
}

#[test]
fn one_path_at_a_time() {
    let folder = tempfile::tempdir().unwrap();
    let queue = folder.path().join("queue");
    let paths = smooth([6000.0, 2000.0]);
    let _producer = filled(&queue, &paths);
    let mut consumer = Consumer::open(&queue, 1 << 20).unwrap();
    let held = std::cell::Cell::new(0);
    let mut order = || {
        if held.get() > 0 {
            held.set(held.get() - 1);
            return Order::Hold;
        }
        Order::Run
    };
    let mut points = Vec::new();
    let mut report = |e: Event| match e {
        Event::At(p) => points.push(p),
        Event::PathDone(_) => held.set(20),
        _ => {}
    };
    let stepping = Reference { single_step: true, ..reference() };
    let (_, tally) = stepping.run(&mut consumer, &mut order, &mut report).unwrap();
    assert_eq!((tally.paths, tally.stops), (paths.len() as u64, paths.len() as u64));
    check_limits(&points, &paths, paths[0].curve.start());
}

#[test]
fn hold_abort_and_resume() {
    for paths in [smooth([6000.0, 2000.0]), tangent(), paths()] {
        for when in [40, 333, 700, 1100] {
            hold_abort_and_resume_at(&paths, when);
        }
    }
}

fn hold_abort_and_resume_at(paths: &[Path], when: u32) {
    let folder = tempfile::tempdir().unwrap();
    let queue = folder.path().join("queue");
    let _producer = filled(&queue, paths);
    let mut seen: Vec<SetPoint> = Vec::new();
    let mut cycle = 0u32;
    // Held for 700 cycles, aborted 400 cycles later: comes to rest, then leaves.
    let mut consumer = Consumer::open(&queue, 1 << 20).unwrap();
    let mut order = || {
        cycle += 1;
        match cycle {
            c if (when..when + 700).contains(&c) => Order::Hold,
            c if c >= when + 1100 => Order::Abort,
            _ => Order::Run,
        }
    };
    let mut keep = |e: Event| seen.extend(if let Event::At(p) = e { Some(p) } else { None });
    let (ended, _) = reference().run(&mut consumer, &mut order, &mut keep).unwrap();
    assert_eq!(ended, Ended::Aborted);
    let still = seen.windows(2).filter(|w| (w[1].tip - w[0].tip).norm() == 0.0).count();
    assert!(still > 50, "{still} cycles at rest");
    drop(consumer);
    // Another process takes it up.
    let at = seen[seen.len() - 1];
    let before = seen.len();
    let mut consumer = Consumer::open(&queue, 1 << 20).unwrap();
    let mut keep = |e: Event| seen.extend(if let Event::At(p) = e { Some(p) } else { None });
    let (ended, _) = reference().run(&mut consumer, &mut || Order::Run, &mut keep).unwrap();
    assert_eq!(ended, Ended::Done);
    assert!((seen[before].tip - at.tip).norm() < 1e-4, "{:?} after {at:?}", seen[before]);
    let numbers: Vec<u64> = seen.iter().map(|p| p.seq).collect();
    assert!(numbers.windows(2).all(|w| w[1] >= w[0]), "a record comes twice");
    assert_eq!(*numbers.last().unwrap(), paths.len() as u64 - 1);
    for w in seen.windows(2).filter(|w| w[0].seq == w[1].seq) {
        assert!(w[1].parameter >= w[0].parameter - 1e-9, "backwards");
    }
    check_limits(&seen, paths, paths[0].curve.start());
}
