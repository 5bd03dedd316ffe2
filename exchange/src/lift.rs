//! Curves in a surface's parameter plane as curves in space.

use claymill_nurbs::{Curve2, Curve3, NurbsError, NurbsSurface};

use crate::hermite::fitted;

/// The lifted curve keeps this close to the surface's own, mm.
const LIFTED_MM: f64 = 1e-5;

/// `S(c(t))` as a cubic with the parameter of `c`, exact in position and slope at its knots.
pub(crate) fn lifted(surface: &NurbsSurface, pcurve: &Curve2) -> Result<Curve3, NurbsError> {
    let at = |t: f64| {
        let [point, slope, _] = surface.lift(pcurve, t);
        [point, slope]
    };
    Ok(fitted(&pcurve.knots().breaks(), LIFTED_MM, at)?.0)
}
