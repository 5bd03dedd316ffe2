//! Eight surface points side by side: parameters in, derivatives, normals and fundamental forms
//! out.

use pulp::Simd;

use super::kernel::{Derivatives, Forms};
use crate::{CurvatureTensor, Jet, Point3, Vector3};

/// Points evaluated side by side.
pub const LANES: usize = 8;

/// One number for each point.
pub type Lanes = [f64; LANES];

/// The parameters of points that are evaluated side by side.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
#[repr(C, align(64))]
pub struct Places {
    /// Parameter `u` of each.
    pub u: Lanes,
    /// Parameter `v` of each.
    pub v: Lanes,
}

/// The shape of a surface at points side by side: for each coordinate a number a point.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
#[repr(C, align(64))]
pub struct Shapes {
    /// The points, mm.
    pub p: [Lanes; 3],
    /// ∂S/∂u.
    pub su: [Lanes; 3],
    /// ∂S/∂v.
    pub sv: [Lanes; 3],
    /// ∂²S/∂u².
    pub suu: [Lanes; 3],
    /// ∂²S/∂u∂v.
    pub suv: [Lanes; 3],
    /// ∂²S/∂v².
    pub svv: [Lanes; 3],
    /// Unit normals `Su × Sv / |Su × Sv|`; no numbers where the parametrisation is singular.
    pub n: [Lanes; 3],
    /// `E`, `F`, `G` of the first fundamental form.
    pub first: [Lanes; 3],
    /// `L`, `M`, `N` of the second for the normal above.
    pub second: [Lanes; 3],
}

impl Shapes {
    /// Point `k` and its derivatives.
    #[must_use]
    pub fn jet(&self, k: usize) -> Jet {
        let at = |x: &[Lanes; 3]| Vector3::new(x[0][k], x[1][k], x[2][k]);
        Jet {
            p: Point3::from(at(&self.p)),
            su: at(&self.su),
            sv: at(&self.sv),
            suu: at(&self.suu),
            suv: at(&self.suv),
            svv: at(&self.svv),
        }
    }

    /// Unit normal of point `k`; `None` where the parametrisation is singular.
    #[must_use]
    pub fn normal(&self, k: usize) -> Option<Vector3> {
        let n = Vector3::new(self.n[0][k], self.n[1][k], self.n[2][k]);
        n.x.is_finite().then_some(n)
    }

    /// Both fundamental forms at point `k`.
    #[must_use]
    pub fn curvature(&self, k: usize) -> CurvatureTensor {
        let form = |x: &[Lanes; 3]| nalgebra::Matrix2::new(x[0][k], x[1][k], x[1][k], x[2][k]);
        CurvatureTensor { first: form(&self.first), second: form(&self.second) }
    }
}

impl Shapes {
    /// Puts what was found for register `k` of the lanes in its place.
    #[inline(always)]
    pub(super) fn put<S: Simd>(&mut self, k: usize, d: &Derivatives<S::f64s>, forms: &Forms<S::f64s>) {
        put::<S>(&mut self.p, k, &d.p);
        put::<S>(&mut self.su, k, &d.su);
        put::<S>(&mut self.sv, k, &d.sv);
        put::<S>(&mut self.suu, k, &d.suu);
        put::<S>(&mut self.suv, k, &d.suv);
        put::<S>(&mut self.svv, k, &d.svv);
        put::<S>(&mut self.n, k, &forms.n);
        put::<S>(&mut self.first, k, &forms.first);
        put::<S>(&mut self.second, k, &forms.second);
    }
}

#[inline(always)]
fn put<S: Simd>(lanes: &mut [Lanes; 3], k: usize, from: &[S::f64s; 3]) {
    for (lane, &x) in lanes.iter_mut().zip(from) {
        let (registers, _) = S::as_mut_simd_f64s(lane);
        registers[k] = x;
    }
}
