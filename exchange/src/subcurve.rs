//! Parts of curves, their joins and affine images, exactly.

use claymill_nurbs::{KnotVector, NurbsCurve, NurbsError};
use nalgebra::{Point, SVector};

/// The part of `curve` over `[a, b]`, with clamped ends; parameters keep their meaning.
///
/// Control point `i` of a B-spline is its blossom at the `p` inner knots of basis function `i`
/// (Ramshaw 1989), which also gives the points of the new knot vector.
///
/// # Errors
/// The interval is empty or not finite.
pub(crate) fn subcurve<const D: usize>(
    curve: &NurbsCurve<D>,
    a: f64,
    b: f64,
) -> Result<NurbsCurve<D>, NurbsError> {
    let degree = curve.knots().degree();
    let mut knots = vec![a; degree + 1];
    knots.extend(curve.knots().as_slice().iter().filter(|k| a < **k && **k < b));
    knots.extend(vec![b; degree + 1]);
    let knots = KnotVector::new(degree, knots)?;
    let new = knots.as_slice();
    let (points, weights) = (0..knots.point_count())
        .map(|i| {
            // Any span under basis function i gives the same value.
            let under = (i..=i + degree).find(|&k| new[k] < new[k + 1]).unwrap_or(i);
            let span = curve.knots().span(0.5 * (new[under] + new[under + 1]));
            let (p, w) = blossom(curve, span, &new[i + 1..=i + degree]);
            (Point::from(p / w), w)
        })
        .unzip();
    NurbsCurve::new(knots, points, curve.weights().map(|_| weights))
}

/// The homogeneous blossom of the polynomial piece on `span`.
pub(crate) fn blossom<const D: usize>(
    curve: &NurbsCurve<D>,
    span: usize,
    at: &[f64],
) -> (SVector<f64, D>, f64) {
    let (knots, degree) = (curve.knots().as_slice(), curve.knots().degree());
    let mut net: Vec<(SVector<f64, D>, f64)> = (span - degree..=span)
        .map(|i| {
            let w = curve.weights().map_or(1.0, |w| w[i]);
            (curve.points()[i].coords * w, w)
        })
        .collect();
    for (k, t) in at.iter().enumerate() {
        for r in (k + 1..=degree).rev() {
            let i = span - degree + r;
            let (left, right) = (knots[i], knots[i + degree - k]);
            let a = (t - left) / (right - left);
            let (low, high) = (net[r - 1], net[r]);
            net[r] = (low.0 * (1.0 - a) + high.0 * a, low.1 * (1.0 - a) + high.1 * a);
        }
    }
    net[degree]
}

/// `first` followed by `second`, which starts where `first` ends; both clamped and of one degree.
pub(crate) fn joined<const D: usize>(first: &NurbsCurve<D>, second: &NurbsCurve<D>) -> Option<NurbsCurve<D>> {
    let degree = first.knots().degree();
    if second.knots().degree() != degree {
        return None;
    }
    let shift = first.domain().1 - second.domain().0;
    let mut knots = first.knots().as_slice().to_vec();
    knots.pop();
    knots.extend(second.knots().as_slice()[degree + 1..].iter().map(|k| k + shift));
    let mut points = first.points().to_vec();
    points.extend(&second.points()[1..]);
    let weights = (first.weights().is_some() || second.weights().is_some()).then(|| {
        let of = |c: &NurbsCurve<D>| c.weights().map_or(vec![1.0; c.points().len()], <[f64]>::to_vec);
        let (mut weights, tail) = (of(first), of(second));
        let scale = weights[weights.len() - 1] / tail[0];
        weights.extend(tail[1..].iter().map(|w| w * scale));
        weights
    });
    NurbsCurve::new(KnotVector::new(degree, knots).ok()?, points, weights).ok()
}

/// The image of the curve under an affine map, exactly.
pub(crate) fn mapped<const D: usize, const E: usize>(
    curve: &NurbsCurve<D>,
    map: impl Fn(&Point<f64, D>) -> Point<f64, E>,
) -> Result<NurbsCurve<E>, NurbsError> {
    let weights = curve.weights().map(<[f64]>::to_vec);
    NurbsCurve::new(curve.knots().clone(), curve.points().iter().map(map).collect(), weights)
}

#[cfg(test)]
mod tests {
    use super::*;
    use claymill_nurbs::Curve3;
    use claymill_nurbs::Point3;

    fn wavy() -> Curve3 {
        let knots =
            KnotVector::new(3, vec![-0.3, -0.1, 0.0, 0.1, 0.4, 0.5, 0.5, 1.0, 1.0, 1.2, 1.3]).unwrap();
        let count = knots.point_count();
        let points =
            (0..count).map(|i| Point3::new(i as f64, (i as f64).sin() * 3.0, (i * i) as f64 * 0.2)).collect();
        let weights = (0..count).map(|i| 1.0 + 0.3 * (i as f64 * 2.0).cos()).collect();
        Curve3::new(knots, points, Some(weights)).unwrap()
    }

    #[test]
    fn parts_and_their_join_are_the_same_curve() {
        let c = wavy();
        let (a, b) = c.domain();
        for cut in [0.45, 0.5, 0.17] {
            let low = subcurve(&c, a, cut).unwrap();
            let high = subcurve(&c, cut, b).unwrap();
            let inner = subcurve(&c, 0.13, 0.51).unwrap();
            let both = joined(&low, &high).unwrap();
            assert_eq!((low.domain(), high.domain()), ((a, cut), (cut, b)));
            for i in 0..=60 {
                let t = a + (b - a) * f64::from(i) / 60.0;
                let part = if t < cut { &low } else { &high };
                approx::assert_abs_diff_eq!(part.point(t), c.point(t), epsilon = 1e-12);
                approx::assert_abs_diff_eq!(both.point(t), c.point(t), epsilon = 1e-12);
                if (0.13..=0.51).contains(&t) {
                    approx::assert_abs_diff_eq!(inner.point(t), c.point(t), epsilon = 1e-12);
                }
            }
        }
        assert!(subcurve(&c, 0.4, 0.4).is_err());
        assert!(subcurve(&c, 0.4, f64::NAN).is_err());
    }
}
