//! Setup axes as signed axes of the model: conversion permutes coordinates and flips signs, so that
//! nothing is rounded. Also the direction of rows in a setup.

use claymill_nurbs::{Point3, Vector3};
use thiserror::Error;

use crate::orientation::Orientation;

/// A signed coordinate axis of the model.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Axis {
    /// 0 = x, 1 = y, 2 = z.
    pub index: usize,
    /// Points along the negative axis.
    pub negative: bool,
}

/// `text` is not one of `+x -x +y -y +z -z`.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("`{0}` is not an axis; write one of +x -x +y -y +z -z")]
pub struct AxisError(pub String);

impl std::str::FromStr for Axis {
    type Err = AxisError;

    fn from_str(text: &str) -> Result<Self, AxisError> {
        let (negative, letter) = match text.strip_prefix(['+', '-']) {
            Some(rest) => (text.starts_with('-'), rest),
            None => (false, text),
        };
        let index = ["x", "y", "z"].iter().position(|&l| l == letter.to_ascii_lowercase());
        index.map(|index| Axis { index, negative }).ok_or_else(|| AxisError(text.to_owned()))
    }
}

impl std::fmt::Display for Axis {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}{}", if self.negative { '-' } else { '+' }, ["x", "y", "z"][self.index])
    }
}

impl Axis {
    /// The unit vector.
    #[must_use]
    pub fn vector(self) -> Vector3 {
        let mut v = Vector3::zeros();
        v[self.index] = if self.negative { -1.0 } else { 1.0 };
        v
    }

    /// The opposite axis.
    #[must_use]
    pub fn opposite(self) -> Self {
        Axis { negative: !self.negative, ..self }
    }
}

/// A setup: a right-handed frame whose `z` is the tool axis (from tip to holder).
///
/// Its axes are signed axes of the model, so that going back and forth only permutes coordinates and flips
/// signs: nothing is rounded.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Frame {
    /// `top`, `left`, `right`, `front` or `rear`.
    pub name: &'static str,
    x: Axis,
    y: Axis,
    z: Axis,
}

impl Frame {
    /// The five setups of a vehicle with `up` and `front` (from rear to front) axes. Left and right are
    /// those of the driver.
    ///
    /// # Panics
    /// If the axes are parallel; see [`Orientation::new`].
    #[must_use]
    pub fn five(orientation: Orientation) -> [Frame; 5] {
        let (up, front) = (orientation.up, orientation.front);
        let left = cross(up, front);
        let frame = |name, z: Axis, x: Axis| Frame { name, x, y: cross(z, x), z };
        [
            frame("top", up, front),
            frame("left", left, front),
            frame("right", left.opposite(), front),
            frame("front", front, left),
            frame("rear", front.opposite(), left),
        ]
    }

    /// The tool axis in model coordinates.
    #[must_use]
    pub fn axis(&self) -> Vector3 {
        self.z.vector()
    }

    /// The direction of rows in model coordinates.
    #[must_use]
    pub fn direction(&self, along: RowsAlong) -> Vector3 {
        self.x.vector() * along.cosine + self.y.vector() * along.sine
    }

    /// Model coordinates to the frame's.
    #[must_use]
    pub fn to_setup(&self, p: &Point3) -> Point3 {
        let pick = |a: Axis| if a.negative { -p[a.index] } else { p[a.index] };
        Point3::new(pick(self.x), pick(self.y), pick(self.z))
    }

    /// The frame's coordinates to the model's.
    #[must_use]
    pub fn to_model(&self, p: &Point3) -> Point3 {
        let mut out = Point3::origin();
        for (k, a) in [self.x, self.y, self.z].into_iter().enumerate() {
            out[a.index] = if a.negative { -p[k] } else { p[k] };
        }
        out
    }
}

/// Which way straight rows run in a setup's horizontal plane.
#[derive(Debug, Clone, Copy, PartialEq)]
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
}

fn cross(a: Axis, b: Axis) -> Axis {
    let v = a.vector().cross(&b.vector());
    let index = v.iamax();
    assert!(v[index] != 0.0, "axes of a frame must not be parallel");
    Axis { index, negative: v[index] < 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_are_right_handed_and_round_trip_to_the_bit() {
        for (up, front) in [("+z", "-y"), ("+y", "+z"), ("-x", "+y")] {
            let o = Orientation::new(up.parse().unwrap(), front.parse().unwrap()).unwrap();
            for f in Frame::five(o) {
                let (x, y) = (f.direction(RowsAlong::X), f.direction(RowsAlong::Y));
                assert_eq!(x.cross(&y), f.axis(), "{} is right-handed", f.name);
                let p = Point3::new(0.1, -2.3, 7.7);
                assert_eq!(f.to_model(&f.to_setup(&p)), p);
                assert_eq!(f.to_setup(&Point3::from(f.axis())), Point3::new(0.0, 0.0, 1.0));
            }
        }
    }

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

    #[test]
    fn left_is_the_drivers_left() {
        let o = Orientation::new("+z".parse().unwrap(), "-y".parse().unwrap()).unwrap();
        // Front -y, up z: the driver's left hand points to +x.
        assert_eq!(Frame::five(o)[1].axis(), Vector3::new(1.0, 0.0, 0.0));
        assert!(Orientation::new("+z".parse().unwrap(), "-z".parse().unwrap()).is_err());
    }
}
