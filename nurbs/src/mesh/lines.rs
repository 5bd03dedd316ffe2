//! The parameter lines of a triangulation grid: every knot, and between knots as close as curvature
//! bounds and the longest edge ask for.

use crate::curvedness::{Bounds, Curvedness};
use crate::{MeshOptions, NurbsError, Point2};

/// The parameter lines of a grid over a box: every break of the surface is one, and between two breaks they
/// are evenly spaced, as close as the most curved piece there needs.
#[derive(Debug, Clone)]
pub(crate) struct Lines {
    pub(crate) u: Vec<f64>,
    pub(crate) v: Vec<f64>,
}

/// More grid points than this on one face are refused rather than stored.
const MOST_POINTS: f64 = 1e7;

impl Lines {
    pub(crate) fn new(
        curved: &Curvedness,
        (min, max): (Point2, Point2),
        options: &MeshOptions,
    ) -> Result<Self, NurbsError> {
        let (bu, bv) = (within(&curved.breaks_u, min.x, max.x), within(&curved.breaks_v, min.y, max.y));
        let mut steps_u = vec![1.0f64; bu.len() - 1];
        let mut steps_v = vec![1.0f64; bv.len() - 1];
        for i in 0..steps_u.len() {
            for j in 0..steps_v.len() {
                let (a, b) = (Point2::new(bu[i], bv[j]), Point2::new(bu[i + 1], bv[j + 1]));
                let (nu, nv) = steps(&curved.over(a, b), b.x - a.x, b.y - a.y, options);
                steps_u[i] = steps_u[i].max(nu);
                steps_v[j] = steps_v[j].max(nv);
            }
        }
        let points = steps_u.iter().sum::<f64>() * steps_v.iter().sum::<f64>();
        if points.is_nan() || points > MOST_POINTS {
            let reason =
                format!("{points:.0} points would be needed: the tolerance is too fine for its size");
            return Err(NurbsError::Mesh { reason });
        }
        Ok(Lines { u: subdivided(&bu, &steps_u), v: subdivided(&bv, &steps_v) })
    }
}

/// The breaks inside `[a, b]` with both ends.
fn within(breaks: &[f64], a: f64, b: f64) -> Vec<f64> {
    let mut all = vec![a];
    all.extend(breaks.iter().filter(|&&k| a < k && k < b));
    all.push(b);
    all
}

fn subdivided(breaks: &[f64], steps: &[f64]) -> Vec<f64> {
    let mut lines = Vec::new();
    for (ends, &n) in breaks.windows(2).zip(steps) {
        lines.extend((0..n as usize).map(|k| ends[0] + (ends[1] - ends[0]) * (k as f64 / n)));
    }
    lines.push(breaks[breaks.len() - 1]);
    lines
}

/// Number of steps in `u` and `v` over a box of the size `(wu, wv)`.
fn steps(b: &Bounds, wu: f64, wv: f64, options: &MeshOptions) -> (f64, f64) {
    let tolerance = options.deviation_mm;
    let single = |w: f64, second: f64| (w * (0.125 * second / tolerance).sqrt()).max(1.0);
    let (mut nu, mut nv) = (single(wu, b.uu), single(wv, b.vv));
    let together = b.deviation_mm(wu / nu, wv / nv);
    if together > tolerance {
        // Refine only where it helps: a direction with no second derivative of its own keeps its steps
        // unless the twist needs it.
        let finer = (together / tolerance).sqrt();
        let twist = 0.25 * (wu / nu) * (wv / nv) * b.uv > 0.5 * tolerance;
        if nu > 1.0 || twist {
            nu *= finer;
        }
        if nv > 1.0 || twist {
            nv *= finer;
        }
        let rest = (b.deviation_mm(wu / nu.ceil(), wv / nv.ceil()) / tolerance).sqrt();
        if rest > 1.0 {
            (nu, nv) = (nu.ceil() * rest, nv.ceil() * rest);
        }
    }
    // The shorter diagonal of a cell is at most the hypotenuse of its bounds.
    let longest = options.longest_edge_mm * std::f64::consts::FRAC_1_SQRT_2;
    (nu.max(wu * b.u / longest).ceil(), nv.max(wv * b.v / longest).ceil())
}
