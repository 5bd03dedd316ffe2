//! A surface point with derivatives up to order 2 (a jet), and its normal, fundamental forms and
//! curvatures.

use nalgebra::{Matrix2, Vector2};

use crate::{Point3, Vector3};

/// A surface point with all derivatives up to the second order.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Jet {
    /// The point, mm.
    pub p: Point3,
    /// ∂S/∂u.
    pub su: Vector3,
    /// ∂S/∂v.
    pub sv: Vector3,
    /// ∂²S/∂u².
    pub suu: Vector3,
    /// ∂²S/∂u∂v.
    pub suv: Vector3,
    /// ∂²S/∂v².
    pub svv: Vector3,
}

/// First and second fundamental form at a point, for one choice of unit normal `n`.
///
/// With `n` pointing toward the tool, a positive normal curvature is a valley (concave toward the tool);
/// this is κ⁺ (docs/theory.md §1.2).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CurvatureTensor {
    /// `[E F; F G]`.
    pub first: Matrix2<f64>,
    /// `[L M; M N]`.
    pub second: Matrix2<f64>,
}

impl Jet {
    /// Unit normal `Su × Sv / |Su × Sv|`; `None` where the parametrisation is singular.
    #[must_use]
    #[inline]
    pub fn normal(&self) -> Option<Vector3> {
        let n = self.su.cross(&self.sv);
        let size = n.norm();
        // Relative test: parallel derivatives or one that vanishes against the other.
        (size > 1e-12 * self.su.norm_squared().max(self.sv.norm_squared()) && size > 0.0).then(|| n / size)
    }

    /// Fundamental forms with respect to the unit normal `n` (either side).
    #[must_use]
    pub fn curvature(&self, n: &Vector3) -> CurvatureTensor {
        let (e, f, g) = (self.su.dot(&self.su), self.su.dot(&self.sv), self.sv.dot(&self.sv));
        let (l, m, nn) = (self.suu.dot(n), self.suv.dot(n), self.svv.dot(n));
        CurvatureTensor { first: Matrix2::new(e, f, f, g), second: Matrix2::new(l, m, m, nn) }
    }

    /// The tangent direction `w` written in the basis `(Su, Sv)`: `w = a·Su + b·Sv` in the least-squares
    /// sense; `None` where the parametrisation is singular.
    #[must_use]
    pub fn tangent_coordinates(&self, w: &Vector3) -> Option<Vector2<f64>> {
        let first = Matrix2::new(
            self.su.dot(&self.su),
            self.su.dot(&self.sv),
            self.su.dot(&self.sv),
            self.sv.dot(&self.sv),
        );
        Some(first.try_inverse()? * Vector2::new(w.dot(&self.su), w.dot(&self.sv)))
    }

    /// Normal curvature in the direction of the unit tangent `w`, 1/mm, for unit normal `n`.
    #[must_use]
    pub fn normal_curvature(&self, w: &Vector3, n: &Vector3) -> Option<f64> {
        let ab = self.tangent_coordinates(w)?;
        Some(ab.dot(&(self.curvature(n).second * ab)))
    }
}

impl CurvatureTensor {
    /// Principal curvatures `(κ_min, κ_max)`, 1/mm; `None` at singular points.
    #[must_use]
    pub fn principal(&self) -> Option<(f64, f64)> {
        let det = self.first.determinant();
        if det <= 0.0 {
            return None;
        }
        let (e, f, g) = (self.first.m11, self.first.m12, self.first.m22);
        let (l, m, n) = (self.second.m11, self.second.m12, self.second.m22);
        let gauss = (l * n - m * m) / det;
        let mean = (e * n - 2.0 * f * m + g * l) / (2.0 * det);
        let root = (mean * mean - gauss).max(0.0).sqrt();
        Some((mean - root, mean + root))
    }
}
