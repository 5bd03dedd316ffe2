//! The contact of a dropped end on one surface: Newton on the generalised offset `S + corner·n + flat·n_h`.

use claymill_nurbs::{Leaves, Point3, Vector3};
use nalgebra::{Matrix2, Matrix2x3, Vector2};

use super::end::{EndShape, UPRIGHT, level};

/// A contact of an end on a surface.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Contact {
    /// The end's middle.
    pub(crate) middle: Point3,
    /// Unit normal of the surface, into the tool.
    pub(crate) normal: Vector3,
    pub(crate) u: f64,
    pub(crate) v: f64,
}

/// Nothing is left to be done at this horizontal distance, mm.
const RESIDUAL_MM: f64 = 1e-10;
const ITERATIONS: usize = 12;
/// Contacts steeper than this (`n·axis`) are left to the search.
const STEEPEST_NZ: f64 = 0.02;

/// The place near `start` over which the middle stands at `(x, y)`, with `n` on the upper side. `None` where there is none,
/// the ground is level or steep, or curves as the end does.
pub(crate) fn contact_at(s: &Leaves, start: (f64, f64), [x, y]: [f64; 2], end: &EndShape) -> Option<Contact> {
    let ((u0, u1), (v0, v1)) = s.domain();
    let (mut u, mut v) = (start.0.clamp(u0, u1), start.1.clamp(v0, v1));
    for _ in 0..ITERATIONS {
        let jet = s.jet(u, v);
        let n = jet.normal()?;
        let n = if n.z < 0.0 { -n } else { n };
        let lean = n.x.hypot(n.y);
        if n.z < STEEPEST_NZ || (end.flat_mm > 0.0 && lean <= UPRIGHT) {
            return None;
        }
        let middle = jet.p + end.to_middle(&n);
        let rest = Vector2::new(x - middle.x, y - middle.y);
        if rest.norm_squared() < RESIDUAL_MM * RESIDUAL_MM {
            return Some(Contact { middle: Point3::new(x, y, middle.z), normal: n, u, v });
        }
        // Weingarten: the normal turns by −[Su Sv]·W; its horizontal direction only by what lies across it.
        let forms = jet.curvature(&n);
        let weingarten = forms.first.try_inverse()? * forms.second;
        let sides = Matrix2x3::from_rows(&[jet.su.transpose(), jet.sv.transpose()]).transpose();
        let turn = -(sides * weingarten);
        let outward = level(&n).xy();
        let across = if lean > UPRIGHT {
            (Matrix2::identity() - outward * outward.transpose()) / lean
        } else {
            Matrix2::zeros()
        };
        let flat_turn = turn.fixed_rows::<2>(0).into_owned();
        let moves = sides.fixed_rows::<2>(0) + flat_turn * end.corner_mm + across * flat_turn * end.flat_mm;
        let step = moves.try_inverse()? * rest;
        // Half the domain at most: a wild first step must not throw the search across the surface.
        let shrink = (0.5 * (u1 - u0) / step.x.abs()).min(0.5 * (v1 - v0) / step.y.abs()).min(1.0);
        let next = ((u + step.x * shrink).clamp(u0, u1), (v + step.y * shrink).clamp(v0, v1));
        if next == (u, v) {
            return None;
        }
        (u, v) = next;
    }
    None
}
