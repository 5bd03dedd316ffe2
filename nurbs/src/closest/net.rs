//! Bézier nets of surface pieces: cutting (de Casteljau), bounds of position and derivatives
//! (convex hull, quotient rule), and a bound on the distance from a point in Bernstein form.

use nalgebra::Vector4;

use super::interval::Interval;
use crate::bernstein::binomials;
use crate::{NurbsSurface, Point3, Vector3};

/// Knot intervals shorter than this share of the domain are rounding errors.
const SLIVER: f64 = 1e-12;

/// One Bézier piece of a surface in Bernstein form, homogeneous `(w·x, w·y, w·z, w)`, row-major in `u`.
#[derive(Debug, Clone)]
pub(super) struct Net {
    pub(super) degree: (usize, usize),
    /// The piece's interval of the face's parameters.
    pub(super) u: (f64, f64),
    pub(super) v: (f64, f64),
    pub(super) rational: bool,
    pub(super) points: Vec<Vector4<f64>>,
}

/// Which parameter a piece is cut across.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Direction {
    U,
    V,
}

/// Ranges of position and derivatives over a piece, per coordinate. Parameters are scaled to unit length.
#[derive(Debug, Clone, Copy)]
pub(super) struct JetRange {
    pub(super) p: [Interval; 3],
    pub(super) su: [Interval; 3],
    pub(super) sv: [Interval; 3],
    pub(super) suu: [Interval; 3],
    pub(super) suv: [Interval; 3],
    pub(super) svv: [Interval; 3],
}

impl Net {
    /// The Bézier pieces of `surface`.
    ///
    /// Knot intervals of rounding size are left out: their neighbours end there, and the middle of one is on
    /// no certain side of a trim curve along it.
    pub(super) fn pieces(surface: &NurbsSurface) -> Vec<Net> {
        let ((u0, u1), (v0, v1)) = surface.domain();
        let sound =
            |net: &Net| net.u.1 - net.u.0 > SLIVER * (u1 - u0) && net.v.1 - net.v.0 > SLIVER * (v1 - v0);
        let piece = |s: &NurbsSurface| {
            let (u, v) = s.domain();
            Net {
                degree: (s.knots_u().degree(), s.knots_v().degree()),
                u,
                v,
                rational: s.is_rational(),
                points: s.net().to_vec(),
            }
        };
        surface.bezier_pieces().iter().map(piece).filter(sound).collect()
    }

    /// Homogeneous control point.
    pub(super) fn at(&self, i: usize, j: usize) -> Vector4<f64> {
        self.points[i * (self.degree.1 + 1) + j]
    }

    /// Control point in space.
    pub(super) fn place(&self, i: usize, j: usize) -> Vector3 {
        let h = self.at(i, j);
        h.xyz() / h.w
    }

    /// The two parts below and above the fraction `x` across `direction` (de Casteljau).
    pub(super) fn cut(&self, direction: Direction, x: f64) -> [Net; 2] {
        let (p, q) = self.degree;
        let (mut low, mut high) = (self.clone(), self.clone());
        let (degree, stride, lines, hop) = match direction {
            Direction::U => {
                let at = self.u.0 + x * (self.u.1 - self.u.0);
                (low.u.1, high.u.0) = (at, at);
                (p, q + 1, q + 1, 1)
            }
            Direction::V => {
                let at = self.v.0 + x * (self.v.1 - self.v.0);
                (low.v.1, high.v.0) = (at, at);
                (q, 1, p + 1, q + 1)
            }
        };
        for line in 0..lines {
            // `high` doubles as the triangle's working row: its last entries become final one by one.
            let at = |k: usize| line * hop + k * stride;
            for round in 1..=degree {
                for k in 0..=degree - round {
                    high.points[at(k)] = high.points[at(k)].lerp(&high.points[at(k + 1)], x);
                }
                low.points[at(round)] = high.points[at(0)];
            }
        }
        [low, high]
    }

    /// The same piece in the frame with rows `axes` at `origin`.
    pub(super) fn moved(&self, origin: &Point3, axes: &nalgebra::Matrix3<f64>) -> Net {
        let moved = |h: &Vector4<f64>| (axes * (h.xyz() - origin.coords * h.w)).push(h.w);
        Net { points: self.points.iter().map(moved).collect(), ..*self }
    }

    /// Derivative across `direction` with the parameter scaled to unit length, again in Bernstein form.
    fn derivative(&self, direction: Direction) -> Net {
        let (p, q) = self.degree;
        let (degree, factor, step) = match direction {
            Direction::U => ((p.saturating_sub(1), q), p as f64, (1, 0)),
            Direction::V => ((p, q.saturating_sub(1)), q as f64, (0, 1)),
        };
        let mut points = Vec::with_capacity((degree.0 + 1) * (degree.1 + 1));
        for i in 0..=degree.0 {
            for j in 0..=degree.1 {
                points.push(if factor == 0.0 {
                    Vector4::zeros()
                } else {
                    (self.at(i + step.0, j + step.1) - self.at(i, j)) * factor
                });
            }
        }
        Net { degree, points, ..*self }
    }

    /// Bounds of position and derivatives by the convex-hull property and the quotient rule.
    pub(super) fn range(&self) -> JetRange {
        let hull = |n: &Net| [0, 1, 2, 3].map(|k| Interval::of(n.points.iter().map(|h| h[k])));
        let (du, dv) = (self.derivative(Direction::U), self.derivative(Direction::V));
        let (a_u, a_v) = (hull(&du), hull(&dv));
        let a_uu = hull(&du.derivative(Direction::U));
        let a_uv = hull(&du.derivative(Direction::V));
        let a_vv = hull(&dv.derivative(Direction::V));
        let p = [0, 1, 2].map(|k| Interval::of(self.points.iter().map(|h| h[k] / h.w)));
        let xyz = |a: &[Interval; 4]| [a[0], a[1], a[2]];
        if !self.rational {
            return JetRange {
                p,
                su: xyz(&a_u),
                sv: xyz(&a_v),
                suu: xyz(&a_uu),
                suv: xyz(&a_uv),
                svv: xyz(&a_vv),
            };
        }
        let w = Interval::of(self.points.iter().map(|h| h.w));
        let su = [0, 1, 2].map(|k| (a_u[k] - a_u[3] * p[k]).over_positive(w));
        let sv = [0, 1, 2].map(|k| (a_v[k] - a_v[3] * p[k]).over_positive(w));
        let suu = [0, 1, 2].map(|k| {
            let wu_su = a_u[3] * su[k];
            (a_uu[k] - (wu_su + wu_su) - a_uu[3] * p[k]).over_positive(w)
        });
        let suv =
            [0, 1, 2].map(|k| (a_uv[k] - a_u[3] * sv[k] - a_v[3] * su[k] - a_uv[3] * p[k]).over_positive(w));
        let svv = [0, 1, 2].map(|k| {
            let wv_sv = a_v[3] * sv[k];
            (a_vv[k] - (wv_sv + wv_sv) - a_vv[3] * p[k]).over_positive(w)
        });
        JetRange { p, su, sv, suu, suv, svv }
    }

    /// `None` if every point of the piece is at least `distance` from `p`, by the Bernstein coefficients of
    /// `|A − w p|² − distance² w²` (degree `2p × 2q`); else the direction in which they bend more and a cut
    /// sharpens the bound.
    ///
    /// Unlike the hull of the piece itself this bound is exact when the distance is constant over the piece
    /// (a ball resting in a fillet of its own radius), so that such pieces need no further cutting.
    pub(super) fn blocks(&self, p: &Vector3, distance: f64) -> Option<Direction> {
        let (m, n) = self.degree;
        let (bm, bn) = (binomials(m), binomials(n));
        let (b2m, b2n) = (binomials(2 * m), binomials(2 * n));
        let scaled = |(k, h): (usize, &Vector4<f64>)| {
            (h.xyz() - p * h.w).push(h.w * distance) * (bm[k / (n + 1)] * bn[k % (n + 1)])
        };
        let factors: Vec<Vector4<f64>> = self.points.iter().enumerate().map(scaled).collect();
        let at = |i: usize, j: usize| &factors[i * (n + 1) + j];
        let columns = 2 * n + 1;
        let mut excess = vec![0.0; (2 * m + 1) * columns];
        for i in 0..=2 * m {
            for j in 0..=2 * n {
                let mut sum = 0.0;
                for a in i.saturating_sub(m)..=i.min(m) {
                    for b in j.saturating_sub(n)..=j.min(n) {
                        let (x, y) = (at(a, b), at(i - a, j - b));
                        sum += x.x * y.x + x.y * y.y + x.z * y.z - x.w * y.w;
                    }
                }
                excess[i * columns + j] = sum / (b2m[i] * b2n[j]);
            }
        }
        if excess.iter().all(|&x| x >= 0.0) {
            return None;
        }
        let bend =
            |k: usize, stride: usize| (excess[k - stride] - 2.0 * excess[k] + excess[k + stride]).abs();
        let inner = |k: &usize, count: usize, stride: usize| {
            let x = k / stride % count;
            x > 0 && x + 1 < count
        };
        let all = 0..excess.len();
        let bend_u: f64 =
            (all.clone().filter(|k| inner(k, 2 * m + 1, columns))).map(|k| bend(k, columns)).sum();
        let bend_v: f64 = (all.filter(|k| inner(k, columns, 1))).map(|k| bend(k, 1)).sum();
        Some(if bend_u >= bend_v { Direction::U } else { Direction::V })
    }
}
