//! A motion from rest to rest with limited jerk. A base profile of limited acceleration is averaged
//! over a window of `a / j` in time (box filter), and can be extended or held while it runs.

use crate::speed::{Leg, Start, brake, legs};
use crate::{Joint, Limits, Place};

/// A stretch of constant acceleration of the base profile, from time `t` on.
#[derive(Debug, Clone, Copy)]
struct Phase {
    t: f64,
    s: f64,
    v: f64,
    a: f64,
}

impl Phase {
    fn way(&self, t: f64) -> f64 {
        let dt = t - self.t;
        self.s + dt * (self.v + 0.5 * self.a * dt)
    }

    fn speed(&self, t: f64) -> f64 {
        self.v + self.a * (t - self.t)
    }

    /// Integral of the way, less `s0`, from `from` to `to`.
    fn integral(&self, s0: f64, from: f64, to: f64) -> f64 {
        let part = |dt: f64| dt * (self.s - s0 + dt * (0.5 * self.v + dt * self.a / 6.0));
        part(to - self.t) - part(from - self.t)
    }
}

/// A motion from rest to rest over places, whose base profile runs ahead of it by the window of the filter.
#[derive(Debug, Clone)]
pub struct Chain {
    limits: Limits,
    places: Vec<(Joint, Place)>,
    /// Largest acceleration of the base, and the window of its average.
    acceleration: f64,
    window_s: f64,
    /// The last one stands still.
    phases: Vec<Phase>,
}

/// Steps of a search for the best acceleration.
const GOLDEN_STEPS: usize = 24;
/// Chains with more places than this are long enough for the full acceleration.
const MOST_PLACES_SEARCHED: usize = 400;
const NEWTON_STEPS: usize = 30;
/// A time is found when the way is this near, mm.
const NEAR_MM: f64 = 1e-9;

impl Chain {
    /// Plans a motion over places, from rest to rest. Stops are where chains are cut ([`crate::Schedule`] does): one inside is
    /// passed at a thousandth of a millimetre a second.
    #[must_use]
    pub fn plan(places: Vec<(Joint, Place)>, limits: Limits) -> Self {
        let acceleration = best_acceleration(&places, &limits);
        let window_s = window(acceleration, &limits);
        let legs = legs(&places, Start::default(), acceleration, window_s, &limits);
        let still = Phase { t: 0.0, s: 0.0, v: 0.0, a: 0.0 };
        let mut chain = Chain { limits, places, acceleration, window_s, phases: vec![still] };
        chain.go_on(0.0, &legs);
        chain
    }

    /// How long it takes, s.
    #[must_use]
    pub fn time_s(&self) -> f64 {
        let end = self.phases[self.phases.len() - 1].t;
        if end > 0.0 { end + self.window_s } else { 0.0 }
    }

    /// How far it goes, mm.
    #[must_use]
    pub fn length_mm(&self) -> f64 {
        self.phases[self.phases.len() - 1].s
    }

    /// Whether it comes to rest before the end of its places: it was held.
    #[must_use]
    pub fn is_held(&self) -> bool {
        self.length_mm() < self.whole_mm() - 1e-9
    }

    /// Places from `s` mm on, for a motion that goes on from rest.
    #[must_use]
    pub fn rest_of(&self, s: f64) -> Vec<(Joint, Place)> {
        tail(&self.places, s)
    }

    /// Way and speed after `t` s: mm, mm/s.
    #[must_use]
    pub fn at(&self, t: f64) -> (f64, f64) {
        let last = &self.phases[self.phases.len() - 1];
        if t >= self.time_s() {
            return (last.s, 0.0);
        }
        if t <= 0.0 {
            return (0.0, 0.0);
        }
        if self.window_s <= 0.0 {
            let phase = &self.phases[self.index(t)];
            return (phase.way(t), phase.speed(t));
        }
        let begin = (t - self.window_s).max(0.0);
        let first = self.index(begin);
        let s0 = self.phases[first].way(begin);
        let mut sum = 0.0;
        let mut from = begin;
        let mut i = first;
        loop {
            let to = self.phases.get(i + 1).map_or(t, |p| p.t.min(t));
            sum += self.phases[i].integral(s0, from, to);
            if to >= t {
                break;
            }
            (from, i) = (to, i + 1);
        }
        // Before the beginning it stood at zero.
        let s = s0 * (t - begin) / self.window_s + sum / self.window_s;
        (s, (self.phases[i].way(t) - s0) / self.window_s)
    }

    /// When the way has reached `s` mm, s.
    #[must_use]
    pub fn time_of(&self, s: f64) -> f64 {
        if s <= 0.0 {
            return 0.0;
        }
        if s >= self.length_mm() {
            return self.time_s();
        }
        let i = self.phases.partition_point(|p| p.s <= s).max(1) - 1;
        let p = &self.phases[i];
        let root = (p.v * p.v + 2.0 * p.a * (s - p.s)).max(0.0).sqrt();
        let base = p.t + if p.v + root > 0.0 { 2.0 * (s - p.s) / (p.v + root) } else { 0.0 };
        let (mut low, mut high) = (base, base + self.window_s);
        let mut t = base + 0.5 * self.window_s;
        for _ in 0..NEWTON_STEPS {
            let (way, speed) = self.at(t);
            if (way - s).abs() < NEAR_MM {
                break;
            }
            if way > s {
                high = t
            } else {
                low = t
            }
            let next = if speed > 0.0 { t - (way - s) / speed } else { low };
            t = if next > low && next < high { next } else { 0.5 * (low + high) };
        }
        t
    }

    /// Adds places behind the end while the base moves, at time `t`: what has been run until then stays, the rest is
    /// planned anew. `false` where it cannot be: the base has come to rest, was held, would have to brake at once after
    /// it has gained speed, or should have gained less for what comes; it then goes on to rest as planned, and may be asked again.
    pub fn extend(&mut self, t: f64, places: &[(Joint, Place)]) -> bool {
        let end = self.phases[self.phases.len() - 1].t;
        if t >= end || self.is_held() || places.first().is_none_or(|(joint, _)| joint.speed <= 0.0) {
            return false;
        }
        let phase = self.phases[self.index(t)];
        let (s, v) = (phase.way(t), phase.speed(t));
        if self.reaches_back(places, t, s) {
            return false;
        }
        let known = self.places.len();
        self.places.extend_from_slice(places);
        // Whoever has braked within the window keeps his speed until that is over.
        let keep = if self.since(t, t, |p| p.a < 0.0) { v * self.window_s } else { 0.0 };
        let legs = legs(&self.places, Start { s, v, keep }, self.acceleration, self.window_s, &self.limits);
        let too_fast = legs.first().is_none_or(|l| l.from < v * (1.0 - 1e-9) - 1e-9);
        let change = legs.iter().position(|l| l.to != l.from);
        let braking = change.is_some_and(|i| {
            let kept: f64 = legs[..i].iter().map(Leg::time_s).sum();
            legs[i].to < legs[i].from && self.since(t + kept, t, |p| p.a > 0.0)
        });
        if too_fast || braking {
            self.places.truncate(known);
            return false;
        }
        self.go_on(t, &legs);
        true
    }

    /// Comes to rest as soon as the limits allow, from time `t` on, when the base was what it was planned to be.
    pub fn hold(&mut self, t: f64) {
        let end = self.phases[self.phases.len() - 1].t;
        if t >= end {
            return;
        }
        let phase = self.phases[self.index(t)];
        let (s, v) = (phase.way(t), phase.speed(t));
        if v <= 0.0 {
            // Not begun yet, or just at a stop.
            self.go_on(t, &[]);
            return;
        }
        // The plan as it stands, from here.
        let mut plan = vec![(0.0, v * v)];
        for p in &self.phases[self.index(t) + 1..] {
            plan.push((p.s - s, p.v * p.v));
        }
        let keep = if self.since(t, t, |p| p.a > 0.0) { v * self.window_s } else { 0.0 };
        let start = Start { s, v, keep };
        let legs = brake(&self.places, &plan, start, self.acceleration, self.window_s, &self.limits);
        self.go_on(t, &legs);
    }

    /// Whether new places would have asked for less speed or acceleration before `s` mm, where the base is at time `t`.
    fn reaches_back(&self, places: &[(Joint, Place)], t: f64, s: f64) -> bool {
        let first = self.index((t - self.window_s).max(0.0));
        let fastest =
            self.phases[first..=self.index(t)].iter().map(|p| p.v.max(p.speed(t))).fold(0.0, f64::max);
        let mut at = self.whole_mm();
        places.iter().any(|(joint, place)| {
            let cap = place.cap(&self.limits);
            let slow = cap.min(joint.speed);
            let bent = place.push(cap, 0.0, self.acceleration, &self.limits) < self.acceleration;
            let by_push = if bent || joint.jerk_per_speed > 0.0 { cap * self.window_s } else { 0.0 };
            let by_speed = if slow < fastest { 0.5 * slow * self.window_s } else { 0.0 };
            let back = by_push.max(by_speed) > at - s;
            at += place.length_mm;
            back
        })
    }

    fn whole_mm(&self) -> f64 {
        self.places.iter().map(|p| p.1.length_mm).sum()
    }

    /// Whether a phase like this was running within the window before `t`, as far as it has been run at `now`.
    fn since(&self, t: f64, now: f64, like: impl Fn(&Phase) -> bool) -> bool {
        let first = self.index((t - self.window_s).max(0.0));
        self.phases[first..].iter().take_while(|p| p.t < now).any(like)
    }

    fn index(&self, t: f64) -> usize {
        self.phases.partition_point(|p| p.t <= t).max(1) - 1
    }

    /// From time `t` on, the base runs along these legs.
    fn go_on(&mut self, t: f64, legs: &[Leg]) {
        let i = self.index(t);
        let here = Phase { t, s: self.phases[i].way(t), v: self.phases[i].speed(t).max(0.0), a: 0.0 };
        self.phases.truncate(if self.phases[i].t < t { i + 1 } else { i });
        let mut next = here;
        for leg in legs {
            let time = leg.time_s();
            let a = (leg.to - leg.from) / time;
            self.phases.push(Phase { v: leg.from, a, ..next });
            next = Phase { t: next.t + time, s: next.s + leg.length_mm, v: leg.to, a: 0.0 };
        }
        self.phases.push(Phase { v: 0.0, a: 0.0, ..next });
    }
}

fn window(acceleration: f64, limits: &Limits) -> f64 {
    if limits.jerk_mm_per_s3.is_finite() { acceleration / limits.jerk_mm_per_s3 } else { 0.0 }
}

/// Places from `s` mm on.
fn tail(places: &[(Joint, Place)], s: f64) -> Vec<(Joint, Place)> {
    let mut begin = 0.0;
    let mut rest = Vec::new();
    for &(joint, place) in places {
        let end = begin + place.length_mm;
        if end > s + 1e-12 {
            let left = end - s.max(begin);
            let joint = if rest.is_empty() { Joint::STOP } else { joint };
            rest.push((joint, Place { length_mm: left, ..place }));
        }
        begin = end;
    }
    rest
}

/// The acceleration of the base that makes the motion short: all of it takes `a / j` to build up, which pays for long
/// ways and high speeds only.
fn best_acceleration(places: &[(Joint, Place)], limits: &Limits) -> f64 {
    let (a, j) = (limits.acceleration_mm_per_s2, limits.jerk_mm_per_s3);
    if !j.is_finite() {
        return a;
    }
    let top = places.iter().map(|p| p.1.cap(limits)).fold(0.0, f64::max);
    let length: f64 = places.iter().map(|p| p.1.length_mm).sum();
    let full = a.min((top * j).sqrt());
    if length >= 2.0 * top * (top / full + full / j) || places.len() > MOST_PLACES_SEARCHED {
        return full;
    }
    let time = |a: f64| {
        let t = window(a, limits);
        legs(places, Start::default(), a, t, limits).iter().map(Leg::time_s).sum::<f64>() + t
    };
    // The shortest way from rest to rest over this length, which no bend makes shorter.
    let least = (0.5 * j * j * length).cbrt().min(full);
    let ratio = 0.5 * (5.0f64.sqrt() - 1.0);
    let (mut low, mut high) = (0.25 * least, full);
    let (mut x, mut y) = (high - ratio * (high - low), low + ratio * (high - low));
    let (mut at_x, mut at_y) = (time(x), time(y));
    for _ in 0..GOLDEN_STEPS {
        if at_x <= at_y {
            (high, y, at_y) = (y, x, at_x);
            x = high - ratio * (high - low);
            at_x = time(x);
        } else {
            (low, x, at_x) = (x, y, at_y);
            y = low + ratio * (high - low);
            at_y = time(y);
        }
    }
    let found = if at_x <= at_y { (at_x, x) } else { (at_y, y) };
    let ends = [(time(full), full), (time(least), least)];
    ends.into_iter().fold(found, |best, end| if end.0 < best.0 { end } else { best }).1
}
