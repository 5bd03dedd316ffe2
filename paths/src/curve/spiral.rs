//! One way through closed lines that lie inside each other, without a step from one to the next.
//!
//! ```text
//!    ╭───────────╮      once around the first line, then turn by turn from each line over to the next,
//!    │ ╭───────╮ │      by the share of the turn that is behind, and once around the last
//!    │ │ ╭───╮ │ │
//!    │ │ ╰─▶─╯ │╱
//!    │ ╰──────╱╯
//!    ╰───────╯
//! ```
//!
//! Two neighbouring turns are as far apart everywhere as two neighbouring lines.

use claymill_nurbs::Point2;

/// Fewer lines are not worth a spiral, which goes round once more than they do.
pub(crate) const FEWEST: usize = 8;
/// The nearest place of the next line is looked for no further along it than this share of a turn.
const AROUND: f64 = 0.2;
/// Lines further apart than this, in steps, are no neighbours.
const FARTHEST_STEPS: f64 = 2.5;

/// A closed line in plan: its places without the first one again, and the share of the turn that is behind at each.
struct Turn {
    places: Vec<Point2>,
    share: Vec<f64>,
}

impl Turn {
    /// Begins next to a place and runs anticlockwise.
    fn new(closed: &[Point2], near: &Point2) -> Self {
        let mut places = closed[..closed.len() - 1].to_vec();
        let doubled: f64 =
            (0..places.len()).map(|k| places[k].coords.perp(&places[(k + 1) % places.len()].coords)).sum();
        if doubled < 0.0 {
            places.reverse();
        }
        let away = |k: &usize| (places[*k] - near).norm_squared();
        let first = (0..places.len()).min_by(|a, b| away(a).total_cmp(&away(b))).unwrap_or(0);
        places.rotate_left(first);
        let mut behind = vec![0.0];
        for k in 0..places.len() {
            behind.push(behind[k] + (places[(k + 1) % places.len()] - places[k]).norm());
        }
        let whole = behind[places.len()];
        Turn { share: behind[..places.len()].iter().map(|b| b / whole).collect(), places }
    }

    /// The place nearest to `p`, about where this share of the turn is behind.
    fn nearest(&self, p: &Point2, share: f64) -> Point2 {
        let count = self.places.len();
        let middle = self.share.partition_point(|s| *s < share);
        let reach = (AROUND * count as f64).ceil() as usize + 1;
        let sides = (0..=2 * reach).map(|k| (middle + count * 2 + k - reach) % count);
        let on_side = |k: usize| {
            let (a, b) = (self.places[k], self.places[(k + 1) % count]);
            let along = (p - a).dot(&(b - a)) / (b - a).norm_squared().max(f64::MIN_POSITIVE);
            a + (b - a) * along.clamp(0.0, 1.0)
        };
        sides
            .map(on_side)
            .min_by(|a, b| (a - p).norm_squared().total_cmp(&(b - p).norm_squared()))
            .unwrap_or(*p)
    }
}

/// The spiral through closed lines (each ends where it begins), one inside the other; `None` where two neighbours are
/// further apart than such lines are.
pub(crate) fn spiral(lines: &[Vec<Point2>], step_mm: f64) -> Option<Vec<Point2>> {
    let mut turn = Turn::new(lines.first()?, &lines[0][0]);
    let mut way = turn.places.clone();
    for line in &lines[1..] {
        let next = Turn::new(line, &turn.places[0]);
        for (p, &share) in turn.places.iter().zip(&turn.share) {
            let inward = next.nearest(p, share) - p;
            if inward.norm() > FARTHEST_STEPS * step_mm {
                return None;
            }
            way.push(p + inward * share);
        }
        turn = next;
    }
    way.extend(&turn.places);
    way.push(turn.places[0]);
    Some(way)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An ellipse as a polygon that ends where it begins.
    fn ellipse(a: f64, b: f64, count: u32, clockwise: bool, from: f64) -> Vec<Point2> {
        let turn = |k: u32| from + std::f64::consts::TAU * f64::from(k % count) / f64::from(count);
        let sign = if clockwise { -1.0 } else { 1.0 };
        (0..=count).map(|k| Point2::new(a * turn(k).cos(), sign * b * turn(k).sin())).collect()
    }

    #[test]
    fn turns_lie_a_step_apart_and_nothing_jumps() {
        let lines: Vec<Vec<Point2>> = (0..8)
            .map(|k| {
                ellipse(
                    40.0 - 2.0 * f64::from(k),
                    30.0 - 2.0 * f64::from(k),
                    200 + 7 * k,
                    k % 2 == 1,
                    f64::from(k),
                )
            })
            .collect();
        let way = spiral(&lines, 2.0).unwrap();
        // It begins on the first line, ends on the last, and every step is about a two-hundredth of a turn.
        approx::assert_abs_diff_eq!(way[0], lines[0][0]);
        let on_last = |p: &Point2| (p.x / 26.0).hypot(p.y / 16.0);
        assert!((on_last(&way[way.len() - 1]) - 1.0).abs() < 1e-9);
        let longest = way.windows(2).map(|w| (w[1] - w[0]).norm()).fold(0.0, f64::max);
        assert!(longest < 3.0, "{longest}");
        // Straight out from the middle neighbouring turns are no further apart than the lines: 2 mm at the ends of the axes.
        let crossings: Vec<f64> = way
            .windows(2)
            .filter(|w| w[0].y < 0.0 && w[1].y >= 0.0 && w[0].x > 0.0)
            .map(|w| w[0].x)
            .collect();
        assert_eq!(crossings.len(), 8);
        for w in crossings.windows(2) {
            assert!((w[0] - w[1] - 2.0).abs() < 0.3 || (w[0] - w[1]).abs() < 2.3, "{crossings:?}");
        }
        // Lines that are no neighbours are left alone.
        assert!(spiral(&[lines[0].clone(), lines[6].clone()], 2.0).is_none());
    }
}
