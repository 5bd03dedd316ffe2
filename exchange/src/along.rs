//! Places along curves: spread over them, and nearest to a point.

use claymill_nurbs::{Curve3, NurbsCurve, Point3};

/// Parameter of the point of `curve` nearest to `p`: samples, then Newton steps.
pub(crate) fn parameter_near(curve: &Curve3, p: &Point3) -> f64 {
    let (first, last) = curve.domain();
    let samples = samples(curve, 4 * curve.knots().degree().max(2));
    let distance = |t: f64| (curve.point(t) - p).norm_squared();
    let nearest = samples.iter().copied().map(|t| (distance(t), t));
    let (_, start) = nearest.fold((f64::INFINITY, first), |a, b| if b.0 < a.0 { b } else { a });
    let found = descended(curve, p, start);
    // Where a curve closes, the way from its first end may lead out of it, and from its last to the point.
    if start != first {
        return found;
    }
    let other = descended(curve, p, last);
    if distance(other) < distance(found) { other } else { found }
}

/// Where Newton steps from a parameter lead to, never further away.
fn descended(curve: &Curve3, p: &Point3, mut t: f64) -> f64 {
    let (first, last) = curve.domain();
    let distance = |t: f64| (curve.point(t) - p).norm_squared();
    let mut best = distance(t);
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

#[cfg(test)]
mod tests {
    use claymill_nurbs::Vector3;
    use claymill_nurbs::analytic::{Frame, circle_arc};

    use super::*;

    #[test]
    fn the_nearest_point_of_a_closed_curve_is_found_on_both_sides_of_its_ends() {
        let frame = Frame::new(Point3::new(1.0, 2.0, 3.0), Vector3::z(), Vector3::x()).unwrap();
        let circle = circle_arc(&frame, 18.0, (0.0, std::f64::consts::TAU)).unwrap();
        for deg in [-7.0, -0.1, 0.0, 0.1, 7.0, 123.0_f64] {
            let (sine, cosine) = deg.to_radians().sin_cos();
            let p = frame.point(18.5 * cosine, 18.5 * sine, 0.0);
            let away = (circle.point(parameter_near(&circle, &p)) - p).norm();
            approx::assert_abs_diff_eq!(away, 0.5, epsilon = 1e-9);
        }
    }
}
