//! Knot insertion on control points in plain arrays, shared by curves and surfaces.

use nalgebra::{DMatrix, SVector};

use crate::KnotVector;

/// The same curve (or `columns` curves side by side, point `i` of curve `c` at `i · columns + c`) cut down
/// to `[a, b]` and clamped there: both ends are inserted to full multiplicity, what lies outside is dropped.
pub(crate) fn restrict<const N: usize>(
    knots: &KnotVector,
    points: &[SVector<f64, N>],
    columns: usize,
    (a, b): (f64, f64),
) -> (KnotVector, Vec<SVector<f64, N>>) {
    let p = knots.degree();
    let (mut all, mut points) = (knots.as_slice().to_vec(), points.to_vec());
    for t in [a, b] {
        for _ in knots.multiplicity(t)..p {
            insert(p, &mut all, &mut points, columns, t);
        }
    }
    let first_inside = all.partition_point(|&k| k <= a);
    let end_inside = all.partition_point(|&k| k < b);
    let mut kept = vec![a; p + 1];
    kept.extend_from_slice(&all[first_inside..end_inside]);
    kept.extend(vec![b; p + 1]);
    // `a` has multiplicity p or p + 1 now: point first_inside - p - 1 is the one that lies at `a`.
    let points = points[(first_inside - p - 1) * columns..end_inside * columns].to_vec();
    (KnotVector::from_sound(p, kept), points)
}

/// Inserts `t` once (Boehm's algorithm; The NURBS Book, eq. 5.15). `t` may lie at either end of the domain,
/// clamped or not.
fn insert<const N: usize>(
    p: usize,
    knots: &mut Vec<f64>,
    points: &mut Vec<SVector<f64, N>>,
    columns: usize,
    t: f64,
) {
    let above = knots.partition_point(|&k| k <= t);
    let old_count = points.len() / columns;
    let mut fresh = Vec::with_capacity(points.len() + columns);
    for i in 0..=old_count {
        // Share of old point i in new point i; the rest is old point i - 1.
        let share = if i + p < above {
            1.0
        } else if i >= above {
            0.0
        } else {
            (t - knots[i]) / (knots[i + p] - knots[i])
        };
        for c in 0..columns {
            fresh.push(if share == 1.0 {
                points[i * columns + c]
            } else if share == 0.0 {
                points[(i - 1) * columns + c]
            } else {
                points[i * columns + c] * share + points[(i - 1) * columns + c] * (1.0 - share)
            });
        }
    }
    *points = fresh;
    knots.insert(above, t);
}

/// The matrix that turns the `degree + 1` control points of a span into the Bézier points of the polynomial
/// there: Bézier point `j` is the polar form of the span at `degree - j` copies of its start and `j` copies
/// of its end (Ramshaw). Every step is a convex combination, so nothing is lost to rounding.
pub(crate) fn bezier_extraction(knots: &KnotVector, span: usize) -> DMatrix<f64> {
    let (p, u) = (knots.degree(), knots.as_slice());
    let mut rows = DMatrix::zeros(p + 1, p + 1);
    for j in 0..=p {
        let mut d = DMatrix::identity(p + 1, p + 1);
        for level in 1..=p {
            let t = if level <= p - j { u[span] } else { u[span + 1] };
            for i in (level..=p).rev() {
                let (left, right) = (u[span - p + i], u[span + i + 1 - level]);
                let share = (t - left) / (right - left);
                let blend = d.row(i) * share + d.row(i - 1) * (1.0 - share);
                d.set_row(i, &blend);
            }
        }
        rows.set_row(j, &d.row(p));
    }
    rows
}

/// The non-empty spans of the domain, as indices into the knots.
pub(crate) fn spans(knots: &KnotVector) -> impl Iterator<Item = usize> + '_ {
    let u = knots.as_slice();
    (knots.degree()..knots.point_count()).filter(|&i| u[i] < u[i + 1])
}
