//! How long a machine takes: feed, acceleration, jerk, bends and corners, by the law of `claymill_motion`.

use claymill_motion::{JointRule, Limits, Looks, Rail, Schedule, Track};
use claymill_toolpath::{MachineLimits, Move};
use rayon::prelude::*;

/// Moves that are looked at side by side.
const MOVES_AT_ONCE: usize = 4096;

/// Time of each move of a program that begins and ends at rest, s.
#[must_use]
pub fn times_s(moves: &[Move], machine: &MachineLimits) -> Vec<f64> {
    let limits = Limits {
        acceleration_mm_per_s2: machine.acceleration_mm_per_s2,
        jerk_mm_per_s3: machine.jerk_mm_per_s3,
    };
    let mut track = Track::new(limits, JointRule::Within { mm: machine.corner_mm, stop_deg: 180.0 });
    let mut known = Vec::with_capacity(moves.len());
    for some in moves.chunks(MOVES_AT_ONCE) {
        let rail = |m: &Move| m.curve().ok().map(|curve| Rail::new(curve, Looks::COARSE));
        let rails: Vec<Option<Rail>> = some.par_iter().map(rail).collect();
        for (m, rail) in some.iter().zip(&rails) {
            known.push(rail.is_some());
            rail.iter().for_each(|rail| track.add(rail, m.feed));
        }
    }
    let mut ends = Schedule::new(&track, false).ends_s.into_iter();
    let mut last = 0.0;
    let mut next = |known: bool| {
        let end = if known { ends.next().unwrap_or(last) } else { last };
        end - std::mem::replace(&mut last, end)
    };
    known.into_iter().map(&mut next).collect()
}

#[cfg(test)]
mod tests {
    use claymill_nurbs::{Point3, Vector3};
    use claymill_toolpath::MoveKind;

    use super::*;

    fn machine() -> MachineLimits {
        MachineLimits { acceleration_mm_per_s2: 1000.0, jerk_mm_per_s3: 10_000.0, ..MachineLimits::default() }
    }

    fn straight(from: [f64; 3], to: [f64; 3], feed: f64) -> Move {
        Move::straight(MoveKind::Cut, Point3::from(from), Point3::from(to), Vector3::z(), feed)
    }

    #[test]
    fn from_rest_to_rest_the_closed_form_holds() {
        // docs/theory.md §9.1: t = L/v + v/a + a/j.
        let t = times_s(&[straight([0.0; 3], [500.0, 0.0, 0.0], 10_000.0)], &machine());
        approx::assert_abs_diff_eq!(t[0], 3.266_66, epsilon = 1e-4);
        // Too short to reach feed or acceleration: t = 4 (L / 2j)^⅓.
        let t = times_s(&[straight([0.0; 3], [1.0, 0.0, 0.0], 10_000.0)], &machine());
        approx::assert_relative_eq!(t[0], 4.0 * (1.0 / 20_000.0f64).cbrt(), max_relative = 1e-6);
    }

    #[test]
    fn straight_on_is_not_a_stop_and_turning_back_is() {
        let on = [
            straight([0.0; 3], [250.0, 0.0, 0.0], 10_000.0),
            straight([250.0, 0.0, 0.0], [500.0, 0.0, 0.0], 10_000.0),
        ];
        approx::assert_abs_diff_eq!(times_s(&on, &machine()).iter().sum::<f64>(), 3.266_66, epsilon = 1e-4);
        let back = [
            straight([0.0; 3], [250.0, 0.0, 0.0], 10_000.0),
            straight([250.0, 0.0, 0.0], [0.0; 3], 10_000.0),
        ];
        let one = 250.0 / (10_000.0 / 60.0) + 10_000.0 / 60.0 / 1000.0 + 0.1;
        approx::assert_abs_diff_eq!(
            times_s(&back, &machine()).iter().sum::<f64>(),
            2.0 * one,
            epsilon = 1e-4
        );
    }

    #[test]
    fn a_circle_is_run_as_fast_as_its_bend_allows() {
        // A quarter of a circle of 10 mm: six tenths of the jerk are for the bend, (0.6 · 10⁴ · 10²)^⅓ = 84.3 mm/s,
        // with the margin of 1.1 on the change of curvature 81.7 mm/s.
        let placement =
            claymill_nurbs::analytic::Frame::new(Point3::origin(), Vector3::z(), Vector3::x()).unwrap();
        let arc = claymill_nurbs::analytic::circle_arc(&placement, 10.0, (0.0, std::f64::consts::FRAC_PI_2))
            .unwrap();
        let moves = [
            straight([10.0, -400.0, 0.0], [10.0, 0.0, 0.0], 10_000.0),
            Move::along(MoveKind::Cut, &arc, Vector3::z(), 10_000.0),
            straight([0.0, 10.0, 0.0], [-400.0, 10.0, 0.0], 10_000.0),
        ];
        let t = times_s(&moves, &machine());
        approx::assert_relative_eq!(t[1], 0.5 * std::f64::consts::PI * 10.0 / 81.7, max_relative = 0.02);
    }
}
