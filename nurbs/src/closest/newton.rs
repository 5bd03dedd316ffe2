//! Newton descent to the nearest point of one piece, with the full Hessian of `½|S − p|²` and
//! sliding along the sides of the parameter square.

use super::piece::Piece;
use crate::Vector3;

/// A step this short is the last one: the position is then carried along by its Taylor polynomial, with an
/// error of third order (below 1e-12 mm), and Newton's next residual would be of second order.
const LAST_STEP_MM: f64 = 1e-5;
/// Steps before giving up; reached only around degenerate parametrisations.
const LARGEST_STEP_COUNT: usize = 60;

/// A point of a piece.
#[derive(Debug, Clone, Copy)]
pub(super) struct Spot {
    pub(super) s: f64,
    pub(super) t: f64,
    pub(super) position: Vector3,
    pub(super) distance_squared: f64,
}

/// Descends from `start` to a constrained local minimum of the distance from `local` over the piece: Newton
/// with the full Hessian on `½|S − p|²`, sliding along the sides of the parameter square.
///
/// With a `convexity` (see [`super::piece::Shape`]) the search stops with `None` as soon as the paraboloid
/// that touches the squared distance from below shows that the piece has nothing nearer than
/// `cutoff_squared`.
pub(super) fn descend(
    piece: &Piece,
    local: &Vector3,
    start: (f64, f64),
    convexity: Option<[f64; 2]>,
    cutoff_squared: f64,
) -> Option<Spot> {
    let (mut s, mut t) = start;
    let mut previous = Spot { s, t, position: Vector3::zeros(), distance_squared: f64::INFINITY };
    for _ in 0..LARGEST_STEP_COUNT {
        let j = piece.jet(s, t);
        let away = j.p.coords - local;
        let distance_squared = away.norm_squared();
        if distance_squared > previous.distance_squared * (1.0 + 1e-14) {
            // Too long a step: come back most of the way.
            let (next_s, next_t) = (0.75 * previous.s + 0.25 * s, 0.75 * previous.t + 0.25 * t);
            if next_s == s && next_t == t {
                return Some(previous);
            }
            (s, t) = (next_s, next_t);
            continue;
        }
        previous = Spot { s, t, position: j.p.coords, distance_squared };
        let (gs, gt) = (away.dot(&j.su), away.dot(&j.sv));
        if let Some([least_s, least_t]) = convexity
            && distance_squared - 2.0 * (drop(gs, least_s, s) + drop(gt, least_t, t)) > cutoff_squared
        {
            return None;
        }
        let (e, f, g) = (j.su.norm_squared(), j.su.dot(&j.sv), j.sv.norm_squared());
        let (hss, hst, htt) = (e + away.dot(&j.suu), f + away.dot(&j.suv), g + away.dot(&j.svv));
        let (ds, dt) = newton_step((gs, gt), (hss, hst, htt), (e, f, g), (s, t));
        // As far as the square allows.
        let room = |x: f64, d: f64| match d {
            d if d > 0.0 => (0.5 - x) / d,
            d if d < 0.0 => (-0.5 - x) / d,
            _ => f64::INFINITY,
        };
        let fraction = room(s, ds).min(room(t, dt)).min(1.0);
        let (ds, dt) = (ds * fraction, dt * fraction);
        let tangent = j.su * ds + j.sv * dt;
        let (next_s, next_t) = ((s + ds).clamp(-0.5, 0.5), (t + dt).clamp(-0.5, 0.5));
        if fraction == 1.0 && tangent.norm_squared() <= LAST_STEP_MM * LAST_STEP_MM {
            let bend = j.suu * (0.5 * ds * ds) + j.suv * (ds * dt) + j.svv * (0.5 * dt * dt);
            let position = j.p.coords + tangent + bend;
            let distance_squared = (position - local).norm_squared();
            return Some(if distance_squared < previous.distance_squared {
                Spot { s: next_s, t: next_t, position, distance_squared }
            } else {
                previous
            });
        }
        (s, t) = (next_s, next_t);
    }
    Some(previous)
}

/// The most that `gradient · d + ½ least · d²` falls below zero while `x + d` stays on the piece.
fn drop(gradient: f64, least: f64, x: f64) -> f64 {
    let d = (-gradient / least).clamp(-0.5 - x, 0.5 - x);
    -d * (gradient + 0.5 * least * d)
}

/// The Newton step for gradient `g`, Hessian `h` (else its positive part, the first fundamental form `first`),
/// with the parameters that a side holds back left out.
fn newton_step(
    (gs, gt): (f64, f64),
    h: (f64, f64, f64),
    first: (f64, f64, f64),
    (s, t): (f64, f64),
) -> (f64, f64) {
    let held = |x: f64, d: f64| (x >= 0.5 && d > 0.0) || (x <= -0.5 && d < 0.0);
    let single = |g: f64, h: f64, e: f64| {
        let curvature = if h > 0.0 { h } else { e };
        if curvature > 0.0 { -g / curvature } else { 0.0 }
    };
    let only_s = || (single(gs, h.0, first.0), 0.0);
    let only_t = || (0.0, single(gt, h.2, first.2));
    match (held(s, -gs), held(t, -gt)) {
        (true, true) => (0.0, 0.0),
        (true, false) => only_t(),
        (false, true) => only_s(),
        (false, false) => {
            let determinant = h.0 * h.2 - h.1 * h.1;
            let positive = h.0 > 0.0 && determinant > 1e-12 * h.0 * h.2;
            let (a, b, c, determinant) = if positive {
                (h.0, h.1, h.2, determinant)
            } else {
                // Gauss–Newton, damped so that a collapsed direction stays where it is.
                let damping = 1e-6 * (first.0 + first.2) + f64::MIN_POSITIVE;
                let (a, c) = (first.0 + damping, first.2 + damping);
                (a, first.1, c, a * c - first.1 * first.1)
            };
            let (ds, dt) = ((b * gt - c * gs) / determinant, (b * gs - a * gt) / determinant);
            if held(s, ds) {
                only_t()
            } else if held(t, dt) {
                only_s()
            } else {
                (ds, dt)
            }
        }
    }
}
