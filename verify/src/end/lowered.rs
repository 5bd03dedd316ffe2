//! An end lowered along its axis on the triangles of a view: bounds for rapids.

use std::ops::ControlFlow;

use claymill_nurbs::{Point3, Vector3};

use super::body::EndBody;
use crate::drop::DropMesh;
use crate::golden::golden_section;

/// Facets steeper than this (cosine against the axis) are met by their sides only.
const VERTICAL: f64 = 1e-9;
/// Steps of the golden section along a side of a triangle: the height over it is concave.
const STEPS: u32 = 48;

impl EndBody {
    /// The same swollen by a distance.
    fn thicker(&self, by_mm: f64) -> Self {
        EndBody { radius_mm: self.radius_mm + by_mm, corner_mm: self.corner_mm + by_mm }
    }

    /// Height of its tip where a point at this distance from its axis, and at this height, stops it.
    fn stopped(&self, from_axis: f64, height: f64) -> f64 {
        let out = (from_axis - self.radius_mm + self.corner_mm).max(0.0);
        let within = self.corner_mm * self.corner_mm - out * out;
        if from_axis > self.radius_mm || within < 0.0 {
            return f64::NEG_INFINITY;
        }
        height - self.corner_mm + within.sqrt()
    }

    /// Height of its tip when it comes down on a triangle at the place of `at`. What is no higher than `least` may be found lower than
    /// it is.
    fn on_triangle(&self, corners: &[Point3; 3], at: &Point3, least: f64) -> f64 {
        let [a, b, c] = corners;
        if a.z.max(b.z).max(c.z) <= least {
            return f64::NEG_INFINITY;
        }
        let n = (b - a).cross(&(c - a));
        if n.z.abs() > VERTICAL * n.norm() {
            let n = n * (n.z.signum() / n.norm());
            // It touches the plane where it would stand with this normal.
            let tip = self.tip_over(a, &n, &Vector3::z());
            let plane = |x: f64, y: f64| -(n.x * x + n.y * y) / n.z;
            let height = tip.z + plane(at.x - tip.x, at.y - tip.y);
            let touch = a + (Point3::new(at.x, at.y, height) - tip);
            let turn = |p: &Point3, q: &Point3| (q.x - p.x) * (touch.y - p.y) - (q.y - p.y) * (touch.x - p.x);
            let turns = [turn(a, b), turn(b, c), turn(c, a)];
            if turns.iter().all(|t| *t >= 0.0) || turns.iter().all(|t| *t <= 0.0) {
                return height;
            }
        }
        [(a, b), (b, c), (c, a)]
            .into_iter()
            .fold(f64::NEG_INFINITY, |best, (a, b)| best.max(self.on_side(a, b, at, best.max(least))))
    }

    fn on_side(&self, a: &Point3, b: &Point3, at: &Point3, least: f64) -> f64 {
        let over = |share: f64| {
            let p = a + (b - a) * share;
            self.stopped((p - at).xy().norm(), p.z)
        };
        // Only what lies below the end counts: that is one stretch.
        let (way, to) = ((b - a).xy(), (at - a).xy());
        let length_squared = way.norm_squared();
        let (mut from, mut until, mut nearest) = (0.0, 1.0, 0.0);
        if length_squared > 0.0 {
            let (foot, aside_squared) =
                (to.dot(&way) / length_squared, to.perp(&way).powi(2) / length_squared);
            let half =
                (self.radius_mm * self.radius_mm - aside_squared).max(0.0).sqrt() / length_squared.sqrt();
            (from, until) = ((foot - half).clamp(0.0, 1.0), (foot + half).clamp(0.0, 1.0));
            nearest = foot.clamp(from, until);
        }
        let height = |share: f64| a.z + (b.z - a.z) * share;
        let from_axis = (a + (b - a) * nearest - at).xy().norm();
        // As if the highest place were the nearest one to the axis; on a level side it is.
        let most = self.stopped(from_axis, height(from).max(height(until)));
        if most <= least || a.z == b.z {
            return most;
        }
        let mut best = over(from).max(over(until));
        golden_section([from, until], STEPS, |share| {
            let height = over(share);
            best = best.max(height);
            height
        });
        best
    }
}

impl DropMesh<'_> {
    /// An upper bound of the height of an end's tip when it is lowered at the place of `at` (in the frame), if there is anything
    /// below or above it.
    pub(crate) fn highest_tip(&self, at: &Point3, body: &EndBody) -> Option<f64> {
        let best = std::cell::Cell::new(f64::NEG_INFINITY);
        self.tips_over(&best, at, body, |tip| {
            best.set(best.get().max(tip));
            ControlFlow::Continue(())
        });
        best.get().is_finite().then(|| best.get())
    }

    /// Whether an end with its tip at a place of the frame may hold something above itself.
    pub(crate) fn may_hold(&self, tip: &Point3, body: &EndBody) -> bool {
        let floor = std::cell::Cell::new(tip.z);
        let mut holds = false;
        self.tips_over(&floor, tip, body, |highest| {
            holds |= highest > tip.z;
            if holds { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        });
        holds
    }

    /// Upper bounds of the height of the tip over each triangle that rises above a floor, which may rise meanwhile.
    fn tips_over(
        &self,
        floor: &std::cell::Cell<f64>,
        at: &Point3,
        body: &EndBody,
        mut take: impl FnMut(f64) -> ControlFlow<()>,
    ) {
        let thick = body.radius_mm + self.worst_deviation_mm();
        self.visit(
            |b| {
                let beside = |k: usize| (b.min[k] - at[k]).max(at[k] - b.max[k]).max(0.0);
                b.max.z + self.worst_deviation_mm() > floor.get() && beside(0).hypot(beside(1)) < thick
            },
            |i| {
                let swollen_mm = self.deviation(i);
                let least = floor.get() - swollen_mm;
                take(body.thicker(swollen_mm).on_triangle(&self.corners(i), at, least) + swollen_mm)
            },
        );
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// Sides that cannot be higher than something are not looked at.
        #[test]
        fn what_is_higher_than_asked_for_is_found_as_high(
            corners in [0.0..9.0, 0.0..9.0, 0.0..2.0, 0.0..9.0, 0.0..9.0, 0.0..2.0, 0.0..9.0, 0.0..9.0, 0.0..2.0],
            x in -2.0..11.0, y in -2.0..11.0, corner_mm in 0.0..2.9, least in -3.0..2.0, is_level in proptest::bool::ANY,
        ) {
            let height = |i: usize| if is_level { corners[2] } else { corners[3 * i + 2] };
            let triangle = [0, 1, 2].map(|i| Point3::new(corners[3 * i], corners[3 * i + 1], height(i)));
            let (body, at) = (EndBody { radius_mm: 3.0, corner_mm }, Point3::new(x, y, 0.0));
            let all = body.on_triangle(&triangle, &at, f64::NEG_INFINITY);
            let found = body.on_triangle(&triangle, &at, least);
            prop_assert!(found == all || all <= least && found <= least, "{all} {found}");
            // Level sides are looked at in one place.
            let tilted = triangle.map(|p| Point3::new(p.x, p.y, p.z + 1e-9 * p.x));
            let near = body.on_triangle(&tilted, &at, f64::NEG_INFINITY);
            prop_assert!(all == near || (all - near).abs() < 1e-4, "{all} {near}");
        }

        #[test]
        fn no_point_of_a_triangle_enters_an_end_that_lies_on_it(
            corners in [0.0..9.0, 0.0..9.0, 0.0..9.0, 0.0..9.0, 0.0..9.0, 0.0..9.0, 0.0..9.0, 0.0..9.0, 0.0..9.0],
            x in -2.0..11.0, y in -2.0..11.0, corner_mm in 0.0..2.9,
        ) {
            let corner = |i: usize| Point3::new(corners[3 * i], corners[3 * i + 1], corners[3 * i + 2]);
            let triangle = [corner(0), corner(1), corner(2)];
            let body = EndBody { radius_mm: 3.0, corner_mm };
            let tip = Point3::new(x, y, body.on_triangle(&triangle, &Point3::new(x, y, 0.0), f64::NEG_INFINITY));
            prop_assume!(tip.z.is_finite());
            let mut nearest = f64::INFINITY;
            for i in 0..=120 {
                for j in 0..=120 - i {
                    let [s, t] = [i, j].map(|k| f64::from(k) / 120.0);
                    let p = triangle[0] + (triangle[1] - triangle[0]) * s + (triangle[2] - triangle[0]) * t;
                    nearest = nearest.min(body.distance(&(p - tip), &Vector3::z()).0);
                }
            }
            prop_assert!(nearest > -1e-6, "{nearest}");
            prop_assert!(nearest < 0.2, "{nearest}");
        }
    }
}
