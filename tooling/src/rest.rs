//! What tools leave in corners, grooves and slots, in closed form: to check plans against, and to
//! estimate with.

use std::f64::consts::PI;

/// Volume that an upright tool of a radius removes from a rectangular pocket, mm³: all but its four corners.
#[must_use]
pub fn pocket_removed_mm3(sides_mm: [f64; 2], depth_mm: f64, radius_mm: f64) -> f64 {
    (sides_mm[0] * sides_mm[1] - corners_mm2(radius_mm)) * depth_mm
}

/// Volume that a smaller tool removes after a larger one from the corners of a rectangular pocket, mm³.
#[must_use]
pub fn pocket_rest_mm3(depth_mm: f64, larger_radius_mm: f64, smaller_radius_mm: f64) -> f64 {
    (corners_mm2(larger_radius_mm) - corners_mm2(smaller_radius_mm)) * depth_mm
}

/// What a circle leaves in the corners of a square around it, mm².
fn corners_mm2(radius_mm: f64) -> f64 {
    (4.0 - PI) * radius_mm * radius_mm
}

/// Section that a ball leaves at the bottom of a groove whose sides slope by this angle, mm².
#[must_use]
pub fn groove_rest_mm2(slope_deg: f64, radius_mm: f64) -> f64 {
    let slope = slope_deg.to_radians();
    radius_mm * radius_mm * (slope.tan() - slope)
}

/// How far the tip of a ball that is wider than a slot hangs below the slot's rim, mm. `None` where the ball falls in.
#[must_use]
pub fn slot_hang_mm(width_mm: f64, radius_mm: f64) -> Option<f64> {
    (width_mm < 2.0 * radius_mm)
        .then(|| radius_mm - (radius_mm * radius_mm - 0.25 * width_mm * width_mm).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Values that were computed with 30 digits.
    #[test]
    fn rests_have_their_closed_forms() {
        let approx = |a: f64, b: f64| approx::assert_abs_diff_eq!(a, b, epsilon = 1e-9);
        approx(pocket_removed_mm3([100.0, 100.0], 20.0, 10.0), 198_283.185_307_180);
        approx(pocket_rest_mm3(20.0, 10.0, 5.0), 1_287.611_019_615);
        approx(pocket_rest_mm3(20.0, 5.0, 2.0), 360.531_085_492);
        approx(groove_rest_mm2(30.0, 10.0), 5.375_149_359);
        approx(groove_rest_mm2(30.0, 3.0), 0.483_763_442);
        approx(groove_rest_mm2(45.0, 10.0), 21.460_183_660);
        approx(slot_hang_mm(16.0, 10.0).unwrap(), 4.0);
        assert_eq!(slot_hang_mm(20.0, 10.0), None);
    }
}
