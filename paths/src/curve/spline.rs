//! Cubic splines by least squares: what passes and drive curves are made of.

use claymill_nurbs::KnotVector;
use nalgebra::{Point, SVector};

use crate::curve::banded::solve_banded;

const DEGREE: usize = 3;

/// A place that a spline should run through.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Datum<const D: usize> {
    /// Parameter.
    pub(crate) t: f64,
    pub(crate) weight: f64,
    pub(crate) p: Point<f64, D>,
}

/// The knot vector of a cubic with these breaks: C², and C¹ where two are one.
pub(crate) fn knot_vector(breaks: &[f64]) -> Option<KnotVector> {
    let (first, last) = (*breaks.first()?, *breaks.last()?);
    let mut knots = vec![first; DEGREE];
    knots.extend_from_slice(breaks);
    knots.extend([last; DEGREE]);
    KnotVector::new(DEGREE, knots).ok()
}

/// The four basis functions that act in one span of a cubic, as polynomials.
#[derive(Debug)]
pub(crate) struct SpanBasis {
    /// The first control point that acts.
    pub(crate) first: usize,
    start: f64,
    width: f64,
    /// Factors of the powers of the share of the span that is behind.
    functions: [[f64; DEGREE + 1]; DEGREE + 1],
}

impl SpanBasis {
    /// That of the span between knots `span` and `span + 1`, which has a length (Cox–de Boor recursion, The NURBS Book,
    /// eq. 2.5).
    pub(crate) fn new(knots: &KnotVector, span: usize) -> Self {
        let u = &knots.as_slice()[span + 1 - DEGREE..=span + DEGREE];
        let (start, width) = (u[DEGREE - 1], u[DEGREE] - u[DEGREE - 1]);
        // `(a + b·x)` times a polynomial, whose last factor is zero.
        let times = |n: [f64; DEGREE + 1], a: f64, b: f64| {
            [a * n[0], a * n[1] + b * n[0], a * n[2] + b * n[1], a * n[3] + b * n[2]]
        };
        let mut functions = [[0.0; DEGREE + 1]; DEGREE + 1];
        functions[0][0] = 1.0;
        for d in 1..=DEGREE {
            let mut carry = [0.0; DEGREE + 1];
            for r in 0..d {
                let (right, left) = (u[DEGREE + r], u[DEGREE + r - d]);
                let part = functions[r].map(|factor| factor / (right - left));
                let falling = times(part, right - start, -width);
                functions[r] = std::array::from_fn(|k| carry[k] + falling[k]);
                carry = times(part, start - left, width);
            }
            functions[d] = carry;
        }
        SpanBasis { first: span - DEGREE, start, width, functions }
    }

    fn holds(&self, t: f64) -> bool {
        (self.start..self.start + self.width).contains(&t)
    }

    fn at(&self, t: f64) -> [f64; DEGREE + 1] {
        let x = (t - self.start) / self.width;
        self.functions.map(|[a, b, c, d]| a + x * (b + x * (c + x * d)))
    }

    /// The span of a spline with the control points that act in it: factors of the powers of the share that is behind.
    pub(crate) fn span<const D: usize>(
        &self,
        points: [SVector<f64, D>; DEGREE + 1],
    ) -> [SVector<f64, D>; DEGREE + 1] {
        std::array::from_fn(|power| {
            self.functions.iter().zip(points).map(|(function, point)| point * function[power]).sum()
        })
    }
}

/// Control points of the cubic from `first` to `last` that comes closest to the data. Normal equations are
/// banded (half bandwidth 3). `None` where the data do not determine it.
pub(crate) fn least_squares<const D: usize>(
    knots: &KnotVector,
    (first, last): (Point<f64, D>, Point<f64, D>),
    data: impl Iterator<Item = Datum<D>>,
) -> Option<Vec<Point<f64, D>>> {
    let n = knots.point_count();
    let inner = n - 2;
    let mut a = vec![[0.0; DEGREE + 1]; inner];
    let mut b = vec![[0.0; D]; inner];
    let mut basis = SpanBasis::new(knots, knots.span(knots.domain().0));
    for Datum { t, weight, p } in data {
        if !basis.holds(t) {
            basis = SpanBasis::new(knots, knots.span(t));
        }
        let (start, values) = (basis.first, basis.at(t));
        let mut rest = p.coords;
        for (i, &w) in values.iter().enumerate() {
            match start + i {
                0 => rest -= first.coords * w,
                j if j == n - 1 => rest -= last.coords * w,
                _ => {}
            }
        }
        for (i, &wi) in values.iter().enumerate() {
            let row = start + i;
            if row == 0 || row == n - 1 {
                continue;
            }
            for (sum, value) in b[row - 1].iter_mut().zip(rest.iter()) {
                *sum += weight * wi * value;
            }
            for (j, &wj) in values.iter().enumerate().skip(i) {
                if start + j < n - 1 {
                    a[row - 1][j - i] += weight * wi * wj;
                }
            }
        }
    }
    solve_banded(&mut a, &mut b)?;
    let middle = b.into_iter().map(|p| Point::from(SVector::from(p)));
    Some(std::iter::once(first).chain(middle).chain(std::iter::once(last)).collect())
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector1;

    use super::*;

    #[test]
    fn spans_are_the_basis_functions() {
        // Two breaks in one, and a span a thousand times shorter than those beside it.
        let knots = knot_vector(&[0.0, 4.0, 4.0, 9.0, 9.01, 20.0]).unwrap();
        for t in (0..400).map(|k| 0.05 * f64::from(k)).chain([9.001, 9.0099]) {
            let basis = SpanBasis::new(&knots, knots.span(t));
            let (first, exact) = knots.basis_functions(t);
            assert_eq!(basis.first, first);
            for (ours, exact) in basis.at(t).iter().zip(&exact) {
                approx::assert_abs_diff_eq!(*ours, *exact, epsilon = 1e-14);
            }
            let points = [3.0, -1.0, 4.0, 1.5].map(Vector1::new);
            let x = (t - basis.start) / basis.width;
            let [a, b, c, d] = basis.span(points).map(|factor| factor.x);
            let point: f64 = exact.iter().zip(points).map(|(n, p)| n * p.x).sum();
            approx::assert_abs_diff_eq!(a + x * (b + x * (c + x * d)), point, epsilon = 1e-13);
        }
    }
}
