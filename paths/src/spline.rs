//! Cubic splines by least squares: what passes and guides are made of.

use claymill_nurbs::KnotVector;
use nalgebra::{Point, SVector};

use crate::banded::solve_banded;

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
    for Datum { t, weight, p } in data {
        let (start, values) = knots.basis_functions(t);
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
