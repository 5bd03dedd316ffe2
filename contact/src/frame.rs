//! Frames of setups: signed axes of the model, which round nothing, or any turn, as a quaternion of integers.

use claymill_nurbs::{Aabb, Point3, Vector3};
use claymill_toolpath::{LARGEST_ENTRY, axes_of_quaternion};
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

/// Name of a setup: letters, digits, `-` and `_`.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct SetupName {
    bytes: [u8; SetupName::LONGEST],
    length: u8,
}

impl SetupName {
    /// Most characters in a name.
    pub const LONGEST: usize = 24;

    /// A name; `None` if it is empty, too long, or has other characters than letters, digits, `-` and `_`.
    #[must_use]
    pub fn new(name: &str) -> Option<Self> {
        let is_plain = |b: &u8| b.is_ascii_alphanumeric() || matches!(b, b'-' | b'_');
        if !(1..=Self::LONGEST).contains(&name.len()) || !name.as_bytes().iter().all(is_plain) {
            return None;
        }
        let mut bytes = [0; Self::LONGEST];
        bytes[..name.len()].copy_from_slice(name.as_bytes());
        Some(SetupName { bytes, length: name.len() as u8 })
    }

    /// The name as text.
    #[must_use]
    pub fn as_str(&self) -> &str {
        std::str::from_utf8(&self.bytes[..usize::from(self.length)]).unwrap_or_default()
    }
}

impl std::fmt::Display for SetupName {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.pad(self.as_str())
    }
}

impl std::fmt::Debug for SetupName {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        std::fmt::Debug::fmt(self.as_str(), f)
    }
}

impl PartialEq<&str> for SetupName {
    fn eq(&self, other: &&str) -> bool {
        self.as_str() == *other
    }
}

/// Why there is no such frame.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum FrameError {
    /// A name that no setup can have.
    #[error(
        "`{0}` is not a name for a setup; take up to {most} letters, digits, - and _",
        most = SetupName::LONGEST
    )]
    Name(String),
    /// Two axes that span it are parallel.
    #[error(transparent)]
    Parallel(#[from] ParallelAxes),
    /// The tool axis has no length, or is not finite.
    #[error("the tool axis {} {} {} of setup `{name}` is no direction", axis[0], axis[1], axis[2])]
    Axis {
        /// Of the setup.
        name: String,
        /// As given.
        axis: [f64; 3],
    },
    /// A quaternion turns nothing.
    #[error(
        "the quaternion of setup `{name}` must have an entry other than 0, and none beyond {LARGEST_ENTRY}"
    )]
    Quaternion {
        /// Of the setup.
        name: String,
    },
}

/// A setup: a right-handed frame whose `z` is the tool axis (from tip to holder). Its origin is the model's.
///
/// ```text
///        z, towards the holder          axis-parallel: coordinates are permuted and change signs, nothing is rounded
///        │   y                          any other:     the matrix of a quaternion of integers (a, b, c, d), every entry
///        │  ╱                                          one division of integers, so that it is the same everywhere
///        │ ╱______ x
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Frame {
    /// Its name in the job, such as `top`.
    pub name: SetupName,
    turn: Turn,
}

/// How a frame lies in the model.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Turn {
    /// Its `x`, `y` and `z` are axes of the model.
    Axes([Axis; 3]),
    /// Its `x`, `y` and `z` in model coordinates, by the quaternion.
    Quaternion([Vector3; 3], [i64; 4]),
}

/// Entries of a quaternion are rounded to integers of this size: a direction is met within 1e-9 rad.
const SCALE: f64 = LARGEST_ENTRY as f64;
/// A direction as near to an axis of the model as this is that axis.
const ALONG_AXIS: f64 = 1e-9;
/// `x` runs along the first candidate that is at least this far off the tool axis (sine).
const ACROSS: f64 = 0.5;

impl Frame {
    /// A setup with the tool axis `z`, from tip to holder, and `x`.
    ///
    /// # Errors
    /// The axes are parallel, or no setup can have the name.
    pub fn new(name: &str, z: Axis, x: Axis) -> Result<Frame, FrameError> {
        let name = SetupName::new(name).ok_or_else(|| FrameError::Name(name.to_owned()))?;
        Ok(Frame { name, turn: Turn::Axes([x, cross(z, x)?, z]) })
    }

    /// A setup with any tool axis, from tip to holder, in model coordinates. Its `x` runs along `front`, or where the tool
    /// does that, to the left; it is the frame of [`Frame::five`] where the axis is one of the model's.
    ///
    /// # Errors
    /// `up` and `front` are parallel, `axis` is no direction, or no setup can have the name.
    pub fn tilted(name: &str, axis: [f64; 3], up: Axis, front: Axis) -> Result<Frame, FrameError> {
        let left = cross(up, front)?;
        let no_axis = || FrameError::Axis { name: name.to_owned(), axis };
        // By the largest component first: no square is too large or too small.
        let largest = Vector3::from(axis).amax();
        if !axis.iter().all(|c| c.is_finite()) || largest == 0.0 {
            return Err(no_axis());
        }
        let z = (Vector3::from(axis) / largest).try_normalize(0.0).ok_or_else(no_axis)?;
        let across = |x: &Axis| x.vector().cross(&z).norm() > ACROSS;
        let x = [front, left].into_iter().find(across).unwrap_or(front);
        let model_axes = (0..3).flat_map(|index| [false, true].map(|negative| Axis { index, negative }));
        if let Some(along) = model_axes.into_iter().find(|a| (a.vector() - z).amax() < ALONG_AXIS) {
            return Frame::new(name, along, x);
        }
        let x = (x.vector() - z * z.dot(&x.vector())).normalize();
        Frame::turned(name, quaternion_of([x, z.cross(&x), z]))
    }

    /// A setup by a quaternion of integers, not all zero: the turn that takes the setup's axes to the model's coordinates.
    /// Every entry of the matrix is one division of integers.
    ///
    /// # Errors
    /// No setup can have the name, all entries are zero, or one is larger than 2³⁰.
    pub fn turned(name: &str, quaternion: [i64; 4]) -> Result<Frame, FrameError> {
        let short = SetupName::new(name).ok_or_else(|| FrameError::Name(name.to_owned()))?;
        let axes = axes_of_quaternion(quaternion);
        let axes = axes.ok_or_else(|| FrameError::Quaternion { name: name.to_owned() })?;
        Ok(Frame { name: short, turn: Turn::Quaternion(axes.map(Vector3::from), quaternion) })
    }

    /// The five setups of a vehicle with `up` and `front` (from rear to front) axes. Left and right are
    /// those of the driver.
    ///
    /// # Errors
    /// The axes are parallel.
    pub fn five(up: Axis, front: Axis) -> Result<[Frame; 5], FrameError> {
        let left = cross(up, front)?;
        Ok([
            Frame::new("top", up, front)?,
            Frame::new("left", left, front)?,
            Frame::new("right", left.opposite(), front)?,
            Frame::new("front", front, left)?,
            Frame::new("rear", front.opposite(), left)?,
        ])
    }

    /// The quaternion of a frame that is not parallel to the model's axes.
    #[must_use]
    pub fn quaternion(&self) -> Option<[i64; 4]> {
        match self.turn {
            Turn::Axes(_) => None,
            Turn::Quaternion(_, quaternion) => Some(quaternion),
        }
    }

    /// Whether it is not parallel to the model's axes, so that its coordinates are rounded.
    #[must_use]
    pub fn is_tilted(&self) -> bool {
        matches!(self.turn, Turn::Quaternion(..))
    }

    /// The tool axis in model coordinates.
    #[must_use]
    pub fn axis(&self) -> Vector3 {
        let [_, _, z] = self.axes();
        z
    }

    /// The frame's own `x`, `y` and `z` in model coordinates.
    #[must_use]
    pub fn axes(&self) -> [Vector3; 3] {
        match self.turn {
            Turn::Axes(axes) => axes.map(Axis::vector),
            Turn::Quaternion(axes, _) => axes,
        }
    }

    /// Model coordinates to the frame's.
    #[must_use]
    pub fn to_setup(&self, p: &Point3) -> Point3 {
        match &self.turn {
            Turn::Axes(axes) => axes.map(|a| if a.negative { -p[a.index] } else { p[a.index] }).into(),
            Turn::Quaternion(axes, _) => axes.map(|a| a.dot(&p.coords)).into(),
        }
    }

    /// The box around a box of the model, in the frame's coordinates.
    #[must_use]
    pub fn box_in_setup(&self, of: &Aabb) -> Aabb {
        Aabb::of(&of.vertices().map(|p| self.to_setup(&p)))
    }

    /// The frame's coordinates to the model's.
    #[must_use]
    pub fn to_model(&self, p: &Point3) -> Point3 {
        match &self.turn {
            Turn::Axes(axes) => {
                let mut out = Point3::origin();
                for (k, a) in axes.iter().enumerate() {
                    out[a.index] = if a.negative { -p[k] } else { p[k] };
                }
                out
            }
            Turn::Quaternion([x, y, z], _) => (x * p.x + y * p.y + z * p.z).into(),
        }
    }
}

/// The quaternion of the turn with these columns, in integers. The largest of its four entries comes first from a sum
/// of squares, the others by dividing through it (Shepperd 1978).
fn quaternion_of([x, y, z]: [Vector3; 3]) -> [i64; 4] {
    let trace = x.x + y.y + z.z;
    let raw = if trace >= x.x.max(y.y).max(z.z) {
        [1.0 + trace, y.z - z.y, z.x - x.z, x.y - y.x]
    } else if x.x >= y.y.max(z.z) {
        [y.z - z.y, 1.0 + x.x - y.y - z.z, y.x + x.y, x.z + z.x]
    } else if y.y >= z.z {
        [z.x - x.z, y.x + x.y, 1.0 - x.x + y.y - z.z, z.y + y.z]
    } else {
        [x.y - y.x, x.z + z.x, z.y + y.z, 1.0 - x.x - y.y + z.z]
    };
    let norm = raw.iter().map(|q| q * q).sum::<f64>().sqrt();
    raw.map(|q| (q / norm * SCALE).round() as i64)
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
    use proptest::prelude::*;

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

    fn axis() -> impl Strategy<Value = Vector3> {
        [-1.0..1.0, -1.0..1.0, -1.0..1.0_f64]
            .prop_map(Vector3::from)
            .prop_filter("no length", |v| v.norm() > 0.1)
    }

    proptest! {
        #[test]
        fn any_direction_is_met_and_keeps_distances(v in axis(), p in [-5e3..5e3, -5e3..5e3, -5e3..5e3_f64]) {
            let axes = |t: &str| t.parse::<Axis>().unwrap();
            let frame = Frame::tilted("odd", v.into(), axes("+z"), axes("-y")).unwrap();
            let [x, y, z] = frame.axes();
            prop_assert!((z - v.normalize()).norm() < 2e-9);
            prop_assert!((x.cross(&y) - z).norm() < 1e-15 * 4.0);
            let p = Point3::from(p);
            prop_assert!((frame.to_model(&frame.to_setup(&p)) - p).norm() < 5e-12);
            prop_assert!((frame.to_setup(&p).coords.norm() - p.coords.norm()).abs() < 6e-12);
            // The same frame again, from what is written.
            let again = Frame::turned("odd", frame.quaternion().unwrap()).unwrap();
            prop_assert_eq!(again, frame);
        }
    }

    #[test]
    fn the_axis_of_a_quaternion_is_the_one_worked_out_by_hand() {
        let frame = Frame::turned("tilted", [3, 1, 0, 0]).unwrap();
        assert_eq!(frame.axis(), Vector3::new(0.0, -0.6, 0.8));
        let tilt_deg = frame.axis().z.acos().to_degrees();
        approx::assert_abs_diff_eq!(tilt_deg, 36.869_897_646, epsilon = 1e-9);
    }

    #[test]
    fn a_direction_along_an_axis_is_the_setup_of_that_name() {
        let axes = |t: &str| t.parse::<Axis>().unwrap();
        for five in Frame::five(axes("+z"), axes("-y")).unwrap() {
            let frame = Frame::tilted(five.name.as_str(), (five.axis() * 7.0).into(), axes("+z"), axes("-y"))
                .unwrap();
            assert_eq!(frame, five);
        }
    }

    #[test]
    fn what_is_no_direction_or_no_name_is_refused() {
        let axes = |t: &str| t.parse::<Axis>().unwrap();
        let tilted = |name: &str, axis| Frame::tilted(name, axis, axes("+z"), axes("-y"));
        for axis in [[0.0; 3], [f64::NAN, 0.0, 1.0], [f64::INFINITY, 0.0, 1.0]] {
            assert!(matches!(tilted("a", axis), Err(FrameError::Axis { .. })), "{axis:?}");
        }
        for name in ["", "a b", "a/b", "ä", "a123456789012345678901234"] {
            assert!(matches!(tilted(name, [0.0, 1.0, 1.0]), Err(FrameError::Name(_))), "{name}");
        }
        assert!(tilted("a", [1e-300, 0.0, 1e300]).is_ok());
        assert!(Frame::turned("a", [0; 4]).is_err());
    }

    #[test]
    fn left_is_the_drivers_left() {
        let five = |up: &str, front: &str| Frame::five(up.parse().unwrap(), front.parse().unwrap());
        // Front -y, up z: the driver's left hand points to +x.
        assert_eq!(five("+z", "-y").unwrap()[1].axis(), Vector3::new(1.0, 0.0, 0.0));
        assert!(five("+z", "-z").is_err());
    }
}
