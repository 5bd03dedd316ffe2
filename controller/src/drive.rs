use claymill_nurbs::{Curve3, Point3};

use crate::Dynamics;

/// A curve with its arc length: `t` of a distance from the start.
#[derive(Debug)]
struct Rail<'a> {
    curve: &'a Curve3,
    /// Parameter and distance at stations, both growing.
    stations: Vec<(f64, f64)>,
}

/// Distance between stations, mm.
const STATION_MM: f64 = 0.5;
const MOST_STATIONS: f64 = 1e6;
/// Gauss–Legendre nodes and weights on −1..1, three points.
const GAUSS: [(f64, f64); 3] =
    [(-0.774_596_669_241_483_4, 5.0 / 9.0), (0.0, 8.0 / 9.0), (0.774_596_669_241_483_4, 5.0 / 9.0)];

impl<'a> Rail<'a> {
    fn new(curve: &'a Curve3) -> Self {
        let mut stations = vec![(curve.domain().0, 0.0)];
        let mut along = 0.0;
        for span in curve.knots().breaks().windows(2) {
            let rough = length(curve, span[0], span[1]);
            let parts = (rough / STATION_MM).ceil().clamp(4.0, MOST_STATIONS) as usize;
            let mut last = span[0];
            for i in 1..=parts {
                let t = span[0] + (span[1] - span[0]) * i as f64 / parts as f64;
                along += length(curve, last, t);
                stations.push((t, along));
                last = t;
            }
        }
        Rail { curve, stations }
    }

    fn length_mm(&self) -> f64 {
        self.stations[self.stations.len() - 1].1
    }

    fn parameter(&self, s: f64) -> f64 {
        let i = self.stations.partition_point(|st| st.1 <= s).clamp(1, self.stations.len() - 1);
        let ((t0, s0), (t1, s1)) = (self.stations[i - 1], self.stations[i]);
        if s1 <= s0 {
            return t1;
        }
        let mut t = t0 + (t1 - t0) * ((s - s0) / (s1 - s0)).clamp(0.0, 1.0);
        for _ in 0..3 {
            let speed = self.curve.derivatives(t)[1].norm();
            if speed <= 0.0 {
                break;
            }
            t = (t - (s0 + length(self.curve, t0, t) - s) / speed).clamp(t0, t1);
        }
        t
    }
}

fn length(curve: &Curve3, a: f64, b: f64) -> f64 {
    let (middle, half) = (0.5 * (a + b), 0.5 * (b - a));
    GAUSS.iter().map(|(x, w)| w * curve.derivatives(middle + half * x)[1].norm()).sum::<f64>() * half
}

/// A motion from rest to rest along a curve under limits of velocity, acceleration and jerk.
///
/// Along the path it is the seven-phase profile with limited jerk. What the path's curvature κ adds is kept
/// within the limits by the cruising speed: with `v²κ ≤ a/√2` and a tangential acceleration up to `a/√2` the
/// whole acceleration is no larger than `a`; the three parts of the jerk, `j_t`, `3·v·a_t·κ` and
/// `v³·(|κ′| + κ²)`, get a third each.
#[derive(Debug)]
pub struct Motion<'a> {
    rail: Rail<'a>,
    /// Jerk and duration of the phases.
    phases: [(f64, f64); 7],
    time_s: f64,
}

/// Largest κ and |κ′| found at stations are taken this much larger.
const MARGIN: f64 = 1.1;

impl<'a> Motion<'a> {
    /// Plans a motion along `curve` with `feed` in mm/min.
    #[must_use]
    pub fn plan(curve: &'a Curve3, feed: f64, limits: &Dynamics) -> Self {
        let rail = Rail::new(curve);
        let (bend, change) = curvature(&rail);
        let (a, j) = (limits.acceleration_mm_per_s2, limits.jerk_mm_per_s3);
        let tangential = a * std::f64::consts::FRAC_1_SQRT_2;
        let mut v = feed / 60.0;
        if bend > 0.0 {
            v = v.min((tangential / bend).sqrt());
        }
        let twist = change + bend * bend;
        if twist > 0.0 {
            v = v.min((j / (3.0 * twist)).cbrt());
        }
        let mut a_t = tangential;
        if bend > 0.0 {
            a_t = a_t.min(j / (9.0 * v * bend));
        }
        let phases = profile(rail.length_mm(), v, a_t, j / 3.0);
        let time_s = phases.iter().map(|p| p.1).sum();
        Motion { rail, phases, time_s }
    }

    /// How long it takes, s.
    #[must_use]
    pub fn time_s(&self) -> f64 {
        self.time_s
    }

    /// The set point after `time_s` seconds, and the parameter of the curve there.
    #[must_use]
    pub fn at(&self, time_s: f64) -> (Point3, f64) {
        let (mut s, mut v, mut a, mut rest) = (0.0, 0.0, 0.0, time_s.clamp(0.0, self.time_s));
        for (j, duration) in self.phases {
            let t = rest.min(duration);
            s += v * t + 0.5 * a * t * t + j * t * t * t / 6.0;
            v += a * t + 0.5 * j * t * t;
            a += j * t;
            rest -= t;
        }
        let t = if time_s >= self.time_s {
            self.rail.curve.domain().1
        } else {
            self.rail.parameter(s.clamp(0.0, self.rail.length_mm()))
        };
        (self.rail.curve.point(t), t)
    }
}

/// Largest curvature, 1/mm, and its change along the path, 1/mm².
fn curvature(rail: &Rail) -> (f64, f64) {
    let bend = |t: f64| {
        let [_, d1, d2] = rail.curve.derivatives(t);
        let speed = d1.norm();
        if speed > 0.0 { d1.cross(&d2).norm() / speed.powi(3) } else { 0.0 }
    };
    let (mut largest, mut change, mut last): (f64, f64, Option<(f64, f64)>) = (0.0, 0.0, None);
    for w in rail.stations.windows(2) {
        let k = bend(0.5 * (w[0].0 + w[1].0));
        let s = 0.5 * (w[0].1 + w[1].1);
        largest = largest.max(k).max(bend(w[0].0)).max(bend(w[1].0));
        if let Some((before, at)) = last
            && s > at
        {
            change = change.max((k - before).abs() / (s - at));
        }
        last = Some((k, s));
    }
    (MARGIN * largest, MARGIN * change)
}

/// The seven phases from rest to rest over `length` under the limits.
fn profile(length: f64, v: f64, a: f64, j: f64) -> [(f64, f64); 7] {
    // Time to reach a speed: with the full acceleration, or without ever reaching it.
    let ramp = |v: f64| {
        let rise = (v / j).sqrt().min(a / j);
        (rise, if rise < a / j { 0.0 } else { v / a - rise })
    };
    let distance = |v: f64| {
        let (rise, flat) = ramp(v);
        v * (2.0 * rise + flat)
    };
    let mut top = v;
    if distance(top) > length {
        let (mut low, mut high) = (0.0, top);
        for _ in 0..100 {
            let middle = 0.5 * (low + high);
            if distance(middle) > length { high = middle } else { low = middle }
        }
        top = low;
    }
    let (rise, flat) = ramp(top);
    let cruise = if top > 0.0 { ((length - distance(top)) / top).max(0.0) } else { 0.0 };
    // The jerk that reaches the top speed exactly.
    let j = if rise > 0.0 { top / (rise * (rise + flat)) } else { 0.0 };
    [(j, rise), (0.0, flat), (-j, rise), (0.0, cruise), (-j, rise), (0.0, flat), (j, rise)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use claymill_nurbs::{KnotVector, Vector3};

    fn wave() -> Curve3 {
        let points: Vec<Point3> = (0..12)
            .map(|i| Point3::new(f64::from(i) * 9.0, 4.0 * f64::from(i % 3), f64::from(i * i % 5)))
            .collect();
        let mut knots = vec![0.0; 4];
        knots.extend((1..9).map(|i| f64::from(i) * 11.0));
        knots.extend([100.0; 4]);
        Curve3::new(KnotVector::new(3, knots).unwrap(), points, None).unwrap()
    }

    #[test]
    fn set_points_keep_every_limit() {
        let curve = wave();
        for feed in [600.0, 6000.0, 60_000.0] {
            let limits = Dynamics { acceleration_mm_per_s2: 3000.0, jerk_mm_per_s3: 60_000.0, cycle_s: 1e-3 };
            let motion = Motion::plan(&curve, feed, &limits);
            let ticks = (motion.time_s() / limits.cycle_s).ceil() as usize;
            let points: Vec<Point3> = (0..=ticks).map(|i| motion.at(i as f64 * limits.cycle_s).0).collect();
            let differences = |v: &[Vector3]| -> Vec<Vector3> {
                v.windows(2).map(|w| (w[1] - w[0]) / limits.cycle_s).collect()
            };
            let positions: Vec<Vector3> = points.iter().map(|p| p.coords).collect();
            let velocity = differences(&positions);
            let acceleration = differences(&velocity);
            let jerk = differences(&acceleration);
            let largest = |v: &[Vector3]| v.iter().map(|x| x.norm()).fold(0.0, f64::max);
            assert!(largest(&velocity) <= feed / 60.0 * (1.0 + 1e-6), "{}", largest(&velocity));
            assert!(largest(&acceleration) <= limits.acceleration_mm_per_s2, "{}", largest(&acceleration));
            assert!(largest(&jerk) <= limits.jerk_mm_per_s3, "{}", largest(&jerk));
            assert!((points[ticks] - curve.end()).norm() < 1e-9);
            let executed = ticks as f64 * limits.cycle_s;
            assert!((executed - motion.time_s()).abs() <= 0.01 * motion.time_s(), "{executed}");
            // Set points lie on the curve.
            for (i, p) in points.iter().enumerate() {
                let t = motion.at(i as f64 * limits.cycle_s).1;
                assert!((curve.point(t) - p).norm() < 1e-4);
            }
        }
    }

    #[test]
    fn a_profile_covers_its_length() {
        for length in [1e-4, 0.1, 3.0, 80.0, 5000.0] {
            let phases = profile(length, 100.0, 2000.0, 20_000.0);
            let (mut s, mut v, mut a) = (0.0, 0.0, 0.0);
            for (j, t) in phases {
                s += v * t + 0.5 * a * t * t + j * t * t * t / 6.0;
                v += a * t + 0.5 * j * t * t;
                a += j * t;
                assert!(v <= 100.0 + 1e-9 && a.abs() <= 2000.0 + 1e-9);
            }
            approx::assert_relative_eq!(s, length, max_relative = 1e-9);
            assert!(v.abs() < 1e-6 && a.abs() < 1e-6, "{v} {a}");
        }
    }
}
