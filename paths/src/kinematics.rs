//! How long a machine takes: feed, acceleration, jerk and corners.
//!
//! ```text
//!   v │   ┌──────────┐          limits: feed, curvature, corners
//!     │  ╱            ╲__╱╲     what acceleration makes of them, forwards and backwards
//!     └─────────────────────► s
//! ```
//!
//! Controls filter the speed so that acceleration takes `a / j` to build up; from rest to rest that makes the
//! way last as much longer (geometry.md §9: 500 mm at 10 m/min, 1 m/s², 10 m/s³ take 3.26666 s).

use claymill_nurbs::Vector3;
use claymill_toolpath::Move;

use crate::Feeds;

/// How far from a corner the control may run, mm.
const CORNER_MM: f64 = 0.005;
/// Directions that differ by less than this are no corner, as a sine.
const STRAIGHT_SINE: f64 = 0.01;
/// Places at which each knot span of a curve is looked at.
const LOOKS: u32 = 4;
/// Slower than this stands still, mm/s.
const STILL_MM_PER_S: f64 = 1e-3;

/// A place on the way with the fastest that it allows, mm/s.
#[derive(Debug, Clone, Copy)]
struct Node {
    v: f64,
    /// Length and fastest speed of the way to the next node.
    ahead_mm: f64,
    ahead_v: f64,
    /// The move ahead.
    of: usize,
}

/// Time of each move of a program that begins and ends at rest, s.
#[must_use]
pub fn times_s(moves: &[Move], feeds: &Feeds) -> Vec<f64> {
    let mut nodes = Vec::new();
    let mut heading: Option<Vector3> = None;
    for (of, m) in moves.iter().enumerate() {
        add(&mut nodes, of, m, feeds, &mut heading);
    }
    nodes.push(Node { v: 0.0, ahead_mm: 0.0, ahead_v: 0.0, of: moves.len() });
    let a = feeds.acceleration_mm_per_s2;
    let reach = |v: f64, way_mm: f64| (v * v + 2.0 * a * way_mm).sqrt();
    for i in 1..nodes.len() {
        nodes[i].v = nodes[i].v.min(reach(nodes[i - 1].v, nodes[i - 1].ahead_mm));
    }
    for i in (1..nodes.len()).rev() {
        nodes[i - 1].v = nodes[i - 1].v.min(reach(nodes[i].v, nodes[i - 1].ahead_mm));
    }
    let mut times = vec![0.0; moves.len()];
    for w in nodes.windows(2) {
        let (from, to) = (w[0], w[1]);
        times[from.of] += over(from.ahead_mm, from.v, to.v, from.ahead_v, a);
        if to.v <= STILL_MM_PER_S && from.ahead_mm > 0.0 {
            times[from.of] += a / feeds.jerk_mm_per_s3;
        }
    }
    times
}

/// Time over a way between two speeds, as fast as allowed.
fn over(way_mm: f64, v0: f64, v1: f64, most: f64, a: f64) -> f64 {
    if way_mm <= 0.0 {
        return 0.0;
    }
    let peak = (0.5 * (v0 * v0 + v1 * v1) + a * way_mm).sqrt().min(most).max(v0).max(v1);
    let ramps_mm = (2.0 * peak * peak - v0 * v0 - v1 * v1) / (2.0 * a);
    (2.0 * peak - v0 - v1) / a + (way_mm - ramps_mm).max(0.0) / peak
}

/// Adds the nodes of a move.
fn add(nodes: &mut Vec<Node>, of: usize, m: &Move, feeds: &Feeds, heading: &mut Option<Vector3>) {
    let feed = m.feed / 60.0;
    let Ok(curve) = m.curve() else { return };
    let breaks = curve.knots().breaks();
    let looks = if m.degree == 1 { 1 } else { LOOKS };
    let mut first = true;
    for span in breaks.windows(2) {
        let width = (span[1] - span[0]) / f64::from(looks);
        for k in 0..looks {
            // Inside the span, where derivatives are its own.
            let at = |share: f64| curve.derivatives(span[0] + width * (f64::from(k) + share));
            let ([p, ..], [_, speed, bend], [q, ..]) = (at(0.0), at(0.5), at(1.0));
            let rate = speed.norm();
            if rate <= 0.0 {
                continue;
            }
            let curvature = speed.cross(&bend).norm() / rate.powi(3);
            let in_bend = if curvature > 0.0 {
                let by_acceleration = (feeds.acceleration_mm_per_s2 / curvature).sqrt();
                by_acceleration.min((feeds.jerk_mm_per_s3 / (curvature * curvature)).cbrt())
            } else {
                f64::INFINITY
            };
            let most = feed.min(in_bend);
            let mut v = most.min(nodes.last().map_or(0.0, |n: &Node| n.ahead_v));
            if first {
                let [_, ahead, _] = at(1e-6);
                let ahead = ahead.normalize();
                v = v.min(heading.map_or(0.0, |before| corner(&before, &ahead, feeds)));
                first = false;
            }
            nodes.push(Node { v, ahead_mm: (q - p).norm(), ahead_v: most, of });
        }
    }
    let [_, last, _] = curve.derivatives(breaks[breaks.len() - 1]);
    *heading = last.try_normalize(0.0).or(*heading);
}

/// Fastest speed through a corner at which the way stays within [`CORNER_MM`] of it (geometry.md §9).
fn corner(before: &Vector3, after: &Vector3, feeds: &Feeds) -> f64 {
    let turned_back = 0.5 * (1.0 - before.dot(after));
    if before.dot(after) > 0.0 && before.cross(after).norm() < STRAIGHT_SINE {
        return f64::INFINITY;
    }
    // θ is the angle between the ways, 180° for straight on.
    let sine = (1.0 - turned_back).max(0.0).sqrt();
    (feeds.acceleration_mm_per_s2 * CORNER_MM * sine / (1.0 - sine)).sqrt()
}

#[cfg(test)]
mod tests {
    use claymill_nurbs::Point3;
    use claymill_toolpath::MoveKind;

    use super::*;

    fn feeds() -> Feeds {
        Feeds { acceleration_mm_per_s2: 1000.0, jerk_mm_per_s3: 10_000.0, ..Feeds::default() }
    }

    fn straight(from: [f64; 3], to: [f64; 3], feed: f64) -> Move {
        Move::straight(MoveKind::Cut, Point3::from(from), Point3::from(to), Vector3::z(), feed)
    }

    #[test]
    fn from_rest_to_rest_the_closed_form_holds() {
        // geometry.md §9: t = L/v + v/a + a/j.
        let t = times_s(&[straight([0.0; 3], [500.0, 0.0, 0.0], 10_000.0)], &feeds());
        approx::assert_abs_diff_eq!(t[0], 3.266_66, epsilon = 1e-4);
        // Too short to reach the feed: t = 2 √(L/a) + a/j.
        let t = times_s(&[straight([0.0; 3], [1.0, 0.0, 0.0], 10_000.0)], &feeds());
        approx::assert_abs_diff_eq!(t[0], 2.0 * (1.0 / 1000.0f64).sqrt() + 0.1, epsilon = 1e-9);
    }

    #[test]
    fn straight_on_is_not_a_stop_and_turning_back_is() {
        let on = [
            straight([0.0; 3], [250.0, 0.0, 0.0], 10_000.0),
            straight([250.0, 0.0, 0.0], [500.0, 0.0, 0.0], 10_000.0),
        ];
        approx::assert_abs_diff_eq!(times_s(&on, &feeds()).iter().sum::<f64>(), 3.266_66, epsilon = 1e-4);
        let back = [
            straight([0.0; 3], [250.0, 0.0, 0.0], 10_000.0),
            straight([250.0, 0.0, 0.0], [0.0; 3], 10_000.0),
        ];
        let one = 250.0 / (10_000.0 / 60.0) + 10_000.0 / 60.0 / 1000.0 + 0.1;
        approx::assert_abs_diff_eq!(times_s(&back, &feeds()).iter().sum::<f64>(), 2.0 * one, epsilon = 1e-4);
    }

    #[test]
    fn a_circle_is_run_as_fast_as_its_bend_allows() {
        // A quarter of a circle of 10 mm: by jerk (10⁴ · 100)^⅓ = 100 mm/s and by acceleration √(1000 · 10) = 100 mm/s.
        let placement =
            claymill_nurbs::analytic::Frame::new(Point3::origin(), Vector3::z(), Vector3::x()).unwrap();
        let arc = claymill_nurbs::analytic::circle_arc(&placement, 10.0, (0.0, std::f64::consts::FRAC_PI_2))
            .unwrap();
        let moves = [
            straight([10.0, -400.0, 0.0], [10.0, 0.0, 0.0], 10_000.0),
            Move::along(MoveKind::Cut, &arc, Vector3::z(), 10_000.0),
            straight([0.0, 10.0, 0.0], [-400.0, 10.0, 0.0], 10_000.0),
        ];
        let t = times_s(&moves, &feeds());
        approx::assert_relative_eq!(t[1], 0.5 * std::f64::consts::PI * 10.0 / 100.0, max_relative = 0.02);
    }
}
