//! Cubic B-spline curves by polar forms (blossoms): interpolation, restriction and knot refinement
//! that keep shared edges equal to the last bits.

use claymill_nurbs::{Point3, Vector3};
use nalgebra::{DMatrix, DVector};

const DEGREE: usize = 3;

/// A cubic B-spline curve: what every feature line of a generated model is made of.
///
/// Everything it does is exact (polar forms; Ramshaw, "Blossoming", 1987), so that two sheets that take the
/// same piece of one curve as their edge meet to the last bits.
#[derive(Debug, Clone)]
pub(crate) struct Spline {
    pub(crate) knots: Vec<f64>,
    pub(crate) points: Vec<Point3>,
}

/// A node of a [`Spline::profile`]: parameter, point, direction of travel.
pub(crate) type Node = (f64, Point3, Vector3);

impl Spline {
    /// The twice continuously differentiable interpolant of at least four points at increasing parameters
    /// (end condition: not a knot).
    pub(crate) fn through(table: &[(f64, Point3)]) -> Spline {
        let n = table.len();
        assert!(n > DEGREE, "a cubic needs four points");
        let mut knots = vec![table[0].0; DEGREE + 1];
        knots.extend(table[2..n - 2].iter().map(|row| row.0));
        knots.extend(vec![table[n - 1].0; DEGREE + 1]);
        let basis = DMatrix::from_fn(n, n, |row, column| {
            let unit: Vec<f64> = (0..n).map(|i| f64::from(u8::from(i == column))).collect();
            let t = table[row].0;
            polar(&knots, &unit, span(&knots, t), [t; 3], |a, b, s| a + (b - a) * s)
        });
        let lu = basis.lu();
        let solve = |axis: usize| {
            let right = DVector::from_fn(n, |row, _| table[row].1[axis]);
            lu.solve(&right).expect("interpolation at increasing parameters is regular")
        };
        let (x, y, z) = (solve(0), solve(1), solve(2));
        let mut points: Vec<Point3> = (0..n).map(|i| Point3::new(x[i], y[i], z[i])).collect();
        (points[0], points[n - 1]) = (table[0].1, table[n - 1].1);
        Spline { knots, points }
    }

    /// A once continuously differentiable curve through nodes with given directions: flats, fillets and
    /// rolls meet tangentially, with a jump in curvature (double knots).
    pub(crate) fn profile(nodes: &[Node]) -> Spline {
        let n = nodes.len();
        let slowness = |i: usize| (nodes[i + 1].0 - nodes[i].0) / (nodes[i + 1].1 - nodes[i].1).norm();
        let tangent = |i: usize| {
            let before = (i > 0).then(|| slowness(i - 1));
            let after = (i + 1 < n).then(|| slowness(i));
            let mean = match (before, after) {
                (Some(a), Some(b)) => 0.5 * (a + b),
                (a, b) => a.or(b).expect("a profile has at least two nodes"),
            };
            nodes[i].2.normalize() / mean
        };
        let mut knots = vec![nodes[0].0; DEGREE + 1];
        let mut points = vec![nodes[0].1];
        for i in 0..n - 1 {
            let third = (nodes[i + 1].0 - nodes[i].0) / 3.0;
            points.push(nodes[i].1 + tangent(i) * third);
            points.push(nodes[i + 1].1 - tangent(i + 1) * third);
            if i + 2 < n {
                knots.extend([nodes[i + 1].0; 2]);
            }
        }
        points.push(nodes[n - 1].1);
        knots.extend([nodes[n - 1].0; DEGREE + 1]);
        Spline { knots, points }
    }

    /// The straight segment over `[0, 1]`.
    pub(crate) fn line(a: Point3, b: Point3) -> Spline {
        let knots = [[0.0; 4], [1.0; 4]].concat();
        let points = (0..4).map(|i| a + (b - a) * (f64::from(i) / 3.0)).collect();
        Spline { knots, points }
    }

    /// The closed uniform curve with these control points, one knot interval each, cut open at parameter 0.
    pub(crate) fn closed(control: &[Point3]) -> Spline {
        let n = control.len();
        let knots = (0..n + 2 * DEGREE + 1).map(|i| i as f64 - DEGREE as f64).collect();
        let points = (0..n + DEGREE).map(|i| control[i % n]).collect();
        Spline { knots, points }.restricted(0.0, n as f64)
    }

    pub(crate) fn domain(&self) -> (f64, f64) {
        (self.knots[DEGREE], self.knots[self.points.len()])
    }

    pub(crate) fn point(&self, t: f64) -> Point3 {
        polar(&self.knots, &self.points, span(&self.knots, t), [t; 3], |a, b, s| a + (b - a) * s)
    }

    /// Its length, from chords, mm.
    pub(crate) fn length(&self) -> f64 {
        let (a, b) = self.domain();
        let at = |i: i32| self.point(a + (b - a) * f64::from(i) / 32.0);
        (0..32).map(|i| (at(i + 1) - at(i)).norm()).sum()
    }

    /// The part over `[a, b]`.
    pub(crate) fn restricted(&self, a: f64, b: f64) -> Spline {
        let mut knots = vec![a; DEGREE + 1];
        knots.extend(self.knots.iter().filter(|&&k| a < k && k < b));
        knots.extend([b; DEGREE + 1]);
        self.with_knots(knots)
    }

    /// The same curve on more knots; `knots` must hold all of its own over the domain that they span.
    pub(crate) fn with_knots(&self, knots: Vec<f64>) -> Spline {
        let points = (0..knots.len() - DEGREE - 1)
            .map(|i| {
                // Any polynomial piece under the new control point's support gives the same value.
                let piece = knots[i..i + DEGREE + 2].windows(2).find(|w| w[0] < w[1]);
                let middle = piece.map_or(knots[i], |w| 0.5 * (w[0] + w[1]));
                let s = span(&self.knots, middle);
                let args = [knots[i + 1], knots[i + 2], knots[i + 3]];
                polar(&self.knots, &self.points, s, args, |a, b, s| a + (b - a) * s)
            })
            .collect();
        Spline { knots, points }
    }

    /// The same points run over `[0, 1]`, backwards if asked.
    pub(crate) fn normalised(&self, backwards: bool) -> Spline {
        let (a, b) = self.domain();
        let mut knots: Vec<f64> = self.knots.iter().map(|k| (k - a) / (b - a)).collect();
        let mut points = self.points.clone();
        if backwards {
            knots = knots.iter().rev().map(|k| 1.0 - k).collect();
            points.reverse();
        }
        Spline { knots, points }
    }

    /// The mirror image in the plane `y = 0`.
    pub(crate) fn mirrored(&self) -> Spline {
        let points = self.points.iter().map(|p| Point3::new(p.x, -p.y, p.z)).collect();
        Spline { knots: self.knots.clone(), points }
    }
}

/// Where the control points of clamped cubic `knots` sit in the parameter: means of three knots.
pub(crate) fn greville(knots: &[f64]) -> Vec<f64> {
    let count = knots.len() - DEGREE - 1;
    (0..count).map(|i| (knots[i + 1] + knots[i + 2] + knots[i + 3]) / 3.0).collect()
}

/// All knots of both with the higher of the two multiplicities; knots closer than `NEAR` are one.
pub(crate) fn united(a: &[f64], b: &[f64]) -> Vec<f64> {
    const NEAR: f64 = 1e-9;
    let (mut i, mut j) = (0, 0);
    let mut all = Vec::with_capacity(a.len() + b.len());
    while i < a.len() || j < b.len() {
        let (x, y) = (a.get(i).copied(), b.get(j).copied());
        match (x, y) {
            (Some(x), Some(y)) if (x - y).abs() <= NEAR => {
                all.push(x);
                (i, j) = (i + 1, j + 1);
            }
            (Some(x), y) if y.is_none_or(|y| x < y) => {
                all.push(x);
                i += 1;
            }
            (_, y) => {
                all.extend(y);
                j += 1;
            }
        }
    }
    all
}

/// Index of the non-empty knot interval that holds `t`.
fn span(knots: &[f64], t: f64) -> usize {
    let last = knots.len() - DEGREE - 2;
    let mut s = knots.partition_point(|&k| k <= t).saturating_sub(1).clamp(DEGREE, last);
    while s > DEGREE && knots[s] == knots[s + 1] {
        s -= 1;
    }
    s
}

/// The polar form of the polynomial on interval `s`, with de Boor's pyramid.
fn polar<P: Copy>(knots: &[f64], points: &[P], s: usize, args: [f64; 3], lerp: impl Fn(P, P, f64) -> P) -> P {
    let mut d: [P; 4] = std::array::from_fn(|i| points[s - DEGREE + i]);
    for (level, &t) in (1..=DEGREE).zip(&args) {
        for i in (level..=DEGREE).rev() {
            let (left, right) = (knots[s - DEGREE + i], knots[s + i + 1 - level]);
            d[i] = lerp(d[i - 1], d[i], (t - left) / (right - left));
        }
    }
    d[DEGREE]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wavy() -> Spline {
        let row = |i: i32| {
            let t = f64::from(i * i) * 0.1 + f64::from(i);
            (t, Point3::new(t * 100.0, (t * 0.7).sin() * 50.0, (t * 0.4).cos() * 80.0))
        };
        Spline::through(&(0..9).map(row).collect::<Vec<_>>())
    }

    #[test]
    fn it_interpolates_and_restricting_keeps_the_curve() {
        let s = wavy();
        for i in 0..9 {
            let t = f64::from(i * i) * 0.1 + f64::from(i);
            approx::assert_relative_eq!(s.point(t).x, t * 100.0, epsilon = 1e-9);
        }
        let part = s.restricted(1.37, 9.2);
        let back = part.normalised(true);
        for i in 0..=50 {
            let f = f64::from(i) / 50.0;
            let t = 1.37 + f * (9.2 - 1.37);
            assert!((part.point(t) - s.point(t)).norm() < 1e-11);
            assert!((back.point(1.0 - f) - s.point(t)).norm() < 1e-10);
        }
    }

    #[test]
    fn more_knots_keep_the_curve() {
        let s = wavy().normalised(false);
        let finer = s.with_knots(united(&s.knots, &[0.111, 0.5, 0.5, 0.93]));
        assert_eq!(finer.points.len(), s.points.len() + 4);
        for i in 0..=100 {
            let t = f64::from(i) / 100.0;
            assert!((finer.point(t) - s.point(t)).norm() < 1e-11);
        }
    }

    #[test]
    fn closed_control_polygons_give_circles_to_a_part_in_a_hundred_thousand() {
        let n = 24;
        let step = std::f64::consts::TAU / f64::from(n);
        let radius = 100.0 * 6.0 / (4.0 + 2.0 * step.cos());
        let at = |i: i32| {
            Point3::new(radius * (f64::from(i) * step).cos(), radius * (f64::from(i) * step).sin(), 0.0)
        };
        let ring = Spline::closed(&(0..n).map(at).collect::<Vec<_>>());
        for i in 0..=200 {
            let t = f64::from(i) / 200.0 * f64::from(n);
            approx::assert_abs_diff_eq!(ring.point(t).coords.norm(), 100.0, epsilon = 2e-3);
        }
        assert!((ring.point(0.0) - ring.point(24.0)).norm() < 1e-12);
    }
}
