//! Ways into closed passes: along a circle that touches the pass from inside and starts where nothing is left to cut.
//!
//! ```text
//!       pass ───────•───────►        A circle that may be run along (see `rounds`) is one way in: the tool comes out of
//!                 ╱   ╲              what it has reached, cuts deeper and deeper, and joins the pass along its tangent.
//!        way in  (  c  )  way out
//!     ~~~~~~~~~~~~\~~~/~~~~~~~~ A
//! ```

use crate::fronts::Ground;
use crate::outline::{Place, distance};

/// Places of a contour that are tried.
const MOST_TRIED: usize = 48;
/// Circles from as large as the tool, halved so often.
const HALVINGS: usize = 7;
/// A circle may stick out of what is reached by this, mm: chords do.
const SLACK_MM: f64 = 3e-3;
/// Steps along a circle, of which it takes this many to go around.
const STEPS: usize = 72;
/// The way out, in steps.
const STEPS_OUT: usize = 6;

/// A way in and out of a closed pass, along a circle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Lead {
    pub(crate) centre: Place,
    /// Where nothing is left to cut.
    pub(crate) from: Place,
    /// Where the pass is left.
    pub(crate) to: Place,
}

/// Where to enter a contour, and how; without a way in if no circle fits.
pub(crate) fn lead(contour: &[Place], ground: &Ground<'_>) -> (usize, Option<Lead>) {
    let n = contour.len();
    let stride = n.div_ceil(MOST_TRIED);
    let radius_mm = ground.limit.radius_mm();
    for halving in 0..HALVINGS {
        let r = radius_mm * 0.5_f64.powi(halving as i32);
        for k in (0..n).step_by(stride) {
            if let Some(lead) = circle(contour, k, r, ground) {
                return (k, Some(lead));
            }
        }
    }
    (0, None)
}

/// The circle of a radius that touches a contour at a vertex from its left.
fn circle(contour: &[Place], k: usize, r: f64, ground: &Ground<'_>) -> Option<Lead> {
    let n = contour.len();
    let p = contour[k];
    let (before, after) = (contour[(k + n - 1) % n], contour[(k + 1) % n]);
    let unit = |a: Place, b: Place| {
        let length = distance(a, b);
        (length > 0.0).then(|| [(b[0] - a[0]) / length, (b[1] - a[1]) / length])
    };
    let ([ux, uy], [vx, vy]) = (unit(before, p)?, unit(p, after)?);
    let tangent = unit([0.0, 0.0], [ux + vx, uy + vy])?;
    let centre = [p[0] - r * tangent[1], p[1] + r * tangent[0]];
    let clear_mm = ground.limit.cleared_radius_mm(r);
    let fits = ground.next.contains(centre)
        && ground.next.distance(centre, r) >= r - SLACK_MM
        && ground.uncut.distance(centre, clear_mm) >= clear_mm
        && !ground.uncut.contains(centre);
    if !fits {
        return None;
    }
    let at = |steps: f64| {
        let (sine, cosine) = (std::f64::consts::TAU * steps / STEPS as f64).sin_cos();
        let d = [p[0] - centre[0], p[1] - centre[1]];
        [centre[0] + cosine * d[0] - sine * d[1], centre[1] + sine * d[0] + cosine * d[1]]
    };
    let is_reached = |p: Place| ground.reached.contains(p) && ground.reached.distance(p, 0.01) > 1e-3;
    let steps = (STEPS / 8..STEPS * 3 / 4).find(|&s| is_reached(at(-(s as f64))))?;
    Some(Lead { centre, from: at(-(steps as f64)), to: at(STEPS_OUT as f64) })
}
