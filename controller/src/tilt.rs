//! A working plane that is tilted on the machine: its axes, and the three angles by which controls are told of it.

use claymill_nurbs::{Point3, Vector3};
use nalgebra::{Matrix3, Rotation3};

use crate::frame::Frame;

/// Coordinates that are turned and shifted against those in which the part stands on the machine.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tilt {
    /// Its x, y and z, in the coordinates in which the part stands.
    axes: Matrix3<f64>,
    origin: Point3,
}

/// How a control turns coordinates by three angles, degrees.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Angles {
    /// About x, then about the new y, then about the new z: CYCLE800 axis by axis in this order.
    Xyz,
    /// About the standing x, y and z, in this order: PLANE SPATIAL.
    SpatialXyz,
    /// About z, then about the new x, then about the new z (Euler): G68.2.
    Zxz,
}

/// How a section stands on the machine.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Placed {
    /// Its plane, in the coordinates in which the part stands.
    pub tilt: Tilt,
    /// What the control is told.
    pub by: Turn,
    /// The coordinates in which the part stands.
    pub stands: Frame,
}

/// How the machine comes to a setup.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Turn {
    /// By the control's own tilted plane.
    Plane {
        /// Its angles as they are written, degrees.
        deg: [f64; 3],
    },
    /// By an indexed axis that turns the part.
    Index {
        /// Its position, degrees.
        deg: f64,
        /// Height above everything that turns, mm.
        safe_mm: f64,
    },
}

/// Sines below this leave the first and the last turn about one axis: all of it is then given to one of them.
const ALIGNED: f64 = 1e-12;

impl Tilt {
    /// A plane by its axes; `None` where they are no right-handed turn.
    #[must_use]
    pub fn new([x, y, z]: [Vector3; 3], origin: Point3) -> Option<Self> {
        let axes = Matrix3::from_columns(&[x, y, z]);
        let is_turn =
            (axes.transpose() * axes - Matrix3::identity()).amax() < 1e-6 && axes.determinant() > 0.0;
        (is_turn && origin.iter().all(|c| c.is_finite())).then_some(Tilt { axes, origin })
    }

    /// A plane by three angles, degrees.
    #[must_use]
    pub fn by(angles: Angles, deg: [f64; 3], origin: Point3) -> Self {
        let [a, b, c] = deg;
        // Turns about standing axes are those about the plane's own axes in the opposite order.
        let turns = match angles {
            Angles::Xyz => [(0, a), (1, b), (2, c)],
            Angles::SpatialXyz => [(2, c), (1, b), (0, a)],
            Angles::Zxz => [(2, a), (0, b), (2, c)],
        };
        Tilt::by_turns(turns, origin)
    }

    /// A plane by successive turns about its own axes (0 = x), degrees.
    #[must_use]
    pub fn by_turns(turns: [(usize, f64); 3], origin: Point3) -> Self {
        let unit = [Vector3::x_axis(), Vector3::y_axis(), Vector3::z_axis()];
        let turn = turns.iter().fold(Rotation3::identity(), |turn, (axis, deg)| {
            turn * Rotation3::from_axis_angle(&unit[*axis], deg.to_radians())
        });
        Tilt { axes: turn.into_inner(), origin }
    }

    /// The plane of a part that was turned by an angle about an axis of the machine: what is programmed then is where the
    /// part has come to.
    #[must_use]
    pub fn of_turned_part(axis: &Vector3, deg: f64) -> Option<Self> {
        let axis = nalgebra::Unit::try_new(*axis, 1e-9)?;
        let back = Rotation3::from_axis_angle(&axis, -deg.to_radians());
        Some(Tilt { axes: back.into_inner(), origin: Point3::origin() })
    }

    /// The angles of the plane, degrees.
    #[must_use]
    pub fn angles_deg(&self, angles: Angles) -> [f64; 3] {
        let r = |row: usize, column: usize| self.axes[(row, column)];
        let radians = match angles {
            Angles::Xyz => {
                let cosine = r(0, 0).hypot(r(0, 1));
                let second = r(0, 2).atan2(cosine);
                if cosine < ALIGNED {
                    [0.0, second, r(1, 0).atan2(r(1, 1))]
                } else {
                    [(-r(1, 2)).atan2(r(2, 2)), second, (-r(0, 1)).atan2(r(0, 0))]
                }
            }
            Angles::SpatialXyz => {
                let cosine = r(0, 0).hypot(r(1, 0));
                let second = (-r(2, 0)).atan2(cosine);
                if cosine < ALIGNED {
                    [(-r(1, 2)).atan2(r(1, 1)), second, 0.0]
                } else {
                    [r(2, 1).atan2(r(2, 2)), second, r(1, 0).atan2(r(0, 0))]
                }
            }
            Angles::Zxz => {
                let sine = r(0, 2).hypot(r(1, 2));
                let second = sine.atan2(r(2, 2));
                if sine < ALIGNED {
                    [r(1, 0).atan2(r(0, 0)), second, 0.0]
                } else {
                    [r(0, 2).atan2(-r(1, 2)), second, r(2, 0).atan2(r(2, 1))]
                }
            }
        };
        // Adding 0 makes 0 of -0.
        radians.map(|a| a.to_degrees() + 0.0)
    }

    /// From the plane's coordinates to those in which the part stands.
    #[must_use]
    pub fn to_standing(&self, p: &Point3) -> Point3 {
        self.origin + self.axes * p.coords
    }

    /// The plane's x, y and z, in the coordinates in which the part stands.
    #[must_use]
    pub fn axes(&self) -> [Vector3; 3] {
        [0, 1, 2].map(|k| self.axes.column(k).into_owned())
    }

    /// Whether it is no tilt at all.
    #[must_use]
    pub fn is_none(&self) -> bool {
        self.axes == Matrix3::identity() && self.origin == Point3::origin()
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Quaternion, UnitQuaternion};
    use proptest::prelude::*;

    use super::*;

    const ALL: [Angles; 3] = [Angles::Xyz, Angles::SpatialXyz, Angles::Zxz];

    /// The matrix of a quaternion of integers, entry by entry.
    fn tilt_of(quaternion: [i64; 4]) -> Tilt {
        let [a, b, c, d] = quaternion.map(|q| q as f64);
        let n = a * a + b * b + c * c + d * d;
        let x = Vector3::new(a * a + b * b - c * c - d * d, 2.0 * (b * c + a * d), 2.0 * (b * d - a * c)) / n;
        let y = Vector3::new(2.0 * (b * c - a * d), a * a - b * b + c * c - d * d, 2.0 * (c * d + a * b)) / n;
        Tilt::new([x, y, x.cross(&y)], Point3::origin()).unwrap()
    }

    /// A second derivation: quaternions of the single turns, multiplied.
    fn quaternion_by(angles: Angles, deg: [f64; 3]) -> UnitQuaternion<f64> {
        let about = |axis: [f64; 3], deg: f64| {
            let half = 0.5 * deg.to_radians();
            let [x, y, z] = axis.map(|c| c * half.sin());
            Quaternion::new(half.cos(), x, y, z)
        };
        let [x, y, z] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let [a, b, c] = deg;
        UnitQuaternion::from_quaternion(match angles {
            Angles::Xyz => about(x, a) * about(y, b) * about(z, c),
            Angles::SpatialXyz => about(z, c) * about(y, b) * about(x, a),
            Angles::Zxz => about(z, a) * about(x, b) * about(z, c),
        })
    }

    fn check(quaternion: [i64; 4]) {
        let tilt = tilt_of(quaternion);
        let [a, b, c, d] = quaternion.map(|q| q as f64);
        let whole = UnitQuaternion::from_quaternion(Quaternion::new(a, b, c, d));
        for angles in ALL {
            let deg = tilt.angles_deg(angles);
            let again = Tilt::by(angles, deg, Point3::origin());
            let far = (again.axes - tilt.axes).amax();
            assert!(far < 1e-9, "{quaternion:?} {angles:?} {deg:?}: {far}");
            let other = quaternion_by(angles, deg).to_rotation_matrix().into_inner();
            let far = (other - whole.to_rotation_matrix().into_inner()).amax();
            assert!(far < 1e-9, "{quaternion:?} {angles:?} {deg:?}: {far} by quaternions");
        }
        // Half angles of Euler's turns, straight from the quaternion.
        let [first, second, third] = tilt.angles_deg(Angles::Zxz);
        if second > 1e-3 && second < 179.999 {
            let [sum, difference] = [d.atan2(a), c.atan2(b)];
            let same = |deg: f64, radians: f64| ((deg.to_radians() - radians).sin()).abs() < 1e-9;
            assert!(same(first, sum + difference) && same(third, sum - difference), "{quaternion:?}");
            assert!((second.to_radians() - 2.0 * b.hypot(c).atan2(a.hypot(d))).abs() < 1e-9);
        }
    }

    proptest! {
        #[test]
        fn angles_give_the_turn_of_the_quaternion_again(
            q in [-1_000_000_000..1_000_000_000_i64, -1_000_000_000..1_000_000_000_i64,
                  -1_000_000_000..1_000_000_000_i64, -1_000_000_000..1_000_000_000_i64]
        ) {
            prop_assume!(q != [0; 4]);
            check(q);
        }

        /// Near and in the places where two of the turns are about one axis.
        #[test]
        fn small_quaternions_do_too(q in [-3..4_i64, -3..4_i64, -3..4_i64, -3..4_i64], near in -2..3_i64) {
            prop_assume!(q != [0; 4]);
            check(q);
            check([q[0] * 300_000_000 + near, q[1] * 300_000_000, q[2] * 300_000_000, q[3] * 300_000_000 + near]);
        }
    }

    /// The direction (½, ½, √½) leans 45° from upright towards 45° between x and y.
    #[test]
    fn a_known_direction_has_the_angles_worked_out_by_hand() {
        let s = std::f64::consts::FRAC_1_SQRT_2;
        let z = Vector3::new(0.5, 0.5, s);
        let x = (Vector3::x() - z * z.x).normalize();
        let tilt = Tilt::new([x, z.cross(&x), z], Point3::origin()).unwrap();
        let [precession, lean, _] = tilt.angles_deg(Angles::Zxz);
        approx::assert_abs_diff_eq!(lean, 45.0, epsilon = 1e-9);
        // The line of nodes is across the lean: 45° + 90°.
        approx::assert_abs_diff_eq!(precession, 135.0, epsilon = 1e-9);
        // x runs as near to the machine's x as it can, so y has no x: the last turn about z is none.
        let [a, b, c] = tilt.angles_deg(Angles::Xyz);
        approx::assert_abs_diff_eq!(b, 30.0, epsilon = 1e-9);
        approx::assert_abs_diff_eq!(a, -(0.5_f64).atan2(s).to_degrees(), epsilon = 1e-9);
        approx::assert_abs_diff_eq!(c, 0.0, epsilon = 1e-9);
    }

    #[test]
    fn a_turned_part_stands_where_the_turn_takes_it() {
        // The table turns the part by +90° about x: what was along y is up then.
        let tilt = Tilt::of_turned_part(&Vector3::x(), 90.0).unwrap();
        let standing = tilt.to_standing(&Point3::new(1.0, 0.0, 5.0));
        assert!((standing - Point3::new(1.0, 5.0, 0.0)).norm() < 1e-12, "{standing}");
    }
}
