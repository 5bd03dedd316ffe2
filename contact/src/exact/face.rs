//! The contact of a dropped ball on one surface: Newton on the offset surface `S + R·n`, with the
//! Weingarten map for its derivatives.

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

impl Polished {
    pub(crate) fn pace(self) -> Option<Pace> {
        match self {
            Polished::Contact { pace, .. } => Some(pace),
            _ => None,
        }
    }
}

/// How `(u, v)` of the contact changes with the horizontal place of the ball, close to a contact.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Pace(Matrix2<f64>);

impl Pace {
    /// The mean of this one and the one at the next place, if they change as they did since `before`.
    pub(crate) fn onward(&self, before: &Pace) -> Pace {
        Pace(self.0 * 1.5 - before.0 * 0.5)
    }

    /// Where the contact will be, by and large, when the ball has moved on by `(dx, dy)`.
    pub(crate) fn ahead(&self, (u, v): (f64, f64), (dx, dy): (f64, f64)) -> (f64, f64) {
        let step = self.0 * Vector2::new(dx, dy);
        (u + step.x, v + step.y)
    }
}

/// Nothing is left to be done at this horizontal distance, mm.
const RESIDUAL_MM: f64 = 1e-10;
/// So close to the contact, over the ground and along the surface, a last step is taken without another look: height,
/// contact and normal are then off by its third, second and second power times the change of curvature. Where the ball
/// almost fits, places far apart on the surface have centres close together: the ground alone does not tell.
const LAST_STEP_MM: f64 = 1e-3;
const ITERATIONS: usize = 16;
/// Contacts steeper than this (sine of the angle to the vertical wall) are left to subdivision.
const STEEPEST_NZ: f64 = 0.02;

/// Inverse-offset Newton (docs/theory.md §6.1): the `(u, v)` whose offset point `S + R·n` lies above `(x, y)`,
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
        // Weingarten: [n_u n_v] = −[Su Sv]·W, so the offset's derivatives are [Su Sv]·(1 − R·W).
        let (e, f, g) = (jet.su.dot(&jet.su), jet.su.dot(&jet.sv), jet.sv.dot(&jet.sv));
        let (l, m, k) = (jet.suu.dot(&n), jet.suv.dot(&n), jet.svv.dot(&n));
        let inverse = 1.0 / (e * g - f * f);
        let weingarten = Matrix2::new(g * l - f * m, g * m - f * k, e * m - f * l, e * k - f * m) * inverse;
        let (m11, m12) = (1.0 - r * weingarten.m11, -r * weingarten.m12);
        let (m21, m22) = (-r * weingarten.m21, 1.0 - r * weingarten.m22);
        let (cux, cuy) = (jet.su.x * m11 + jet.sv.x * m21, jet.su.y * m11 + jet.sv.y * m21);
        let (cvx, cvy) = (jet.su.x * m12 + jet.sv.x * m22, jet.su.y * m12 + jet.sv.y * m22);
        let det = cux * cvy - cuy * cvx;
        if det == 0.0 || !det.is_finite() {
            return Polished::Failed;
        }
        pace = Pace(Matrix2::new(cvy, -cvx, -cuy, cux) * (1.0 / det));
        let (du, dv) = pace.ahead((0.0, 0.0), (rx, ry));
        let (on_ground, along) = (rx * rx + ry * ry, e * du * du + 2.0 * f * du * dv + g * dv * dv);
        let inside = (u0..=u1).contains(&(u + du)) && (v0..=v1).contains(&(v + dv));
        if inside && on_ground.max(along) < LAST_STEP_MM * LAST_STEP_MM {
            let turn = weingarten * Vector2::new(du, dv);
            let half = (jet.su * turn.x + jet.sv * turn.y) * -0.5;
            let middle = n + half;
            let z = centre.z - (middle.x * rx + middle.y * ry) / middle.z;
            return Polished::Contact {
                centre: Point3::new(x, y, z),
                normal: middle + half,
                u: u + du,
                v: v + dv,
                pace,
            };
        }
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
