//! What a block moves along, in machine coordinates: lines, circular arcs in G17, G18 or G19, and
//! NURBS.

use std::f64::consts::{FRAC_PI_2, TAU};

use claymill_nurbs::{Curve3, KnotVector, Point3, Vector3};

/// A plane of the machine's axes, as G17, G18 and G19 choose it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Plane {
    /// G17.
    Xy,
    /// G18.
    Zx,
    /// G19.
    Yz,
}

impl Plane {
    /// All three.
    pub const ALL: [Plane; 3] = [Plane::Xy, Plane::Zx, Plane::Yz];

    /// Indices of the plane's first and second axis (right-handed) and of the third.
    #[must_use]
    pub fn axes(self) -> [usize; 3] {
        match self {
            Plane::Xy => [0, 1, 2],
            Plane::Zx => [2, 0, 1],
            Plane::Yz => [1, 2, 0],
        }
    }

    /// The number behind G.
    #[must_use]
    pub fn g(self) -> u32 {
        match self {
            Plane::Xy => 17,
            Plane::Zx => 18,
            Plane::Yz => 19,
        }
    }
}

/// A circular arc in a plane of two machine axes, no more than a full turn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Arc {
    /// Start, mm.
    pub from: Point3,
    /// End, mm.
    pub to: Point3,
    /// Centre, equally far from both ends, mm.
    pub centre: Point3,
    /// Its plane.
    pub plane: Plane,
    /// G2.
    pub clockwise: bool,
}

/// Ends of an arc may be this much nearer to or farther from the written centre, mm.
pub const ARC_RADIUS_MM: f64 = 0.01;

impl Arc {
    /// An arc about a written centre, whose digits put it a little off: the circle goes through both ends.
    /// `None` where the ends differ in their distance by more than [`ARC_RADIUS_MM`], or the radius is zero.
    #[must_use]
    pub fn through(from: Point3, to: Point3, centre: Point3, plane: Plane, clockwise: bool) -> Option<Self> {
        let [i, j, k] = plane.axes();
        let flat = |p: &Point3| nalgebra::Vector2::new(p[i], p[j]);
        let (a, b, c) = (flat(&from), flat(&to), flat(&centre));
        let (ra, rb) = ((a - c).norm(), (b - c).norm());
        if (ra - rb).abs() > ARC_RADIUS_MM || ra.min(rb) <= 0.0 {
            return None;
        }
        let chord = b - a;
        let mut centred = centre;
        if chord.norm() > 1e-9 {
            let off = (c - (a + b) * 0.5).dot(&chord) / chord.norm_squared();
            let moved = c - chord * off;
            (centred[i], centred[j]) = (moved.x, moved.y);
        }
        centred[k] = from[k];
        Some(Arc { from, to, centre: centred, plane, clockwise })
    }

    /// Radius, mm.
    #[must_use]
    pub fn radius_mm(&self) -> f64 {
        let [i, j, _] = self.plane.axes();
        (self.from[i] - self.centre[i]).hypot(self.from[j] - self.centre[j])
    }

    /// Angle at the start and the signed angle swept.
    fn angles(&self) -> (f64, f64) {
        let [i, j, _] = self.plane.axes();
        let at = |p: &Point3| (p[j] - self.centre[j]).atan2(p[i] - self.centre[i]);
        let (a, b) = (at(&self.from), at(&self.to));
        let turn = (if self.clockwise { a - b } else { b - a }).rem_euclid(TAU);
        let turn = if turn < 1e-12 { TAU } else { turn };
        (a, if self.clockwise { -turn } else { turn })
    }

    /// Angle swept, radians, positive.
    #[must_use]
    pub fn sweep(&self) -> f64 {
        self.angles().1.abs()
    }

    /// The point at `s` in 0..=1.
    #[must_use]
    pub fn point(&self, s: f64) -> Point3 {
        let [i, j, k] = self.plane.axes();
        let (start, sweep) = self.angles();
        let angle = start + sweep * s;
        let mut p = self.from;
        let r = self.radius_mm();
        p[i] = self.centre[i] + r * angle.cos();
        p[j] = self.centre[j] + r * angle.sin();
        p[k] = self.from[k] + (self.to[k] - self.from[k]) * s;
        p
    }

    /// The arc as a rational quadratic, exact (The NURBS Book, section 7.3).
    #[must_use]
    pub fn curve(&self) -> Option<Curve3> {
        let sweep = self.sweep();
        let parts = (sweep / FRAC_PI_2).ceil().clamp(1.0, 4.0) as usize;
        let half = 0.5 * sweep / parts as f64;
        let length = self.length_mm();
        let (mut points, mut weights) = (vec![self.from], vec![1.0]);
        let mut knots = vec![0.0; 3];
        let [i, j, _] = self.plane.axes();
        for part in 0..parts {
            let at = |s: f64| self.point((part as f64 + s) / parts as f64);
            let mut corner = at(0.5);
            for axis in [i, j] {
                corner[axis] = self.centre[axis] + (corner[axis] - self.centre[axis]) / half.cos();
            }
            let end = if part + 1 == parts { self.to } else { at(1.0) };
            points.extend([corner, end]);
            weights.extend([half.cos(), 1.0]);
            knots.extend([length * (part + 1) as f64 / parts as f64; 2]);
        }
        knots.push(length);
        Curve3::new(KnotVector::new(2, knots).ok()?, points, Some(weights)).ok()
    }

    /// Length, mm.
    #[must_use]
    pub fn length_mm(&self) -> f64 {
        let [_, _, k] = self.plane.axes();
        (self.radius_mm() * self.sweep()).hypot(self.to[k] - self.from[k])
    }
}

/// What one block (or one spline of several blocks) moves along, in the setup's machine coordinates.
#[derive(Debug, Clone, PartialEq)]
pub enum Shape {
    /// Straight.
    Line {
        /// Start, mm.
        from: Point3,
        /// End, mm.
        to: Point3,
    },
    /// Circular.
    Arc(Arc),
    /// A NURBS.
    Spline(Curve3),
}

impl Shape {
    /// Start, mm.
    #[must_use]
    pub fn start(&self) -> Point3 {
        match self {
            Shape::Line { from, .. } => *from,
            Shape::Arc(arc) => arc.from,
            Shape::Spline(curve) => curve.start(),
        }
    }

    /// End, mm.
    #[must_use]
    pub fn end(&self) -> Point3 {
        match self {
            Shape::Line { to, .. } => *to,
            Shape::Arc(arc) => arc.to,
            Shape::Spline(curve) => curve.end(),
        }
    }

    /// Calls `visit` with points along the shape, the start left out, the end last.
    pub fn visit(&self, mut visit: impl FnMut(Point3)) {
        match self {
            Shape::Line { from, to } => {
                for s in [0.25, 0.5, 0.75] {
                    visit(from + (to - from) * s);
                }
                visit(*to);
            }
            Shape::Arc(arc) => {
                for i in 1..8 {
                    visit(arc.point(f64::from(i) / 8.0));
                }
                visit(arc.to);
            }
            Shape::Spline(curve) => {
                for span in curve.knots().breaks().windows(2) {
                    for i in 1..=8 {
                        visit(curve.point(span[0] + (span[1] - span[0]) * f64::from(i) / 8.0));
                    }
                }
            }
        }
    }

    /// Length, mm; of a spline that of a polygon through its points, a few parts in ten thousand short.
    #[must_use]
    pub fn length_mm(&self) -> f64 {
        match self {
            Shape::Line { from, to } => (to - from).norm(),
            Shape::Arc(arc) => arc.length_mm(),
            Shape::Spline(curve) => {
                let (mut last, mut sum) = (curve.start(), 0.0);
                self.visit(|p| {
                    sum += (p - last).norm();
                    last = p;
                });
                sum
            }
        }
    }

    /// Direction of motion at the start and at the end; `None` where the shape has none.
    #[must_use]
    pub fn directions(&self) -> Option<[Vector3; 2]> {
        let unit = |v: Vector3| v.try_normalize(1e-12);
        match self {
            Shape::Line { from, to } => unit(to - from).map(|d| [d, d]),
            Shape::Arc(arc) => {
                let h = 1e-4;
                Some([unit(arc.point(h) - arc.from)?, unit(arc.to - arc.point(1.0 - h))?])
            }
            Shape::Spline(curve) => {
                let (a, b) = curve.domain();
                let step = 1e-6 * (b - a);
                let at = |t: f64, u: f64, v: f64| {
                    unit(curve.derivatives(t)[1]).or_else(|| unit(curve.point(v) - curve.point(u)))
                };
                Some([at(a, a, a + step)?, at(b, b - step, b)?])
            }
        }
    }

    /// The shape as a curve; `None` for one that is a single point.
    #[must_use]
    pub fn curve(&self) -> Option<Curve3> {
        match self {
            Shape::Line { from, to } => {
                let length = (to - from).norm();
                let knots = KnotVector::new(1, vec![0.0, 0.0, length, length]).ok()?;
                Curve3::new(knots, vec![*from, *to], None).ok()
            }
            Shape::Arc(arc) => arc.curve(),
            Shape::Spline(curve) => Some(curve.clone()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_arc_and_its_curve_are_one_circle() {
        let (a, b) = (Point3::new(0.0, 7.0, 5.0), Point3::new(5.0, 7.0, 0.0));
        for (clockwise, sweep) in [(false, FRAC_PI_2), (true, 3.0 * FRAC_PI_2)] {
            // G18's first axis is Z: from +Z to +X is counterclockwise.
            let arc = Arc::through(a, b, Point3::new(0.0, 7.0, 0.0), Plane::Zx, clockwise).unwrap();
            approx::assert_relative_eq!(arc.sweep(), sweep, epsilon = 1e-12);
            let curve = arc.curve().unwrap();
            let (t0, t1) = curve.domain();
            for i in 0..=20 {
                let p = curve.point(t0 + (t1 - t0) * f64::from(i) / 20.0);
                approx::assert_relative_eq!(p.x.hypot(p.z), 5.0, epsilon = 1e-12);
                assert!((p.y - 7.0).abs() < 1e-12);
            }
            approx::assert_relative_eq!(curve.point(0.5 * (t0 + t1)), arc.point(0.5), epsilon = 1e-9);
        }
    }

    #[test]
    fn a_centre_off_by_its_digits_is_put_between_the_ends() {
        let (a, b) = (Point3::new(5.0, 0.0, 0.0), Point3::new(0.0, 5.0, 0.0));
        let arc = Arc::through(a, b, Point3::new(0.0004, -0.0003, 0.0), Plane::Xy, false).unwrap();
        approx::assert_relative_eq!((arc.centre - a).norm(), (arc.centre - b).norm(), epsilon = 1e-12);
        assert!(Arc::through(a, b, Point3::new(0.5, 0.0, 0.0), Plane::Xy, false).is_none());
    }
}
