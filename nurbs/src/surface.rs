//! NURBS surfaces: construction with checks, points, derivatives up to order 2, and normals also at
//! poles.

use nalgebra::Vector4;

use crate::curve::check_weights;
use crate::knots::for_degree;
use crate::tolerance::LARGEST_COORDINATE_MM;
use crate::{Jet, KnotVector, NurbsError, Point3, Vector3};

/// A NURBS surface.
///
/// The net is stored row-major: control point `(i, j)` is at index `i · n_v + j`, where `i` runs with `u`.
/// Points are held in homogeneous form `(w·x, w·y, w·z, w)`.
#[derive(Debug, Clone, PartialEq)]
pub struct NurbsSurface {
    knots_u: KnotVector,
    knots_v: KnotVector,
    net: Vec<Vector4<f64>>,
    rational: bool,
}

impl NurbsSurface {
    /// Checks and wraps the parts. `points` and `weights` are row-major, `i · n_v + j`; weights that are
    /// all equal are dropped.
    ///
    /// # Errors
    /// Counts that do not fit, non-finite or absurd coordinates, non-positive weights.
    pub fn new(
        knots_u: KnotVector,
        knots_v: KnotVector,
        points: Vec<Point3>,
        weights: Option<Vec<f64>>,
    ) -> Result<Self, NurbsError> {
        let needed = knots_u.point_count() * knots_v.point_count();
        if points.len() != needed {
            return Err(NurbsError::NetSize { needed, given: points.len() });
        }
        let bad = |p: &Point3| p.iter().any(|c| !c.is_finite() || c.abs() > LARGEST_COORDINATE_MM);
        if let Some(index) = points.iter().position(bad) {
            return Err(NurbsError::NotFinite { what: "control point", index });
        }
        let weights = check_weights(weights, points.len())?;
        let rational = weights.is_some();
        let net = match weights {
            Some(w) => points.iter().zip(w).map(|(p, w)| (p.coords * w).push(w)).collect(),
            None => points.iter().map(|p| p.coords.push(1.0)).collect(),
        };
        Ok(NurbsSurface { knots_u, knots_v, net, rational })
    }

    /// Wraps a homogeneous net that is known to be sound.
    pub(crate) fn from_net(
        knots_u: KnotVector,
        knots_v: KnotVector,
        net: Vec<Vector4<f64>>,
        rational: bool,
    ) -> Self {
        debug_assert_eq!(net.len(), knots_u.point_count() * knots_v.point_count(), "net size");
        NurbsSurface { knots_u, knots_v, net, rational }
    }

    /// The surface whose control points are the images of this one's. Exact for affine maps; weights stay.
    #[must_use]
    pub fn mapped(&self, map: impl Fn(Point3) -> Point3) -> Self {
        let image = |h: &Vector4<f64>| (map(Point3::from(h.xyz() / h.w)).coords * h.w).push(h.w);
        NurbsSurface { net: self.net.iter().map(image).collect(), ..self.clone() }
    }

    /// Knots in `u`.
    #[must_use]
    pub fn knots_u(&self) -> &KnotVector {
        &self.knots_u
    }

    /// Knots in `v`.
    #[must_use]
    pub fn knots_v(&self) -> &KnotVector {
        &self.knots_v
    }

    /// The homogeneous net, row-major.
    #[must_use]
    pub fn net(&self) -> &[Vector4<f64>] {
        &self.net
    }

    /// Whether weights differ.
    #[must_use]
    pub fn is_rational(&self) -> bool {
        self.rational
    }

    /// Number of control points in `u` and `v`.
    #[must_use]
    pub fn size(&self) -> (usize, usize) {
        (self.knots_u.point_count(), self.knots_v.point_count())
    }

    /// Control point `(i, j)`, mm.
    #[must_use]
    pub fn control_point(&self, i: usize, j: usize) -> Point3 {
        let h = self.net[i * self.size().1 + j];
        Point3::from(h.xyz() / h.w)
    }

    /// Weight of control point `(i, j)`.
    #[must_use]
    pub fn weight(&self, i: usize, j: usize) -> f64 {
        self.net[i * self.size().1 + j].w
    }

    /// `((u_min, u_max), (v_min, v_max))`.
    #[must_use]
    pub fn domain(&self) -> ((f64, f64), (f64, f64)) {
        (self.knots_u.domain(), self.knots_v.domain())
    }

    /// The parameters moved to the nearest ones inside the domain.
    #[must_use]
    pub fn clamp(&self, u: f64, v: f64) -> (f64, f64) {
        let ((u0, u1), (v0, v1)) = self.domain();
        (u.clamp(u0, u1), v.clamp(v0, v1))
    }

    /// The point at `(u, v)`, mm.
    #[must_use]
    pub fn point(&self, u: f64, v: f64) -> Point3 {
        for_degree!(self.largest_degree(), self.point_sized(u, v))
    }

    fn point_sized<const N: usize>(&self, u: f64, v: f64) -> Point3 {
        let ((first_u, bu), (first_v, bv)) = (self.knots_u.values::<N>(u), self.knots_v.values::<N>(v));
        let columns = self.size().1;
        let mut sum = Vector4::zeros();
        for i in 0..=self.knots_u.degree() {
            let row = &self.net[(first_u + i) * columns + first_v..];
            let mut inner = Vector4::zeros();
            for j in 0..=self.knots_v.degree() {
                inner += row[j] * bv[j];
            }
            sum += inner * bu[i];
        }
        Point3::from(sum.xyz() / sum.w)
    }

    /// Point and derivatives to the second order at `(u, v)` (tensor product, then the quotient rule:
    /// The NURBS Book, eq. 4.20).
    #[must_use]
    pub fn jet(&self, u: f64, v: f64) -> Jet {
        for_degree!(self.largest_degree(), self.jet_sized(u, v))
    }

    fn largest_degree(&self) -> usize {
        self.knots_u.degree().max(self.knots_v.degree())
    }

    fn jet_sized<const N: usize>(&self, u: f64, v: f64) -> Jet {
        let (bu, bv) = (self.knots_u.basis::<N>(u), self.knots_v.basis::<N>(v));
        let columns = self.size().1;
        // a[k][l]: homogeneous ∂^{k+l} / ∂u^k ∂v^l for k + l <= 2.
        let mut a = [[Vector4::zeros(); 3]; 3];
        for i in 0..=self.knots_u.degree() {
            let row = &self.net[(bu.first + i) * columns + bv.first..];
            let mut inner = [Vector4::zeros(); 3];
            for j in 0..=self.knots_v.degree() {
                inner[0] += row[j] * bv.n[0][j];
                inner[1] += row[j] * bv.n[1][j];
                inner[2] += row[j] * bv.n[2][j];
            }
            for k in 0..3 {
                for l in 0..3 - k {
                    a[k][l] += inner[l] * bu.n[k][i];
                }
            }
        }
        let xyz = |k: usize, l: usize| a[k][l].xyz();
        if !self.rational {
            return Jet {
                p: Point3::from(xyz(0, 0)),
                su: xyz(1, 0),
                sv: xyz(0, 1),
                suu: xyz(2, 0),
                suv: xyz(1, 1),
                svv: xyz(0, 2),
            };
        }
        let w = |k: usize, l: usize| a[k][l].w;
        let w0 = w(0, 0);
        let p: Vector3 = xyz(0, 0) / w0;
        let su = (xyz(1, 0) - p * w(1, 0)) / w0;
        let sv = (xyz(0, 1) - p * w(0, 1)) / w0;
        let suu = (xyz(2, 0) - su * (2.0 * w(1, 0)) - p * w(2, 0)) / w0;
        let suv = (xyz(1, 1) - su * w(0, 1) - sv * w(1, 0) - p * w(1, 1)) / w0;
        let svv = (xyz(0, 2) - sv * (2.0 * w(0, 1)) - p * w(0, 2)) / w0;
        Jet { p: Point3::from(p), su, sv, suu, suv, svv }
    }

    /// Unit normal at `(u, v)`, also where one derivative vanishes (a collapsed edge or coincident rows):
    /// there the limit is taken from parameters moved a thousandth of the domain inward, and the second
    /// value says that this was done. `None` only where the surface is degenerate around the point.
    #[must_use]
    pub fn normal(&self, u: f64, v: f64) -> Option<(Vector3, bool)> {
        if let Some(n) = self.jet(u, v).normal() {
            return Some((n, false));
        }
        let ((u0, u1), (v0, v1)) = self.domain();
        let inward = |t: f64, a: f64, b: f64| t + (0.5 * (a + b) - t).signum() * 1e-3 * (b - a);
        let (iu, iv) = (inward(u, u0, u1), inward(v, v0, v1));
        [(u, iv), (iu, v), (iu, iv)].iter().find_map(|&(u, v)| self.jet(u, v).normal()).map(|n| (n, true))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bumpy(p: usize, q: usize, rational: bool) -> NurbsSurface {
        let (nu, nv) = (p + 3, q + 2);
        let mut points = Vec::new();
        let mut weights = Vec::new();
        for i in 0..nu {
            for j in 0..nv {
                let (x, y) = (i as f64 * 3.0, j as f64 * 2.0);
                points.push(Point3::new(x + (y * 1.3).sin() * 0.4, y, (x * 0.7 + y).sin() * 2.0));
                weights.push(1.0 + 0.3 * ((i * 3 + j) as f64).cos());
            }
        }
        NurbsSurface::new(
            KnotVector::clamped_uniform(p, nu),
            KnotVector::clamped_uniform(q, nv),
            points,
            rational.then_some(weights),
        )
        .unwrap()
    }

    #[test]
    fn derivatives_match_differences_for_all_common_degrees() {
        for (p, q) in [(1, 1), (2, 3), (3, 3), (4, 2), (5, 5), (7, 6)] {
            for rational in [false, true] {
                let s = bumpy(p, q, rational);
                let (u, v, h) = (0.41, 0.63, 1e-4);
                let j = s.jet(u, v);
                let pt = |u: f64, v: f64| s.point(u, v).coords;
                let du = (pt(u + h, v) - pt(u - h, v)) / (2.0 * h);
                let dv = (pt(u, v + h) - pt(u, v - h)) / (2.0 * h);
                let duu = (pt(u + h, v) - 2.0 * pt(u, v) + pt(u - h, v)) / (h * h);
                let dvv = (pt(u, v + h) - 2.0 * pt(u, v) + pt(u, v - h)) / (h * h);
                let duv = (pt(u + h, v + h) - pt(u + h, v - h) - pt(u - h, v + h) + pt(u - h, v - h))
                    / (4.0 * h * h);
                for (a, b, e) in [
                    (j.su, du, 1e-4),
                    (j.sv, dv, 1e-4),
                    (j.suu, duu, 2e-3),
                    (j.suv, duv, 2e-3),
                    (j.svv, dvv, 2e-3),
                ] {
                    assert!(
                        (a - b).norm() < e * (1.0 + b.norm()),
                        "degree {p},{q} rational {rational}: {a} {b}"
                    );
                }
            }
        }
    }

    #[test]
    fn a_power_surface_has_exact_second_derivatives() {
        // z = u^p as a Bezier strip: control heights 0,…,0,1.
        for p in 2..=7usize {
            let points = (0..=p)
                .flat_map(|i| {
                    let z = if i == p { 1.0 } else { 0.0 };
                    let x = i as f64 / p as f64;
                    [Point3::new(x, 0.0, z), Point3::new(x, 1.0, z)]
                })
                .collect();
            let s = NurbsSurface::new(
                KnotVector::clamped_uniform(p, p + 1),
                KnotVector::clamped_uniform(1, 2),
                points,
                None,
            )
            .unwrap();
            for u in [0.0, 0.3, 0.7, 1.0] {
                let expected = (p * (p - 1)) as f64 * f64::powi(u, p as i32 - 2);
                approx::assert_abs_diff_eq!(s.jet(u, 0.5).suu.z, expected, epsilon = 1e-11);
            }
        }
    }
}
