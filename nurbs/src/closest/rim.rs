//! Trim curves lifted to the surface, cut into nearly straight pieces, and the nearest point on
//! each by bracketed Newton. Bounds on their second derivatives are sampled, not proven.

use crate::{Aabb, Curve2, FaceId, NurbsSurface, Point2, Point3, Vector2, Vector3};

/// Sampled bounds on second derivatives are multiplied by this.
const SAFETY: f64 = 1.5;
/// A piece is cut while it bends from its chord by more than this part of its length.
const LARGEST_BEND: f64 = 0.04;
/// A piece that bends less than this is never cut for it, mm.
const STRAIGHT_MM: f64 = 1e-6;
const LARGEST_DEPTH: usize = 12;
/// Pieces across a crease of the surface are cut this often, until the kink has no length.
const CREASE_DEPTH: usize = 44;
/// How often a query cuts a piece on which the distance may have several minima.
const SEARCH_DEPTH: usize = 6;
/// See `newton::LAST_STEP_MM`.
const LAST_STEP_MM: f64 = 1e-5;

/// A short piece of a trim curve lifted to the surface. Its parameter runs over `[0, 1]`.
#[derive(Debug, Clone, Copy)]
pub(super) struct RimPiece {
    pub(super) face: FaceId,
    /// Index among the face's trim curves, loop by loop.
    pub(super) edge: usize,
    t: (f64, f64),
    ends: [Point3; 2],
    /// Upper bound of the second derivative's length.
    second: f64,
    /// Lower bound of the first derivative's length.
    speed: f64,
}

/// A rim piece in the parameter plane: its chord and how far it may stray from it in `u` and `v`.
#[derive(Debug, Clone, Copy)]
pub(super) struct Chord {
    a: Point2,
    b: Point2,
    stray: Vector2,
}

/// The nearest point of a rim piece.
#[derive(Debug, Clone, Copy)]
pub(super) struct RimSpot {
    pub(super) t: f64,
    pub(super) point: Point3,
    pub(super) distance_squared: f64,
}

/// Cuts the lifted `pcurve` into pieces that are nearly straight. `creases` are the knots at which the
/// surface is only continuous.
pub(super) fn cut(
    surface: &NurbsSurface,
    pcurve: &Curve2,
    (face, edge): (FaceId, usize),
    creases: &[Vec<f64>; 2],
) -> Vec<(RimPiece, Chord)> {
    let mut out = Vec::new();
    for span in pcurve.knots().breaks().windows(2) {
        let middle = 0.5 * (span[0] + span[1]);
        // Two at least: samples at equal distances can all miss the bend of a symmetric span.
        for t in [(span[0], middle), (middle, span[1])] {
            let piece = RimPiece {
                face,
                edge,
                t,
                ends: [t.0, t.1].map(|t| Point3::from(surface.lift(pcurve, t)[0])),
                second: 0.0,
                speed: 0.0,
            };
            piece.refine(surface, pcurve, creases, 0, &mut out);
        }
    }
    out
}

impl RimPiece {
    fn refine(
        mut self,
        surface: &NurbsSurface,
        pcurve: &Curve2,
        creases: &[Vec<f64>; 2],
        depth: usize,
        out: &mut Vec<(RimPiece, Chord)>,
    ) {
        let h = self.t.1 - self.t.0;
        let (mut second, mut least_second, mut speed) = (0.0f64, f64::INFINITY, f64::INFINITY);
        let (mut bend_uv, mut uv) = (Vector2::zeros(), [Point2::origin(); 5]);
        for (k, place) in uv.iter_mut().enumerate() {
            // Just inside the piece, where one-sided derivatives at knots are this piece's own.
            let x = (k as f64 * 0.25).clamp(1e-9, 1.0 - 1e-9);
            let t = self.t.0 + x * h;
            let [_, d1, d2] = surface.lift(pcurve, t);
            let [c, _, c2] = pcurve.derivatives(t);
            (*place, bend_uv) = (Point2::from(c), bend_uv.sup(&c2.abs()));
            second = second.max(d2.norm() * h * h);
            least_second = least_second.min(d2.norm() * h * h);
            speed = speed.min(d1.norm() * h);
        }
        self.second = SAFETY * second + (second - least_second);
        self.speed = (speed - 0.125 * self.second).max(0.0);
        let chord = (self.ends[1] - self.ends[0]).norm();
        let bend = 0.125 * self.second;
        let creased = (0..2).any(|axis| {
            let (a, b) = (uv[0][axis].min(uv[4][axis]), uv[0][axis].max(uv[4][axis]));
            creases[axis].iter().any(|&k| a < k && k < b)
        });
        let bent = bend > LARGEST_BEND * chord && bend > STRAIGHT_MM;
        if (bent && depth < LARGEST_DEPTH) || (creased && chord > STRAIGHT_MM && depth < CREASE_DEPTH) {
            for half in self.halves(surface, pcurve) {
                half.refine(surface, pcurve, creases, depth + 1, out);
            }
            return;
        }
        let stray = bend_uv * (0.125 * h * h * SAFETY);
        let (a, b) = (uv[0], uv[4]);
        out.push((self, Chord { a, b, stray }));
    }

    /// Both halves, bounds scaled to their own parameter.
    fn halves(&self, surface: &NurbsSurface, pcurve: &Curve2) -> [RimPiece; 2] {
        let middle = 0.5 * (self.t.0 + self.t.1);
        let point = Point3::from(surface.lift(pcurve, middle)[0]);
        let half =
            |t, ends| RimPiece { t, ends, second: 0.25 * self.second, speed: 0.5 * self.speed, ..*self };
        [half((self.t.0, middle), [self.ends[0], point]), half((middle, self.t.1), [point, self.ends[1]])]
    }

    /// How far the piece may stray from its chord, mm: `max |C″| / 8`.
    fn bend(&self) -> f64 {
        0.125 * self.second
    }

    pub(super) fn bounds(&self) -> Aabb {
        Aabb::of(&self.ends).inflated(self.bend() + 1e-9)
    }

    /// Lower bound of the distance from `p`.
    pub(super) fn lower_bound(&self, p: &Point3) -> f64 {
        let [a, b] = self.ends;
        let ab = b - a;
        let x = ((p - a).dot(&ab) / ab.norm_squared().max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
        ((p - (a + ab * x)).norm() - self.bend() - 1e-12).max(0.0)
    }

    /// The point nearest to `p`, if its squared distance is below `cutoff_squared`.
    ///
    /// The squared distance is convex where `|C'|² + (C − p)·C″ > 0`; a piece for which the bounds do not show
    /// this is halved a few times and each half is searched.
    pub(super) fn nearest(
        &self,
        surface: &NurbsSurface,
        pcurve: &Curve2,
        p: &Point3,
        cutoff_squared: f64,
    ) -> Option<RimSpot> {
        self.search(surface, pcurve, p, cutoff_squared, SEARCH_DEPTH)
    }

    fn search(
        &self,
        surface: &NurbsSurface,
        pcurve: &Curve2,
        p: &Point3,
        cutoff_squared: f64,
        depth: usize,
    ) -> Option<RimSpot> {
        if self.lower_bound(p).powi(2) >= cutoff_squared {
            return None;
        }
        let reach = self.ends.map(|e| (e - p).norm());
        let convex = self.speed * self.speed > (reach[0].max(reach[1]) + self.bend()) * self.second;
        if convex || depth == 0 {
            let spot = self.descend(surface, pcurve, p);
            return (spot.distance_squared < cutoff_squared).then_some(spot);
        }
        let [a, b] = self.halves(surface, pcurve);
        let first = a.search(surface, pcurve, p, cutoff_squared, depth - 1);
        let cutoff_squared = first.map_or(cutoff_squared, |s| s.distance_squared);
        b.search(surface, pcurve, p, cutoff_squared, depth - 1).or(first)
    }

    /// Newton for `(C − p)·C' = 0` kept inside a shrinking bracket.
    fn descend(&self, surface: &NurbsSurface, pcurve: &Curve2, p: &Point3) -> RimSpot {
        let h = self.t.1 - self.t.0;
        let chord = self.ends[1] - self.ends[0];
        let along = (p - self.ends[0]).dot(&chord) / chord.norm_squared().max(f64::MIN_POSITIVE);
        let (mut low, mut high) = (0.0f64, 1.0f64);
        let (mut low_seen, mut high_seen) = (false, false);
        let mut x = along.clamp(0.0, 1.0);
        let mut best = RimSpot { t: self.t.0, point: self.ends[0], distance_squared: f64::INFINITY };
        let mut offer = |x: f64, point: Vector3| {
            let distance_squared = (point - p.coords).norm_squared();
            if distance_squared < best.distance_squared {
                best = RimSpot {
                    t: (self.t.0 + x * h).clamp(self.t.0, self.t.1),
                    point: Point3::from(point),
                    distance_squared,
                };
            }
        };
        for _ in 0..60 {
            let [c, d1, d2] = surface.lift(pcurve, self.t.0 + x * h);
            let (d1, d2, away) = (d1 * h, d2 * (h * h), c - p.coords);
            offer(x, c);
            let slope = away.dot(&d1);
            let curvature = d1.norm_squared() + away.dot(&d2);
            if slope > 0.0 {
                (high, high_seen) = (x, true);
            } else {
                (low, low_seen) = (x, true);
            }
            let newton = if curvature > 0.0 { x - slope / curvature } else { f64::NAN };
            let step = newton - x;
            if (low..=high).contains(&newton) && d1.norm() * step.abs() <= LAST_STEP_MM {
                offer(newton, c + d1 * step + d2 * (0.5 * step * step));
                break;
            }
            // Newton's step, an end of the piece that it leads beyond, or the middle of the bracket.
            x = match newton {
                n if n > low && n < high => n,
                n if n >= high && !high_seen => high,
                n if n <= low && !low_seen => low,
                _ => 0.5 * (low + high),
            };
            if high - low < 1e-15 {
                break;
            }
        }
        best
    }
}

impl Chord {
    /// Whether the rim piece may meet the open rectangle `u × v` (separating axes of the chord and the
    /// rectangle grown by the stray).
    pub(super) fn meets(&self, u: (f64, f64), v: (f64, f64)) -> bool {
        let middle = Vector2::new(0.5 * (u.0 + u.1), 0.5 * (v.0 + v.1));
        let half = Vector2::new(0.5 * (u.1 - u.0), 0.5 * (v.1 - v.0)) + self.stray;
        let (a, b) = (self.a.coords - middle, self.b.coords - middle);
        let clear = |axis: usize| a[axis].min(b[axis]) >= half[axis] || a[axis].max(b[axis]) <= -half[axis];
        let normal = Vector2::new(a.y - b.y, b.x - a.x);
        let reach = normal.x.abs() * half.x + normal.y.abs() * half.y;
        !(clear(0) || clear(1) || a.dot(&normal).abs() > reach)
    }
}
