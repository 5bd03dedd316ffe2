//! Follows a curve beside a sequence of points (Newton's method for the nearest point) and measures
//! the largest distance, skipped parts included.

use claymill_nurbs::{Curve3, Point3};

use crate::Shape;

/// Steps after which a search for the nearest point gives up where it is.
const NEWTON_STEPS: usize = 8;

/// Runs along a curve beside points that follow it, and tells how far from it they are.
#[derive(Debug)]
pub(crate) struct Follower<'a> {
    curve: &'a Curve3,
    t: f64,
    last: Point3,
}

impl<'a> Follower<'a> {
    pub(crate) fn new(curve: &'a Curve3) -> Self {
        Follower { curve, t: curve.domain().0, last: curve.start() }
    }

    /// Distance of `p` from the curve, and how far along the curve (mm) its nearest point lies beyond the
    /// last one, less the distance of the two points: positive where the points have skipped a part.
    pub(crate) fn to(&mut self, p: &Point3) -> (f64, f64) {
        let (a, b) = self.curve.domain();
        let step = (p - self.last).norm();
        let before = self.curve.point(self.t);
        let mut t = self.t;
        let mut speed = self.curve.derivatives(t)[1].norm();
        if speed > 0.0 {
            t = (t + step / speed).min(b);
        }
        let mut distance = f64::INFINITY;
        for _ in 0..NEWTON_STEPS {
            let [q, d1, d2] = self.curve.derivatives(t);
            let off = q - p.coords;
            speed = d1.norm();
            distance = off.norm();
            let slope = off.dot(&d1);
            let bend = d1.norm_squared() + off.dot(&d2);
            // Gauss–Newton where the curve bends away: the true Hessian may point uphill.
            let bend = if bend > 0.1 * d1.norm_squared() { bend } else { d1.norm_squared() };
            if bend <= 0.0 {
                break;
            }
            let next = (t - slope / bend).clamp(a, b);
            let moved = (next - t).abs() * speed;
            t = next;
            if moved < 1e-7 {
                break;
            }
        }
        let foot = self.curve.point(t);
        self.t = t;
        self.last = *p;
        (distance.min((foot - p).norm()), (foot - before).norm() - step)
    }
}

/// Largest distance between a curve and the shapes that stand for it, mm: each point of the shapes is held
/// against the curve, and a part of the curve that they leave out counts with its length.
pub(crate) fn deviation<'s>(curve: &Curve3, shapes: impl IntoIterator<Item = &'s Shape>) -> f64 {
    let mut follower = Follower::new(curve);
    let mut largest: f64 = 0.0;
    let mut first = true;
    let mut last = None;
    for shape in shapes {
        if first {
            largest = (shape.start() - curve.start()).norm();
            first = false;
        }
        shape.visit(|p| {
            let (distance, skipped) = follower.to(&p);
            let skipped = if skipped > SKIP_SHARE * distance + SKIP_MM { skipped } else { 0.0 };
            largest = largest.max(distance).max(skipped);
        });
        last = Some(shape.end());
    }
    let end = last.unwrap_or(curve.start());
    largest.max((end - curve.end()).norm())
}

/// A nearest point may run ahead by what arc and chord differ: less than this between two samples, mm.
const SKIP_MM: f64 = 0.5;
const SKIP_SHARE: f64 = 10.0;
