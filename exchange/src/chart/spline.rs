//! NURBS carriers: finding parameters of points, and going round more than once.

use std::cell::{Cell, OnceCell};

use claymill_nurbs::{KnotVector, NurbsError, NurbsSurface, Point2, Point3};
use nalgebra::Vector2;

use super::carrier::{Foot, Range};

/// Points closer than this part of the surface's size are one point: closed sides and poles.
const SAME_POINT: f64 = 1e-6;
/// Seeds of the global search, per direction.
const MOST_SEEDS: usize = 200;
/// Newton runs of one global search.
const STARTS: usize = 8;
const NEWTON_STEPS: usize = 40;
/// After so many global searches for nothing a continued foot is believed.
const MOST_FRUITLESS: u32 = 8;

/// A NURBS surface with its closed directions and poles.
#[derive(Debug)]
pub(crate) struct SplineChart {
    surface: NurbsSurface,
    periods: [Option<f64>; 2],
    /// Whether the sides `v = v0`, `v = v1` (first row) and `u = u0`, `u = u1` (second row) are points.
    poles: [[bool; 2]; 2],
    /// Surface points spread over the domain, made when first needed.
    seeds: OnceCell<Vec<(Point2, Point3)>>,
    /// Global searches in a row that found nothing better than the foot at hand.
    fruitless: Cell<u32>,
}

impl SplineChart {
    pub(crate) fn new(surface: NurbsSurface) -> Self {
        let surface = surface.clamped();
        let (rows, columns) = surface.size();
        let corner = |i: usize, j: usize| surface.control_point(i, j);
        let mut size = 0.0_f64;
        for i in 0..rows {
            for j in 0..columns {
                size = size.max((corner(i, j) - corner(0, 0)).norm());
            }
        }
        let same = |a: Point3, b: Point3| (a - b).norm() <= SAME_POINT * size;
        let ((u0, u1), (v0, v1)) = surface.domain();
        let closed_u = (0..columns).all(|j| same(corner(0, j), corner(rows - 1, j)))
            && proportional((0..columns).map(|j| surface.weight(rows - 1, j) / surface.weight(0, j)));
        let closed_v = (0..rows).all(|i| same(corner(i, 0), corner(i, columns - 1)))
            && proportional((0..rows).map(|i| surface.weight(i, columns - 1) / surface.weight(i, 0)));
        let row_is_point = |j: usize| (1..rows).all(|i| same(corner(0, j), corner(i, j)));
        let column_is_point = |i: usize| (1..columns).all(|j| same(corner(i, 0), corner(i, j)));
        SplineChart {
            periods: [closed_u.then_some(u1 - u0), closed_v.then_some(v1 - v0)],
            poles: [
                [row_is_point(0), row_is_point(columns - 1)],
                [column_is_point(0), column_is_point(rows - 1)],
            ],
            seeds: OnceCell::new(),
            fruitless: Cell::new(0),
            surface,
        }
    }

    pub(crate) fn surface(&self) -> &NurbsSurface {
        &self.surface
    }

    pub(crate) fn periods(&self) -> [Option<f64>; 2] {
        self.periods
    }

    /// See [`super::carrier::Carrier::pole`].
    pub(crate) fn pole(&self, direction: usize, upper: bool) -> Option<f64> {
        let (u, v) = self.surface.domain();
        let across = if direction == 0 { v } else { u };
        self.poles[direction][usize::from(upper)].then_some(if upper { across.1 } else { across.0 })
    }

    /// The patch that covers `range`: the surface itself, or laid twice round where it is closed.
    pub(crate) fn patch(&self, range: &Range) -> Result<NurbsSurface, NurbsError> {
        let mut surface = self.surface.clone();
        for (d, period) in self.periods.into_iter().enumerate() {
            let Some(period) = period else { continue };
            let end = if d == 0 { surface.domain().0.1 } else { surface.domain().1.1 };
            if range.max[d] > end + 1e-6 * period {
                surface = laid_twice(&surface, d)?;
            }
        }
        Ok(surface)
    }

    /// See [`super::carrier::Carrier::foot`].
    pub(crate) fn foot(&self, p: &Point3, near: Option<Point2>, size: f64) -> Foot {
        let (mut uv, mut distance) = (Point2::origin(), f64::INFINITY);
        if let Some(near) = near {
            (uv, distance) = self.newton(p, self.wrapped(near));
        }
        // A continued foot that is off the surface may have stuck on the wrong side of a fold; or the edge is off.
        if distance > 10.0 * size && (near.is_none() || self.fruitless.get() < MOST_FRUITLESS) {
            let before = distance;
            for start in self.starts(p) {
                let (other, d) = self.newton(p, start);
                if d < distance {
                    (uv, distance) = (other, d);
                }
                if distance <= size {
                    break;
                }
            }
            let found = distance < 0.5 * before;
            self.fruitless.set(if found { 0 } else { self.fruitless.get() + 1 });
        }
        let jet = self.surface.jet(uv.x, uv.y);
        let ((u0, u1), (v0, v1)) = self.surface.domain();
        let free = [
            jet.su.norm() * (u1 - u0) <= size.max(1e-9 * jet.sv.norm() * (v1 - v0)),
            jet.sv.norm() * (v1 - v0) <= size.max(1e-9 * jet.su.norm() * (u1 - u0)),
        ];
        Foot { uv, distance, free }.towards(near, self.periods)
    }

    /// Parameters moved into the domain: by periods where closed, else to the nearest end.
    fn wrapped(&self, uv: Point2) -> Point2 {
        let (u, v) = self.surface.domain();
        let wrap = |t: f64, (low, high): (f64, f64), period: Option<f64>| match period {
            Some(period) if !(low..=high).contains(&t) => low + (t - low).rem_euclid(period),
            _ => t.clamp(low, high),
        };
        Point2::new(wrap(uv.x, u, self.periods[0]), wrap(uv.y, v, self.periods[1]))
    }

    /// The seeds nearest to `p`.
    fn starts(&self, p: &Point3) -> Vec<Point2> {
        let seeds = self.seeds.get_or_init(|| {
            let (u, v) = (seeds(self.surface.knots_u()), seeds(self.surface.knots_v()));
            let pairs = u.iter().flat_map(|u| v.iter().map(|v| Point2::new(*u, *v)));
            pairs.map(|uv| (uv, self.surface.point(uv.x, uv.y))).collect()
        });
        let mut near: Vec<(f64, usize)> =
            seeds.iter().enumerate().map(|(i, (_, q))| ((q - p).norm_squared(), i)).collect();
        let count = STARTS.min(near.len());
        if count < near.len() {
            near.select_nth_unstable_by(count, |a, b| a.0.total_cmp(&b.0));
        }
        near.truncate(count);
        near.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        near.iter().map(|(_, i)| seeds[*i].0).collect()
    }

    /// Minimises the distance from `p`, never increasing it; returns the parameters and the distance.
    fn newton(&self, p: &Point3, start: Point2) -> (Point2, f64) {
        let (mut uv, mut distance) = (start, (self.surface.point(start.x, start.y) - p).norm());
        let (u, v) = self.surface.domain();
        let bounds = [u, v];
        for _ in 0..NEWTON_STEPS {
            let j = self.surface.jet(uv.x, uv.y);
            let r = j.p - p;
            let slope = Vector2::new(r.dot(&j.su), r.dot(&j.sv));
            let (e, f, g) = (j.su.norm_squared(), j.su.dot(&j.sv), j.sv.norm_squared());
            let (l, m, n) = (r.dot(&j.suu), r.dot(&j.suv), r.dot(&j.svv));
            // A parameter at its end that wants to go further stays there.
            let held = [0, 1].map(|d| {
                let (low, high) = bounds[d];
                self.periods[d].is_none()
                    && ((uv[d] <= low && slope[d] > 0.0) || (uv[d] >= high && slope[d] < 0.0))
            });
            let step = descent(slope, [e, f, g], [l, m, n], held);
            let mut factor = 1.0;
            let mut improved = false;
            while factor > 1e-4 {
                let next = self.wrapped(uv + step * factor);
                let d = (self.surface.point(next.x, next.y) - p).norm();
                if d < distance {
                    (uv, distance, improved) = (next, d, true);
                    break;
                }
                factor *= 0.5;
            }
            // Below this, rounding moves the point more than Newton does.
            let moved = (j.su * step.x + j.sv * step.y).norm();
            if !improved || moved <= 1e-13 * (1.0 + p.coords.amax()) {
                break;
            }
        }
        (uv, distance)
    }
}

/// Newton's step for half the squared distance, or Gauss–Newton's where the surface bends too far.
fn descent(slope: Vector2<f64>, [e, f, g]: [f64; 3], [l, m, n]: [f64; 3], held: [bool; 2]) -> Vector2<f64> {
    let along = |slope: f64, full: f64, plain: f64| {
        let h = if full > 0.0 { full } else { plain };
        if h > 0.0 { -slope / h } else { 0.0 }
    };
    match held {
        [true, true] => Vector2::zeros(),
        [true, false] => Vector2::new(0.0, along(slope.y, g + n, g)),
        [false, true] => Vector2::new(along(slope.x, e + l, e), 0.0),
        [false, false] => {
            let solve = |a: f64, b: f64, c: f64| {
                let det = a * c - b * b;
                (a > 0.0 && det > 1e-14 * a * c)
                    .then(|| -Vector2::new(c * slope.x - b * slope.y, a * slope.y - b * slope.x) / det)
            };
            solve(e + l, f + m, g + n)
                .or_else(|| solve(e, f, g))
                .unwrap_or_else(|| Vector2::new(along(slope.x, e, e), along(slope.y, g, g)))
        }
    }
}

/// Parameters that no polynomial piece can hide from.
fn seeds(knots: &KnotVector) -> Vec<f64> {
    let breaks = knots.breaks();
    let spans = breaks.len() - 1;
    let per_span = (knots.degree() + 2).min((MOST_SEEDS / spans).max(1));
    let mut all: Vec<f64> = breaks
        .windows(2)
        .flat_map(|w| {
            let (a, b) = (w[0], w[1]);
            (0..per_span).map(move |i| a + (b - a) * i as f64 / per_span as f64)
        })
        .collect();
    all.extend(breaks.last());
    all
}

fn proportional(mut ratios: impl Iterator<Item = f64>) -> bool {
    let first = ratios.next().unwrap_or(1.0);
    ratios.all(|r| (r / first - 1.0).abs() < 1e-9)
}

/// A closed surface followed by itself in direction 0 (`u`) or 1 (`v`).
fn laid_twice(surface: &NurbsSurface, direction: usize) -> Result<NurbsSurface, NurbsError> {
    let (rows, columns) = surface.size();
    let twice = |knots: &KnotVector| {
        let (k, p) = (knots.as_slice(), knots.degree());
        let period = knots.domain().1 - knots.domain().0;
        let mut all = k[..k.len() - 1].to_vec();
        all.extend(k[p + 1..].iter().map(|t| t + period));
        KnotVector::new(p, all)
    };
    let again = |n: usize| (0..n).map(|i| (i, false)).chain((1..n).map(|i| (i, true)));
    let once = |n: usize| (0..n).map(|i| (i, false));
    let (mut points, mut weights) = (Vec::new(), Vec::new());
    let mut push = |i: usize, j: usize, second: bool| {
        let scale = match (second, direction) {
            (false, _) => 1.0,
            (true, 0) => surface.weight(rows - 1, j) / surface.weight(0, j),
            (true, _) => surface.weight(i, columns - 1) / surface.weight(i, 0),
        };
        points.push(surface.control_point(i, j));
        weights.push(scale * surface.weight(i, j));
    };
    let (knots_u, knots_v) = if direction == 0 {
        for (i, second) in again(rows) {
            once(columns).for_each(|(j, _)| push(i, j, second));
        }
        (twice(surface.knots_u())?, surface.knots_v().clone())
    } else {
        for (i, _) in once(rows) {
            again(columns).for_each(|(j, second)| push(i, j, second));
        }
        (surface.knots_u().clone(), twice(surface.knots_v())?)
    };
    NurbsSurface::new(knots_u, knots_v, points, Some(weights))
}

#[cfg(test)]
mod tests {
    use super::*;
    use claymill_nurbs::Vector3;
    use claymill_nurbs::analytic::{Frame, torus};
    use std::f64::consts::TAU;

    fn ring() -> SplineChart {
        let frame = Frame::new(Point3::new(1.0, 2.0, 3.0), Vector3::z(), Vector3::x()).unwrap();
        SplineChart::new(torus(&frame, 10.0, 3.0, (0.0, TAU), (0.0, TAU)).unwrap())
    }

    #[test]
    fn closed_directions_are_seen_and_laid_twice() {
        let chart = ring();
        assert!(chart.periods().iter().all(Option::is_some));
        let range = Range { min: Point2::new(4.0, 4.0), max: Point2::new(9.0, 8.0) };
        let patch = chart.patch(&range).unwrap();
        for (u, v) in [(0.3, 0.4), (5.0, 6.0), (2.0, 4.4)] {
            let p = chart.surface().point(u, v);
            for (a, b) in [(0.0, TAU), (TAU, 0.0), (TAU, TAU)] {
                approx::assert_abs_diff_eq!(patch.point(u + a, v + b), p, epsilon = 1e-12);
            }
        }
    }

    /// A ring of quadratic pieces whose first control points come again at its end.
    #[test]
    fn periodic_knots_close_too() {
        let knots = KnotVector::new(2, (-2..=6).map(f64::from).collect()).unwrap();
        let corner = |k: usize| Point3::new([5.0, 0.0, -5.0, 0.0][k % 4], [0.0, 5.0, 0.0, -5.0][k % 4], 0.0);
        let points = (0..6).flat_map(|k| [corner(k), corner(k) + Vector3::z()]).collect();
        let ring = NurbsSurface::new(knots, KnotVector::clamped_uniform(1, 2), points, None).unwrap();
        let chart = SplineChart::new(ring.clone());
        assert_eq!(chart.periods(), [Some(4.0), None]);
        for (u, v) in [(0.0, 0.0), (0.3, 1.0), (2.0, 0.5), (3.9, 0.1), (4.0, 1.0)] {
            approx::assert_abs_diff_eq!(chart.surface().point(u, v), ring.point(u, v), epsilon = 1e-14);
        }
    }

    #[test]
    fn feet_are_found_from_nowhere_and_across_the_seam() {
        let chart = ring();
        for (u, v) in [(0.01, 0.02), (6.2, 6.2), (3.0, 1.0), (1.0, 4.0)] {
            let p = chart.surface().point(u, v);
            let foot = chart.foot(&p, None, 1e-9);
            assert!((foot.uv - Point2::new(u, v)).norm() < 1e-8, "{} {u} {v}", foot.uv);
            let near = Point2::new(u + TAU - 0.3, v - TAU + 0.2);
            let foot = chart.foot(&p, Some(near), 1e-9);
            assert!((foot.uv - Point2::new(u + TAU, v - TAU)).norm() < 1e-8, "{}", foot.uv);
        }
    }
}
