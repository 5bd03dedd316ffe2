use claymill_nurbs::{Curve2, Leaves, Point3};

/// Steps on a piece of edge, at most; Newton's end after a few.
const STEPS: usize = 60;
/// What is left of the slope `(C − P)·P′/|P′|` at the highest place, mm.
const RESIDUAL_MM: f64 = 1e-9;

/// Highest resting place of a dropped ball on the exact edge `S(c(t))`, `t` in `[t0, t1]`, looked for from a `share` of
/// the way: centre height and contact point.
///
/// The height `g(t) = z(t) + √(R² − d(t)²)` has the derivative of `(C − P)·P′` where `C` is the centre that
/// rests on `P(t)`; pieces are short enough for `g` to have one maximum, which Newton on that product finds, within a
/// bracket of its signs.
pub(crate) fn highest(
    surface: &Leaves,
    pcurve: &Curve2,
    (t0, t1): (f64, f64),
    share: f64,
    x: f64,
    y: f64,
    r: f64,
) -> Option<(f64, Point3)> {
    let height = |p: Point3| super::flat::on_point(&p, x, y, r).map(|z| (z, p));
    let (mut a, mut b) = (t0, t1);
    let mut t = t0 + (t1 - t0) * share.clamp(0.0, 1.0);
    let mut inner = None;
    for _ in 0..STEPS {
        let [p, d, dd] = surface.lift(pcurve, t);
        let (dx, dy) = (x - p.x, y - p.y);
        let rise2 = r * r - dx * dx - dy * dy;
        // Outside the ball's reach the way to higher contacts is the one toward (x, y).
        let rise = rise2.max(0.0).sqrt();
        let uphill = dx * d.x + dy * d.y + rise * d.z;
        inner = (rise2 > 0.0).then(|| Point3::from(p));
        if uphill * uphill <= RESIDUAL_MM * RESIDUAL_MM * d.norm_squared() {
            break;
        }
        if uphill > 0.0 {
            a = t;
        } else {
            b = t;
        }
        let bend =
            dx * dd.x + dy * dd.y + rise * dd.z + (dx * d.x + dy * d.y) / rise * d.z - d.x * d.x - d.y * d.y;
        let newton = t - uphill / bend;
        let at_end = (uphill > 0.0 && t == t1) || (uphill < 0.0 && t == t0);
        if at_end || b - a < 1e-12 * (t1 - t0) {
            break;
        }
        t = if bend < 0.0 && newton > a && newton < b {
            newton
        } else if bend < 0.0 && newton >= t1 {
            t1
        } else if bend < 0.0 && newton <= t0 {
            t0
        } else {
            0.5 * (a + b)
        };
    }
    let ends = [t0, t1].map(|t| surface.point_on(pcurve, t));
    [inner, Some(ends[0]), Some(ends[1])]
        .into_iter()
        .flatten()
        .filter_map(height)
        .max_by(|p, q| p.0.total_cmp(&q.0))
}
