//! Places along curves: spread over them, and nearest to a point.

use claymill_nurbs::{Curve3, NurbsCurve, Point3};

/// Parameter of the point of `curve` nearest to `p`: samples, then Newton steps.
pub(crate) fn parameter_near(curve: &Curve3, p: &Point3) -> f64 {
    let (first, last) = curve.domain();
    let samples = samples(curve, 4 * curve.knots().degree().max(2));
    let distance = |t: f64| (curve.point(t) - p).norm_squared();
    let nearest = samples.iter().copied().map(|t| (distance(t), t));
    let (mut best, mut t) = nearest.fold((f64::INFINITY, first), |a, b| if b.0 < a.0 { b } else { a });
    for _ in 0..20 {
        let [c, d1, d2] = curve.derivatives(t);
        let r = c - p.coords;
        let slope = r.dot(&d1);
        let bend = d1.norm_squared() + r.dot(&d2);
        let bend = if bend > 0.0 { bend } else { d1.norm_squared() };
        let mut step = slope / bend;
        if !step.is_finite() || step == 0.0 {
            break;
        }
        let mut next = (t - step).clamp(first, last);
        while distance(next) > best && step.abs() > 1e-15 * (last - first) {
            step *= 0.5;
            next = (t - step).clamp(first, last);
        }
        let now = distance(next);
        if now >= best {
            break;
        }
        (best, t) = (now, next);
    }
    t
}

/// Parameters along a curve: `per_span` on each polynomial piece, and the last.
pub(crate) fn samples<const D: usize>(curve: &NurbsCurve<D>, per_span: usize) -> Vec<f64> {
    let breaks = curve.knots().breaks();
    let inside = |w: &[f64]| {
        let (a, b) = (w[0], w[1]);
        (0..per_span).map(move |i| a + (b - a) * i as f64 / per_span as f64)
    };
    let mut all: Vec<f64> = breaks.windows(2).flat_map(inside).collect();
    all.extend(breaks.last());
    all
}
