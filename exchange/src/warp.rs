//! From a file's parameters to those of the exact NURBS.
//!
//! Rhino's archives and IGES run along arcs and round surfaces of revolution by angle; a rational quadratic cannot. The two
//! agree where its pieces meet and differ a little in between (see
//! [`claymill_nurbs::analytic::ArcParameter`]). Elsewhere the parameters are the same.

use claymill_nurbs::{Curve2, NurbsError, NurbsSurface, Point2, Vector3};

use crate::hermite;
use crate::subcurve::mapped;
use crate::trim::pace;

/// A pcurve in other parameters stays this close to the file's on the surface, mm.
const FOLLOWED_MM: f64 = 1e-5;

/// A curve's map of parameters: the identity but for arcs.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Warp {
    /// In order of parameters.
    arcs: Vec<Arc>,
}

/// One rational quadratic piece, symmetric about its middle.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Arc {
    from: f64,
    to: f64,
    half_angle: f64,
}

impl Warp {
    /// The map of an arc of `angle` radians whose pieces meet at `joints`.
    pub(crate) fn of_arc(joints: &[f64], angle: f64) -> Self {
        let pieces = joints.len().saturating_sub(1).max(1);
        let half_angle = 0.5 * angle / pieces as f64;
        let piece = |w: &[f64]| Arc { from: w[0], to: w[1], half_angle };
        Warp { arcs: joints.windows(2).map(piece).collect() }
    }

    pub(crate) fn is_identity(&self) -> bool {
        self.arcs.is_empty()
    }

    /// The map of a curve whose domain `from` was laid onto `to`.
    pub(crate) fn moved(&self, from: (f64, f64), to: (f64, f64)) -> Self {
        let at = |t: f64| to.0 + (t - from.0) * ((to.1 - to.0) / (from.1 - from.0));
        let arc = |a: &Arc| Arc { from: at(a.from), to: at(a.to), ..*a };
        Warp { arcs: self.arcs.iter().map(arc).collect() }
    }

    /// Appends the map of the curve that follows.
    pub(crate) fn extend(&mut self, next: Warp) {
        self.arcs.extend(next.arcs);
    }

    /// The NURBS parameter at the file's `t`, and its derivative.
    pub(crate) fn at(&self, t: f64) -> (f64, f64) {
        let behind = self.arcs.partition_point(|a| a.to < t);
        // Parameters that miss an arc at either end by rounding belong to it as well.
        let Some(arc) = self.arcs.get(behind).filter(|a| a.from <= t) else { return (t, 1.0) };
        let (middle, half) = (0.5 * (arc.from + arc.to), 0.5 * (arc.to - arc.from));
        let (x, whole) = (0.5 * arc.half_angle * (t - middle) / half, (0.5 * arc.half_angle).tan());
        let slope = 0.5 * arc.half_angle / (x.cos() * x.cos() * whole);
        ((middle + half * x.tan() / whole).clamp(arc.from, arc.to), slope)
    }
}

/// A pcurve in the file's parameters of a surface as one in those of its NURBS `surface`, to within
/// [`FOLLOWED_MM`] on the surface; exact along parameter lines.
pub(crate) fn pcurve(surface: &NurbsSurface, warps: &[Warp; 2], curve: Curve2) -> Result<Curve2, NurbsError> {
    if warps.iter().all(Warp::is_identity) {
        return Ok(curve);
    }
    let [u, v] = warps;
    let points = curve.points();
    let axial = points.iter().all(|p| p.x == points[0].x) || points.iter().all(|p| p.y == points[0].y);
    if axial && curve.knots().degree() == 1 {
        return mapped(&curve, |p| Point2::new(u.at(p.x).0, v.at(p.y).0));
    }
    // Followed in millimetres at the surface's largest pace, so that the tolerance is one in space.
    let [pace_u, pace_v] = pace(surface).map(|p| p.max(f64::MIN_POSITIVE.sqrt()));
    let followed = hermite::fitted(&curve.knots().breaks(), FOLLOWED_MM, |t| {
        let [p, slope, _] = curve.derivatives(t);
        let ((x, dx), (y, dy)) = (u.at(p.x), v.at(p.y));
        [
            Vector3::new(x * pace_u, y * pace_v, 0.0),
            Vector3::new(dx * slope.x * pace_u, dy * slope.y * pace_v, 0.0),
        ]
    })?;
    mapped(&followed.0, |p| Point2::new(p.x / pace_u, p.y / pace_v))
}

#[cfg(test)]
mod tests {
    use super::*;
    use claymill_nurbs::analytic::{self, ArcParameter, Frame};
    use claymill_nurbs::{KnotVector, Point3};
    use std::f64::consts::TAU;

    #[test]
    fn the_map_is_that_of_the_kernel_and_its_slope_is_right() {
        for (from, to) in [(0.0, TAU), (0.3, 2.9), (-1.0, 0.4)] {
            let arc = ArcParameter::new(from, to).unwrap();
            let frame = Frame::new(Point3::origin(), Vector3::z(), Vector3::x()).unwrap();
            let curve = analytic::circle_arc(&frame, 1.0, (from, to)).unwrap();
            let warp = Warp::of_arc(&curve.knots().breaks(), to - from);
            for i in 0..=100 {
                let t = from + (to - from) * f64::from(i) / 100.0;
                approx::assert_abs_diff_eq!(warp.at(t).0, arc.at_angle(t), epsilon = 1e-12);
            }
            let (t, h) = (from + 0.37 * (to - from), 1e-6);
            let difference = (warp.at(t + h).0 - warp.at(t - h).0) / (2.0 * h);
            approx::assert_abs_diff_eq!(warp.at(t).1, difference, epsilon = 1e-8);
        }
        assert_eq!(Warp::default().at(0.3), (0.3, 1.0));
    }

    #[test]
    fn a_slanted_pcurve_on_a_cylinder_stays_where_it_was() {
        let frame = Frame::new(Point3::new(1.0, 2.0, 3.0), Vector3::z(), Vector3::x()).unwrap();
        let surface = analytic::cylinder(&frame, 20.0, (0.0, TAU), (0.0, 10.0)).unwrap();
        let warps = [Warp::of_arc(&surface.knots_u().breaks(), TAU), Warp::default()];
        let knots = KnotVector::clamped_uniform(2, 3);
        let points = vec![Point2::new(0.4, 1.0), Point2::new(3.0, 9.0), Point2::new(5.5, 2.0)];
        let slanted = Curve2::new(knots, points, None).unwrap();
        let warped = pcurve(&surface, &warps, slanted.clone()).unwrap();
        for i in 0..=200 {
            let t = f64::from(i) / 200.0;
            let (angles, p) = (slanted.point(t), warped.point(t));
            let on_cylinder = frame.point(20.0 * angles.x.cos(), 20.0 * angles.x.sin(), angles.y);
            assert!((surface.point(p.x, p.y) - on_cylinder).norm() < 2e-5, "{t}");
        }
    }
}
