//! Analytic curves and surfaces as exact rational NURBS (The NURBS Book, chapters 7 and 8).
//!
//! Angles are in radians. A rational quadratic arc cannot be parametrised by its angle; here its knots are
//! placed at the angles where its pieces meet, so that parameter and angle agree there and differ by less
//! than 0.02 in between, and [`ArcParameter`] converts exactly between the two.

use std::f64::consts::FRAC_PI_2;

use nalgebra::Rotation3;

use crate::{Curve3, KnotVector, NurbsError, NurbsSurface, Point3, Vector3};

/// A right-handed frame: an origin and three orthogonal unit axes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Frame {
    /// Origin, mm.
    pub origin: Point3,
    /// Where angles start.
    pub x: Vector3,
    /// `z × x`.
    pub y: Vector3,
    /// The axis.
    pub z: Vector3,
}

impl Frame {
    /// The frame with axis `z` and `x` as near to `x_hint` as can be; any perpendicular `x` when the hint
    /// is parallel to the axis. `None` when `z` is zero or not finite.
    #[must_use]
    pub fn new(origin: Point3, z: Vector3, x_hint: Vector3) -> Option<Self> {
        let z = z.try_normalize(0.0).filter(|z| z.iter().all(|c| c.is_finite()))?;
        let across = |hint: Vector3| {
            let hint = hint.try_normalize(0.0)?;
            // Hints within a millionth of the axis say nothing about a direction across it.
            (hint - z * hint.dot(&z)).try_normalize(1e-6)
        };
        let x = across(x_hint).or_else(|| across(Vector3::ith(z.iamin(), 1.0)))?;
        Some(Frame { origin, x, y: z.cross(&x), z })
    }

    /// Coordinates of `p` in this frame.
    #[must_use]
    pub fn local(&self, p: &Point3) -> Point3 {
        let d = p - self.origin;
        Point3::new(d.dot(&self.x), d.dot(&self.y), d.dot(&self.z))
    }

    /// The point with the coordinates `(x, y, z)` in this frame.
    #[must_use]
    pub fn point(&self, x: f64, y: f64, z: f64) -> Point3 {
        self.origin + self.x * x + self.y * y + self.z * z
    }
}

/// Exact map between the angle of an arc and the parameter of its rational quadratic form.
///
/// The range is cut into equal pieces of at most a quarter turn. On a piece of half-angle `φ` around its
/// middle angle `m`, `tan((θ − m) / 2) = x · tan(φ / 2)` where `x ∈ [−1, 1]` runs linearly with the parameter:
/// both sides are linear fractional in the parameter, odd about the middle and equal at the ends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ArcParameter {
    from: f64,
    piece: f64,
    count: usize,
}

/// More turns than this in one arc are refused as damaged data: faces run round once at most, and one that is laid
/// out across a seam reaches a part of a turn further.
const MOST_TURNS: f64 = 2.0;

impl ArcParameter {
    /// The arc from angle `from` to angle `to`, radians, `from < to`.
    ///
    /// # Errors
    /// An empty, reversed, non-finite or absurdly long range.
    pub fn new(from: f64, to: f64) -> Result<Self, NurbsError> {
        let quarters = (to - from) / FRAC_PI_2;
        if !(quarters > 0.0 && quarters <= 4.0 * MOST_TURNS && from.is_finite()) {
            return Err(NurbsError::KnotMultiplicity);
        }
        // A quarter turn that misses by rounding is still one piece.
        let count = (quarters - 1e-9).ceil().max(1.0);
        Ok(ArcParameter { from, piece: (to - from) / count, count: count as usize })
    }

    /// The parameter of the point at angle `theta`; the map continues periodically outside the range.
    #[must_use]
    pub fn at_angle(&self, theta: f64) -> f64 {
        let start = self.from + self.piece * ((theta - self.from) / self.piece).floor();
        let from_middle = theta - start - 0.5 * self.piece;
        let x = (0.5 * from_middle).tan() / (0.25 * self.piece).tan();
        start + 0.5 * self.piece * (1.0 + x)
    }

    /// The angle of the point at parameter `t`: the inverse of [`Self::at_angle`].
    #[must_use]
    pub fn angle(&self, t: f64) -> f64 {
        let start = self.from + self.piece * ((t - self.from) / self.piece).floor();
        let x = 2.0 * (t - start) / self.piece - 1.0;
        start + 0.5 * self.piece + 2.0 * (x * (0.25 * self.piece).tan()).atan()
    }

    fn knots(&self) -> Result<KnotVector, NurbsError> {
        let joints = (0..=self.count).map(|i| self.from + self.piece * i as f64);
        let mut knots: Vec<f64> = joints.flat_map(|k| [k, k]).collect();
        knots.insert(0, knots[0]);
        knots.push(knots[knots.len() - 1]);
        KnotVector::new(2, knots)
    }

    /// Angle, distance factor and weight of each control point of the unit arc.
    fn control_polygon(&self) -> impl Iterator<Item = (f64, f64, f64)> + use<> {
        let ArcParameter { from, piece, count } = *self;
        let middle = (0.5 * piece).cos();
        (0..=2 * count).map(move |i| {
            let angle = from + 0.5 * piece * i as f64;
            let (reach, weight) = if i % 2 == 0 { (1.0, 1.0) } else { (1.0 / middle, middle) };
            (angle, reach, weight)
        })
    }
}

/// The segment from `a` at parameter `t0` to `b` at parameter `t1`.
///
/// # Errors
/// `t0 < t1` does not hold, or a number is not finite.
pub fn segment(a: Point3, b: Point3, (t0, t1): (f64, f64)) -> Result<Curve3, NurbsError> {
    Curve3::new(KnotVector::new(1, vec![t0, t0, t1, t1])?, vec![a, b], None)
}

/// The arc `o + r (cos θ · x + sin θ · y)` for `θ` from `from` to `to`; see [`ArcParameter`].
///
/// # Errors
/// As [`ArcParameter::new`].
pub fn circle_arc(frame: &Frame, radius_mm: f64, (from, to): (f64, f64)) -> Result<Curve3, NurbsError> {
    ellipse_arc(frame, radius_mm, radius_mm, (from, to))
}

/// The arc `o + a cos θ · x + b sin θ · y` for `θ` (the eccentric angle) from `from` to `to`.
///
/// # Errors
/// As [`ArcParameter::new`].
pub fn ellipse_arc(
    frame: &Frame,
    a_mm: f64,
    b_mm: f64,
    (from, to): (f64, f64),
) -> Result<Curve3, NurbsError> {
    let arc = ArcParameter::new(from, to)?;
    let (points, weights) = arc
        .control_polygon()
        .map(|(t, reach, w)| (frame.point(a_mm * reach * t.cos(), b_mm * reach * t.sin(), 0.0), w))
        .unzip();
    Curve3::new(arc.knots()?, points, Some(weights))
}

/// The parabola `o + f t² · x + 2 f t · y` for `t` from `t0` to `t1`; the parameter is `t`.
///
/// # Errors
/// An empty range.
pub fn parabola_arc(frame: &Frame, focal_mm: f64, (t0, t1): (f64, f64)) -> Result<Curve3, NurbsError> {
    // The blossom of t² at (a, b) is a b, that of t the mean.
    let at = |a: f64, b: f64| frame.point(focal_mm * a * b, focal_mm * (a + b), 0.0);
    let knots = KnotVector::new(2, vec![t0, t0, t0, t1, t1, t1])?;
    Curve3::new(knots, vec![at(t0, t0), at(t0, t1), at(t1, t1)], None)
}

/// A rational quadratic piece of a hyperbola is no longer than this in `t`: weights stay moderate.
const LONGEST_HYPERBOLA: f64 = 2.0;

/// The branch `o + a cosh t · x + b sinh t · y` for `t` from `t0` to `t1`, in rational quadratic pieces of equal
/// length in `t`; parameter and `t` agree where the pieces meet.
///
/// # Errors
/// An empty or absurdly long range.
pub fn hyperbola_arc(
    frame: &Frame,
    a_mm: f64,
    b_mm: f64,
    (t0, t1): (f64, f64),
) -> Result<Curve3, NurbsError> {
    let length = t1 - t0;
    // cosh 40 is 1e17: no coordinate of use lies there.
    if !(length > 0.0 && t0.abs().max(t1.abs()) < 40.0) {
        return Err(NurbsError::KnotMultiplicity);
    }
    let pieces = (length / LONGEST_HYPERBOLA).ceil().max(1.0);
    let half = 0.5 * length / pieces;
    let (mut knots, mut points, mut weights) = (vec![t0], Vec::new(), Vec::new());
    for i in 0..=2 * pieces as usize {
        let t = t0 + half * i as f64;
        // The tangents at both ends of a piece meet on the ray through its middle.
        let (reach, weight) = if i % 2 == 0 { (1.0, 1.0) } else { (1.0 / half.cosh(), half.cosh()) };
        points.push(frame.point(a_mm * reach * t.cosh(), b_mm * reach * t.sinh(), 0.0));
        weights.push(weight);
        if i % 2 == 0 {
            let knot = if i == 2 * pieces as usize { t1 } else { t };
            knots.extend([knot; 2]);
        }
    }
    knots.push(t1);
    Curve3::new(KnotVector::new(2, knots)?, points, Some(weights))
}

/// The rectangle `o + u · x + v · y`; parameters are millimetres.
///
/// # Errors
/// An empty range.
pub fn plane_patch(frame: &Frame, (u0, u1): (f64, f64), v: (f64, f64)) -> Result<NurbsSurface, NurbsError> {
    let base = segment(frame.point(u0, 0.0, 0.0), frame.point(u1, 0.0, 0.0), (u0, u1))?;
    extrusion(&base, &frame.y, v)
}

/// `C(u) + v · direction` for `v` in the range given.
///
/// # Errors
/// An empty range.
pub fn extrusion(
    curve: &Curve3,
    direction: &Vector3,
    (v0, v1): (f64, f64),
) -> Result<NurbsSurface, NurbsError> {
    let shift = |p: &Point3| [p + direction * v0, p + direction * v1];
    NurbsSurface::new(
        curve.knots().clone(),
        KnotVector::new(1, vec![v0, v0, v1, v1])?,
        curve.points().iter().flat_map(shift).collect(),
        curve.weights().map(|w| w.iter().flat_map(|w| [*w, *w]).collect()),
    )
}

/// The surface swept by turning `curve` about the axis through `origin`, by angles `from` to `to`:
/// `u` is the angle (see [`ArcParameter`]), `v` the curve's parameter.
///
/// # Errors
/// A zero axis, or as [`ArcParameter::new`].
pub fn revolution(
    curve: &Curve3,
    origin: &Point3,
    axis: &Vector3,
    (from, to): (f64, f64),
) -> Result<NurbsSurface, NurbsError> {
    let arc = ArcParameter::new(from, to)?;
    let axis = nalgebra::Unit::try_new(*axis, 0.0).ok_or(NurbsError::NotFinite { what: "axis", index: 0 })?;
    let count = curve.points().len();
    let mut points = Vec::with_capacity(count * (2 * arc.count + 1));
    let mut weights = Vec::with_capacity(points.capacity());
    for (angle, reach, weight) in arc.control_polygon() {
        let turn = Rotation3::from_axis_angle(&axis, angle);
        for (i, p) in curve.points().iter().enumerate() {
            let d = p - origin;
            let along = axis.scale(d.dot(&axis));
            points.push(origin + along + turn * (d - along) * reach);
            weights.push(weight * curve.weights().map_or(1.0, |w| w[i]));
        }
    }
    NurbsSurface::new(arc.knots()?, curve.knots().clone(), points, Some(weights))
}

/// `o + r (cos u · x + sin u · y) + v · z`: `u` as in [`ArcParameter`], `v` the height.
///
/// # Errors
/// An empty range.
pub fn cylinder(
    frame: &Frame,
    radius_mm: f64,
    angles: (f64, f64),
    heights: (f64, f64),
) -> Result<NurbsSurface, NurbsError> {
    cone(frame, radius_mm, 0.0, angles, heights)
}

/// `o + (r + v · tan α)(cos u · x + sin u · y) + v · z`: `v` is the height, `α` the half-angle.
///
/// # Errors
/// An empty range, or a half-angle of a right angle or more.
pub fn cone(
    frame: &Frame,
    radius_mm: f64,
    half_angle: f64,
    angles: (f64, f64),
    (v0, v1): (f64, f64),
) -> Result<NurbsSurface, NurbsError> {
    let slope = half_angle.tan();
    let at = |v: f64| frame.point(radius_mm + v * slope, 0.0, v);
    revolution(&segment(at(v0), at(v1), (v0, v1))?, &frame.origin, &frame.z, angles)
}

/// `o + r cos v (cos u · x + sin u · y) + r sin v · z`: longitudes `u`, latitudes `v` within ±π/2, both as in
/// [`ArcParameter`].
///
/// # Errors
/// An empty range.
pub fn sphere(
    frame: &Frame,
    radius_mm: f64,
    longitudes: (f64, f64),
    latitudes: (f64, f64),
) -> Result<NurbsSurface, NurbsError> {
    torus(frame, 0.0, radius_mm, longitudes, latitudes)
}

/// `o + (R + r cos v)(cos u · x + sin u · y) + r sin v · z`: `u` around the axis, `v` around the tube.
///
/// # Errors
/// An empty range.
pub fn torus(
    frame: &Frame,
    major_mm: f64,
    minor_mm: f64,
    around_axis: (f64, f64),
    around_tube: (f64, f64),
) -> Result<NurbsSurface, NurbsError> {
    let tube = Frame { origin: frame.point(major_mm, 0.0, 0.0), x: frame.x, y: frame.z, z: -frame.y };
    let meridian = circle_arc(&tube, minor_mm, around_tube)?;
    revolution(&meridian, &frame.origin, &frame.z, around_axis)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::{PI, TAU};

    fn tilted() -> Frame {
        Frame::new(Point3::new(3.0, -2.0, 7.0), Vector3::new(1.0, 2.0, -0.5), Vector3::new(0.3, 0.1, 1.0))
            .unwrap()
    }

    /// Checks `surface` against its formula in angles: `u` (and `v` when given) are turned into parameters.
    fn matches(
        surface: &NurbsSurface,
        u: ArcParameter,
        v: Option<ArcParameter>,
        formula: impl Fn(f64, f64) -> Point3,
    ) {
        let ((u0, u1), (v0, v1)) = surface.domain();
        for i in 0..=13 {
            for j in 0..=11 {
                let (a, b) = (u0 + (u1 - u0) * f64::from(i) / 13.0, v0 + (v1 - v0) * f64::from(j) / 11.0);
                let p = surface.point(u.at_angle(a), v.map_or(b, |v| v.at_angle(b)));
                approx::assert_abs_diff_eq!(p, formula(a, b), epsilon = 1e-12);
            }
        }
    }

    #[test]
    fn angle_and_parameter_are_inverse_agree_at_the_joints_and_stay_close() {
        for (from, to) in [(0.0, TAU), (-0.3, 0.2), (1.0, 4.0), (5.0, 5.0 + 3.0 * PI)] {
            let arc = ArcParameter::new(from, to).unwrap();
            for i in 0..=100 {
                let angle = from + (to - from) * f64::from(i) / 100.0;
                let t = arc.at_angle(angle);
                approx::assert_abs_diff_eq!(arc.angle(t), angle, epsilon = 1e-13);
                assert!((t - angle).abs() < 0.02, "{t} is far from {angle}");
            }
            approx::assert_abs_diff_eq!(arc.at_angle(to), to, epsilon = 1e-13);
        }
        assert!(ArcParameter::new(1.0, 1.0).is_err());
        assert!(ArcParameter::new(0.0, f64::NAN).is_err());
        assert!(ArcParameter::new(0.0, 1e9).is_err());
    }

    #[test]
    fn arcs_follow_their_angle() {
        let f = tilted();
        for (from, to) in [(0.0, TAU), (0.4, 0.9), (-2.0, 3.5)] {
            let (arc, ellipse) =
                (ArcParameter::new(from, to).unwrap(), ellipse_arc(&f, 4.0, 1.5, (from, to)).unwrap());
            for i in 0..=50 {
                let a = from + (to - from) * f64::from(i) / 50.0;
                let expected = f.point(4.0 * a.cos(), 1.5 * a.sin(), 0.0);
                approx::assert_abs_diff_eq!(ellipse.point(arc.at_angle(a)), expected, epsilon = 1e-13);
            }
        }
    }

    #[test]
    fn open_conics_satisfy_their_equations() {
        let f = tilted();
        let range = (-1.5, 2.75);
        let parabola = parabola_arc(&f, 3.0, range).unwrap();
        let hyperbola = hyperbola_arc(&f, 4.0, 1.5, range).unwrap();
        for i in 0..=40 {
            let t = range.0 + (range.1 - range.0) * f64::from(i) / 40.0;
            approx::assert_abs_diff_eq!(
                parabola.point(t),
                f.point(3.0 * t * t, 6.0 * t, 0.0),
                epsilon = 1e-12
            );
            let l = f.local(&hyperbola.point(t));
            approx::assert_relative_eq!((l.x / 4.0).powi(2) - (l.y / 1.5).powi(2), 1.0, epsilon = 1e-10);
            assert!(l.x > 0.0 && ((l.y / 1.5).asinh() - t).abs() < 0.2);
        }
        let ends = [hyperbola.start(), hyperbola.end()].map(|p| (f.local(&p).y / 1.5).asinh());
        approx::assert_abs_diff_eq!(ends.as_slice(), [range.0, range.1].as_slice(), epsilon = 1e-12);
        assert!(hyperbola_arc(&f, 4.0, 1.5, (0.0, 1e6)).is_err());
    }

    #[test]
    fn analytic_surfaces_follow_their_formulas() {
        let f = tilted();
        let angles = (0.3, 5.1);
        let u = ArcParameter::new(angles.0, angles.1).unwrap();
        let ring = |r: f64, u: f64, z: f64| f.point(r * u.cos(), r * u.sin(), z);

        let s = cylinder(&f, 2.5, angles, (-1.0, 4.0)).unwrap();
        matches(&s, u, None, |u, v| ring(2.5, u, v));
        let s = cone(&f, 2.5, 0.4, angles, (-1.0, 4.0)).unwrap();
        matches(&s, u, None, |u, v| ring(2.5 + v * 0.4_f64.tan(), u, v));
        let v = ArcParameter::new(-PI / 2.0, PI / 2.0).unwrap();
        let s = sphere(&f, 3.0, angles, (-PI / 2.0, PI / 2.0)).unwrap();
        matches(&s, u, Some(v), |u, v| ring(3.0 * v.cos(), u, 3.0 * v.sin()));
        let v = ArcParameter::new(0.5, 6.0).unwrap();
        let s = torus(&f, 5.0, 2.0, angles, (0.5, 6.0)).unwrap();
        matches(&s, u, Some(v), |u, v| ring(5.0 + 2.0 * v.cos(), u, 2.0 * v.sin()));

        let s = plane_patch(&f, (-3.0, 2.0), (1.0, 8.0)).unwrap();
        approx::assert_abs_diff_eq!(s.point(-1.2, 5.5), f.point(-1.2, 5.5, 0.0), epsilon = 1e-13);
        // Outside is where the formulas of ISO 10303-42 put it.
        let outward = cylinder(&f, 2.5, angles, (-1.0, 4.0)).unwrap().jet(0.3, 0.0).normal();
        assert!(outward.unwrap().dot(&(ring(1.0, 0.3, 0.0) - f.origin)) > 0.999);
    }

    #[test]
    fn swept_surfaces_keep_the_curve() {
        let f = tilted();
        let curve = ellipse_arc(&f, 4.0, 1.5, (0.2, 2.0)).unwrap();
        let d = Vector3::new(0.0, 1.0, 3.0);
        let s = extrusion(&curve, &d, (-2.0, 5.0)).unwrap();
        approx::assert_abs_diff_eq!(s.point(0.9, 3.3), curve.point(0.9) + d * 3.3, epsilon = 1e-12);
        let s = revolution(&curve, &Point3::new(1.0, 1.0, 1.0), &d, (0.0, 2.0)).unwrap();
        approx::assert_abs_diff_eq!(s.point(0.0, 0.9), curve.point(0.9), epsilon = 1e-12);
        let distance = |p: Point3| d.normalize().cross(&(p - Point3::new(1.0, 1.0, 1.0))).norm();
        approx::assert_abs_diff_eq!(distance(s.point(1.7, 0.9)), distance(curve.point(0.9)), epsilon = 1e-12);
    }

    #[test]
    fn a_frame_survives_a_useless_hint() {
        let z = Vector3::new(0.0, 0.0, 2.0);
        let f = Frame::new(Point3::origin(), z, z).unwrap();
        approx::assert_abs_diff_eq!(f.x.cross(&f.y), f.z, epsilon = 1e-15);
        assert!(Frame::new(Point3::origin(), Vector3::zeros(), z).is_none());
    }
}
