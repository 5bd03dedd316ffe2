//! Smooth drive curves through places that lie on a curve, more or less.

use claymill_nurbs::{Curve2, Point2};

use crate::curve::cubics::Cubics;
use crate::curve::drive::DriveCurve;
use crate::curve::spline::{Datum, knot_vector, least_squares};

/// A drive curve may run this far beside the places that it is made of, mm: a hundredth of a fine step-over.
const BESIDE_MM: f64 = 0.01;
/// Where places turn by more than this a drive curve ends and another begins, degrees.
const KINK_DEG: f64 = 25.0;
/// First spans: at least so many places and so long, mm.
const PLACES_PER_SPAN: usize = 4;
const SPAN_MM: f64 = 24.0;
const ROUNDS: usize = 8;
/// Places closer than this are one, mm.
const SAME_MM: f64 = 1e-4;
const SHORTEST_MM: f64 = 0.5;

/// A drive curve and its parameters at the places that it is made of.
#[derive(Debug, Clone)]
pub(crate) struct Drawn {
    pub(crate) drive: DriveCurve,
    /// Index of the place, parameter there; both ascend.
    pub(crate) at: Vec<(usize, f64)>,
    /// Parameters at which it turns sharply.
    pub(crate) corners: Vec<f64>,
}

/// Drive curves along `places`: one, or several end to end where the places turn sharply.
pub(crate) fn through(places: &[Point2]) -> Vec<Drawn> {
    within(places, BESIDE_MM)
}

/// The same, this close to the places.
pub(crate) fn within(places: &[Point2], beside_mm: f64) -> Vec<Drawn> {
    let mut kept: Vec<usize> = Vec::with_capacity(places.len());
    for (i, p) in places.iter().enumerate() {
        if kept.last().is_none_or(|&k| (p - places[k]).norm() > SAME_MM) {
            kept.push(i);
        }
    }
    let turns = |w: &[usize]| {
        let (a, b) = (places[w[1]] - places[w[0]], places[w[2]] - places[w[1]]);
        a.angle(&b).to_degrees() > KINK_DEG
    };
    let mut starts = vec![0];
    starts.extend((1..kept.len().saturating_sub(1)).filter(|&i| turns(&kept[i - 1..=i + 1])));
    starts.push(kept.len().saturating_sub(1));
    starts
        .windows(2)
        .filter(|w| w[1] > w[0])
        .filter_map(|w| smooth(places, &kept[w[0]..=w[1]], beside_mm))
        .collect()
}

fn smooth(places: &[Point2], kept: &[usize], beside_mm: f64) -> Option<Drawn> {
    let mut at = vec![(kept[0], 0.0)];
    for w in kept.windows(2) {
        at.push((w[1], at[at.len() - 1].1 + (places[w[1]] - places[w[0]]).norm()));
    }
    let length = at[at.len() - 1].1;
    if length < SHORTEST_MM {
        return None;
    }
    let mut breaks = first_breaks(&at);
    for round in 0..ROUNDS {
        let curve = fit(places, &at, &breaks)?;
        let off: Vec<f64> = at.iter().map(|&(i, s)| (curve.point(s) - places[i]).norm()).collect();
        let finer = if round + 1 < ROUNDS { split(&at, &off, &breaks, beside_mm) } else { breaks.clone() };
        if finer.len() == breaks.len() {
            return Some(Drawn { drive: DriveCurve::Curved(Cubics::new(&curve)?), at, corners: Vec::new() });
        }
        breaks = finer;
    }
    None
}

fn first_breaks(at: &[(usize, f64)]) -> Vec<f64> {
    let mut breaks = vec![0.0];
    let mut since = 0;
    for &(_, s) in &at[1..at.len() - 1] {
        since += 1;
        if since >= PLACES_PER_SPAN && s - breaks[breaks.len() - 1] >= SPAN_MM {
            breaks.push(s);
            since = 0;
        }
    }
    if since + 1 < PLACES_PER_SPAN && breaks.len() > 1 {
        breaks.pop();
    }
    breaks.push(at[at.len() - 1].1);
    breaks
}

/// Halves the spans in which a place is too far away, as long as each half keeps places enough.
fn split(at: &[(usize, f64)], off: &[f64], breaks: &[f64], beside_mm: f64) -> Vec<f64> {
    let mut finer = vec![breaks[0]];
    for span in breaks.windows(2) {
        let from = at.partition_point(|p| p.1 < span[0]);
        let to = at.partition_point(|p| p.1 <= span[1]);
        let middle = usize::midpoint(from, to);
        if to - from >= 2 * PLACES_PER_SPAN && off[from..to].iter().any(|&d| d > beside_mm) {
            finer.push(at[middle].1);
        }
        finer.push(span[1]);
    }
    finer
}

/// Between places the data go on along the chord, so that every span is determined; they weigh little.
fn fit(places: &[Point2], at: &[(usize, f64)], breaks: &[f64]) -> Option<Curve2> {
    const CHORD_WEIGHT: f64 = 1e-3;
    let knots = knot_vector(breaks)?;
    let whole = at.iter().map(|&(i, t)| Datum { t, weight: 1.0, p: places[i] });
    let chords = at.windows(2).flat_map(|w| {
        let ((i, a), (j, b)) = (w[0], w[1]);
        [0.25, 0.5, 0.75].map(|f| Datum {
            t: a + f * (b - a),
            weight: CHORD_WEIGHT,
            p: places[i] + (places[j] - places[i]) * f,
        })
    });
    let ends = (places[at[0].0], places[at[at.len() - 1].0]);
    let points = least_squares(&knots, ends, whole.chain(chords))?;
    Curve2::new(knots, points, None).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_guide_runs_close_to_the_places_of_a_circle() {
        let places: Vec<Point2> = (0..=120)
            .map(|k| f64::from(k) * 0.025)
            .map(|a| Point2::new(50.0 * a.cos(), 50.0 * a.sin()))
            .collect();
        let [drawn] = &through(&places)[..] else { panic!() };
        let end = drawn.at[drawn.at.len() - 1].1;
        approx::assert_relative_eq!(end, 150.0, max_relative = 1e-4);
        for k in 0..=1000 {
            let s = end * f64::from(k) / 1000.0;
            let [x, y] = drawn.drive.at(s);
            assert!((x.hypot(y) - 50.0).abs() < BESIDE_MM, "{}", x.hypot(y) - 50.0);
            let [dx, dy] = drawn.drive.direction(s);
            approx::assert_abs_diff_eq!(dx.hypot(dy), 1.0, epsilon = 0.02);
        }
    }

    #[test]
    fn a_kink_parts_two_guides() {
        let places: Vec<Point2> =
            (0..=20).map(f64::from).map(|x| Point2::new(x, if x > 10.0 { x - 10.0 } else { 0.0 })).collect();
        assert_eq!(through(&places).len(), 2);
        assert!(through(&places[..1]).is_empty() && through(&[]).is_empty());
    }
}
