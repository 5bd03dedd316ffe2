//! The last look at what is emitted: in its written digits the ball enters no face anywhere along it.
//!
//! ```text
//!   g(a)      g(b)      gaps between ball and model, by closest points
//!    ●─────────●        no point of the model that keeps R away at both ends comes nearer between
//!      ▔▔▔▔▔▔▔          them than by h² / 8R, and by as much as the way bows out
//! ```
//!
//! Passes, links and leads are laid by drops of the ball. But then they are fitted, moved onto each other and rounded, and a ball
//! that comes down beside a narrow face need not be where it comes to rest a thousandth beside. So nothing of how they came
//! about is believed here. What is not proven is not emitted: links are lifted over, passes cut back.

use claymill_nurbs::{Curve3, Foot, Hint, Point3, Vector3};
use claymill_toolpath::{Move, WRITTEN_STEP_MM, round_to_written};

use crate::fit::written::one_span;
use crate::setup::context::SetupContext;

/// The ball may enter a face by this much, mm: more than the accuracy chain comes to.
const ENTERS_MM: f64 = 3e-3;
/// What may hide between two places is not looked for below this, mm.
const HIDES_MM: f64 = 2e-4;
/// A sharper corner is taken for one of this radius: what the faces of a model can hide between two places is no needle, mm.
const SHARPEST_MM: f64 = 0.5;
/// Farther away from the model than this nothing is asked, mm.
const AWAY_MM: f64 = 1.0;
/// What is cut out of a pass is found to this length, mm.
const CUT_OUT_MM: f64 = 0.1;

impl SetupContext<'_> {
    /// Whether the ball enters nothing along a written curve of its tip, nor is in the material of an open sheet.
    pub(crate) fn enters_nothing(&self, curve: &Curve3) -> bool {
        let end = self.ball.end();
        let radius_mm = end.radius_mm();
        let up = self.frame.axis() * radius_mm;
        let mut hint = Hint::default();
        let mut gap_mm = |tip: Point3| {
            let centre = tip + up;
            if !end.is_ball() {
                return self.gap_of_end_mm(tip, &centre, &mut hint);
            }
            match self.walls.closest.closest_from(&centre, radius_mm + AWAY_MM, &mut hint) {
                // All of the ball is, then.
                Some(foot) if self.ball.is_in_material(&foot, &centre) => -radius_mm,
                Some(foot) => foot.distance_mm - radius_mm,
                None => AWAY_MM,
            }
        };
        let corner_mm = end.corner_mm.max(SHARPEST_MM.min(radius_mm));
        curve.bezier_pieces().iter().all(|piece| is_clear(piece, corner_mm, &mut gap_mm))
    }

    /// The same of another end: how deep it enters, less than 0, and nothing where it does not.
    fn gap_of_end_mm(&self, tip: Point3, centre: &Point3, hint: &mut Hint) -> f64 {
        let radius_mm = self.ball.radius_mm();
        let mut foot = || self.walls.closest.closest_from(centre, radius_mm + AWAY_MM, hint);
        let cuts_material = |foot: Foot| self.ball.is_in_material(&foot, centre);
        if self.ball.has_material() && foot().is_some_and(cuts_material) {
            return -radius_mm;
        }
        -self.ball.entered_mm(&self.frame.to_setup(&tip))
    }

    /// The same of a curve of a pass, which may end with it: nor would the ball come up through the material from its ends, where
    /// no lead gets to.
    fn is_proven_of_pass(&self, curve: &Curve3) -> bool {
        let comes_up = |tip: Point3| {
            let centre = self.frame.to_setup(&tip) + Vector3::z() * self.ball.radius_mm();
            !self.ball.is_in_material_above(&centre)
        };
        comes_up(curve.start()) && comes_up(curve.end()) && self.enters_nothing(curve)
    }

    /// Whether it enters nothing on the straight way between two places.
    pub(crate) fn enters_nothing_between(&self, from: Point3, to: Point3) -> bool {
        from == to || self.enters_nothing(&Curve3::line(from, to))
    }

    /// A way, if it enters nothing.
    pub(crate) fn proven(&self, way: Vec<Move>) -> Option<Vec<Move>> {
        let is_proven = |m: &Move| m.curve().is_ok_and(|curve| self.enters_nothing(&curve));
        way.iter().all(is_proven).then_some(way)
    }

    /// The curves of a pass without what enters anything: what is left between, end to end.
    pub(crate) fn proven_runs(&self, curves: Vec<Curve3>) -> Vec<Vec<Curve3>> {
        let mut runs = vec![Vec::new()];
        for curve in curves {
            if self.is_proven_of_pass(&curve) {
                push(&mut runs, curve);
                continue;
            }
            for piece in curve.bezier_pieces() {
                let (t0, t1) = piece.domain();
                if let Ok(points) = <[Point3; 4]>::try_from(piece.points().to_vec()) {
                    self.cut_out(points, t1 - t0, &mut runs);
                }
            }
        }
        runs.retain(|run| !run.is_empty());
        runs
    }

    /// Adds what is proven of a cubic that is about so long to the last of some runs; what is not ends it.
    fn cut_out(&self, points: [Point3; 4], length_mm: f64, runs: &mut Vec<Vec<Curve3>>) {
        let mut written = points.map(|p| p.map(round_to_written));
        if let Some(before) = runs.last().and_then(|run| run.last()) {
            written[0] = before.end();
        }
        let length = round_to_written(length_mm).max(WRITTEN_STEP_MM);
        match one_span(written, length).filter(|curve| self.is_proven_of_pass(curve)) {
            Some(curve) => push(runs, curve),
            None if length_mm > CUT_OUT_MM => {
                for half in halves(points) {
                    self.cut_out(half, 0.5 * length_mm, runs);
                }
            }
            None => runs.push(Vec::new()),
        }
    }
}

fn push(runs: &mut [Vec<Curve3>], curve: Curve3) {
    if let Some(run) = runs.last_mut() {
        run.push(curve);
    }
}

/// Both halves of a cubic (de Casteljau).
fn halves([a, b, c, d]: [Point3; 4]) -> [[Point3; 4]; 2] {
    let middle = |p: Point3, q: Point3| nalgebra::center(&p, &q);
    let (ab, bc, cd) = (middle(a, b), middle(b, c), middle(c, d));
    let (abc, bcd) = (middle(ab, bc), middle(bc, cd));
    let m = middle(abc, bcd);
    [[a, ab, abc, m], [m, bcd, cd, d]]
}

/// Whether the gap along a polynomial piece stays above what is allowed, known at places as close together as it takes.
fn is_clear(piece: &Curve3, radius_mm: f64, gap_mm: &mut impl FnMut(Point3) -> f64) -> bool {
    let (points, (t0, t1)) = (piece.points(), piece.domain());
    let degree = (points.len() - 1) as f64;
    // No derivative is larger than those of the control polygon.
    let fastest = points.windows(2).map(|w| (w[1] - w[0]).norm()).fold(0.0, f64::max) * degree;
    let bend = points.windows(3).map(|w| (w[2] - w[1] - (w[1] - w[0])).norm()).fold(0.0, f64::max);
    let bend = bend * degree * (degree - 1.0);
    let dip_mm = |share: f64| share * share / 8.0 * (fastest * fastest / radius_mm + bend);
    let mut at = |share: f64| (share, gap_mm(piece.point(t0 + (t1 - t0) * share)));
    let mut open = vec![(at(0.0), at(1.0))];
    while let Some((a, b)) = open.pop() {
        let (least_mm, dip_mm) = (a.1.min(b.1), dip_mm(b.0 - a.0));
        if least_mm < -ENTERS_MM {
            return false;
        }
        if least_mm - dip_mm < -ENTERS_MM && dip_mm > HIDES_MM {
            let middle = at(0.5 * (a.0 + b.0));
            open.extend([(middle, b), (a, middle)]);
        }
    }
    true
}

#[cfg(test)]
mod tests {
    use super::*;

    const R: f64 = 1.5;

    /// The gap of a ball over a point that is so high.
    fn over_point(height_mm: f64) -> impl FnMut(Point3) -> f64 {
        move |tip| (tip + Vector3::z() * R - Point3::new(0.123, 0.0, height_mm)).norm() - R
    }

    #[test]
    fn what_stands_out_between_two_places_is_found() {
        let way = Curve3::line(Point3::new(-150.0, 0.0, 0.0), Point3::new(150.0, 0.0, 0.0));
        assert!(is_clear(&way, R, &mut over_point(0.0)));
        assert!(is_clear(&way, R, &mut over_point(0.002)));
        assert!(!is_clear(&way, R, &mut over_point(0.012)));
    }

    #[test]
    fn a_bend_between_two_places_is_followed() {
        // It dips in the middle, where both of its ends see nothing.
        let arch = |dip: f64| {
            let at = |x: f64, z: f64| Point3::new(x, 0.0, z);
            one_span([at(-3.0, 0.0), at(-1.0, -dip), at(1.0, -dip), at(3.0, 0.0)], 6.0).unwrap()
        };
        let mut over_plane = |tip: Point3| (tip.z + 0.5).min(AWAY_MM);
        assert!(is_clear(&arch(0.6), R, &mut over_plane));
        assert!(!is_clear(&arch(0.7), R, &mut over_plane));
    }

    #[test]
    fn halves_of_a_cubic_are_the_cubic() {
        let points = [[0.0, 0.0, 0.0], [1.0, 2.0, 0.5], [3.0, 2.0, -1.0], [4.0, 0.0, 2.0]].map(Point3::from);
        let whole = one_span(points, 1.0).unwrap();
        for (k, half) in halves(points).into_iter().enumerate() {
            let half = one_span(half, 1.0).unwrap();
            for t in [0.0, 0.3, 1.0] {
                let expected = whole.point(0.5 * (k as f64 + t));
                approx::assert_abs_diff_eq!((half.point(t) - expected).norm(), 0.0, epsilon = 1e-12);
            }
        }
    }
}
