use claymill_nurbs::{Leaves, Point3, Vector3};
use nalgebra::{Matrix2, Vector2};

/// Outcome of looking for the contact of a dropped ball on one surface.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Polished {
    /// The ball rests here; when it moves on horizontally the parameters follow with `pace`.
    Contact { centre: Point3, normal: Vector3, u: f64, v: f64, pace: Pace },
    /// The search runs out of the surface here.
    Outside { u: f64, v: f64 },
    /// No convergence: steep, singular, or curved more tightly than the ball.
    Failed,
}

/// How `(u, v)` of the contact changes with the horizontal place of the ball, close to a contact.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Pace(Matrix2<f64>);

impl Pace {
    /// Where the contact will be, by and large, when the ball has moved on by `(dx, dy)`.
    pub(crate) fn ahead(&self, (u, v): (f64, f64), (dx, dy): (f64, f64)) -> (f64, f64) {
        let step = self.0 * Vector2::new(dx, dy);
        (u + step.x, v + step.y)
    }
}

/// Iterations stop at this horizontal residual, mm. Where the ball almost fits, places far apart on the surface have
/// centres close together, and the slope asks for the right one.
const RESIDUAL_MM: f64 = 1e-10;
const ITERATIONS: usize = 16;
/// Contacts steeper than this (sine of the angle to the vertical wall) are left to subdivision.
const STEEPEST_NZ: f64 = 0.02;

/// Inverse-offset Newton (geometry.md §6.1): the `(u, v)` whose offset point `S + R·n` lies above `(x, y)`,
/// with `n` on the upper side. The pace is passed on where the start is the contact.
pub(crate) fn polish(s: &Leaves, start: (f64, f64), pace: Pace, x: f64, y: f64, r: f64) -> Polished {
    let ((u0, u1), (v0, v1)) = s.domain();
    let (mut u, mut v) = (start.0.clamp(u0, u1), start.1.clamp(v0, v1));
    let (mut stuck, mut pace) = (0, pace);
    for _ in 0..ITERATIONS {
        let jet = s.jet(u, v);
        let Some(mut n) = jet.normal() else {
            return Polished::Failed;
        };
        if n.z < 0.0 {
            n = -n;
        }
        if n.z < STEEPEST_NZ {
            return Polished::Failed;
        }
        let centre = jet.p + n * r;
        let (rx, ry) = (x - centre.x, y - centre.y);
        if rx * rx + ry * ry < RESIDUAL_MM * RESIDUAL_MM {
            return Polished::Contact { centre: Point3::new(x, y, centre.z), normal: n, u, v, pace };
        }
        let forms = jet.curvature(&n);
        let Some(inverse) = forms.first.try_inverse() else {
            return Polished::Failed;
        };
        // Weingarten: [n_u n_v] = −[Su Sv]·W, so the offset's derivatives are [Su Sv]·(1 − R·W).
        let m = Matrix2::identity() - inverse * forms.second * r;
        let cu = jet.su * m.m11 + jet.sv * m.m21;
        let cv = jet.su * m.m12 + jet.sv * m.m22;
        let det = cu.x * cv.y - cu.y * cv.x;
        if det == 0.0 || !det.is_finite() {
            return Polished::Failed;
        }
        pace = Pace(Matrix2::new(cv.y, -cv.x, -cu.y, cu.x) / det);
        let (du, dv) = pace.ahead((0.0, 0.0), (rx, ry));
        // Half the domain at most: a wild first step must not throw the search across the surface.
        let shrink = (0.5 * (u1 - u0) / du.abs()).min(0.5 * (v1 - v0) / dv.abs()).min(1.0);
        let (nu, nv) = ((u + du * shrink).clamp(u0, u1), (v + dv * shrink).clamp(v0, v1));
        let clamped = nu != u + du * shrink || nv != v + dv * shrink;
        stuck = if clamped && (nu == u0 || nu == u1 || nv == v0 || nv == v1) { stuck + 1 } else { 0 };
        if (nu, nv) == (u, v) || stuck >= 4 {
            return Polished::Outside { u, v };
        }
        (u, v) = (nu, nv);
    }
    Polished::Failed
}
