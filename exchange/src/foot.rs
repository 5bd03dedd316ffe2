//! Feet of perpendiculars from points near a surface, and whole curves projected onto it.

use claymill_nurbs::tolerance::NEWTON_MM;
use claymill_nurbs::{Curve2, Curve3, KnotVector, NurbsSurface, Point2, Point3, Vector2};
use nalgebra::Matrix2;

/// A projected curve keeps this close to the true foot points, mm.
const PCURVE_MM: f64 = 1e-5;
/// Where the whole parameter range is no longer than this, the surface is a pole, mm.
const POLE_MM: f64 = 1e-3;
/// Halvings of one knot span of the curve before the projection gives up refining.
const DEEPEST: u32 = 10;
/// Pieces of one projected curve before it is refined no further: sound curves have a few dozen.
const MOST_PIECES: usize = 500;

/// The foot of a perpendicular.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Foot {
    pub(crate) uv: Point2,
    pub(crate) distance_mm: f64,
}

/// A curve projected onto a surface.
#[derive(Debug)]
pub(crate) struct Projected {
    /// Piecewise cubic; it has the parameter of the curve in space.
    pub(crate) pcurve: Curve2,
    /// How far the curve was from the surface, mm.
    pub(crate) distance_mm: f64,
}

/// Projects onto one surface. Holds a grid of surface points to start from.
#[derive(Debug)]
pub(crate) struct Projector<'a> {
    surface: &'a NurbsSurface,
    grid: Vec<(Point2, Point3)>,
}

/// A curve point on the way to a pcurve.
#[derive(Clone, Copy)]
struct Station {
    t: f64,
    uv: Point2,
    distance_mm: f64,
    /// `d(uv)/dt`; `None` where the surface is singular.
    slope: Option<Vector2>,
}

impl<'a> Projector<'a> {
    pub(crate) fn new(surface: &'a NurbsSurface) -> Self {
        let stations = |knots: &KnotVector| -> Vec<f64> {
            let breaks = knots.breaks();
            let per_span = knots.degree() + 1;
            let inner = breaks
                .windows(2)
                .flat_map(|w| (0..per_span).map(move |i| w[0] + (w[1] - w[0]) * i as f64 / per_span as f64));
            inner.chain(breaks.last().copied()).collect()
        };
        let vs = stations(surface.knots_v());
        let grid = stations(surface.knots_u())
            .iter()
            .flat_map(|&u| vs.iter().map(move |&v| (u, v)))
            .map(|(u, v)| (Point2::new(u, v), surface.point(u, v)))
            .collect();
        Projector { surface, grid }
    }

    /// The foot nearest to `p`, from the best few grid points.
    pub(crate) fn nearest(&self, p: &Point3) -> Foot {
        let mut best = [(f64::INFINITY, Point2::origin()); 4];
        for (uv, q) in &self.grid {
            let d = (q - p).norm_squared();
            if let Some(at) = best.iter().position(|b| d < b.0) {
                best[at..].rotate_right(1);
                best[at] = (d, *uv);
            }
        }
        best.iter()
            .filter(|b| b.0.is_finite())
            .map(|b| self.foot(p, b.1))
            .min_by(|a, b| a.distance_mm.total_cmp(&b.distance_mm))
            .unwrap_or(Foot { uv: Point2::origin(), distance_mm: f64::INFINITY })
    }

    /// Opposite corners of the domain.
    fn bounds(&self) -> [Point2; 2] {
        let ((u0, u1), (v0, v1)) = self.surface.domain();
        [Point2::new(u0, v0), Point2::new(u1, v1)]
    }

    /// The foot that Newton's method finds from `start`, sliding along the sides of the domain.
    pub(crate) fn foot(&self, p: &Point3, start: Point2) -> Foot {
        let ((u0, u1), (v0, v1)) = self.surface.domain();
        let clamp = |q: Point2| Point2::new(q.x.clamp(u0, u1), q.y.clamp(v0, v1));
        let mut uv = clamp(start);
        let mut distance = (self.surface.point(uv.x, uv.y) - p).norm();
        for _ in 0..40 {
            let j = self.surface.jet(uv.x, uv.y);
            let r = j.p - p;
            let gradient = Vector2::new(r.dot(&j.su), r.dot(&j.sv));
            let (mut e, mut f, mut g) = (j.su.norm_squared(), j.su.dot(&j.sv), j.sv.norm_squared());
            let (suu, suv, svv) = (r.dot(&j.suu), r.dot(&j.suv), r.dot(&j.svv));
            if e + suu > 0.0 && (e + suu) * (g + svv) > (f + suv) * (f + suv) {
                (e, f, g) = (e + suu, f + suv, g + svv);
            }
            // A parameter at its limit that wants to go farther out is held, and so is one that moves nothing:
            // a curve keeps its meridian when it runs into a pole.
            let held_u = (uv.x <= u0 && gradient.x >= 0.0)
                || (uv.x >= u1 && gradient.x <= 0.0)
                || j.su.norm() * (u1 - u0) < POLE_MM;
            let held_v = (uv.y <= v0 && gradient.y >= 0.0)
                || (uv.y >= v1 && gradient.y <= 0.0)
                || j.sv.norm() * (v1 - v0) < POLE_MM;
            let step = match (held_u, held_v) {
                (true, true) => break,
                (true, false) => Vector2::new(0.0, -gradient.y / g),
                (false, true) => Vector2::new(-gradient.x / e, 0.0),
                (false, false) => {
                    let hessian = Matrix2::new(e, f, f, g);
                    let damped = || hessian + Matrix2::identity() * (1e-9 * (e + g));
                    let inverse = hessian.try_inverse().or_else(|| damped().try_inverse());
                    inverse.map_or_else(Vector2::zeros, |m| -(m * gradient))
                }
            };
            if !(step.x.is_finite() && step.y.is_finite()) {
                break;
            }
            let mut scale = 1.0;
            let mut next = (uv, distance);
            for _ in 0..12 {
                let candidate = clamp(uv + step * scale);
                let d = (self.surface.point(candidate.x, candidate.y) - p).norm();
                if d <= distance {
                    next = (candidate, d);
                    break;
                }
                scale *= 0.5;
            }
            let moved = j.su * (next.0.x - uv.x) + j.sv * (next.0.y - uv.y);
            (uv, distance) = next;
            if moved.norm() < NEWTON_MM {
                break;
            }
        }
        Foot { uv, distance_mm: distance }
    }

    /// Projects a whole curve, as a cubic with the curve's own parameter: positions and slopes are exact at
    /// stations that are added until the pieces between them follow the true feet. A curve that runs farther than
    /// `limit_mm` from the surface somewhere is given up there.
    pub(crate) fn curve(&self, curve: &Curve3, limit_mm: f64) -> Option<Projected> {
        let breaks = curve.knots().breaks();
        let kink = |t: f64| curve.knots().multiplicity(t) >= curve.knots().degree();
        // A curve may start on the seam of a closed surface, where both sides are equally near: its middle
        // decides where it runs.
        let middle = breaks[0] + 0.5 * (breaks[1] - breaks[0]);
        let mut seed = self.nearest(&curve.point(middle)).uv;
        for i in (0..8).rev() {
            let t = breaks[0] + (middle - breaks[0]) * f64::from(i) / 8.0;
            seed = self.foot(&curve.point(t), seed).uv;
        }
        let mut pieces: Vec<[Station; 2]> = Vec::new();
        for span in breaks.windows(2) {
            // At kinks the slope is that of the span, taken a hair inside.
            let inset = |t: f64| if kink(t) { 1e-9 * (span[1] - span[0]) } else { 0.0 };
            let start = match pieces.last() {
                Some([_, end]) if !kink(span[0]) => *end,
                _ => self.station(curve, span[0], span[0] + inset(span[0]), seed),
            };
            self.refine(curve, start, span[1], inset(span[1]), DEEPEST, limit_mm, &mut pieces);
            seed = pieces.last().map_or(seed, |p| p[1].uv);
            if pieces.last().is_some_and(|p| p[0].distance_mm.max(p[1].distance_mm) > limit_mm) {
                break;
            }
        }
        Some(Projected {
            pcurve: hermite(&pieces, &self.bounds())?,
            distance_mm: pieces.iter().flatten().map(|s| s.distance_mm).fold(0.0, f64::max),
        })
    }

    fn station(&self, curve: &Curve3, t: f64, slope_at: f64, seed: Point2) -> Station {
        let foot = self.foot(&curve.point(t), seed);
        let j = self.surface.jet(foot.uv.x, foot.uv.y);
        let tangent = curve.derivatives(slope_at)[1];
        let (e, f, g) = (j.su.norm_squared(), j.su.dot(&j.sv), j.sv.norm_squared());
        let (a, b) = (j.su.dot(&tangent), j.sv.dot(&tangent));
        let det = e * g - f * f;
        // Near a pole the slope is meaningless: any parameter is the same point.
        let ((u0, u1), (v0, v1)) = self.surface.domain();
        let size = (e.sqrt() * (u1 - u0)).min(g.sqrt() * (v1 - v0));
        let regular = det > 1e-12 * e * g && size > POLE_MM;
        let slope = regular.then(|| Vector2::new(a * g - b * f, b * e - a * f) / det);
        Station { t, uv: foot.uv, distance_mm: foot.distance_mm, slope }
    }

    /// Appends the pieces from `start` to parameter `end`.
    #[expect(clippy::too_many_arguments, reason = "it calls itself, with all but three as they are")]
    fn refine(
        &self,
        curve: &Curve3,
        start: Station,
        end: f64,
        inset: f64,
        depth: u32,
        limit_mm: f64,
        pieces: &mut Vec<[Station; 2]>,
    ) {
        let length = end - start.t;
        let guess = start.slope.map_or(start.uv, |d| start.uv + d * length);
        let mut last = self.station(curve, end, end - inset, guess);
        // Far guesses can slide to another part of the surface; a walk does not.
        let reach = (curve.point(end) - curve.point(start.t)).norm();
        if last.distance_mm > 1e-2 * reach {
            let mut seed = start.uv;
            for i in 1..=8 {
                seed = self.foot(&curve.point(start.t + length * f64::from(i) / 8.0), seed).uv;
            }
            last = self.station(curve, end, end - inset, seed);
        }
        let follows = |x: f64| {
            let uv = hermite_point(&start, &last, &self.bounds(), x);
            let foot = self.foot(&curve.point(start.t + x * length), uv);
            let on = |q: Point2| self.surface.point(q.x, q.y);
            (on(uv) - on(foot.uv)).norm() <= PCURVE_MM
        };
        let away = start.distance_mm.max(last.distance_mm) > limit_mm;
        if away || depth == 0 || pieces.len() > MOST_PIECES || [0.25, 0.5, 0.75].into_iter().all(follows) {
            pieces.push([start, last]);
            return;
        }
        let middle = start.t + 0.5 * length;
        self.refine(curve, start, middle, 0.0, depth - 1, limit_mm, pieces);
        if let Some([_, at_middle]) = pieces.last().copied().filter(|p| p[1].distance_mm <= limit_mm) {
            self.refine(curve, at_middle, end, inset, depth - 1, limit_mm, pieces);
        }
    }
}

/// Slopes of a piece; a singular end takes the chord.
fn slopes(a: &Station, b: &Station) -> [Vector2; 2] {
    let chord = (b.uv - a.uv) / (b.t - a.t);
    [a.slope.unwrap_or(chord), b.slope.unwrap_or(chord)]
}

/// The inner control points of a piece. Where a curve leaves the surface its feet slide along a side, and a slope across
/// that side would lead out of the domain: control points inside keep the whole piece inside.
fn inner(a: &Station, b: &Station, [min, max]: &[Point2; 2]) -> [Point2; 2] {
    let third = (b.t - a.t) / 3.0;
    let [da, db] = slopes(a, b);
    [a.uv + da * third, b.uv - db * third].map(|p| p.sup(min).inf(max))
}

fn hermite_point(a: &Station, b: &Station, bounds: &[Point2; 2], x: f64) -> Point2 {
    let [p1, p2] = inner(a, b, bounds);
    let y = 1.0 - x;
    let c = a.uv.coords * (y * y * y)
        + p1.coords * (3.0 * y * y * x)
        + p2.coords * (3.0 * y * x * x)
        + b.uv.coords * (x * x * x);
    Point2::from(c)
}

/// The Hermite pieces as one cubic: double knots where pieces meet smoothly, triple knots at kinks.
fn hermite(pieces: &[[Station; 2]], bounds: &[Point2; 2]) -> Option<Curve2> {
    let (first, last) = (pieces.first()?[0], pieces.last()?[1]);
    let mut knots = vec![first.t; 4];
    let mut points = vec![first.uv];
    for (i, [a, b]) in pieces.iter().enumerate() {
        let [p1, p2] = inner(a, b, bounds);
        points.extend([p1, p2]);
        if i + 1 < pieces.len() {
            knots.extend([b.t; 2]);
            // Exactly equal slopes and positions leave the joint point implied by a double knot.
            let third = |[a, b]: &[Station; 2]| (b.t - a.t) / 3.0;
            let [next, _] = inner(&pieces[i + 1][0], &pieces[i + 1][1], bounds);
            let free =
                |d: Vector2| p2 == b.uv - d * third(&pieces[i]) && next == b.uv + d * third(&pieces[i + 1]);
            let smooth = pieces[i + 1][0].slope == b.slope && b.slope.is_some_and(free);
            if !smooth {
                knots.push(b.t);
                points.push(b.uv);
            }
        }
    }
    points.push(last.uv);
    knots.extend([last.t; 4]);
    Curve2::new(KnotVector::new(3, knots).ok()?, points, None).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_curve_that_swings_over_the_rim_is_projected_onto_the_rim() {
        let flat = || KnotVector::clamped_uniform(1, 2);
        let corners = [(0.0, 0.0), (0.0, 10.0), (10.0, 0.0), (10.0, 10.0)];
        let points = corners.map(|(x, y)| Point3::new(x, y, 0.0)).to_vec();
        let surface = NurbsSurface::new(flat(), flat(), points, None).unwrap();
        // In, out by 0.02 mm, in again, and a stretch that turns at the rim.
        let heights = [0.5, -0.3, 0.2, -0.1, 0.4, 0.0];
        let points = (0..6).map(|i| Point3::new(2.0 * f64::from(i), heights[i as usize], 0.01)).collect();
        let curve = Curve3::new(KnotVector::clamped_uniform(3, 6), points, None).unwrap();
        let projected = Projector::new(&surface).curve(&curve, 1.0).unwrap();
        let mut outside = 0;
        for i in 0..=1000 {
            let t = f64::from(i) / 1000.0;
            let (p, q) = (projected.pcurve.point(t), curve.point(t));
            assert!((0.0..=1.0).contains(&p.x) && (0.0..=1.0).contains(&p.y), "{p} at {t}");
            let foot = Point2::new(0.1 * q.x, (0.1 * q.y).max(0.0));
            assert!((p - foot).norm() < 1e-5, "{p} {foot} at {t}");
            outside += i32::from(q.y < 0.0);
        }
        assert!(outside > 20);
    }
}
