//! Areas from curves in the parameter plane, by Green's theorem.

use claymill_nurbs::{Curve2, NurbsSurface};

use super::ring::{FIVE, head_to_tail, parts};

/// Each span of the surface is integrated in so many parts.
const STRIPS: usize = 4;

/// `∮ F dv` around the pcurves of one bound, with `F(u, v) = ∫ |Su × Sv| du` from the left side of the surface to `u`:
/// the area inside, positive when they run anticlockwise, mm².
pub(super) fn enclosed(surface: &NurbsSurface, pcurves: &[Curve2]) -> f64 {
    let (us, vs) = (surface.knots_u().breaks(), surface.knots_v().breaks());
    let element = |u: f64, v: f64| {
        let jet = surface.jet(u, v);
        jet.su.cross(&jet.sv).norm()
    };
    let strip = |u: f64, v: f64| -> f64 {
        let spans = us.windows(2).filter(|w| w[0] < u).map(|w| (w[0], w[1].min(u)));
        // Half a turn may be one span.
        let over = |(a, b): (f64, f64)| -> f64 {
            let width = (b - a) / STRIPS as f64;
            let at = |k: usize, x: f64| a + (k as f64 + x) * width;
            (0..STRIPS).flat_map(|k| FIVE.map(|(x, weight)| weight * width * element(at(k, x), v))).sum()
        };
        spans.map(over).sum()
    };
    let along = |c: &Curve2| -> f64 {
        let piece = |(a, b): (f64, f64)| -> f64 {
            let at = |(x, weight): (f64, f64)| {
                let [p, slope, _] = c.derivatives(a + (b - a) * x);
                if slope.y == 0.0 { 0.0 } else { weight * (b - a) * slope.y * strip(p.x, p.y) }
            };
            FIVE.map(at).iter().sum()
        };
        let mut ranges = parts(c);
        // The strips change their law where a straight piece passes a knot.
        if c.knots().degree() == 1 {
            ranges = ranges.into_iter().flat_map(|r| cut(c, r, &vs)).collect();
        }
        ranges.into_iter().map(piece).sum()
    };
    head_to_tail(pcurves, |c| c.start(), |c| c.end(), Curve2::reversed).iter().map(along).sum()
}

/// The parts of a straight piece between the knots in `v`.
fn cut(c: &Curve2, (a, b): (f64, f64), vs: &[f64]) -> Vec<(f64, f64)> {
    let (from, to) = (c.point(a).y, c.point(b).y);
    let share = |v: &f64| (v - from) / (to - from);
    let mut shares: Vec<f64> = vs.iter().map(share).filter(|x| *x > 0.0 && *x < 1.0).collect();
    shares.sort_by(f64::total_cmp);
    let ends: Vec<f64> = [0.0].into_iter().chain(shares).chain([1.0]).map(|x| a + (b - a) * x).collect();
    ends.windows(2).map(|w| (w[0], w[1])).collect()
}
