//! Surfaces through the points of a function, as quintic splines: a smooth function needs a tenth of the lines that
//! cubics need.

use claymill_nurbs::{KnotVector, NurbsError, NurbsSurface, Point3, Vector3};

const DEGREE: usize = 5;
/// A knot of this multiplicity lets the spline have a kink.
pub(crate) const KINK: usize = DEGREE;

/// One direction of the net: knots, the parameters where the spline meets the function, and the factors of the
/// matrix between values there and control points.
struct Direction {
    knots: KnotVector,
    sites: Vec<f64>,
    /// Row `i` holds columns `i − DEGREE ..= i + DEGREE`; below the diagonal the multipliers of the elimination.
    rows: Vec<[f64; 2 * DEGREE + 1]>,
}

impl Direction {
    /// `lines` are parameters with the multiplicity of the knot there; that of the ends is not looked at.
    fn new(lines: &[(f64, usize)]) -> Result<Direction, NurbsError> {
        let last = lines.len() - 1;
        let times = |i: usize| if i == 0 || i == last { DEGREE + 1 } else { lines[i].1.clamp(1, KINK) };
        let all = lines.iter().enumerate().flat_map(|(i, (t, _))| std::iter::repeat_n(*t, times(i)));
        let knots = KnotVector::new(DEGREE, all.collect())?;
        // Greville's abscissae: the matrix is banded and totally positive, so that it needs no pivots
        // (de Boor, A Practical Guide to Splines, ch. XIII).
        let mean =
            |k: &[f64]| if k[0] == k[DEGREE - 1] { k[0] } else { k.iter().sum::<f64>() / DEGREE as f64 };
        let (low, high) = knots.domain();
        let inner = &knots.as_slice()[1..knots.as_slice().len() - 1];
        let sites: Vec<f64> = inner.windows(DEGREE).map(|k| mean(k).clamp(low, high)).collect();
        let mut rows = vec![[0.0; 2 * DEGREE + 1]; sites.len()];
        for (i, t) in sites.iter().enumerate() {
            let (first, basis) = knots.basis_functions(*t);
            for (k, b) in basis.into_iter().enumerate().filter(|(_, b)| *b != 0.0) {
                rows[i][first + k + DEGREE - i] = b;
            }
        }
        for i in 0..rows.len() {
            let pivot = rows[i];
            for below in i + 1..rows.len().min(i + DEGREE + 1) {
                let shift = below - i;
                let factor = rows[below][DEGREE - shift] / pivot[DEGREE];
                rows[below][DEGREE - shift] = factor;
                for k in 1..=DEGREE {
                    rows[below][DEGREE - shift + k] -= factor * pivot[DEGREE + k];
                }
            }
        }
        Ok(Direction { knots, sites, rows })
    }

    /// Values at the sites, `at(i)`, become control points in place.
    fn solve(&self, values: &mut [Vector3], at: impl Fn(usize) -> usize) {
        let n = self.rows.len();
        for i in 0..n {
            for k in 1..=DEGREE.min(i) {
                let above = values[at(i - k)];
                values[at(i)] -= above * self.rows[i][DEGREE - k];
            }
        }
        for i in (0..n).rev() {
            for k in 1..=DEGREE.min(n - 1 - i) {
                let below = values[at(i + k)];
                values[at(i)] -= below * self.rows[i][DEGREE + k];
            }
            values[at(i)] /= self.rows[i][DEGREE];
        }
    }
}

/// Control points of the surface over these lines.
pub(crate) fn net_size(us: &[(f64, usize)], vs: &[(f64, usize)]) -> usize {
    let count = |lines: &[(f64, usize)]| {
        let inner = lines.get(1..lines.len().saturating_sub(1)).unwrap_or_default();
        DEGREE + 1 + inner.iter().map(|l| l.1).sum::<usize>()
    };
    count(us).saturating_mul(count(vs))
}

/// The quintic spline through `at(u, v)`, with knots of the given multiplicities at the lines.
///
/// # Errors
/// Lines that do not rise, or values that are not finite.
pub(crate) fn surface(
    us: &[(f64, usize)],
    vs: &[(f64, usize)],
    at: impl Fn(f64, f64) -> Vector3,
) -> Result<NurbsSurface, NurbsError> {
    let (along_u, along_v) = (Direction::new(us)?, Direction::new(vs)?);
    let (rows, columns) = (along_u.sites.len(), along_v.sites.len());
    let mut net = Vec::with_capacity(rows * columns);
    for u in &along_u.sites {
        net.extend(along_v.sites.iter().map(|v| at(*u, *v)));
    }
    (0..rows).for_each(|i| along_v.solve(&mut net, |j| i * columns + j));
    (0..columns).for_each(|j| along_u.solve(&mut net, |i| i * columns + j));
    let points = net.into_iter().map(Point3::from).collect();
    NurbsSurface::new(along_u.knots, along_v.knots, points, None)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quintics_are_met_exactly_and_kinks_kept() {
        let us = [(-1.0, 0), (0.5, 1), (0.7, KINK), (2.0, 0)];
        let vs = [(0.0, 0), (0.1, 2), (3.0, 0)];
        let f = |u: f64, v: f64| Vector3::new(u.powi(5) - v, (u - 0.7).abs() * v.powi(4), 1.0 + u * v);
        let fit = surface(&us, &vs, f).unwrap();
        assert_eq!(fit.net().len(), net_size(&us, &vs));
        for i in 0..=60 {
            for j in 0..=60 {
                let (u, v) = (-1.0 + f64::from(i) / 20.0, f64::from(j) / 20.0);
                approx::assert_abs_diff_eq!(fit.point(u, v).coords, f(u, v), epsilon = 1e-11);
            }
        }
    }

    #[test]
    fn smooth_functions_are_met_to_the_sixth_order() {
        let f = |u: f64, v: f64| Vector3::new(u, v, (u + 0.5 * v).sin());
        let error = |pieces: usize| {
            let lines: Vec<_> = (0..=pieces).map(|i| (3.0 * i as f64 / pieces as f64, 1)).collect();
            let fit = surface(&lines, &lines, f).unwrap();
            let place = |i: i32| 3.0 * f64::from(i) / 97.0;
            let away = |i: i32, j: i32| (fit.point(place(i), place(j)).coords - f(place(i), place(j))).norm();
            (0..=97).flat_map(|i| (0..=97).map(move |j| away(i, j))).fold(0.0, f64::max)
        };
        let (coarse, fine) = (error(8), error(16));
        assert!(coarse < 1e-5 && fine < coarse / 40.0, "{coarse} {fine}");
    }
}
