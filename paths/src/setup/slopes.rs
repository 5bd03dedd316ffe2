//! Steep and shallow parts of a surface, with an overlap.

use claymill_nurbs::{Jet, Vector3};

/// Which slopes are cut. A place belongs to both sides of the limit when a step-over away from it the surface is on the
/// other one, so that the passes of both overlap by as much and no ridge is left between them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Slopes {
    All,
    /// Those that lean further from the tool axis than the limit.
    Steeper(Limit),
    /// Those that lean less.
    Shallower(Limit),
}

/// A slope with an overlap.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Limit {
    /// `n·axis` of the slope.
    cosine: f64,
    overlap_mm: f64,
}

impl Limit {
    pub(crate) fn new(angle_deg: f64, overlap_mm: f64) -> Self {
        Limit { cosine: angle_deg.to_radians().cos(), overlap_mm }
    }

    /// How far `n·axis` is above the limit at a place given in the setup's coordinates, and by how much it changes
    /// over the overlap.
    fn above(&self, jet: &Jet) -> Option<(f64, f64)> {
        let mut n = jet.normal()?;
        if n.z < 0.0 {
            n = -n;
        }
        let change = bend_of_axis(jet, &n)?.norm() * self.overlap_mm;
        Some((n.z - self.cosine, change))
    }
}

impl Slopes {
    /// Positive where the slope is cut, negative elsewhere.
    pub(crate) fn inside(&self, jet: &Jet) -> f64 {
        let signed = match self {
            Slopes::All => return 1.0,
            Slopes::Steeper(limit) => limit.above(jet).map(|(above, change)| change - above),
            Slopes::Shallower(limit) => limit.above(jet).map(|(above, change)| change + above),
        };
        // Where the surface is singular nobody knows: passes of both sides may run there.
        signed.unwrap_or(1.0)
    }

    pub(crate) fn hold(&self, jet: &Jet) -> bool {
        self.inside(jet) >= 0.0
    }
}

/// The shape operator on the tool axis: `−W·axis`, by which `n·axis` changes for a millimetre along the surface.
fn bend_of_axis(jet: &Jet, n: &Vector3) -> Option<Vector3> {
    let forms = jet.curvature(n);
    let bent = forms.first.try_inverse()? * forms.second * jet.tangent_coordinates(&Vector3::z())?;
    Some(-(jet.su * bent.x + jet.sv * bent.y))
}

/// How far up the ball's centre comes for a millimetre along the surface that it touches, at most:
/// `|(1 − R·W)·axis|` over the part of the axis along the surface.
pub(crate) fn climb(jet: &Jet, n: &Vector3, radius_mm: f64) -> Option<f64> {
    let along = Vector3::z() - n * n.z;
    Some((along + bend_of_axis(jet, n)? * radius_mm).norm())
}

#[cfg(test)]
mod tests {
    use claymill_nurbs::Point3;
    use claymill_nurbs::analytic::{Frame, sphere};
    use std::f64::consts::{PI, TAU};

    use super::*;

    fn ball() -> claymill_nurbs::NurbsSurface {
        let frame = Frame::new(Point3::origin(), Vector3::z(), Vector3::x()).unwrap();
        sphere(&frame, 50.0, (0.0, TAU), (-0.5 * PI, 0.5 * PI)).unwrap()
    }

    #[test]
    fn both_sides_of_a_limit_overlap_by_the_overlap() {
        let surface = ball();
        let (_, (v0, v1)) = surface.domain();
        let limit = Limit::new(45.0, 2.0);
        // On a sphere of 50 mm the slope is the polar angle: 2 mm are 0.04 rad.
        let at = |slope: f64| {
            let z = 50.0 * slope.cos();
            let (mut low, mut high) = (0.5 * (v0 + v1), v1);
            for _ in 0..60 {
                let middle = 0.5 * (low + high);
                *(if surface.point(0.0, middle).z < z { &mut low } else { &mut high }) = middle;
            }
            surface.jet(0.1, low)
        };
        let middle = 45f64.to_radians();
        for (slope, steep, shallow) in [
            (middle - 0.042, false, true),
            (middle - 0.038, true, true),
            (middle, true, true),
            (middle + 0.038, true, true),
            (middle + 0.042, true, false),
        ] {
            assert_eq!(Slopes::Steeper(limit).hold(&at(slope)), steep, "{slope}");
            assert_eq!(Slopes::Shallower(limit).hold(&at(slope)), shallow, "{slope}");
            assert!(Slopes::All.hold(&at(slope)));
        }
    }

    #[test]
    fn the_centre_climbs_as_on_the_offset_sphere() {
        let surface = ball();
        let jet = surface.jet(0.3, 0.7 * surface.domain().1.1);
        let n = jet.normal().unwrap();
        let sine = (1.0 - n.z * n.z).sqrt();
        approx::assert_relative_eq!(climb(&jet, &n, 10.0).unwrap(), sine * 1.2, max_relative = 1e-9);
    }
}
