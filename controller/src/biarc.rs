//! Biarcs between two points with directions (Bolton 1975), in written digits, and a test for
//! curves that LinuxCNC's own biarc formula cannot follow.

use claymill_nurbs::{Curve3, Point3};
use nalgebra::Vector2;

use crate::number::LengthFormat;
use crate::{Arc, Plane, Shape};

/// Where a curve is cut into biarcs: a point of a plane and the direction there.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Station {
    pub(crate) point: Point3,
    pub(crate) direction: Vector2<f64>,
}

/// Biarcs that LinuxCNC makes of a G5.2 for each of its poles (`NURBS_FEED` in emccanon.cc).
pub(crate) const BIARCS_PER_POLE: usize = 4;
/// Tangents at the ends of a biarc of LinuxCNC that are nearer than this to parallel, radians. Its formula for the joint
/// divides by the square of the angle, with an error of some 1e-15 above; at 0 it has no joint at all.
const PARALLEL_RAD: f64 = 1e-5;

/// Whether LinuxCNC fails to make biarcs of a curve: a piece of it is straight, or its ends are parallel.
pub(crate) fn breaks_biarcs(curve: &Curve3) -> bool {
    let (a, b) = curve.domain();
    let parts = BIARCS_PER_POLE * curve.points().len();
    let direction = |k: usize| curve.derivatives(a + (b - a) * k as f64 / parts as f64)[1];
    let parallel = |k: usize| {
        let (s, t) = (direction(k), direction(k + 1));
        s.cross(&t).norm() <= PARALLEL_RAD * s.dot(&t).abs()
    };
    (0..parts).any(parallel)
}

/// Arcs with a larger radius are written as lines, mm: their centres would need more digits than there are.
const LARGEST_RADIUS_MM: f64 = 50_000.0;

/// Arcs with a smaller radius are written as lines, mm: LinuxCNC takes those below 0.00127 mm for none at all.
const SMALLEST_RADIUS_MM: f64 = 0.005;

/// Two arcs from `a` to `b`, tangent to both directions and to each other, in written digits; the joint is
/// the one that makes both tangent lengths equal (Bolton, "Biarc curves", Computer-Aided Design 7, 1975).
/// `None` where there is no such pair.
pub(crate) fn biarc(a: &Station, b: &Station, plane: Plane, format: &LengthFormat) -> Option<Vec<Shape>> {
    let [i, j, _] = plane.axes();
    let flat = |p: &Point3| Vector2::new(p[i], p[j]);
    let (p, q) = (flat(&a.point), flat(&b.point));
    let (s, t) = (a.direction, b.direction);
    let v = q - p;
    let sum = s + t;
    let spread = 2.0 * (1.0 - s.dot(&t));
    let d = if spread > 1e-9 {
        let dot = v.dot(&sum);
        (-dot + (dot * dot + spread * v.norm_squared()).sqrt()) / spread
    } else {
        let along = v.dot(&t);
        if along <= 0.0 {
            return None;
        }
        v.norm_squared() / (4.0 * along)
    };
    if !(d.is_finite() && d > 0.0) || d > 10.0 * v.norm() {
        return None;
    }
    let middle = (p + q + (s - t) * d) * 0.5;
    let mut joint = a.point;
    (joint[i], joint[j]) = (middle.x, middle.y);
    let joint = format.snap_point(&joint);
    let first = tangent_arc(&a.point, &joint, s, false, plane, format);
    let second = tangent_arc(&joint, &b.point, t, true, plane, format);
    Some([first, second].into_iter().filter(|shape| shape.start() != shape.end()).collect())
}

/// The arc from `from` to `to` that has direction `d` at its start, or at its end; a line where it is as good
/// as straight.
fn tangent_arc(
    from: &Point3,
    to: &Point3,
    d: Vector2<f64>,
    at_end: bool,
    plane: Plane,
    format: &LengthFormat,
) -> Shape {
    let line = Shape::Line { from: *from, to: *to };
    let [i, j, _] = plane.axes();
    let chord = Vector2::new(to[i] - from[i], to[j] - from[j]);
    let normal = Vector2::new(-d.y, d.x);
    let (touch, chord) = if at_end { (to, -chord) } else { (from, chord) };
    let off = 2.0 * normal.dot(&chord);
    if off.abs() * LARGEST_RADIUS_MM <= chord.norm_squared() {
        return line;
    }
    // Signed radius along the normal: positive to the left of the motion, counterclockwise.
    let radius = chord.norm_squared() / off;
    if radius.abs() < SMALLEST_RADIUS_MM {
        return line;
    }
    let mut centre = *touch;
    centre[i] += normal.x * radius;
    centre[j] += normal.y * radius;
    // The centre is written from the start, in the program's digits.
    for axis in [i, j] {
        centre[axis] = from[axis] + format.snap(centre[axis] - from[axis]);
    }
    Arc::through(*from, *to, centre, plane, radius < 0.0).map_or(line, Shape::Arc)
}
