//! A curve with its arc length, by three-point Gauss–Legendre quadrature between stations; the
//! parameter at a distance follows by Newton's method.

use claymill_nurbs::{Curve3, Point3};

/// How closely a curve is looked at.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Looks {
    /// Stations in each knot span at least.
    pub per_span: u32,
    /// Distance of stations at most, mm.
    pub longest_mm: f64,
    /// The same on straight ways, where nothing changes.
    pub straight_mm: f64,
}

impl Looks {
    /// For times: bends are seen, positions are not asked for.
    pub const COARSE: Looks = Looks { per_span: 8, longest_mm: f64::INFINITY, straight_mm: f64::INFINITY };
    /// For set points.
    pub const FINE: Looks = Looks { per_span: 8, longest_mm: 1.0, straight_mm: f64::INFINITY };
}

/// A curve with its arc length: the parameter at a distance from the start.
#[derive(Debug, Clone)]
pub struct Rail {
    curve: Curve3,
    /// Parameter and distance at stations, both growing.
    stations: Vec<(f64, f64)>,
}

/// A curve is never looked at in more places than this times its spans.
const MOST_STATIONS: f64 = 1e5;
/// Gauss–Legendre nodes and weights on −1..1, three points.
const GAUSS: [(f64, f64); 3] =
    [(-0.774_596_669_241_483_4, 5.0 / 9.0), (0.0, 8.0 / 9.0), (0.774_596_669_241_483_4, 5.0 / 9.0)];

impl Rail {
    /// Measures a curve.
    #[must_use]
    pub fn new(curve: Curve3, looks: Looks) -> Self {
        let mut stations = vec![(curve.domain().0, 0.0)];
        let mut along = 0.0;
        let straight = curve.knots().degree() == 1;
        for span in curve.knots().breaks().windows(2) {
            let rough = length(&curve, span[0], span[1]);
            let least = if straight { 1.0 } else { f64::from(looks.per_span) };
            let longest = if straight { looks.straight_mm } else { looks.longest_mm };
            let parts = (rough / longest).ceil().clamp(least, MOST_STATIONS) as usize;
            let mut last = span[0];
            for i in 1..=parts {
                let t = span[0] + (span[1] - span[0]) * i as f64 / parts as f64;
                along += length(&curve, last, t);
                stations.push((t, along));
                last = t;
            }
        }
        Rail { curve, stations }
    }

    /// The curve.
    #[must_use]
    pub fn curve(&self) -> &Curve3 {
        &self.curve
    }

    /// Its length, mm.
    #[must_use]
    pub fn length_mm(&self) -> f64 {
        self.stations[self.stations.len() - 1].1
    }

    /// Parameter and distance at stations, both growing.
    pub(crate) fn stations(&self) -> &[(f64, f64)] {
        &self.stations
    }

    /// The parameter at `s` mm from the start.
    #[must_use]
    pub fn parameter(&self, s: f64) -> f64 {
        if self.stations.len() < 2 {
            return self.stations[0].0;
        }
        let i = self.stations.partition_point(|st| st.1 <= s).clamp(1, self.stations.len() - 1);
        let ((t0, s0), (t1, s1)) = (self.stations[i - 1], self.stations[i]);
        if s1 <= s0 || s >= s1 {
            return t1;
        }
        let mut t = t0 + (t1 - t0) * ((s - s0) / (s1 - s0)).clamp(0.0, 1.0);
        for _ in 0..3 {
            let speed = self.curve.derivatives(t)[1].norm();
            if speed <= 0.0 {
                break;
            }
            t = (t - (s0 + length(&self.curve, t0, t) - s) / speed).clamp(t0, t1);
        }
        t
    }

    /// The point at `s` mm from the start.
    #[must_use]
    pub fn point(&self, s: f64) -> Point3 {
        self.curve.point(self.parameter(s))
    }
}

fn length(curve: &Curve3, a: f64, b: f64) -> f64 {
    let (middle, half) = (0.5 * (a + b), 0.5 * (b - a));
    GAUSS.iter().map(|(x, w)| w * curve.derivatives(middle + half * x)[1].norm()).sum::<f64>() * half
}

#[cfg(test)]
mod tests {
    use super::*;
    use claymill_nurbs::{Vector3, analytic};

    #[test]
    fn a_circle_has_its_length_and_equal_steps() {
        let placement = analytic::Frame::new(Point3::origin(), Vector3::z(), Vector3::x()).unwrap();
        let arc = analytic::circle_arc(&placement, 10.0, (0.0, 3.0)).unwrap();
        let rail = Rail::new(arc, Looks::FINE);
        approx::assert_relative_eq!(rail.length_mm(), 30.0, max_relative = 1e-9);
        for i in 0..=30 {
            let s = f64::from(i);
            let p = rail.point(s);
            approx::assert_abs_diff_eq!(p.y.atan2(p.x), s / 10.0, epsilon = 1e-8);
        }
    }
}
