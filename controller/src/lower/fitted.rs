//! Replaces a rational curve by a plain cubic: Hermite pieces, halved until they are within
//! tolerance.

use claymill_nurbs::{Curve3, KnotVector, Point3, between};

/// Pieces below which a curve is no longer halved: it has a cusp that nothing smooth follows.
const SMALLEST_MM: f64 = 1e-3;

/// Pieces of one curve at most: more are not smooth, but a curve that no cubic follows.
const MOST_PARTS: usize = 100_000;

/// A cubic without weights, with the curve's points and derivatives at its joints, within `tolerance_mm`; `None` where that
/// takes too many.
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
        halve(curve, (span[0], span[1]), &far, &mut stations)?;
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

/// Cuts `span` in halves until no part is `far` from what stands for it; `None` where that takes too many parts.
fn halve(
    curve: &Curve3,
    span: (f64, f64),
    far: &dyn Fn(f64, f64) -> bool,
    parts: &mut Vec<(f64, f64)>,
) -> Option<()> {
    let mut waiting = vec![span];
    while let Some((a, b)) = waiting.pop() {
        // Halving ends where no parameter is left between two, too.
        let Some(middle) = between(a, b) else {
            parts.push((a, b));
            continue;
        };
        let small = (curve.point(b) - curve.point(a)).norm() < SMALLEST_MM
            && (curve.point(middle) - curve.point(a)).norm() < SMALLEST_MM;
        if !small && far(a, b) {
            waiting.extend([(middle, b), (a, middle)]);
        } else {
            parts.push((a, b));
        }
        if parts.len() + waiting.len() > MOST_PARTS {
            return None;
        }
    }
    Some(())
}
