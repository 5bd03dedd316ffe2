//! Setup axes as signed axes of the model: conversion permutes coordinates and flips signs, so that
//! nothing is rounded.

use claymill_nurbs::{Point3, Vector3};
use thiserror::Error;

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

/// Two axes that span a setup are parallel.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("up axis {up} and length axis {length} are parallel; choose two different ones")]
pub struct ParallelAxes {
    /// Up, along the tool axis.
    pub up: Axis,
    /// Length.
    pub length: Axis,
}

/// A setup: a right-handed frame whose `z` is the tool axis (from tip to holder).
///
/// Its axes are signed axes of the model, so that going back and forth only permutes coordinates and flips
/// signs: nothing is rounded.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Frame {
    /// Its name in the job, such as `top`.
    pub name: &'static str,
    x: Axis,
    y: Axis,
    z: Axis,
}

impl Frame {
    /// A setup with the tool axis `z`, from tip to holder, and `x`.
    ///
    /// # Errors
    /// The axes are parallel.
    pub fn new(name: &'static str, z: Axis, x: Axis) -> Result<Frame, ParallelAxes> {
        Ok(Frame { name, x, y: cross(z, x)?, z })
    }

    /// The five setups of a vehicle with `up` and `front` (from rear to front) axes. Left and right are
    /// those of the driver.
    ///
    /// # Errors
    /// The axes are parallel.
    pub fn five(up: Axis, front: Axis) -> Result<[Frame; 5], ParallelAxes> {
        let left = cross(up, front)?;
        Ok([
            Frame::new("top", up, front)?,
            Frame::new("left", left, front)?,
            Frame::new("right", left.opposite(), front)?,
            Frame::new("front", front, left)?,
            Frame::new("rear", front.opposite(), left)?,
        ])
    }

    /// The tool axis in model coordinates.
    #[must_use]
    pub fn axis(&self) -> Vector3 {
        self.z.vector()
    }

    /// The frame's own `x`, `y` and `z` in model coordinates.
    #[must_use]
    pub fn axes(&self) -> [Vector3; 3] {
        [self.x, self.y, self.z].map(Axis::vector)
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

fn cross(a: Axis, b: Axis) -> Result<Axis, ParallelAxes> {
    if a.index == b.index {
        return Err(ParallelAxes { up: a, length: b });
    }
    let v = a.vector().cross(&b.vector());
    let index = v.iamax();
    Ok(Axis { index, negative: v[index] < 0.0 })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_are_right_handed_and_round_trip_to_the_bit() {
        for (up, front) in [("+z", "-y"), ("+y", "+z"), ("-x", "+y")] {
            for f in Frame::five(up.parse().unwrap(), front.parse().unwrap()).unwrap() {
                let [x, y, z] = f.axes();
                assert_eq!((x.cross(&y), z), (f.axis(), f.axis()), "{} is right-handed", f.name);
                let p = Point3::new(0.1, -2.3, 7.7);
                assert_eq!(f.to_model(&f.to_setup(&p)), p);
                assert_eq!(f.to_setup(&Point3::from(f.axis())), Point3::new(0.0, 0.0, 1.0));
            }
        }
    }

    #[test]
    fn left_is_the_drivers_left() {
        let five = |up: &str, front: &str| Frame::five(up.parse().unwrap(), front.parse().unwrap());
        // Front -y, up z: the driver's left hand points to +x.
        assert_eq!(five("+z", "-y").unwrap()[1].axis(), Vector3::new(1.0, 0.0, 0.0));
        assert!(five("+z", "-z").is_err());
    }
}
