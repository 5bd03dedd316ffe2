//! The part of a curve between two parameters, exactly.

use claymill_nurbs::{Curve3, KnotVector, NurbsError, Point3};
use nalgebra::Vector4;

/// The part of `curve` over `[a, b]`, with clamped ends; parameters keep their meaning.
///
/// Control point `i` of a B-spline is its blossom at the `p` inner knots of basis function `i`
/// (Ramshaw 1989), which also gives the points of the new knot vector.
pub(crate) fn subcurve(curve: &Curve3, a: f64, b: f64) -> Result<Curve3, NurbsError> {
    let (p, old) = (curve.knots().degree(), curve.knots().as_slice());
    let mut knots = vec![a; p + 1];
    knots.extend(old.iter().filter(|k| a < **k && **k < b));
    knots.extend(vec![b; p + 1]);
    let knots = KnotVector::new(p, knots)?;
    let new = knots.as_slice();
    let homogeneous = |i: usize| {
        let w = curve.weights().map_or(1.0, |w| w[i]);
        (curve.points()[i].coords * w).push(w)
    };
    let net: Vec<Vector4<f64>> = (0..knots.point_count())
        .map(|i| {
            // Any span under basis function i gives the same value.
            let under = (i..=i + p).find(|&k| new[k] < new[k + 1]).unwrap_or(i);
            let span = curve.knots().span(0.5 * (new[under] + new[under + 1]));
            let mut d: Vec<_> = (span - p..=span).map(homogeneous).collect();
            for r in 1..=p {
                let t = new[i + r];
                for j in (r..=p).rev() {
                    let (low, high) = (old[span - p + j], old[span + 1 + j - r]);
                    let x = (t - low) / (high - low);
                    d[j] = d[j - 1] * (1.0 - x) + d[j] * x;
                }
            }
            d[p]
        })
        .collect();
    let points = net.iter().map(|h| Point3::from(h.xyz() / h.w)).collect();
    let weights = curve.weights().map(|_| net.iter().map(|h| h.w).collect());
    Curve3::new(knots, points, weights)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_part_is_the_same_curve() {
        let knots = KnotVector::new(3, vec![0., 0.1, 0.2, 0.5, 1., 1.5, 1.5, 2., 2.5, 3., 3.]).unwrap();
        let points = (0..7).map(|i| Point3::new(f64::from(i), f64::from(i * i % 5), f64::from(i % 3)));
        let weights = (0..7).map(|i| 1.0 + 0.2 * f64::from(i % 4)).collect();
        let whole = Curve3::new(knots, points.collect(), Some(weights)).unwrap();
        for (a, b) in [(0.5, 2.0), (0.7, 1.1), (1.2, 1.9), (0.5, 1.5)] {
            let part = subcurve(&whole, a, b).unwrap();
            assert_eq!(part.domain(), (a, b));
            for i in 0..=20 {
                let t = a + (b - a) * f64::from(i) / 20.0;
                approx::assert_abs_diff_eq!(part.point(t), whole.point(t), epsilon = 1e-12);
            }
        }
    }
}
