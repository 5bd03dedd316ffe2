//! Turns a curve into splines that a control takes: Bézier pieces or cuts at knots, degree
//! elevation, and knots, points and weights in the control's digits.

use claymill_nurbs::{Curve3, KnotVector, Point3};

use super::Splines;
use crate::Shape;
use crate::biarc::breaks_biarcs;
use crate::number::{LengthFormat, round};

/// A curve with its knots, points and weights rounded as the control takes them, cut where it takes no longer.
pub(super) fn written(curve: &Curve3, splines: &Splines, format: &LengthFormat) -> Option<Vec<Shape>> {
    let mut shapes = Vec::new();
    let needs_pieces = splines.pieces || !clamped(curve) || curve.knots().degree() < splines.degrees[0];
    if !needs_pieces && curve.points().len() <= splines.max_points {
        shapes.push(Shape::Spline(rounded(curve, splines, format)?));
    } else if splines.pieces || curve.knots().degree() < splines.degrees[0] || curve.weights().is_some() {
        for piece in curve.bezier_pieces() {
            let mut piece = elevated(&piece, splines.degrees[0])?;
            if splines.halved {
                piece = halved(&piece)?;
            }
            if format.snap_point(&piece.start()) == format.snap_point(&piece.end()) && tiny(&piece, format) {
                continue;
            }
            let piece = rounded(&piece, splines, format)?;
            shapes.push(match splines.biarcs && breaks_biarcs(&piece) {
                true if straight(&piece, format) => Shape::Line { from: piece.start(), to: piece.end() },
                true => return None,
                false => Shape::Spline(piece),
            });
        }
    } else {
        for part in cut(curve, splines.max_points)? {
            shapes.push(Shape::Spline(rounded(&part, splines, format)?));
        }
    }
    chained(&mut shapes);
    Some(shapes)
}

/// Whether all control points are one written point.
fn tiny(curve: &Curve3, format: &LengthFormat) -> bool {
    let first = format.snap_point(&curve.points()[0]);
    curve.points().iter().all(|p| format.snap_point(p) == first)
}

fn clamped(curve: &Curve3) -> bool {
    let (p, u) = (curve.knots().degree(), curve.knots().as_slice());
    u[0] == u[p] && u[u.len() - 1 - p] == u[u.len() - 1]
}

/// Whether all control points are a written step or less from the chord.
fn straight(curve: &Curve3, format: &LengthFormat) -> bool {
    let (from, to) = (curve.start(), curve.end());
    let Some(along) = (to - from).try_normalize(1e-9) else { return false };
    curve.points().iter().all(|p| {
        let off = p - from;
        (off - along * off.dot(&along)).norm() <= format.step_mm()
    })
}

/// A piece may have been left out as too short: the next one then starts where the one before it ends.
fn chained(shapes: &mut [Shape]) {
    for i in 1..shapes.len() {
        let end = shapes[i - 1].end();
        if let Shape::Line { from, .. } = &mut shapes[i] {
            *from = end;
        }
        if let Shape::Spline(curve) = &mut shapes[i]
            && curve.points()[0] != end
        {
            let mut points = curve.points().to_vec();
            points[0] = end;
            if let Ok(moved) =
                Curve3::new(curve.knots().clone(), points, curve.weights().map(<[f64]>::to_vec))
            {
                *curve = moved;
            }
        }
    }
}

/// Cuts a curve without weights at knots so that no part has more than `max_points` points.
fn cut(curve: &Curve3, max_points: usize) -> Option<Vec<Curve3>> {
    let p = curve.knots().degree();
    let pieces = curve.bezier_pieces();
    let per_part = (max_points.checked_sub(1)? / p).max(1);
    let join = |group: &[Curve3]| {
        let mut knots = vec![group[0].domain().0; p + 1];
        let mut points = vec![group[0].points()[0]];
        for piece in group {
            points.extend_from_slice(&piece.points()[1..]);
            knots.extend(vec![piece.domain().1; p]);
        }
        knots.push(group[group.len() - 1].domain().1);
        Curve3::new(KnotVector::new(p, knots).ok()?, points, None).ok()
    };
    pieces.chunks(per_part).map(join).collect()
}

/// The same Bézier curve with a degree of at least `degree` (The NURBS Book, eq. 5.36, one step at a time).
fn elevated(curve: &Curve3, degree: usize) -> Option<Curve3> {
    let mut curve = curve.clone();
    while curve.knots().degree() < degree {
        let p = curve.knots().degree();
        let (a, b) = curve.domain();
        let weight = |i: usize| curve.weights().map_or(1.0, |w| w[i]);
        let (mut points, mut weights) = (Vec::new(), Vec::new());
        for i in 0..=p + 1 {
            let share = i as f64 / (p + 1) as f64;
            let (left, right) = (i.saturating_sub(1), i.min(p));
            let (wl, wr) = (share * weight(left), (1.0 - share) * weight(right));
            weights.push(wl + wr);
            points.push(Point3::from(
                (curve.points()[left].coords * wl + curve.points()[right].coords * wr) / (wl + wr),
            ));
        }
        let mut knots = vec![a; p + 2];
        knots.extend(vec![b; p + 2]);
        let weights = curve.weights().is_some().then_some(weights);
        curve = Curve3::new(KnotVector::new(p + 1, knots).ok()?, points, weights).ok()?;
    }
    Some(curve)
}

/// A cubic Bézier curve with a further knot in its middle.
fn halved(curve: &Curve3) -> Option<Curve3> {
    let (a, b) = curve.domain();
    let p = curve.points();
    if p.len() != 4 || curve.weights().is_some() {
        return None;
    }
    let middle = |i: usize| nalgebra::center(&p[i], &p[i + 1]);
    let points = vec![p[0], middle(0), middle(1), middle(2), p[3]];
    let knots = vec![a, a, a, a, 0.5 * (a + b), b, b, b, b];
    Curve3::new(KnotVector::new(3, knots).ok()?, points, None).ok()
}

/// Knots from zero on, points and weights in the digits that the control reads.
fn rounded(curve: &Curve3, splines: &Splines, format: &LengthFormat) -> Option<Curve3> {
    let (a, b) = curve.domain();
    // Knots mean nothing by their size: they are stretched to use the digits that there are.
    let mut scale = 1.0;
    while scale < 1e3 && (b - a) * scale * 10.0 <= splines.largest_knot {
        scale *= 10.0;
    }
    while (b - a) * scale > splines.largest_knot {
        scale *= 0.1;
    }
    let stretched = |k: &f64| (k - a) * scale;
    let exact = |k: f64| (k - round(k, splines.knot_digits)).abs() < 1e-9;
    let knots: Vec<f64> =
        if curve.knots().as_slice().iter().all(|k| exact(k - a)) && b - a <= splines.largest_knot {
            curve.knots().as_slice().iter().map(|k| round(k - a, splines.knot_digits)).collect()
        } else {
            curve.knots().as_slice().iter().map(|k| round(stretched(k), splines.knot_digits)).collect()
        };
    let points = curve.points().iter().enumerate();
    let last = curve.points().len() - 1;
    let snap = |(i, p): (usize, &Point3)| {
        if splines.exact_points && i != 0 && i != last { *p } else { format.snap_point(p) }
    };
    let weights = match (curve.weights(), splines.weights) {
        (None, _) => None,
        (Some(_), None) => return None,
        (Some(w), Some([smallest, largest])) => {
            let top = w.iter().copied().fold(0.0, f64::max);
            let mut factor = 1.0;
            if splines.first_weight_one {
                factor = 1.0 / w[0];
            }
            // A power of two: weights that were exact stay exact, the others use all the digits.
            if !splines.first_weight_one {
                factor = (largest / top).log2().floor().clamp(-60.0, 60.0).exp2();
            }
            let scaled: Vec<f64> = w.iter().map(|w| round(w * factor, splines.weight_digits)).collect();
            if scaled.iter().any(|w| !(smallest..=largest).contains(w)) {
                return None;
            }
            Some(scaled)
        }
    };
    let knots = KnotVector::new(curve.knots().degree(), knots).ok()?;
    Curve3::new(knots, points.map(snap).collect(), weights).ok()
}
