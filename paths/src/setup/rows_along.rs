//! The direction of straight rows in a setup.

use claymill_contact::Frame;
use claymill_nurbs::Vector3;
use serde::{Deserialize, Serialize};

/// Which way straight rows run in a setup's horizontal plane.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct RowsAlong {
    cosine: f64,
    sine: f64,
}

impl RowsAlong {
    /// Along the setup's `x`.
    pub const X: RowsAlong = RowsAlong { cosine: 1.0, sine: 0.0 };
    /// Along the setup's `y`.
    pub const Y: RowsAlong = RowsAlong { cosine: 0.0, sine: 1.0 };

    /// At an angle from the setup's `x` to its `y`, degrees. Right angles are exact.
    #[must_use]
    pub fn at_deg(angle_deg: f64) -> Self {
        match angle_deg.rem_euclid(180.0) {
            0.0 => Self::X,
            90.0 => Self::Y,
            angle => {
                let (sine, cosine) = angle.to_radians().sin_cos();
                RowsAlong { cosine, sine }
            }
        }
    }

    /// The unit vector along the rows.
    pub(crate) fn unit(&self) -> [f64; 2] {
        [self.cosine, self.sine]
    }

    /// Position along the rows and across them.
    pub(crate) fn place(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        [x * self.cosine + y * self.sine, y * self.cosine - x * self.sine]
    }

    /// The place at a position along the rows and across them.
    pub(crate) fn at(&self, [s, q]: [f64; 2]) -> [f64; 2] {
        [s * self.cosine - q * self.sine, s * self.sine + q * self.cosine]
    }

    /// The direction of the rows in model coordinates.
    #[must_use]
    pub fn direction(self, frame: &Frame) -> Vector3 {
        let [x, y, _] = frame.axes();
        x * self.cosine + y * self.sine
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_at_any_angle_and_exactly_at_right_angles() {
        for angle_deg in [-200.0, -90.0, 0.0, 15.0, 77.7, 90.0, 180.0, 1e4] {
            let along = RowsAlong::at_deg(angle_deg);
            let p = [3.0, -4.5];
            let back = along.at(along.place(p));
            assert!((back[0] - p[0]).hypot(back[1] - p[1]) < 1e-14);
            let half_turns = (along.unit()[1].atan2(along.unit()[0]).to_degrees() - angle_deg) / 180.0;
            approx::assert_abs_diff_eq!(half_turns, half_turns.round(), epsilon = 1e-12);
        }
        assert_eq!((RowsAlong::at_deg(-90.0), RowsAlong::at_deg(360.0)), (RowsAlong::Y, RowsAlong::X));
    }
}
