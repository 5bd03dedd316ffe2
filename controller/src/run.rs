//! The motion loop of the reference controller.

use std::time::{Duration, Instant};

use claymill_motion::{JointRule, Limits};

use crate::drive::Drive;
use crate::judge::Judge;
use crate::reference::Waiting;
use crate::switches::Switches;
use crate::{Consumer, Ended, Event, Order, QueueError, Record, Reference, ReferenceError, Tally};

/// Records that are read ahead at most.
const LOOK_AHEAD: usize = 256;
/// How long a machine without work sleeps before it looks again.
const NAP: Duration = Duration::from_micros(200);
/// A clock that is more than this late begins anew.
const LATE: Duration = Duration::from_millis(100);

/// What went wrong.
struct Fault {
    error: ReferenceError,
    /// Nothing of what waits can be trusted: the machine comes to rest at once. Else it goes on to what is wrong.
    at_once: bool,
    /// Whether it was said that the machine stands there.
    said: bool,
}

/// A controller at work.
pub(crate) struct Run<'a> {
    queue: &'a mut Consumer,
    report: &'a mut dyn FnMut(Event),
    single_step: bool,
    real_time: bool,
    drive: Drive,
    judge: Judge,
    /// What the machine was told by anybody, and what of that in this run.
    switches: Switches,
    told: Switches,
    fault: Option<Fault>,
    tally: Tally,
    clock: Clock,
}

impl<'a> Run<'a> {
    pub(crate) fn new(
        reference: &Reference,
        queue: &'a mut Consumer,
        report: &'a mut dyn FnMut(Event),
    ) -> Self {
        let dynamics = reference.limits;
        let limits = Limits {
            acceleration_mm_per_s2: dynamics.acceleration_mm_per_s2,
            jerk_mm_per_s3: dynamics.jerk_mm_per_s3,
        };
        let rule = JointRule::OnPath { cycle_s: dynamics.cycle_s };
        let judge = Judge::from(queue.next_of_stream(), None);
        let mut run = Run {
            queue,
            report,
            single_step: reference.single_step,
            real_time: reference.real_time,
            drive: Drive::new(limits, rule, dynamics.cycle_s),
            judge,
            switches: Switches::default(),
            told: Switches::default(),
            fault: None,
            tally: Tally::default(),
            clock: Clock::new(reference.real_time, dynamics.cycle_s),
        };
        let taken_up = run.take_up();
        run.note(taken_up);
        run
    }

    /// Learns from the queue what an earlier process has left.
    fn take_up(&mut self) -> Result<(), QueueError> {
        if let Some(way_mm) = self.queue.progress(self.queue.next())? {
            self.drive.begin_at(way_mm);
        }
        self.drive.feed_share = self.queue.feed_share()?;
        self.switches = self.queue.switches()?;
        Ok(())
    }

    pub(crate) fn complete(
        mut self,
        order: &mut dyn FnMut() -> Order,
    ) -> Result<(Ended, Tally), ReferenceError> {
        loop {
            self.look_ahead();
            let recalled = self.queue.recalled();
            let recalled = self.note(recalled).unwrap_or(false);
            let now = if recalled { Order::Discard } else { order() };
            if self.drive.at_rest() {
                match now {
                    Order::Abort => {
                        return match self.fault {
                            Some(fault) => Err(fault.error),
                            None => Ok((Ended::Aborted, self.tally)),
                        };
                    }
                    Order::Discard => {
                        self.discard(recalled);
                        continue;
                    }
                    Order::Run | Order::Step | Order::Hold => {}
                }
                let goes_on = now != Order::Hold && !self.stands();
                match self.drive.front() {
                    Some(Waiting::Other(..)) if goes_on => {
                        if self.execute() {
                            return Ok((Ended::Done, self.tally));
                        }
                        continue;
                    }
                    Some(Waiting::Path(..)) if goes_on => {
                        self.tell_again();
                        if self.stands() {
                            continue;
                        }
                        self.drive.start(self.single_step || now == Order::Step);
                    }
                    front => {
                        let idle = front.is_none();
                        self.wait(idle);
                        continue;
                    }
                }
            }
            let goes_on = now == Order::Run || now == Order::Step && self.drive.is_single();
            if !goes_on || self.brakes() {
                self.drive.hold();
            }
            self.cycle();
        }
    }

    /// Whether a fault asks for rest at once.
    fn brakes(&self) -> bool {
        self.fault.as_ref().is_some_and(|f| f.at_once)
    }

    /// Whether a fault keeps the machine where it is.
    fn stands(&self) -> bool {
        self.fault.is_some() && (self.brakes() || self.drive.front().is_none())
    }

    /// Notes what went wrong with the queue: nothing that comes from it can be trusted any more.
    fn note<T>(&mut self, result: Result<T, QueueError>) -> Option<T> {
        result.map_err(|error| self.fail(error.into(), true)).ok()
    }

    /// The first thing that goes wrong counts, unless worse comes.
    fn fail(&mut self, error: ReferenceError, at_once: bool) {
        if self.fault.as_ref().is_none_or(|f| at_once && !f.at_once) {
            (self.report)(Event::Fault(error.to_string()));
            self.fault = Some(Fault { error, at_once, said: false });
        }
    }

    fn look_ahead(&mut self) {
        while self.fault.is_none() && self.drive.waiting() < LOOK_AHEAD && !self.drive.knows_the_end() {
            let seq = self.queue.next() + self.drive.waiting() as u64;
            let judged = match self.queue.look() {
                Ok(Some(bytes)) => self.judge.judge(bytes),
                Ok(None) => break,
                Err(e) => {
                    self.fail(e.into(), true);
                    break;
                }
            };
            match judged {
                Ok((seq, Record::Path(path))) => self.drive.take(Waiting::Path(seq, path)),
                Ok((seq, other)) => self.drive.take(Waiting::Other(seq, other)),
                Err(source) => self.fail(ReferenceError::Record { seq, source }, false),
            }
        }
        self.drive.look_ahead();
    }

    /// Drops what waits, and what was wrong with it.
    fn discard(&mut self, recalled: bool) {
        let here = self.drive.here().map(|p| (p.tip, p.axis));
        let dropped = if recalled { self.queue.give_back(here) } else { self.queue.discard() };
        self.fault = None;
        if self.note(dropped).is_none() {
            (self.report)(Event::NotDiscarded);
            std::thread::sleep(NAP);
            return;
        }
        self.drive.discard();
        self.judge = Judge::from(Some(0), here);
        (self.report)(Event::Discarded);
    }

    /// Executes the record in front, which is no path; whether it was the stream's end.
    fn execute(&mut self) -> bool {
        let Some(Waiting::Other(seq, record)) = self.drive.pop() else { return false };
        // What is noted comes first: killed behind it, the machine is told the record once more.
        let noted = match &record {
            Record::Feed(share) => {
                self.drive.feed_share = *share;
                self.queue.set_progress(self.queue.next() + 1, 0.0, *share)
            }
            other => {
                self.told.note(other);
                match self.switches.note(other) {
                    true => self.queue.set_switches(&self.switches),
                    false => Ok(()),
                }
            }
        };
        self.note(noted);
        let end = record == Record::End;
        (self.report)(Event::Executed(seq, record));
        let done = self.queue.done();
        self.note(done);
        end
    }

    /// Brings the machine where an earlier process had it: before the first motion, what nobody has told since.
    fn tell_again(&mut self) {
        for record in self.switches.missing(&self.told) {
            self.told.note(&record);
            (self.report)(Event::ToldAgain(record));
        }
    }

    /// Waits a cycle at rest; `idle` where there is nothing to do.
    fn wait(&mut self, idle: bool) {
        if idle && self.fault.is_none() {
            // Whoever fills the queue is waited for, however long he is silent.
            match self.queue.peek() {
                Ok(_) | Err(QueueError::Silent(_)) => {}
                Err(e) => self.fail(e.into(), true),
            }
            return std::thread::sleep(NAP);
        }
        if let Some(point) = self.drive.here() {
            (self.report)(Event::At(point));
        }
        if self.stands()
            && let Some(fault) = &mut self.fault
            && !std::mem::replace(&mut fault.said, true)
        {
            (self.report)(Event::Stands);
        }
        let beat = self.queue.beat();
        self.note(beat);
        match self.real_time {
            true => self.clock.tick(),
            false => std::thread::sleep(NAP),
        }
    }

    /// One cycle on the way.
    fn cycle(&mut self) {
        self.drive.cycle();
        self.tally.cycles += 1;
        if let Some(point) = self.drive.here() {
            (self.report)(Event::At(point));
        }
        while let Some(seq) = self.drive.pass() {
            (self.report)(Event::PathDone(seq));
            self.tally.paths += 1;
            let done = self.queue.done();
            self.note(done);
            let switches = |w: &Waiting| matches!(w, Waiting::Other(_, r) if !r.needs_rest());
            while self.drive.front().is_some_and(switches) {
                self.execute();
            }
        }
        if let Some(way_mm) = self.drive.way_on_path_mm() {
            let noted = self.queue.set_progress(self.queue.next(), way_mm, self.drive.feed_share);
            self.note(noted);
        }
        if let Some(planned_s) = self.drive.come_to_rest() {
            self.tally.planned_s += planned_s;
            self.tally.stops += 1;
        }
        let beat = self.queue.beat();
        self.note(beat);
        self.clock.tick();
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
