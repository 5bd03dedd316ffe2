//! Curves by their length.

use claymill_nurbs::{Curve3, NurbsError};

use crate::hermite::fitted;

/// Nodes and weights of Gauss–Legendre quadrature on `[0, 1]`, five points.
const GAUSS: [(f64, f64); 5] = [
    (0.046_910_077_030_668, 0.118_463_442_528_095),
    (0.230_765_344_947_158, 0.239_314_335_249_683),
    (0.5, 0.284_444_444_444_444),
    (0.769_234_655_052_842, 0.239_314_335_249_683),
    (0.953_089_922_969_332, 0.118_463_442_528_095),
];
/// Steps of one polynomial piece in the table.
const STEPS: usize = 16;

/// Length of a curve from its start, as a table.
pub(crate) struct ArcLength<'a> {
    curve: &'a Curve3,
    /// Parameters and the length up to them.
    table: Vec<(f64, f64)>,
}

impl<'a> ArcLength<'a> {
    pub(crate) fn new(curve: &'a Curve3) -> Self {
        let breaks = curve.knots().breaks();
        let mut table = vec![(breaks[0], 0.0)];
        let mut sum = 0.0;
        for w in breaks.windows(2) {
            for k in 0..STEPS {
                let at = |k: usize| w[0] + (w[1] - w[0]) * k as f64 / STEPS as f64;
                sum += length(curve, at(k), at(k + 1));
                table.push((at(k + 1), sum));
            }
        }
        ArcLength { curve, table }
    }

    pub(crate) fn total(&self) -> f64 {
        self.table[self.table.len() - 1].1
    }

    /// The share of the length up to parameter `t`.
    pub(crate) fn share(&self, t: f64) -> f64 {
        let k = self.table.partition_point(|e| e.0 <= t).clamp(1, self.table.len() - 1);
        let (start, before) = self.table[k - 1];
        (before + length(self.curve, start, t)) / self.total()
    }

    /// The parameter up to which a share of the length lies.
    pub(crate) fn parameter(&self, share: f64) -> f64 {
        let wanted = share * self.total();
        let k = self.table.partition_point(|e| e.1 <= wanted).clamp(1, self.table.len() - 1);
        let ((low, before), (high, behind)) = (self.table[k - 1], self.table[k]);
        let mut t = low + (high - low) * ((wanted - before) / (behind - before)).clamp(0.0, 1.0);
        for _ in 0..8 {
            let off = before + length(self.curve, low, t) - wanted;
            let speed = self.curve.derivatives(t)[1].norm();
            let next = (t - off / speed).clamp(low, high);
            if !next.is_finite() || next == t {
                break;
            }
            t = next;
        }
        t
    }

    /// The curve over `[0, 1]` by its share of length, as a cubic; and how far that is from it.
    pub(crate) fn unrolled(&self, tolerance: f64) -> Result<(Curve3, f64), NurbsError> {
        let breaks: Vec<f64> = self.curve.knots().breaks().iter().map(|t| self.share(*t)).collect();
        let mut breaks = breaks;
        if let Some(last) = breaks.last_mut() {
            *last = 1.0;
        }
        breaks.dedup();
        fitted(&breaks, tolerance, |s| {
            let [p, d, _] = self.curve.derivatives(self.parameter(s));
            [p, d * (self.total() / d.norm())]
        })
    }
}

fn length(curve: &Curve3, from: f64, to: f64) -> f64 {
    let speed = |(x, w): (f64, f64)| curve.derivatives(from + (to - from) * x)[1].norm() * w;
    (to - from) * GAUSS.into_iter().map(speed).sum::<f64>()
}

#[cfg(test)]
mod tests {
    use super::*;
    use claymill_nurbs::{KnotVector, Point3};

    #[test]
    fn a_parabola_has_its_known_length_and_is_unrolled_evenly() {
        // y = x² for x in 0..2.
        let points = [(0.0, 0.0), (1.0, 0.0), (2.0, 4.0)].map(|(x, y)| Point3::new(x, y, 0.0)).to_vec();
        let curve = Curve3::new(KnotVector::clamped_uniform(2, 3), points, None).unwrap();
        let known = |x: f64| 0.5 * x * (1.0 + 4.0 * x * x).sqrt() + 0.25 * (2.0 * x).asinh();
        let by_length = ArcLength::new(&curve);
        approx::assert_relative_eq!(by_length.total(), known(2.0), epsilon = 1e-9);
        let (even, deviation) = by_length.unrolled(1e-6).unwrap();
        assert!(deviation <= 1e-6);
        for i in 0..=20 {
            let share = f64::from(i) / 20.0;
            let p = even.point(share);
            approx::assert_abs_diff_eq!(known(p.x), share * known(2.0), epsilon = 1e-5);
            approx::assert_abs_diff_eq!(p.y, p.x * p.x, epsilon = 1e-5);
        }
    }
}
