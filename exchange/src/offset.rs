//! Curves and surfaces at a constant distance from others, as splines fitted to a stated tolerance.

use claymill_nurbs::{Aabb, Curve3, KnotVector, NurbsError, NurbsSurface, Vector3};

use crate::hermite::fitted;
use crate::interpolant::{self, KINK};

/// Fitted surfaces stay this close to the true offset, mm.
pub(crate) const OFFSET_MM: f64 = 1e-5;
/// Fitted surfaces that miss by more than this are refused, mm: the base has creases or the offset folds.
pub(crate) const WORST_OFFSET_MM: f64 = 0.01;
/// Fitted curves stay this close to the true offset, in parts of the curve's size.
const CURVE_SHARE: f64 = 1e-7;
/// Fitted curves that miss by more are refused: the base has corners or the offset folds.
pub(crate) const WORST_CURVE_SHARE: f64 = 1e-4;
/// An offset surface is not refined to more control points than these, since a file of little text must not take much
/// memory ...
const MOST_POINTS: usize = 4_000;
/// ... and these for each of its base's.
const POINTS_FOR_EACH_OF_THE_BASE: usize = 30;

/// The curve `C(t) + d(t) · (V × T) / |V × T|` for the unit tangent `T`, with the parameter of `curve`; also the
/// deviation in parts of the curve's size.
pub(crate) fn curve(
    curve: &Curve3,
    normal: &Vector3,
    distance: impl Fn(f64) -> f64,
) -> Result<(Curve3, f64), NurbsError> {
    let size = Aabb::of(curve.points()).diagonal();
    let at = |t: f64| {
        let [c, d1, d2] = curve.derivatives(t);
        let across = normal.cross(&d1);
        let side = across.normalize();
        let turn = (normal.cross(&d2) - side * side.dot(&normal.cross(&d2))) / across.norm();
        let (low, high) = curve.domain();
        let h = 1e-6 * (high - low);
        let (before, after) = ((t - h).max(low), (t + h).min(high));
        let rate = (distance(after) - distance(before)) / (after - before);
        [c + side * distance(t), d1 + turn * distance(t) + side * rate]
    };
    let (fit, deviation) = fitted(&curve.knots().breaks(), CURVE_SHARE * size, at)?;
    Ok((fit, deviation / size))
}

/// The surface `S + d · n` with `n` along `Su × Sv`, on the parameters of `base`, and how far it is from that
/// where it was compared. All lengths in the unit of `base`.
///
/// # Errors
/// The base is degenerate where the offset needs its normal.
pub(crate) fn surface(
    base: &NurbsSurface,
    distance: f64,
    tolerance: f64,
) -> Result<(NurbsSurface, f64), NurbsError> {
    let offset = Offset { base, distance };
    let (mut us, mut vs) = (lines(base.knots_u()), lines(base.knots_v()));
    let most_points = MOST_POINTS + POINTS_FOR_EACH_OF_THE_BASE * base.net().len();
    loop {
        let fit = interpolant::surface(&us, &vs, |u, v| offset.point(u, v))?;
        let errors = offset.errors(&fit, &us, &vs);
        let worst = errors.iter().flatten().fold(0.0_f64, |m, e| m.max(*e));
        // Cells not finite cannot be refined away; the surface's own check has refused them by now.
        if worst <= tolerance {
            return Ok((fit, worst));
        }
        let (next_u, next_v) = offset.refined(&errors, &us, &vs, tolerance);
        let same = next_u.len() + next_v.len() == us.len() + vs.len();
        if same || interpolant::net_size(&next_u, &next_v) > most_points {
            return Ok((fit, worst));
        }
        (us, vs) = (next_u, next_v);
    }
}

/// The parameters where a spline in this direction has knots, with the multiplicity at which a quintic is as smooth
/// as the normal there, which is once less than the surface.
fn lines(knots: &KnotVector) -> Vec<Line> {
    let times = |t: f64| (KINK + 1 + knots.multiplicity(t)).saturating_sub(knots.degree()).clamp(1, KINK);
    knots.breaks().into_iter().map(|t| (t, times(t))).collect()
}

/// A parameter and the multiplicity of the knot there.
type Line = (f64, usize);

struct Offset<'a> {
    base: &'a NurbsSurface,
    distance: f64,
}

impl Offset<'_> {
    fn point(&self, u: f64, v: f64) -> Vector3 {
        let normal = self.base.normal(u, v).map_or(Vector3::repeat(f64::NAN), |n| n.0);
        self.base.point(u, v).coords + normal * self.distance
    }

    /// Largest distances between fit and offset in each cell, row by row.
    fn errors(&self, fit: &NurbsSurface, us: &[Line], vs: &[Line]) -> Vec<Vec<f64>> {
        let fractions = [0.13, 0.5, 0.87];
        let cell = |u: &[Line], v: &[Line]| {
            let mut worst = 0.0_f64;
            for x in fractions {
                for y in fractions {
                    let (u, v) = (between(u, x), between(v, y));
                    worst = worst.max((fit.point(u, v).coords - self.point(u, v)).norm());
                }
            }
            worst
        };
        us.windows(2).map(|u| vs.windows(2).map(|v| cell(u, v)).collect()).collect()
    }

    /// Lines added in the middle of cells that miss, in the direction that bends more.
    fn refined(
        &self,
        errors: &[Vec<f64>],
        us: &[Line],
        vs: &[Line],
        tolerance: f64,
    ) -> (Vec<Line>, Vec<Line>) {
        let (mut split_u, mut split_v) = (vec![false; us.len()], vec![false; vs.len()]);
        for (i, u) in us.windows(2).enumerate() {
            for (j, v) in vs.windows(2).enumerate() {
                if errors[i][j] <= tolerance {
                    continue;
                }
                let bend_u = bend(|x| self.point(between(u, x), between(v, 0.5)));
                let bend_v = bend(|y| self.point(between(u, 0.5), between(v, y)));
                split_u[i] |= bend_u >= 0.25 * bend_v;
                split_v[j] |= bend_v >= 0.25 * bend_u;
            }
        }
        (halved(us, &split_u), halved(vs, &split_v))
    }
}

fn between(ends: &[Line], share: f64) -> f64 {
    ends[0].0 + (ends[1].0 - ends[0].0) * share
}

/// How far a curve over `[0, 1]` is from a quintic: its sixth difference. The ends, where it may have kinks, are left
/// out.
fn bend(at: impl Fn(f64) -> Vector3) -> f64 {
    let signed = [1.0, -6.0, 15.0, -20.0, 15.0, -6.0, 1.0];
    let step = |k: usize| 0.02 + 0.16 * k as f64;
    signed.iter().enumerate().fold(Vector3::zeros(), |sum, (k, c)| sum + at(step(k)) * *c).norm()
}

fn halved(lines: &[Line], split: &[bool]) -> Vec<Line> {
    let mut all = Vec::with_capacity(2 * lines.len());
    for (i, w) in lines.windows(2).enumerate() {
        all.push(w[0]);
        let middle = between(w, 0.5);
        if split[i] && middle > w[0].0 && middle < w[1].0 {
            all.push((middle, 1));
        }
    }
    all.extend(lines.last());
    all
}

#[cfg(test)]
mod tests {
    use super::*;
    use claymill_nurbs::Point3;
    use claymill_nurbs::analytic::{Frame, ellipse_arc, torus};

    fn frame() -> Frame {
        Frame::new(Point3::new(1.0, 2.0, 3.0), Vector3::new(0.2, 0.3, 1.0), Vector3::x()).unwrap()
    }

    #[test]
    fn the_offset_of_a_torus_is_a_torus() {
        let base = torus(&frame(), 40.0, 10.0, (0.2, 2.5), (-1.0, 1.3)).unwrap();
        let (fit, deviation) = surface(&base, 3.0, OFFSET_MM).unwrap();
        let exact = torus(&frame(), 40.0, 13.0, (0.2, 2.5), (-1.0, 1.3)).unwrap();
        assert!(deviation <= OFFSET_MM);
        for i in 0..=40 {
            for j in 0..=40 {
                let (u, v) = (0.2 + 2.3 * f64::from(i) / 40.0, -1.0 + 2.3 * f64::from(j) / 40.0);
                approx::assert_abs_diff_eq!(fit.point(u, v), exact.point(u, v), epsilon = 2e-5);
            }
        }
    }

    #[test]
    fn a_bilinear_saddle_gets_its_parallel_surface() {
        let corners = [(0.0, 0.0, 0.0), (0.0, 50.0, 8.0), (60.0, 0.0, 5.0), (60.0, 50.0, -9.0)];
        let points = corners.map(|(x, y, z)| Point3::new(x, y, z)).to_vec();
        let flat = || KnotVector::clamped_uniform(1, 2);
        let base = NurbsSurface::new(flat(), flat(), points, None).unwrap();
        let (fit, _) = surface(&base, -4.0, OFFSET_MM).unwrap();
        for i in 0..=30 {
            for j in 0..=30 {
                let (u, v) = (f64::from(i) / 30.0, f64::from(j) / 30.0);
                let n = base.normal(u, v).unwrap().0;
                approx::assert_abs_diff_eq!(fit.point(u, v), base.point(u, v) - n * 4.0, epsilon = 2e-5);
            }
        }
    }

    #[test]
    fn the_offset_of_a_circle_is_a_circle() {
        let f = frame();
        let arc = ellipse_arc(&f, 20.0, 20.0, (0.0, 4.0)).unwrap();
        let (fit, deviation) = curve(&arc, &f.z, |_| 5.0).unwrap();
        assert!(deviation <= CURVE_SHARE);
        // V × T points to the centre.
        for i in 0..=100 {
            let p = fit.point(4.0 * f64::from(i) / 100.0);
            assert!(((p - f.origin).norm() - 15.0).abs() < 1e-5);
        }
    }
}
