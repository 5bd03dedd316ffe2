//! Bounding-box tree queries for a dropped ball: by the greatest height at which it could rest on a
//! box, over a rectangle, and around a point.

use std::ops::ControlFlow;

use claymill_nurbs::{Aabb, BRANCHES, BoxTree, Boxes, Eight, Point3, outward};

use crate::certificate::support_bound::SupportBound;

/// Boxes in a tree, to find what a ball dropped at `(x, y)` could rest on.
#[derive(Debug)]
pub(crate) struct DropTree(pub(crate) BoxTree);

/// Single precision is off by a few millionths at most; a ball this much larger makes up for it.
const ROUNDING: f32 = 1e-5;

impl DropTree {
    pub(crate) fn new(boxes: &[Aabb]) -> Self {
        DropTree(BoxTree::new(boxes))
    }

    /// Visits every item whose box could carry a ball of radius `r` above `floor`, most promising first; the
    /// visitor returns the new floor.
    pub(crate) fn descend(
        &self,
        x: f64,
        y: f64,
        r: f64,
        mut floor: SupportBound,
        mut visit: impl FnMut(usize) -> SupportBound,
    ) {
        let ball = Ball { over: [outward([x, x]), outward([y, y])], r: r as f32 * (1.0 + ROUNDING) };
        let depths = |floor: &SupportBound, boxes: &Boxes| {
            let (heights, cleared) = (ball.heights(boxes), floor.clears_boxes(boxes));
            std::array::from_fn(|k| if cleared[k] { f32::INFINITY } else { -heights[k] })
        };
        let surpassed = |floor: &SupportBound, depth: f32| -f64::from(depth) <= floor.z;
        self.0.search(&mut floor, depths, surpassed, |floor, item| *floor = visit(item));
    }

    /// Visits every item on which a ball of radius `r` somewhere over the rectangle could rest with its centre
    /// above `low`.
    pub(crate) fn over(&self, [x, y]: [[f64; 2]; 2], r: f64, low: f64, mut visit: impl FnMut(usize)) {
        let ball = Ball { over: [outward(x), outward(y)], r: r as f32 * (1.0 + ROUNDING) };
        let low = (low as f32).next_down();
        let item = |item| {
            visit(item);
            ControlFlow::Continue(())
        };
        self.0.visit(|boxes| ball.may_rest_above(boxes, low), item);
    }

    /// Visits every item whose box comes so near to a point along all axes.
    pub(crate) fn around(&self, p: &Point3, apart_mm: f64, mut visit: impl FnMut(usize)) {
        let ranges = [0, 1, 2].map(|axis| outward([p[axis] - apart_mm, p[axis] + apart_mm]));
        let meets = |boxes: &Boxes| {
            std::array::from_fn(|k| {
                let meets = |axis: usize| {
                    (boxes.min[axis][k] <= ranges[axis][1]) & (ranges[axis][0] <= boxes.max[axis][k])
                };
                meets(0) & meets(1) & meets(2)
            })
        };
        self.0.visit(meets, |item| {
            visit(item);
            ControlFlow::Continue(())
        });
    }
}

/// A ball somewhere over a rectangle.
struct Ball {
    over: [[f32; 2]; 2],
    r: f32,
}

impl Ball {
    /// What is left of `r²` beyond the squared distance over the ground.
    #[inline(always)]
    fn left(&self, boxes: &Boxes) -> Eight {
        let ([x, y], r) = (self.over, self.r);
        std::array::from_fn(|k| {
            let dx = larger(larger(boxes.min[0][k] - x[1], x[0] - boxes.max[0][k]), 0.0);
            let dy = larger(larger(boxes.min[1][k] - y[1], y[0] - boxes.max[1][k]), 0.0);
            r * r - (dx * dx + dy * dy)
        })
    }

    /// It cannot rest on anything in the boxes with its centre above these.
    #[inline(always)]
    fn heights(&self, boxes: &Boxes) -> Eight {
        let left = self.left(boxes);
        std::array::from_fn(|k| {
            let height = (boxes.max[2][k] + larger(left[k], 0.0).sqrt()).next_up();
            if left[k] > 0.0 { height } else { f32::NEG_INFINITY }
        })
    }

    /// Whether it could rest on something in the boxes with its centre above `low`.
    #[inline(always)]
    fn may_rest_above(&self, boxes: &Boxes, low: f32) -> [bool; BRANCHES] {
        let left = self.left(boxes);
        std::array::from_fn(|k| {
            let needed = larger(low - boxes.max[2][k], 0.0);
            left[k] - needed * needed > 0.0
        })
    }
}

/// The larger one; unlike `f32::max` without a thought for what is no number.
#[inline(always)]
fn larger(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

#[cfg(test)]
mod tests {
    use super::*;
    use claymill_nurbs::Vector3;

    #[test]
    fn nothing_that_could_carry_the_ball_is_missed() {
        let share = |k: u32, prime: u32| (f64::from(k) * 0.618_033_988_75 * f64::from(prime)).fract();
        let boxes: Vec<Aabb> = (0..3000)
            .map(|k| {
                let at = Point3::new(4000.0 + 300.0 * share(k, 1), -90.0 * share(k, 3), 30.0 * share(k, 7));
                Aabb::of([&at, &(at + Vector3::new(share(k, 11), share(k, 13), share(k, 17)) * 5.0)])
            })
            .collect();
        let tree = DropTree::new(&boxes);
        let r = 7.0;
        let height = |b: &Aabb, [x, y]: [[f64; 2]; 2]| {
            let dx = (b.min.x - x[1]).max(x[0] - b.max.x).max(0.0);
            let dy = (b.min.y - y[1]).max(y[0] - b.max.y).max(0.0);
            let left = r * r - dx * dx - dy * dy;
            if left > 0.0 { b.max.z + left.sqrt() } else { f64::NEG_INFINITY }
        };
        let mut missed_none = 0;
        for k in 0..200 {
            let (x, y) = (4000.0 + 300.0 * share(k, 19), -90.0 * share(k, 23));
            let rectangle = [[x, x + share(k, 29)], [y, y + 3.0 * share(k, 31)]];
            let low = 40.0 * share(k, 37);
            let mut found = vec![false; boxes.len()];
            tree.over(rectangle, r, low, |i| found[i] = true);
            for (b, found) in boxes.iter().zip(&found) {
                let needed = height(b, rectangle) > low;
                assert!(*found || !needed);
                missed_none += u32::from(needed);
            }
            // By order of promise, the first one is the highest; with a floor below it, all above are met.
            let place = [[x, x], [y, y]];
            let mut best = f64::NEG_INFINITY;
            tree.descend(x, y, r, SupportBound::NONE, |i| {
                best = best.max(height(&boxes[i], place));
                let mut floor = SupportBound::NONE;
                floor.z = best;
                floor
            });
            let highest = boxes.iter().map(|b| height(b, place)).fold(f64::NEG_INFINITY, f64::max);
            assert!(best == highest, "{best} {highest}");
        }
        assert!(missed_none > 1000, "{missed_none}");
        DropTree::new(&[]).over([[0.0; 2]; 2], r, 0.0, |_| unreachable!());
    }
}
