//! The motion of the reference controller: look-ahead over waiting records, one jerk-limited motion
//! from rest to rest, and a set point for each cycle.

use std::collections::VecDeque;

use claymill_motion::{Chain, Joint, JointRule, Limits, Looks, Place, Rail, Track};
use claymill_nurbs::Vector3;

use crate::reference::Waiting;
use crate::{Path, Record, SetPoint};

/// The motion of the reference controller: the records that wait, and the way from rest to rest that it is on.
pub(crate) struct Drive {
    limits: Limits,
    rule: JointRule,
    cycle_s: f64,
    /// One path at a time.
    single: bool,
    waiting: VecDeque<Waiting>,
    /// Rails of the paths at the front of `waiting`, as far as they are laid.
    rails: VecDeque<Laid>,
    /// Records of `waiting` that have been laid, or passed over because they need no rest.
    laid: usize,
    track: Track,
    /// Tool axis at the end of the last rail.
    turned: Option<Vector3>,
    /// Places of `track` that the motion knows.
    known: usize,
    /// Where the motion began on the first rail of the track, mm.
    begin_mm: f64,
    /// Length of the rails that it has left behind.
    passed_mm: f64,
    /// Length of the known places.
    known_mm: f64,
    motion: Option<Chain>,
    time_s: f64,
    /// Where it is, from the start of the path in front, mm.
    way_mm: f64,
    speed: f64,
    last: Option<SetPoint>,
    held: bool,
    /// Nothing is laid behind a rest.
    closed: bool,
    /// Part of their own feed that paths are run with.
    pub(crate) feed_share: f64,
}

/// A path with its measure.
struct Laid {
    seq: u64,
    rail: Rail,
    axes: [Vector3; 2],
}

impl Laid {
    fn new(seq: u64, path: &Path) -> Self {
        let rail = Rail::new(path.curve.clone(), Looks::FINE);
        Laid { seq, rail, axes: [path.axis_start, path.axis_end] }
    }

    fn at(&self, way_mm: f64, speed: f64) -> SetPoint {
        let parameter = self.rail.parameter(way_mm);
        let share = way_mm / self.rail.length_mm().max(SLIVER_MM);
        let [start, end] = self.axes;
        let axis = start.lerp(&end, share.clamp(0.0, 1.0)).try_normalize(1e-9).unwrap_or(end);
        SetPoint { seq: self.seq, parameter, tip: self.rail.curve().point(parameter), axis, speed }
    }
}

/// Ways shorter than this are none, mm.
const SLIVER_MM: f64 = 1e-7;
/// A motion is planned anew when its base ends sooner than this, s: in time for its brakes.
const SOON_S: f64 = 1.0;

impl Drive {
    pub(crate) fn new(limits: Limits, rule: JointRule, cycle_s: f64) -> Self {
        Drive {
            limits,
            rule,
            cycle_s,
            single: false,
            waiting: VecDeque::new(),
            rails: VecDeque::new(),
            laid: 0,
            track: Track::new(limits, rule),
            turned: None,
            known: 0,
            begin_mm: 0.0,
            passed_mm: 0.0,
            known_mm: 0.0,
            motion: None,
            time_s: 0.0,
            way_mm: 0.0,
            speed: 0.0,
            last: None,
            held: false,
            closed: false,
            feed_share: 1.0,
        }
    }

    /// The first path was run so far already.
    pub(crate) fn begin_at(&mut self, way_mm: f64) {
        self.way_mm = way_mm;
    }

    pub(crate) fn waiting(&self) -> usize {
        self.waiting.len()
    }

    pub(crate) fn front(&self) -> Option<&Waiting> {
        self.waiting.front()
    }

    /// Whether the stream's end is among what waits.
    pub(crate) fn knows_the_end(&self) -> bool {
        matches!(self.waiting.back(), Some(Waiting::Other(_, Record::End)))
    }

    pub(crate) fn take(&mut self, record: Waiting) {
        self.waiting.push_back(record);
    }

    pub(crate) fn pop(&mut self) -> Option<Waiting> {
        self.laid = self.laid.saturating_sub(1);
        self.waiting.pop_front()
    }

    pub(crate) fn at_rest(&self) -> bool {
        self.motion.is_none()
    }

    /// Whether the motion is along one path only.
    pub(crate) fn is_single(&self) -> bool {
        self.single
    }

    /// Forgets what waits; the machine stands where it is.
    pub(crate) fn discard(&mut self) {
        // Where it is, is known from the path that goes.
        self.here();
        self.waiting.clear();
        self.rails.clear();
        (self.laid, self.way_mm, self.feed_share) = (0, 0.0, 1.0);
    }

    /// Plans a motion from rest, where the machine is on the path in front: along that path only, or as far as
    /// there is no rest.
    pub(crate) fn start(&mut self, single: bool) {
        self.single = single;
        self.rails.clear();
        self.turned = None;
        self.track = Track::new(self.limits, self.rule);
        (self.laid, self.known, self.held, self.closed) = (0, 0, false, false);
        (self.begin_mm, self.passed_mm, self.known_mm) = (self.way_mm, 0.0, 0.0);
        let mut places = Vec::new();
        while !self.closed && self.lay() {
            places.extend(self.next_places());
        }
        self.motion = Some(Chain::plan(places, self.limits));
        self.time_s = 0.0;
    }

    /// Lays the rail of the next path that the motion can go on to without a rest.
    fn lay(&mut self) -> bool {
        while let Some(next) = self.waiting.get(self.laid) {
            match next {
                Waiting::Path(..) if self.single && !self.rails.is_empty() => break,
                Waiting::Path(seq, path) => {
                    if self.turned.replace(path.axis_end).is_some_and(|a| (a - path.axis_start).norm() > 1e-6)
                    {
                        self.track.stop();
                    }
                    let laid = Laid::new(*seq, path);
                    self.track.add(&laid.rail, path.feed * self.feed_share);
                    self.rails.push_back(laid);
                    self.laid += 1;
                    return true;
                }
                Waiting::Other(_, record) if record.needs_rest() => {
                    self.closed = true;
                    break;
                }
                Waiting::Other(..) => self.laid += 1,
            }
        }
        false
    }

    /// Places of the track that the motion does not know, up to the next stop; from where it began.
    fn next_places(&mut self) -> Vec<(Joint, Place)> {
        let mut places = Vec::new();
        while let Some(&(joint, place)) = self.track.places().get(self.known) {
            if joint.speed <= 0.0 && self.known_mm > self.begin_mm + SLIVER_MM {
                self.closed = true;
                break;
            }
            let left = self.known_mm + place.length_mm - self.begin_mm;
            if left > SLIVER_MM {
                places.push((joint, Place { length_mm: place.length_mm.min(left), ..place }));
            }
            self.known_mm += place.length_mm;
            self.known += 1;
        }
        places
    }

    /// Goes on to what has arrived meanwhile.
    pub(crate) fn look_ahead(&mut self) {
        let Some(motion) = &self.motion else { return };
        let soon_s = SOON_S + 2.0 * self.speed / self.limits.acceleration_mm_per_s2;
        if self.held || self.closed || motion.time_s() - self.time_s > soon_s {
            return;
        }
        while self.lay() {}
        let before = (self.known, self.known_mm, self.closed);
        let places = self.next_places();
        let time_s = self.time_s;
        if !places.is_empty() && !self.motion.as_mut().is_some_and(|m| m.extend(time_s, &places)) {
            (self.known, self.known_mm, self.closed) = before;
        }
    }

    /// Comes to rest as soon as the limits allow.
    pub(crate) fn hold(&mut self) {
        if !std::mem::replace(&mut self.held, true)
            && let Some(motion) = &mut self.motion
        {
            motion.hold(self.time_s.max(0.0));
        }
    }

    /// One cycle on.
    pub(crate) fn cycle(&mut self) {
        let Some(motion) = &self.motion else { return };
        self.time_s += self.cycle_s;
        let (way, speed) = motion.at(self.time_s);
        (self.way_mm, self.speed) = (self.begin_mm + way - self.passed_mm, speed);
    }

    /// Where the machine is.
    pub(crate) fn here(&mut self) -> Option<SetPoint> {
        if let (None, Some(Waiting::Path(seq, path))) = (self.last, self.waiting.front()) {
            // Before the first motion: on a path that an earlier process has begun, or at its start.
            let laid = Laid::new(*seq, path);
            self.last = Some(laid.at(self.way_mm, 0.0));
        }
        let mut way = self.way_mm;
        for (i, laid) in self.rails.iter().enumerate() {
            let length = laid.rail.length_mm();
            if way <= length || i + 1 == self.rails.len() {
                self.last = Some(laid.at(way.min(length), self.speed));
                break;
            }
            way -= length;
        }
        self.last
    }

    /// The path in front, when its end has been passed.
    pub(crate) fn pass(&mut self) -> Option<u64> {
        let first = self.rails.front()?;
        let length = first.rail.length_mm();
        let rest = self.motion.as_ref().is_none_or(|m| self.time_s >= m.time_s());
        // At a joint that is also a rest, the way may be short of the end by rounding.
        if self.way_mm < if rest { length - SLIVER_MM } else { length } {
            return None;
        }
        let seq = first.seq;
        self.way_mm = (self.way_mm - length).max(0.0);
        self.passed_mm += length;
        self.rails.pop_front();
        self.pop();
        Some(seq)
    }

    /// How far the path in front has been run, mm.
    pub(crate) fn way_on_path_mm(&self) -> Option<f64> {
        matches!(self.waiting.front(), Some(Waiting::Path(..))).then(|| self.way_mm.max(0.0))
    }

    /// Ends the motion if it has come to rest; the time that it was planned to take.
    pub(crate) fn come_to_rest(&mut self) -> Option<f64> {
        let planned_s = self.motion.as_ref()?.time_s();
        if self.time_s < planned_s {
            return None;
        }
        self.motion = None;
        Some(planned_s)
    }
}

impl Record {
    /// Whether the machine stands still while it is executed.
    pub(crate) fn needs_rest(&self) -> bool {
        !matches!(self, Record::Coolant(_) | Record::Output { .. } | Record::Path(_))
    }
}
