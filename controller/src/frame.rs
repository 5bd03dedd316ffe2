//! A setup's machine coordinates, with the tool axis as +Z and the work's zero as origin.
//! Conversion to and from model coordinates.

use claymill_nurbs::{Point3, Vector3};
use claymill_toolpath::axes_of_quaternion;

/// A setup's machine coordinates: its tool axis is +Z.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Frame {
    x: Vector3,
    y: Vector3,
    z: Vector3,
    zero: Point3,
}

/// Components of axes that are this near to 0 or 1 are meant to be: going to and fro then rounds nothing.
const AXIS_EPSILON: f64 = 1e-12;

impl Frame {
    /// The frame for a tool axis: X runs along `front`, or to the left where the tool axis does that.
    /// `up` and `front` are the vehicle's axes, `zero` the work's zero, all in model coordinates. `None`
    /// where `axis` is no direction.
    #[must_use]
    pub fn new(axis: Vector3, up: Vector3, front: Vector3, zero: Point3) -> Option<Self> {
        let tidy = |v: Vector3| v.map(|c| if (c - c.round()).abs() < AXIS_EPSILON { c.round() } else { c });
        let z = tidy(axis.try_normalize(1e-9)?);
        let left = up.cross(&front);
        let x =
            [front, left, up].into_iter().find(|d| d.cross(&z).norm() > 0.5 * d.norm() && d.norm() > 0.5)?;
        let x = tidy((x - z * z.dot(&x)).try_normalize(1e-9)?);
        Some(Frame { x, y: tidy(z.cross(&x)), z, zero })
    }

    /// The frame of a quaternion of integers (a, b, c, d), the turn from the setup's axes to the model's; `None` where it
    /// is zero. Every entry is one division of integers.
    #[must_use]
    pub fn of_quaternion(quaternion: [i64; 4], zero: Point3) -> Option<Self> {
        let [x, y, z] = axes_of_quaternion(quaternion)?.map(Vector3::from);
        Some(Frame { x, y, z, zero })
    }

    /// The frame of three axes that are known to be right-handed and of unit length.
    pub(crate) fn of_axes([x, y, z]: [Vector3; 3], zero: Point3) -> Self {
        Frame { x, y, z, zero }
    }

    /// Its x, y and z in model coordinates.
    #[must_use]
    pub fn axes(&self) -> [Vector3; 3] {
        [self.x, self.y, self.z]
    }

    /// Model coordinates to the machine's.
    #[must_use]
    pub fn to_machine(&self, p: &Point3) -> Point3 {
        let d = p - self.zero;
        Point3::new(self.x.dot(&d), self.y.dot(&d), self.z.dot(&d))
    }

    /// The machine's coordinates to the model's.
    #[must_use]
    pub fn to_model(&self, p: &Point3) -> Point3 {
        self.zero + self.x * p.x + self.y * p.y + self.z * p.z
    }

    /// The tool axis in model coordinates.
    #[must_use]
    pub fn axis(&self) -> Vector3 {
        self.z
    }
}

/// A signed axis as text, `-y`, as `job.json` has it.
#[must_use]
pub(crate) fn signed_axis(text: &str) -> Option<Vector3> {
    let (sign, letter) = match text.strip_prefix(['+', '-']) {
        Some(rest) => (if text.starts_with('-') { -1.0 } else { 1.0 }, rest),
        None => (1.0, text),
    };
    let mut v = Vector3::zeros();
    v[["x", "y", "z"].iter().position(|l| *l == letter)?] = sign;
    Some(v)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn signed_axes_round_nothing() {
        let (up, front) = (signed_axis("+z").unwrap(), signed_axis("-x").unwrap());
        for axis in ["+z", "+y", "-y", "+x", "-x"].map(|a| signed_axis(a).unwrap()) {
            let frame = Frame::new(axis, up, front, Point3::origin()).unwrap();
            let p = Point3::new(1335.0026, -305.1963, 428.7);
            assert_eq!(frame.to_model(&frame.to_machine(&p)), p);
            assert_eq!(frame.to_machine(&Point3::from(axis)), Point3::new(0.0, 0.0, 1.0));
        }
    }
}
