//! Curves and surfaces at a constant distance from others, as cubics fitted to a stated tolerance.

use claymill_nurbs::{Aabb, Curve3, KnotVector, NurbsError, NurbsSurface, Point3, Vector3};

use crate::hermite::fitted;

/// Fitted surfaces stay this close to the true offset, mm.
pub(crate) const OFFSET_MM: f64 = 1e-5;
/// Fitted surfaces that miss by more than this are refused, mm: the base has creases or the offset folds.
pub(crate) const WORST_OFFSET_MM: f64 = 0.01;
/// Fitted curves stay this close to the true offset, in parts of the curve's size.
const CURVE_SHARE: f64 = 1e-7;
/// Fitted curves that miss by more are refused: the base has corners or the offset folds.
pub(crate) const WORST_CURVE_SHARE: f64 = 1e-4;
/// An offset surface of more cells than this is not refined further.
const MOST_CELLS: usize = 20_000;

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
    let (mut us, mut vs) = (base.knots_u().breaks(), base.knots_v().breaks());
    let (kinks_u, kinks_v) = (us.clone(), vs.clone());
    loop {
        let fit = offset.net(&us, &vs, &kinks_u, &kinks_v)?;
        let errors = offset.errors(&fit, &us, &vs);
        let worst = errors.iter().flatten().fold(0.0_f64, |m, e| m.max(*e));
        let full = us.len() * vs.len() > MOST_CELLS;
        // Cells not finite cannot be refined away; the surface's own check has refused them by now.
        if worst <= tolerance || full {
            return Ok((fit, worst));
        }
        let (next_u, next_v) = offset.refined(&errors, &us, &vs, tolerance);
        if next_u.len() + next_v.len() == us.len() + vs.len() {
            return Ok((fit, worst));
        }
        (us, vs) = (next_u, next_v);
    }
}

struct Offset<'a> {
    base: &'a NurbsSurface,
    distance: f64,
}

impl Offset<'_> {
    fn point(&self, u: f64, v: f64) -> Vector3 {
        let normal = self.base.normal(u, v).map_or(Vector3::repeat(f64::NAN), |n| n.0);
        self.base.point(u, v).coords + normal * self.distance
    }

    /// `∂/∂u` and `∂/∂v` (Weingarten).
    fn slopes(&self, u: f64, v: f64) -> [Vector3; 2] {
        let j = self.base.jet(u, v);
        let area = j.su.cross(&j.sv);
        let size = area.norm();
        let n = area / size;
        let turn = |change: Vector3| (change - n * n.dot(&change)) * (self.distance / size);
        [
            j.su + turn(j.suu.cross(&j.sv) + j.su.cross(&j.suv)),
            j.sv + turn(j.suv.cross(&j.sv) + j.su.cross(&j.svv)),
        ]
    }

    /// Slopes a little inside of the cell, and their mixed derivative from differences there.
    fn inside(&self, (u, u_in): (f64, f64), (v, v_in): (f64, f64)) -> [Vector3; 3] {
        let at = |x: f64, y: f64| self.slopes(u + (u_in - u) * x, v + (v_in - v) * y);
        let near = 1e-7;
        let [su, sv] = at(near, near);
        let step = 1e-3;
        let (once, twice) = (at(near, near + step)[0], at(near, near + 2.0 * step)[0]);
        let mixed = (once * 4.0 - su * 3.0 - twice) / (2.0 * step * (v_in - v));
        [su, sv, mixed]
    }

    /// The bicubic Hermite interpolant on the lines `us`, `vs`; it may have kinks along some of them.
    fn net(
        &self,
        us: &[f64],
        vs: &[f64],
        kinks_u: &[f64],
        kinks_v: &[f64],
    ) -> Result<NurbsSurface, NurbsError> {
        let (rows, columns) = (stations(us), stations(vs));
        let mut points = Vec::new();
        let kept = |at: &Station, lines: &[f64], kinks: &[f64]| {
            let inner = at.line > 0 && at.line + 1 < lines.len();
            at.toward.is_some() || !inner || kinks.contains(&lines[at.line])
        };
        let kept_rows: Vec<_> = rows.iter().filter(|r| kept(r, us, kinks_u)).collect();
        let kept_columns: Vec<_> = columns.iter().filter(|c| kept(c, vs, kinks_v)).collect();
        for row in &kept_rows {
            for column in &kept_columns {
                let (u, v) = (us[row.line], vs[column.line]);
                let (u_in, v_in) = (inward(us, row), inward(vs, column));
                let [su, sv, mixed] = self.inside((u, u_in), (v, v_in));
                let (du, dv) = (
                    row.toward.map_or(0.0, |_| (u_in - u) / 3.0),
                    column.toward.map_or(0.0, |_| (v_in - v) / 3.0),
                );
                let mut p = self.point(u, v);
                // Derivatives at poles may be undefined where they are not needed.
                if du != 0.0 {
                    p += su * du;
                }
                if dv != 0.0 {
                    p += sv * dv;
                }
                if du != 0.0 && dv != 0.0 {
                    p += mixed * (du * dv);
                }
                points.push(Point3::from(p));
            }
        }
        NurbsSurface::new(knots(us, kinks_u)?, knots(vs, kinks_v)?, points, None)
    }

    /// Largest distances between fit and offset in each cell, row by row.
    fn errors(&self, fit: &NurbsSurface, us: &[f64], vs: &[f64]) -> Vec<Vec<f64>> {
        let fractions = [0.13, 0.5, 0.87];
        let cell = |u: &[f64], v: &[f64]| {
            let mut worst = 0.0_f64;
            for x in fractions {
                for y in fractions {
                    let (u, v) = (u[0] + (u[1] - u[0]) * x, v[0] + (v[1] - v[0]) * y);
                    worst = worst.max((fit.point(u, v).coords - self.point(u, v)).norm());
                }
            }
            worst
        };
        us.windows(2).map(|u| vs.windows(2).map(|v| cell(u, v)).collect()).collect()
    }

    /// Lines added in the middle of cells that miss, in the direction that bends more.
    fn refined(&self, errors: &[Vec<f64>], us: &[f64], vs: &[f64], tolerance: f64) -> (Vec<f64>, Vec<f64>) {
        let (mut split_u, mut split_v) = (vec![false; us.len()], vec![false; vs.len()]);
        // Error of the cubic through both ends of a side, with the offset's own slopes.
        let bend = |a: Vector3, da: Vector3, b: Vector3, db: Vector3, middle: Vector3, h: f64| {
            ((a + b) * 0.5 + (da - db) * (h / 8.0) - middle).norm()
        };
        for (i, u) in us.windows(2).enumerate() {
            for (j, v) in vs.windows(2).enumerate() {
                if errors[i][j] <= tolerance {
                    continue;
                }
                let (um, vm) = (0.5 * (u[0] + u[1]), 0.5 * (v[0] + v[1]));
                let (hu, hv) = (u[1] - u[0], v[1] - v[0]);
                let inset = 1e-7;
                let (ua, ub) = (u[0] + inset * hu, u[1] - inset * hu);
                let (va, vb) = (v[0] + inset * hv, v[1] - inset * hv);
                let middle = self.point(um, vm);
                let along_u = bend(
                    self.point(ua, vm),
                    self.slopes(ua, vm)[0],
                    self.point(ub, vm),
                    self.slopes(ub, vm)[0],
                    middle,
                    hu,
                );
                let along_v = bend(
                    self.point(um, va),
                    self.slopes(um, va)[1],
                    self.point(um, vb),
                    self.slopes(um, vb)[1],
                    middle,
                    hv,
                );
                split_u[i] |= along_u >= 0.25 * along_v;
                split_v[j] |= along_v >= 0.25 * along_u;
            }
        }
        (halved(us, &split_u), halved(vs, &split_v))
    }
}

/// A row of control points: on a line, or a third of an interval off it, towards the line before or behind.
struct Station {
    line: usize,
    toward: Option<bool>,
}

fn stations(lines: &[f64]) -> Vec<Station> {
    let count = lines.len();
    let at = |line: usize| {
        let before = (line > 0).then_some(Station { line, toward: Some(false) });
        let behind = (line + 1 < count).then_some(Station { line, toward: Some(true) });
        before.into_iter().chain([Station { line, toward: None }]).chain(behind)
    };
    (0..count).flat_map(at).collect()
}

/// The neighbouring line of the cell that a station belongs to.
fn inward(lines: &[f64], at: &Station) -> f64 {
    let behind = at.toward.unwrap_or(at.line + 1 < lines.len());
    lines[if behind { at.line + 1 } else { at.line - 1 }]
}

/// Cubic knots: double where pieces meet smoothly, triple where they may kink.
fn knots(lines: &[f64], kinks: &[f64]) -> Result<KnotVector, NurbsError> {
    let last = lines.len() - 1;
    let times = |i: usize| match i {
        0 => 4,
        i if i == last => 4,
        i if kinks.contains(&lines[i]) => 3,
        _ => 2,
    };
    let all = lines.iter().enumerate().flat_map(|(i, t)| std::iter::repeat_n(*t, times(i)));
    KnotVector::new(3, all.collect())
}

fn halved(lines: &[f64], split: &[bool]) -> Vec<f64> {
    let mut all = Vec::with_capacity(2 * lines.len());
    for (i, w) in lines.windows(2).enumerate() {
        all.push(w[0]);
        let middle = 0.5 * (w[0] + w[1]);
        if split[i] && middle > w[0] && middle < w[1] {
            all.push(middle);
        }
    }
    all.extend(lines.last());
    all
}

#[cfg(test)]
mod tests {
    use super::*;
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
