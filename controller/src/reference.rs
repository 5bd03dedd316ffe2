use std::time::{Duration, Instant};

use claymill_motion::{JointRule, Limits};
use claymill_nurbs::{Point3, Vector3};

use crate::drive::Drive;
use crate::route::GAP_MM;
use crate::{Consumer, Dynamics, Path, QueueError, Record, RecordError};

/// What the machine is told while it runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Order {
    /// Go on.
    Run,
    /// Come to rest on the path and wait.
    Hold,
    /// From rest: go on to the end of the path, and wait there; else as [`Order::Hold`].
    Step,
    /// Come to rest on the path and leave; what was not done stays in the queue.
    Abort,
    /// Come to rest on the path, and drop it and what waits behind it.
    Discard,
}

/// Where the machine is, once a cycle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SetPoint {
    /// Number of the record in its stream.
    pub seq: u64,
    /// Parameter on its curve.
    pub parameter: f64,
    /// The tip, mm.
    pub tip: Point3,
    /// Tool axis.
    pub axis: Vector3,
    /// Its speed, mm/s.
    pub speed: f64,
}

/// What the machine reports.
#[derive(Debug, Clone, PartialEq)]
pub enum Event {
    /// Where it is.
    At(SetPoint),
    /// The path of this record was run to its end.
    PathDone(u64),
    /// A record that is no path was executed.
    Executed(u64, Record),
    /// What waited was dropped.
    Discarded,
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
    /// Time that the ways from rest to rest were planned to take, s.
    pub planned_s: f64,
    /// Times that it came to rest.
    pub stops: u64,
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
    /// A path begins elsewhere, though the part was not turned in between.
    #[error("record {seq} begins {gap_mm:.4} mm from the end of the path before it")]
    Gap {
        /// Its number.
        seq: u64,
        /// How far.
        gap_mm: f64,
    },
}

/// A control that exists here only: takes records from a queue and runs along their curves at a servo rate, with
/// look-ahead over the paths that the queue holds, under limits of velocity, acceleration and jerk.
///
/// Tangent paths are run through without a stop. Tools and spindle speeds are changed at rest, coolant and outputs
/// are switched when the motion passes the joint where they stand.
#[derive(Debug, Clone, Copy)]
pub struct Reference {
    /// Limits and cycle.
    pub limits: Dynamics,
    /// Keep to real time; else as fast as it goes.
    pub real_time: bool,
    /// Wait with [`Order::Hold`] semantics after every path until told to run again.
    pub single_step: bool,
}

/// Records that are read ahead at most.
const LOOK_AHEAD: usize = 256;
/// How long a machine without work sleeps before it looks again.
const NAP: Duration = Duration::from_micros(200);
/// A clock that is more than this late begins anew.
const LATE: Duration = Duration::from_millis(100);

/// A record that waits to be done.
pub(crate) enum Waiting {
    Path(u64, Box<Path>),
    Other(u64, Record),
}

impl Reference {
    /// Runs until the stream ends. `order` is asked once a cycle; `report` gets every set point, and what was done. A
    /// record counts as done when its end was reached; one that was interrupted is taken up again where
    /// `progress` of the queue says.
    ///
    /// # Errors
    /// The queue cannot be used, or a record is damaged. A producer that falls silent is waited for.
    pub fn run(
        &self,
        queue: &mut Consumer,
        order: &mut dyn FnMut() -> Order,
        report: &mut dyn FnMut(Event),
    ) -> Result<(Ended, Tally), ReferenceError> {
        let limits = Limits {
            acceleration_mm_per_s2: self.limits.acceleration_mm_per_s2,
            jerk_mm_per_s3: self.limits.jerk_mm_per_s3,
        };
        let rule = JointRule::OnPath { cycle_s: self.limits.cycle_s };
        let mut drive = Drive::new(limits, rule, self.limits.cycle_s);
        let interrupted = queue.progress(queue.next())?;
        if let Some(way_mm) = interrupted {
            drive.begin_at(way_mm);
        }
        drive.feed_share = queue.feed_share()?;
        let mut tally = Tally::default();
        let mut clock = Clock::new(self.real_time, self.limits.cycle_s);
        loop {
            self.look_ahead(queue, &mut drive)?;
            let recalled = queue.recalled()?;
            let now = if recalled { Order::Discard } else { order() };
            if drive.at_rest() {
                let goes_on = matches!(now, Order::Run | Order::Step);
                match now {
                    Order::Abort => return Ok((Ended::Aborted, tally)),
                    Order::Discard => {
                        if recalled {
                            queue.give_back(drive.here().map(|p| (p.tip, p.axis)))?;
                        } else {
                            queue.discard()?;
                        }
                        drive.discard();
                        report(Event::Discarded);
                        continue;
                    }
                    _ => {}
                }
                match drive.front() {
                    Some(Waiting::Other(..)) if goes_on => {
                        if self.execute(queue, &mut drive, report)? {
                            return Ok((Ended::Done, tally));
                        }
                        continue;
                    }
                    Some(Waiting::Path(..)) if goes_on => {
                        drive.start(self.single_step || now == Order::Step);
                    }
                    Some(_) => {
                        if let Some(point) = drive.here() {
                            report(Event::At(point));
                        }
                        queue.beat()?;
                        if self.real_time {
                            clock.tick()
                        } else {
                            std::thread::sleep(NAP)
                        }
                        continue;
                    }
                    None => {
                        // Nothing to do: whoever fills the queue is waited for, however long he is silent.
                        match queue.peek() {
                            Ok(_) | Err(QueueError::Silent(_)) => {}
                            Err(e) => return Err(e.into()),
                        }
                        std::thread::sleep(NAP);
                        continue;
                    }
                }
            }
            if !(now == Order::Run || now == Order::Step && drive.is_single()) {
                drive.hold();
            }
            drive.cycle();
            tally.cycles += 1;
            if let Some(point) = drive.here() {
                report(Event::At(point));
            }
            while let Some(seq) = drive.pass() {
                report(Event::PathDone(seq));
                tally.paths += 1;
                queue.done()?;
                let switches = |w: &Waiting| matches!(w, Waiting::Other(_, r) if !r.needs_rest());
                while drive.front().is_some_and(switches) {
                    self.execute(queue, &mut drive, report)?;
                }
            }
            if let Some(way_mm) = drive.way_on_path_mm() {
                queue.set_progress(queue.next(), way_mm, drive.feed_share)?;
            }
            if let Some(planned_s) = drive.come_to_rest() {
                tally.planned_s += planned_s;
                tally.stops += 1;
            }
            queue.beat()?;
            clock.tick();
        }
    }

    fn look_ahead(&self, queue: &mut Consumer, drive: &mut Drive) -> Result<(), ReferenceError> {
        while drive.waiting() < LOOK_AHEAD {
            let seq = queue.next() + drive.waiting() as u64;
            let Some(bytes) = queue.look()? else { break };
            let (stream_seq, record) =
                Record::decode(bytes).map_err(|source| ReferenceError::Record { seq, source })?;
            drive.take(match record {
                Record::Path(path) => {
                    let gap_mm = drive.gap_mm(&path);
                    if gap_mm > GAP_MM {
                        return Err(ReferenceError::Gap { seq, gap_mm });
                    }
                    Waiting::Path(stream_seq, path)
                }
                other => Waiting::Other(stream_seq, other),
            });
        }
        drive.look_ahead();
        Ok(())
    }

    /// Executes the record in front, which is no path; whether it was the stream's end.
    fn execute(
        &self,
        queue: &mut Consumer,
        drive: &mut Drive,
        report: &mut dyn FnMut(Event),
    ) -> Result<bool, ReferenceError> {
        let Some(Waiting::Other(seq, record)) = drive.pop() else { return Ok(false) };
        if let Record::Feed(share) = record {
            drive.feed_share = share;
            queue.set_progress(queue.next() + 1, 0.0, share)?;
        }
        let end = record == Record::End;
        report(Event::Executed(seq, record));
        queue.done()?;
        Ok(end)
    }
}

/// Keeps to real time.
struct Clock {
    due: Option<Instant>,
    cycle: Duration,
}

impl Clock {
    fn new(real_time: bool, cycle_s: f64) -> Self {
        Clock { due: real_time.then(Instant::now), cycle: Duration::from_secs_f64(cycle_s) }
    }

    fn tick(&mut self) {
        let Some(due) = &mut self.due else { return };
        *due += self.cycle;
        let now = Instant::now();
        match due.checked_duration_since(now) {
            Some(wait) => std::thread::sleep(wait),
            None if now.duration_since(*due) > LATE => *due = now,
            None => {}
        }
    }
}
