//! The contact of a dropped end on one surface: Newton on the generalised offset `S + corner·n + flat·n_h`.

use std::ops::AddAssign;

use claymill_nurbs::{Jet, Leaves, Point3, Vector3};
use nalgebra::{Matrix2, Matrix2x3, Matrix3x2, Vector2};

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
    let upper = |n: Vector3| if n.z < 0.0 { -n } else { n };
    newton(s, start, end, upper, |offset| {
        let Offset { middle, normal, moves } = offset;
        let rest = Vector2::new(x - middle.x, y - middle.y);
        (normal.z >= STEEPEST_NZ).then(|| (rest, moves.fixed_rows::<2>(0).into_owned()))
    })
    .map(|contact| Contact { middle: Point3::new(x, y, contact.middle.z), ..contact })
}

/// The place near `start` that the end touches with its middle at a height, on the line from a place in the direction of a
/// unit vector. `None` where there is none, or the ground is level, overhangs, or curves as the end does.
pub(crate) fn contact_along(
    s: &Leaves,
    start: (f64, f64),
    (from, along): ([f64; 2], [f64; 2]),
    height: f64,
    end: &EndShape,
) -> Option<Contact> {
    let [ahead, aside] = [Vector3::new(along[0], along[1], 0.0), Vector3::new(along[1], -along[0], 0.0)];
    // A wall has no upper side: it is left behind.
    let towards = |n: Vector3| {
        let side = if n.z.abs() < UPRIGHT { n.dot(&ahead) } else { n.z };
        if side < 0.0 { -n } else { n }
    };
    newton(s, start, end, towards, |offset| {
        let Offset { middle, moves, .. } = offset;
        let rest =
            Vector2::new(-aside.dot(&(middle - Point3::new(from[0], from[1], 0.0))), height - middle.z);
        let moves = Matrix2::from_rows(&[aside.transpose() * moves, moves.fixed_rows::<1>(2).into_owned()]);
        Some((rest, moves))
    })
}

/// The end's middle where it touches a place, and how it moves with the parameters.
struct Offset {
    middle: Point3,
    normal: Vector3,
    moves: Matrix3x2<f64>,
}

/// Newton's method for the parameters at which nothing is left of what `residual` tells, mm, with its derivatives; `side` turns
/// normals into the tool.
fn newton(
    s: &Leaves,
    start: (f64, f64),
    end: &EndShape,
    side: impl Fn(Vector3) -> Vector3,
    residual: impl Fn(&Offset) -> Option<(Vector2<f64>, Matrix2<f64>)>,
) -> Option<Contact> {
    let ((u0, u1), (v0, v1)) = s.domain();
    let (mut u, mut v) = (start.0.clamp(u0, u1), start.1.clamp(v0, v1));
    for _ in 0..ITERATIONS {
        let jet = s.jet(u, v);
        let offset = offset(&jet, side(jet.normal()?), end)?;
        let (rest, moves) = residual(&offset)?;
        if rest.norm_squared() < RESIDUAL_MM * RESIDUAL_MM {
            let Offset { middle, normal, .. } = offset;
            return Some(Contact { middle, normal, u, v });
        }
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

fn offset(jet: &Jet, n: Vector3, end: &EndShape) -> Option<Offset> {
    let lean = n.x.hypot(n.y);
    if end.flat_mm > 0.0 && lean <= UPRIGHT {
        return None;
    }
    // Weingarten: the normal turns by −[Su Sv]·W; its horizontal direction only by what lies across it.
    let forms = jet.curvature(&n);
    let weingarten = forms.first.try_inverse()? * forms.second;
    let sides = Matrix2x3::from_rows(&[jet.su.transpose(), jet.sv.transpose()]).transpose();
    let turn = -(sides * weingarten);
    let mut moves = sides + turn * end.corner_mm;
    if lean > UPRIGHT {
        let outward = level(&n).xy();
        let across = (Matrix2::identity() - outward * outward.transpose()) / lean;
        let turned = across * turn.fixed_rows::<2>(0) * end.flat_mm;
        moves.fixed_rows_mut::<2>(0).add_assign(&turned);
    }
    Some(Offset { middle: jet.p + end.to_middle(&n), normal: n, moves })
}
