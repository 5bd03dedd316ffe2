//! Step-over from the scallop height (docs/theory.md §4.2).

use claymill_contact::EndShape;
use claymill_nurbs::{Jet, Vector3};

use crate::RowsAlong;
use crate::pattern::end_step::widest_mm;

/// A valley nearly as tight as the ball asks for rows ever closer together; below this share of the flat
/// step-over nothing is gained.
const CLOSEST: f64 = 0.1;

/// Step-over on a plane: `s = 2 √(2 R h − h²)`.
#[must_use]
pub fn flat_mm(radius_mm: f64, scallop_mm: f64) -> f64 {
    2.0 * (2.0 * radius_mm * scallop_mm - scallop_mm * scallop_mm).max(0.0).sqrt()
}

/// Passes that cut a place run past within two of these, mm.
pub(crate) fn come_by_mm(end: &EndShape, scallop_mm: f64) -> f64 {
    if end.is_ball() { flat_mm(end.radius_mm(), scallop_mm) } else { widest_mm(end, scallop_mm) }
}

/// Distance of parallel rows, in the setup's horizontal plane, that keeps the scallop height at this point
/// of a surface given in setup coordinates.
///
/// On the surface of ball centres the step-over is `√(8 h R (1 − κ⁺R))`, `κ⁺` the normal curvature across the
/// feed (positive in a valley); rows cut that surface by planes, which spreads them by
/// `1 / √(1 − (n·N)²)`, `N` the planes' normal.
pub(crate) fn row_distance_mm(jet: &Jet, along: RowsAlong, radius_mm: f64, scallop_mm: f64) -> Option<f64> {
    let mut n = jet.normal()?;
    if n.z < 0.0 {
        n = -n;
    }
    let [ex, ey] = along.unit();
    let plane = Vector3::new(-ey, ex, 0.0);
    let feed = plane.cross(&n);
    let sine = feed.norm();
    let across = n.cross(&feed) / sine;
    let bend = bend(jet, &across, &n, radius_mm)?;
    let distance = flat_mm(radius_mm, scallop_mm) * bend.sqrt() * sine;
    (distance.is_finite() && distance > 0.0).then_some(distance)
}

/// `1 − κ⁺R` across the feed: how much the surface of ball centres is shorter than the surface.
fn bend(jet: &Jet, across: &Vector3, normal: &Vector3, radius_mm: f64) -> Option<f64> {
    let kappa = jet.normal_curvature(across, normal)?;
    Some((1.0 - kappa * radius_mm).max(CLOSEST * CLOSEST))
}

/// Step-over on the surface, across `across` (any length, along the surface), that keeps the scallop height:
/// `√(8 h R / (1 − κ⁺R))`.
pub(crate) fn on_contact_mm(
    jet: &Jet,
    across: &Vector3,
    normal: &Vector3,
    radius_mm: f64,
    scallop_mm: f64,
) -> Option<f64> {
    let bend = bend(jet, &across.try_normalize(0.0)?, normal, radius_mm)?;
    Some(flat_mm(radius_mm, scallop_mm) / bend.sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;
    use claymill_nurbs::Point3;

    fn jet(su: Vector3, sv: Vector3, svv: Vector3) -> Jet {
        let zero = Vector3::zeros();
        Jet { p: Point3::origin(), su, sv, suu: zero, suv: zero, svv }
    }

    #[test]
    fn planes_and_cylinders_match_the_reference_table() {
        // docs/theory.md §4.3, R = 10, h = 0.02: plane 1.264278; arc on a cylinder of radius 100, convex and
        // concave, 1.205324 and 1.332802, times (1 ∓ κR) on the surface of centres.
        approx::assert_abs_diff_eq!(flat_mm(10.0, 0.02), 1.264_278_450, epsilon = 1e-9);
        for (curvature, arc) in [(-0.01, 1.205_324), (0.01, 1.332_802)] {
            let j = jet(Vector3::x(), Vector3::y(), Vector3::z() * curvature);
            let distance = row_distance_mm(&j, RowsAlong::X, 10.0, 0.02).unwrap();
            let exact = arc * (1.0 - curvature * 10.0);
            approx::assert_relative_eq!(distance, exact, max_relative = 1e-3);
        }
    }

    #[test]
    fn a_slope_across_the_rows_brings_them_together() {
        let tilt = 40f64.to_radians();
        let j = jet(Vector3::x(), Vector3::new(0.0, tilt.cos(), tilt.sin()), Vector3::zeros());
        let across = row_distance_mm(&j, RowsAlong::X, 10.0, 0.1).unwrap();
        let uphill = row_distance_mm(&j, RowsAlong::Y, 10.0, 0.1).unwrap();
        approx::assert_relative_eq!(across / uphill, tilt.cos(), max_relative = 1e-12);
    }
}
