//! An oracle for areas that uses nothing of the kernel but evaluation.

use claymill_nurbs::{Curve2, Face};

/// Five-point Gauss–Legendre nodes and weights on `[0, 1]`.
const GAUSS: [(f64, f64); 5] = [
    (0.046910077030668, 0.118_463_442_528_094_5),
    (0.2307653449471585, 0.239314335249683),
    (0.5, 0.284_444_444_444_444_4),
    (0.7692346550528415, 0.239314335249683),
    (0.953089922969332, 0.118_463_442_528_094_5),
];

/// Area of a trimmed face by Green's theorem: the integral of `F dv` around the loops, where `F(u, v)` is the
/// integral of the area element from `u0` to `u`.
pub(crate) fn green_area(face: &Face) -> f64 {
    let surface = &face.surface;
    let breaks = surface.knots_u().breaks();
    let strip = |u: f64, v: f64| -> f64 {
        let element = |t: f64| {
            let j = surface.jet(t, v);
            j.su.cross(&j.sv).norm()
        };
        breaks
            .windows(2)
            .filter(|w| w[0] < u)
            .map(|w| {
                let (a, b) = (w[0], w[1].min(u));
                GAUSS.iter().map(|(x, w)| w * (b - a) * element(a + (b - a) * x)).sum::<f64>()
            })
            .sum()
    };
    let edge = |c: &Curve2| -> f64 {
        let spans = c.knots().breaks();
        let parts = if spans.len() > 8 { 1 } else { 12 };
        let mut cuts: Vec<f64> = spans
            .windows(2)
            .flat_map(|w| (0..parts).map(move |k| w[0] + (w[1] - w[0]) * f64::from(k) / f64::from(parts)))
            .chain(spans.last().copied())
            .collect();
        // The integrand has kinks where a straight edge crosses the surface's knots.
        if c.knots().degree() == 1 && spans.len() == 2 {
            let (from, rise, length) = (c.start().y, c.end().y - c.start().y, spans[1] - spans[0]);
            let crossings = surface.knots_v().breaks().into_iter().map(|k| (k - from) / rise);
            cuts.extend(crossings.filter(|x| *x > 0.0 && *x < 1.0).map(|x| spans[0] + x * length));
            cuts.sort_by(f64::total_cmp);
        }
        cuts.windows(2)
            .flat_map(|w| GAUSS.map(|(x, weight)| (w[0] + (w[1] - w[0]) * x, weight * (w[1] - w[0]))))
            .map(|(t, w)| {
                let [p, d, _] = c.derivatives(t);
                if d.y == 0.0 { 0.0 } else { w * d.y * strip(p.x, p.y) }
            })
            .sum()
    };
    face.boundary().iter().flat_map(|l| &l.edges).map(|e| edge(&e.pcurve)).sum()
}
