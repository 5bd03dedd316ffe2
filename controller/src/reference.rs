//! The reference controller: orders, set points, events, and its entry point. The motion itself is
//! in `drive`.

use claymill_nurbs::{Point3, Vector3};

use crate::run::Run;
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
    /// A record that an earlier process had executed, told again before the first motion.
    ToldAgain(Record),
    /// Something is wrong: the machine comes to rest, and stays there until what waits is dropped.
    Fault(String),
    /// It has come to rest at what is wrong, and waits.
    Stands,
    /// What waited was dropped.
    Discarded,
    /// What waits could not be dropped; the fault before this says why.
    NotDiscarded,
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
    /// A record makes no sense.
    #[error("record {seq}: {source}")]
    Record {
        /// Its number, counted over all streams that went through the queue.
        seq: u64,
        /// What is wrong.
        source: RecordError,
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

/// A record that waits to be done.
pub(crate) enum Waiting {
    Path(u64, Box<Path>),
    Other(u64, Record),
}

impl Reference {
    /// Runs until the stream ends. `order` is asked once a cycle; `report` gets every set point, and what was done. A
    /// record counts as done when its end was reached; one that was interrupted is taken up again where
    /// `progress` of the queue says, after tool, spindle, coolant and outputs have been told again.
    ///
    /// Whatever goes wrong with a record ends at rest before it, and whatever goes wrong with the queue at rest on the path,
    /// within the limits; it is reported, and nothing moves until what waits is dropped by an order. A producer that falls
    /// silent is waited for.
    ///
    /// # Errors
    /// What went wrong, where the machine was told to leave before that was cleared.
    pub fn run(
        &self,
        queue: &mut Consumer,
        order: &mut dyn FnMut() -> Order,
        report: &mut dyn FnMut(Event),
    ) -> Result<(Ended, Tally), ReferenceError> {
        Run::new(self, queue, report).complete(order)
    }
}
