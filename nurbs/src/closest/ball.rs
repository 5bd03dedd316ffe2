//! The largest ball that touches the model at a point and enters no face.

use super::ClosestPoints;
use crate::{Point3, Vector3};

/// Steps of shrinking; it ends after a few.
const SHRINKINGS: usize = 40;

impl ClosestPoints<'_> {
    /// Radius of the largest ball that touches at `p`, with its centre along the unit vector `normal`, and enters no face by more
    /// than `entered_mm`: at most `most_mm`. Below `least_mm` it need not be the largest.
    ///
    /// The ball shrinks to the one through `p` and the nearest point that it enters, until there is none (Ma, Bae and Choi,
    /// "3D medial axis point approximation using nearest neighbors and the normal field", 2012).
    #[must_use]
    pub fn largest_ball_mm(
        &self,
        p: &Point3,
        normal: &Vector3,
        [least_mm, most_mm]: [f64; 2],
        entered_mm: f64,
    ) -> f64 {
        let mut fits_mm = most_mm;
        for _ in 0..SHRINKINGS {
            if fits_mm <= entered_mm {
                break;
            }
            let Some(entered) = self.closest(&(p + normal * fits_mm), fits_mm - entered_mm) else { break };
            let to = entered.point - p;
            let rise = to.dot(normal);
            let smaller_mm = 0.5 * to.norm_squared() / rise;
            // What is entered right beside `p` is curved as tightly as the ball.
            if rise <= 0.0 || smaller_mm >= fits_mm {
                break;
            }
            fits_mm = smaller_mm;
            if fits_mm < least_mm {
                break;
            }
        }
        fits_mm
    }
}

#[cfg(test)]
mod tests {
    use crate::analytic::{Frame, plane_patch};
    use crate::{ClosestPoints, Face, Model, Point3, Source, SurfaceKind, Vector3};

    #[test]
    fn between_two_plates_half_their_distance_fits() {
        let plate = |z: f64| {
            let at = Frame::new(Point3::new(0.0, 0.0, z), Vector3::z(), Vector3::x()).unwrap();
            Face {
                surface: plane_patch(&at, (-50.0, 50.0), (-50.0, 50.0)).unwrap(),
                loops: Vec::new(),
                reversed: false,
                kind: SurfaceKind::Plane,
                source: Source::default(),
            }
        };
        let model = Model { faces: vec![plate(0.0), plate(12.0)], ..Model::default() };
        let closest = ClosestPoints::new(&model);
        let fits =
            |most_mm: f64| closest.largest_ball_mm(&Point3::origin(), &Vector3::z(), [0.0, most_mm], 1e-3);
        approx::assert_abs_diff_eq!(fits(40.0), 6.0, epsilon = 1e-3);
        approx::assert_abs_diff_eq!(fits(4.0), 4.0, epsilon = 1e-12);
    }
}
