//! The contact of a dropped ball on an exact edge: Newton within a bracket on `(C − P)·P′`, with
//! halving until a piece can touch the ball only once.

use claymill_nurbs::{Curve2, Leaves, Point3};

use crate::covering::EdgePiece;
use crate::exact::flat::on_segment;

/// Steps on a piece of edge, at most; Newton's end after a few.
const STEPS: usize = 60;
/// What is left of the slope `(C − P)·P′/|P′|` at the highest place, mm.
const RESIDUAL_MM: f64 = 1e-9;
/// A piece is halved so often at most; its deviation shrinks by 4 each time.
const DEEPEST: u32 = 6;

/// A ball dropped at a place on one exact edge `S(c(t))`.
pub(crate) struct OnEdge<'a> {
    pub(crate) surface: &'a Leaves,
    pub(crate) pcurve: &'a Curve2,
    pub(crate) x: f64,
    pub(crate) y: f64,
    pub(crate) r: f64,
}

impl OnEdge<'_> {
    /// Highest resting place on a piece with the centre above `floor`: centre height and contact point.
    pub(crate) fn highest(&self, piece: &EdgePiece, floor: f64) -> Option<(f64, Point3)> {
        self.search(piece, floor, 0)
    }

    fn search(&self, piece: &EdgePiece, mut floor: f64, level: u32) -> Option<(f64, Point3)> {
        let widened = self.r + piece.deviation_mm;
        let (_, share) =
            on_segment(&piece.a, &piece.b, self.x, self.y, widened).filter(|(z, _)| *z > floor)?;
        let mut best = self.climb(piece.t, share).filter(|(z, _)| *z > floor);
        if self.is_met_once(piece) || level == DEEPEST {
            return best;
        }
        let middle = 0.5 * (piece.t.0 + piece.t.1);
        let m = self.surface.point_on(self.pcurve, middle);
        let deviation_mm = 0.25 * piece.deviation_mm;
        for half in [
            EdgePiece { t: (piece.t.0, middle), b: m, deviation_mm, ..*piece },
            EdgePiece { t: (middle, piece.t.1), a: m, deviation_mm, ..*piece },
        ] {
            floor = best.map_or(floor, |(z, _)| z);
            best = self.search(&half, floor, level + 1).or(best);
        }
        best
    }

    /// Whether what the ball reaches of a piece is connected, wherever the ball is: then it rests in one place on it
    /// (where an edge curves less than the ball, two would have an unstable one in between).
    ///
    /// Seen from above, `|P′|² > R·|P″|` makes the distance from the ball convex along the piece. Its bow gives bounds
    /// for both: over a length `L` it turns by `4·bow / L` from its chord, and `|P″|` is `8·bow / L²`.
    fn is_met_once(&self, piece: &EdgePiece) -> bool {
        let bow = piece.deviation_mm;
        (piece.b - piece.a).xy().norm() > 4.0 * bow + (8.0 * bow * self.r).sqrt()
    }

    /// A highest place on a piece, looked for from a `share` of the way.
    ///
    /// The height `g(t) = z(t) + √(R² − d(t)²)` has the derivative of `(C − P)·P′` where `C` is the centre that
    /// rests on `P(t)`; Newton on that product finds where it vanishes, within a bracket of its signs.
    fn climb(&self, (t0, t1): (f64, f64), share: f64) -> Option<(f64, Point3)> {
        let height = |p: Point3| crate::exact::flat::on_point(&p, self.x, self.y, self.r).map(|z| (z, p));
        // Looked at below and above the highest place.
        let (mut below, mut above) = (None, None);
        let mut t = t0 + (t1 - t0) * share.clamp(0.0, 1.0);
        let mut inner = None;
        for _ in 0..STEPS {
            let [p, d, dd] = self.surface.lift(self.pcurve, t);
            let (dx, dy) = (self.x - p.x, self.y - p.y);
            let rise2 = self.r * self.r - dx * dx - dy * dy;
            // Outside the ball's reach the way to higher contacts is the one toward (x, y).
            let rise = rise2.max(0.0).sqrt();
            let uphill = dx * d.x + dy * d.y + rise * d.z;
            inner = (rise2 > 0.0).then(|| Point3::from(p));
            if uphill * uphill <= RESIDUAL_MM * RESIDUAL_MM * d.norm_squared() {
                break;
            }
            let at_end = (uphill > 0.0 && t == t1) || (uphill < 0.0 && t == t0);
            *if uphill > 0.0 { &mut below } else { &mut above } = Some(t);
            let (a, b) = (below.unwrap_or(t0), above.unwrap_or(t1));
            if at_end || b - a < 1e-12 * (t1 - t0) {
                break;
            }
            let bend = dx * dd.x + dy * dd.y + rise * dd.z + (dx * d.x + dy * d.y) / rise * d.z
                - d.x * d.x
                - d.y * d.y;
            t = match t - uphill / bend {
                _ if rise2 <= 0.0 || bend >= 0.0 => 0.5 * (a + b),
                newton if newton > a && newton < b => newton,
                newton if newton >= b && above.is_none() => t1,
                newton if newton <= a && below.is_none() => t0,
                _ => 0.5 * (a + b),
            };
        }
        let ends = [t0, t1].map(|t| self.surface.point_on(self.pcurve, t));
        [inner, Some(ends[0]), Some(ends[1])]
            .into_iter()
            .flatten()
            .filter_map(height)
            .max_by(|p, q| p.0.total_cmp(&q.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::covering::cut_edge;
    use claymill_nurbs::{KnotVector, NurbsSurface, Point2, Vector3};

    /// A ball that just reaches a steep arc: most of the piece is out of its reach, the start as a rule too.
    #[test]
    fn a_steep_rim_that_the_ball_just_reaches_is_met() {
        let (r, mut met) = (3.0, 0);
        // Deterministic places, spread by the golden ratio.
        let share = |k: u32, prime: u32| (f64::from(k) * 0.618_033_988_75 * f64::from(prime)).fract();
        for k in 0..4000 {
            let lean = Vector3::new(share(k, 1) - 0.5, share(k, 3) - 0.5, 0.0);
            let bow = Vector3::new(share(k, 5) - 0.5, share(k, 7) - 0.5, share(k, 11) - 0.5);
            // A ruled surface under a quadratic edge 2 mm long; the edge is its side v = 0.
            let edge = [0.0, 1.0, 2.0].map(|z| Point3::new(0.0, 0.0, z) + lean * z);
            let edge = [edge[0], edge[1] + bow * 0.4, edge[2]];
            let points: Vec<Point3> =
                edge.iter().flat_map(|p| [*p, p + Vector3::new(5.0, 0.0, -5.0)]).collect();
            let surface = NurbsSurface::new(
                KnotVector::clamped_uniform(2, 3),
                KnotVector::clamped_uniform(1, 2),
                points,
                None,
            )
            .unwrap();
            let pcurve = Curve2::line(Point2::new(0.0, 0.0), Point2::new(1.0, 0.0));
            let leaves = Leaves::new(&surface);
            // Beside the edge at about the radius.
            let angle = std::f64::consts::TAU * share(k, 13);
            let away = r + 0.1 * (share(k, 17) - 0.8);
            let at = leaves.point_on(&pcurve, share(k, 19));
            let (x, y) = (at.x + away * angle.cos(), at.y + away * angle.sin());
            let sampled = (0..=4_000)
                .map(|i| leaves.point_on(&pcurve, f64::from(i) / 4_000.0))
                .filter_map(|p| crate::exact::flat::on_point(&p, x, y, r))
                .reduce(f64::max);
            let on_edge = OnEdge { surface: &leaves, pcurve: &pcurve, x, y, r };
            let mut found = f64::NEG_INFINITY;
            cut_edge(&surface, &pcurve, (0.0, 1.0), 0, &mut |t, a, b, deviation_mm| {
                let piece = EdgePiece { face: 0, pcurve: 0, t, a, b, deviation_mm };
                if let Some((z, p)) = on_edge.highest(&piece, f64::NEG_INFINITY) {
                    assert!((Point3::new(x, y, z) - p).norm() - r < 1e-9);
                    found = found.max(z);
                }
            });
            met += u32::from(found.is_finite());
            let lowest = sampled.map_or(f64::NEG_INFINITY, |z| z - 1e-9);
            assert!(found >= lowest, "{k}: {found} {sampled:?}");
        }
        assert!(met > 1000, "{met}");
    }
}
