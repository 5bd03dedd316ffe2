use std::time::{Duration, Instant};

use claymill_nurbs::Point3;

use crate::{Consumer, Dynamics, Motion, QueueError, Record, RecordError};

/// What the machine is told while it runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Order {
    /// Go on.
    Run,
    /// Come to rest on the path and wait.
    Hold,
    /// Come to rest on the path and leave; what was not done stays in the queue.
    Abort,
}

/// Where the machine is, once a cycle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SetPoint {
    /// Number of the record in its stream.
    pub seq: u64,
    /// Whether this is the path's end.
    pub last: bool,
    /// Parameter on its curve.
    pub parameter: f64,
    /// The tip, mm.
    pub tip: Point3,
    /// Time within the path as planned, s.
    pub time_s: f64,
}

/// How a reference controller ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Ended {
    /// The stream's end was reached.
    Done,
    /// It was told to.
    Aborted,
}

/// What a run took.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Tally {
    /// Paths run.
    pub paths: u64,
    /// Cycles executed on paths.
    pub cycles: u64,
    /// Time that the paths were planned to take, s.
    pub planned_s: f64,
}

/// Why a reference controller stopped.
#[derive(Debug, thiserror::Error)]
pub enum ReferenceError {
    /// The queue cannot be used.
    #[error(transparent)]
    Queue(#[from] QueueError),
    /// A record is damaged.
    #[error("record {seq}: {source}")]
    Record {
        /// Its number.
        seq: u64,
        /// What is wrong.
        source: RecordError,
    },
}

/// A control that exists here only: takes records from a queue and runs along their curves at a servo rate,
/// from rest to rest, under limits of velocity, acceleration and jerk.
#[derive(Debug, Clone, Copy)]
pub struct Reference {
    /// Limits and cycle.
    pub limits: Dynamics,
    /// Keep to real time; else as fast as it goes.
    pub real_time: bool,
    /// Wait with [`Order::Hold`] semantics after every path until told to run again.
    pub single_step: bool,
}

impl Reference {
    /// Runs until the stream ends. `order` is asked once a cycle; `report` gets every set point. A record counts
    /// as done when its end was reached; one that was interrupted is taken up again where `progress` of the
    /// queue says.
    ///
    /// # Errors
    /// The queue cannot be used, or a record is damaged. A producer that falls silent is waited for.
    pub fn run(
        &self,
        queue: &mut Consumer,
        order: &mut dyn FnMut() -> Order,
        report: &mut dyn FnMut(SetPoint),
    ) -> Result<(Ended, Tally), ReferenceError> {
        let mut tally = Tally::default();
        // What the last cycle overshot goes to the next path: the clock is not lost between paths.
        let mut late_s = 0.0;
        loop {
            if order() == Order::Abort {
                return Ok((Ended::Aborted, tally));
            }
            let seq = queue.next();
            let (stream_seq, record) = match queue.peek() {
                Ok(Some(bytes)) => {
                    Record::decode(bytes).map_err(|source| ReferenceError::Record { seq, source })?
                }
                Ok(None) => {
                    std::thread::sleep(Duration::from_micros(200));
                    continue;
                }
                Err(QueueError::Silent(_)) => continue,
                Err(e) => return Err(e.into()),
            };
            match record {
                Record::End => {
                    queue.done()?;
                    return Ok((Ended::Done, tally));
                }
                Record::Path(path) => {
                    let motion = Motion::plan(&path.curve, path.feed, &self.limits);
                    let begin = queue.progress(seq)?.unwrap_or(0.0);
                    let run = Run { seq, stream_seq, motion: &motion, begin, late_s };
                    match self.follow(&run, queue, order, report, &mut tally)? {
                        Some(late) => late_s = late,
                        None => return Ok((Ended::Aborted, tally)),
                    }
                    tally.paths += 1;
                    tally.planned_s += motion.time_s() - begin;
                    queue.done()?;
                    if self.single_step {
                        // The path's end is a hold that only a new order to run ends.
                        while order() == Order::Hold {
                            queue.beat()?;
                            std::thread::sleep(Duration::from_micros(500));
                        }
                    }
                }
                _ => queue.done()?,
            }
        }
    }

    /// Runs along one path; what its last cycle overshot, or `None` when it was aborted.
    fn follow(
        &self,
        run: &Run<'_>,
        queue: &mut Consumer,
        order: &mut dyn FnMut() -> Order,
        report: &mut dyn FnMut(SetPoint),
        tally: &mut Tally,
    ) -> Result<Option<f64>, ReferenceError> {
        let dt = self.limits.cycle_s;
        let end = run.motion.time_s();
        let mut clock = run.begin + if run.begin > 0.0 { 0.0 } else { run.late_s };
        // Rate of the path's own time: 1 runs as planned. A path that was interrupted starts from rest.
        let mut ramp: f64 = if run.begin > 0.0 { 0.0 } else { 1.0 };
        let begun = Instant::now();
        let mut cycles = 0u32;
        loop {
            let (tip, parameter) = run.motion.at(clock);
            report(SetPoint { seq: run.stream_seq, last: clock >= end, parameter, tip, time_s: clock });
            if clock >= end {
                return Ok(Some(clock - end));
            }
            queue.set_progress(run.seq, clock)?;
            let now = order();
            let step = dt / RAMP_S;
            ramp = if now == Order::Run { (ramp + step).min(1.0) } else { (ramp - step).max(0.0) };
            if now == Order::Abort && ramp == 0.0 {
                return Ok(None);
            }
            // Rate with a soft beginning and end.
            clock += dt * ramp * ramp * (3.0 - 2.0 * ramp);
            queue.beat()?;
            cycles += 1;
            tally.cycles += 1;
            if self.real_time {
                let due = Duration::from_secs_f64(f64::from(cycles) * dt);
                if let Some(wait) = due.checked_sub(begun.elapsed()) {
                    std::thread::sleep(wait);
                }
            }
        }
    }
}

/// A path that is being run along.
struct Run<'a> {
    /// Number in the queue, and in its stream.
    seq: u64,
    stream_seq: u64,
    motion: &'a Motion<'a>,
    begin: f64,
    late_s: f64,
}

/// Time in which a hold comes to rest, s.
const RAMP_S: f64 = 0.3;
