use claymill_nurbs::{Curve2, Leaves, Point3};

/// Bisection of a piece of edge stops at this fraction of the piece.
const STEPS: usize = 60;

/// Highest resting place of a dropped ball on the exact edge `S(c(t))`, `t` in `[t0, t1]`: centre height and
/// contact point.
///
/// The height `g(t) = z(t) + √(R² − d(t)²)` has the derivative of `(C − P)·P′` where `C` is the centre that
/// rests on `P(t)`; pieces are short enough for `g` to have one maximum, which bisection on that sign finds.
pub(crate) fn highest(
    surface: &Leaves,
    pcurve: &Curve2,
    (t0, t1): (f64, f64),
    x: f64,
    y: f64,
    r: f64,
) -> Option<(f64, Point3)> {
    // Sign of the way to higher contacts; outside the ball's reach it points toward (x, y).
    let uphill = |t: f64| {
        let [p, d, _] = surface.lift(pcurve, t);
        let (dx, dy) = (x - p.x, y - p.y);
        let rise = (r * r - dx * dx - dy * dy).max(0.0).sqrt();
        dx * d.x + dy * d.y + rise * d.z
    };
    let height = |t: f64| {
        let p = surface.point_on(pcurve, t);
        super::flat::on_point(&p, x, y, r).map(|z| (z, p))
    };
    let (mut a, mut b) = (t0, t1);
    let (ga, gb) = (uphill(a), uphill(b));
    if ga <= 0.0 {
        b = a;
    } else if gb >= 0.0 {
        a = b;
    } else {
        let mut secant = (ga, gb);
        for step in 0..STEPS {
            // Regula falsi with halving in between keeps a bracket and ends in a few steps.
            let t =
                if step % 3 == 2 { 0.5 * (a + b) } else { a + (b - a) * secant.0 / (secant.0 - secant.1) };
            let g = uphill(t);
            if g > 0.0 {
                (a, secant.0) = (t, g);
            } else {
                (b, secant.1) = (t, g);
            }
            if g.abs() < 1e-10 * (t1 - t0).recip().max(1.0) || b - a < 1e-12 * (t1 - t0) {
                a = t;
                b = t;
                break;
            }
        }
    }
    let inner = height(0.5 * (a + b));
    [inner, height(t0), height(t1)].into_iter().flatten().max_by(|p, q| p.0.total_cmp(&q.0))
}
