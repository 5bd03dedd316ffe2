use claymill_nurbs::{Curve3, KnotVector, Point3};
use nalgebra::Vector2;

use super::{Abilities, holds};
use crate::biarc::{Station, biarc};
use crate::number::LengthFormat;
use crate::{Plane, Shape};

/// Pieces below which a curve is no longer halved: it has a cusp that nothing smooth follows.
const SMALLEST_MM: f64 = 1e-3;

/// A cubic without weights, with the curve's points and derivatives at its joints, within `tolerance_mm`.
pub(super) fn hermite(curve: &Curve3, tolerance_mm: f64) -> Option<Curve3> {
    let mut stations = Vec::new();
    let cubic = |a: f64, b: f64| {
        // Just inside: derivatives may jump at knots.
        let inset = 1e-9 * (b - a);
        let ([p, d, _], [q, e, _]) = (curve.derivatives(a + inset), curve.derivatives(b - inset));
        let third = (b - a) / 3.0;
        [p, p + d * third, q - e * third, q]
    };
    let far = |a: f64, b: f64| {
        let c = cubic(a, b);
        [0.25, 0.5, 0.75].into_iter().any(|s: f64| {
            let r = 1.0 - s;
            let p =
                c[0] * (r * r * r) + c[1] * (3.0 * r * r * s) + c[2] * (3.0 * r * s * s) + c[3] * (s * s * s);
            (p - curve.derivatives(a + (b - a) * s)[0]).norm() > tolerance_mm
        })
    };
    for span in curve.knots().breaks().windows(2) {
        halve(curve, (span[0], span[1]), &far, &mut stations);
    }
    let mut knots = vec![stations.first()?.0; 4];
    let mut points = vec![Point3::from(cubic(stations[0].0, stations[0].1)[0])];
    for &(a, b) in &stations {
        points.extend(cubic(a, b)[1..].iter().map(|&p| Point3::from(p)));
        knots.extend([b; 3]);
    }
    knots.push(stations[stations.len() - 1].1);
    Curve3::new(KnotVector::new(3, knots).ok()?, points, None).ok()
}

/// Cuts `span` in halves until no part is `far` from what stands for it.
fn halve(curve: &Curve3, span: (f64, f64), far: &dyn Fn(f64, f64) -> bool, parts: &mut Vec<(f64, f64)>) {
    let mut waiting = vec![span];
    while let Some((a, b)) = waiting.pop() {
        let middle = 0.5 * (a + b);
        let small = (curve.point(b) - curve.point(a)).norm() < SMALLEST_MM
            && (curve.point(middle) - curve.point(a)).norm() < SMALLEST_MM;
        if !small && far(a, b) {
            waiting.extend([(middle, b), (a, middle)]);
        } else {
            parts.push((a, b));
        }
    }
}

pub(super) fn as_biarcs(
    curve: &Curve3,
    abilities: &Abilities,
    format: &LengthFormat,
    tolerance_mm: f64,
) -> Option<Vec<Shape>> {
    if !abilities.arcs {
        return None;
    }
    let plane = Plane::ALL.into_iter().find(|plane| holds(curve, *plane, format))?;
    let [i, j, _] = plane.axes();
    let station = |t: f64, side: f64| {
        let d = curve.derivatives(t + side)[1];
        let direction = Vector2::new(d[i], d[j]).try_normalize(1e-12)?;
        Some(Station { point: format.snap_point(&curve.point(t)), direction })
    };
    let pair = |a: f64, b: f64| {
        let inset = 1e-9 * (b - a);
        biarc(&station(a, inset)?, &station(b, -inset)?, plane, format)
    };
    let far = |a: f64, b: f64| {
        let Some(shapes) = pair(a, b) else { return true };
        from_part(curve, a, b, &shapes) > tolerance_mm
    };
    let mut parts = Vec::new();
    for span in curve.knots().breaks().windows(2) {
        halve(curve, (span[0], span[1]), &far, &mut parts);
    }
    let mut shapes = Vec::new();
    for (a, b) in parts {
        let ends = (format.snap_point(&curve.point(a)), format.snap_point(&curve.point(b)));
        match pair(a, b) {
            Some(pair) => shapes.extend(pair),
            None if ends.0 == ends.1 => {}
            None => shapes.push(Shape::Line { from: ends.0, to: ends.1 }),
        }
    }
    Some(shapes)
}

/// Largest distance of a few points of the shapes from the part of the curve that they stand for.
fn from_part(curve: &Curve3, a: f64, b: f64, shapes: &[Shape]) -> f64 {
    let mut largest: f64 = 0.0;
    for s in [0.125, 0.25, 0.375, 0.5, 0.625, 0.75, 0.875] {
        let p = curve.point(a + (b - a) * s);
        let nearest = shapes.iter().map(|shape| distance(shape, &p)).fold(f64::INFINITY, f64::min);
        largest = largest.max(nearest);
    }
    largest
}

/// Distance of a point from a line or an arc that it lies beside.
fn distance(shape: &Shape, p: &Point3) -> f64 {
    match shape {
        Shape::Line { from, to } => {
            let d = to - from;
            let s = ((p - from).dot(&d) / d.norm_squared().max(1e-300)).clamp(0.0, 1.0);
            (p - (from + d * s)).norm()
        }
        Shape::Arc(arc) => {
            let ends = (p - arc.from).norm().min((p - arc.to).norm());
            let ring = ((p - arc.centre).norm() - arc.radius_mm()).abs();
            // Beside the arc, not beside the rest of its circle.
            let chord = arc.to - arc.from;
            let s = (p - arc.from).dot(&chord) / chord.norm_squared().max(1e-300);
            if (0.0..=1.0).contains(&s) { ring } else { ends }
        }
        Shape::Spline(_) => f64::INFINITY,
    }
}

pub(super) fn as_chords(
    curve: &Curve3,
    _: &Abilities,
    format: &LengthFormat,
    tolerance_mm: f64,
) -> Option<Vec<Shape>> {
    let far = |a: f64, b: f64| {
        let (p, q) = (curve.point(a), curve.point(b));
        let line = Shape::Line { from: p, to: q };
        [0.25, 0.5, 0.75]
            .into_iter()
            .any(|s| distance(&line, &curve.point(a + (b - a) * s)) > 0.98 * tolerance_mm)
    };
    let mut shapes = Vec::new();
    let mut from = format.snap_point(&curve.start());
    for t in chord_ends(curve, &far) {
        let to = format.snap_point(&curve.point(t));
        if from != to {
            shapes.push(Shape::Line { from, to });
            from = to;
        }
    }
    Some(shapes)
}

/// Points of straight moves along a curve, the start first.
pub(crate) fn chords(curve: &Curve3, format: &LengthFormat, tolerance_mm: f64) -> Vec<Point3> {
    let none = Abilities { splines: Vec::new(), arcs: false };
    let shapes = as_chords(curve, &none, format, tolerance_mm).unwrap_or_default();
    let start = format.snap_point(&curve.start());
    std::iter::once(start).chain(shapes.iter().map(Shape::end)).collect()
}

/// Ends of chords as long as `far` allows, from one knot to the next.
fn chord_ends(curve: &Curve3, far: &dyn Fn(f64, f64) -> bool) -> Vec<f64> {
    let mut ends = Vec::new();
    for span in curve.knots().breaks().windows(2) {
        let mut halves = Vec::new();
        halve(curve, (span[0], span[1]), far, &mut halves);
        // As many equal parts as the shortest half needs are often too many: try with fewer.
        let (mut low, mut high) = (1, halves.len());
        let fits = |n: usize| {
            let at = |i: usize| span[0] + (span[1] - span[0]) * i as f64 / n as f64;
            (0..n).all(|i| !far(at(i), at(i + 1)))
        };
        while low < high {
            let n = usize::midpoint(low, high);
            if fits(n) { high = n } else { low = n + 1 }
        }
        if low < halves.len() || fits(low) {
            ends.extend((1..=low).map(|i| span[0] + (span[1] - span[0]) * i as f64 / low as f64));
        } else {
            ends.extend(halves.iter().map(|h| h.1));
        }
    }
    ends
}
