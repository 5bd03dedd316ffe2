use claymill_nurbs::Point3;
use pulp::{Arch, Simd, WithSimd};

use super::drop::{BallDrop, Search};
use super::face::Pace;
use super::floor::{Floor, Hulls};
use super::{Location, Support};

/// Drops one after the other at places close together: each begins where the one before ended, and what could hold the
/// ball up anywhere around is gathered once for many.
#[derive(Debug)]
pub struct March<'a> {
    ball: &'a BallDrop<'a>,
    last: Option<Location>,
    pace: Pace,
    around: Around,
}

/// So far ahead of the ball is gathered at once, mm, at most and at least.
const AHEAD_MM: [f64; 2] = [6.0, 0.4];
/// And so far aside and behind, as a part of that.
const ASIDE: f64 = 0.05;
/// No corner is further than this from the touched point that bounds heights from below, in ball radii.
const FARTHEST: f64 = 0.95;

/// What could hold the ball up over a rectangle.
#[derive(Debug, Default)]
struct Around {
    rectangle: Option<[[f64; 2]; 2]>,
    items: Vec<u32>,
    hulls: Vec<Hulls>,
}

impl<'a> March<'a> {
    /// Begins anywhere.
    #[must_use]
    pub fn new(ball: &'a BallDrop<'a>) -> Self {
        March { ball, last: None, pace: Pace::default(), around: Around::default() }
    }

    /// [`BallDrop::drop`] at `(x, y)`.
    pub fn drop(&mut self, x: f64, y: f64) -> Option<Location> {
        let mut search = Search::new(self.ball, x, y);
        // Where several contacts compete, the pace may belong to another one: it only says where to begin.
        self.pace = self.last.and_then(|last| search.start_from(&last, &self.pace)).unwrap_or_default();
        let solid = search.best.as_ref().or(self.last.as_ref()).filter(|l| l.support != Support::Bound);
        if !self.around.holds(x, y) {
            let touched = solid.map(|l| l.centre - l.normal * self.ball.radius_mm());
            let from = self.last.map_or([x, y], |l| [l.centre.x, l.centre.y]);
            self.around.gather(self.ball, [x, y], from, touched);
        }
        if self.around.rectangle.is_some() {
            self.around.look(&mut search);
        } else {
            search.descend();
        }
        let found = search.finish();
        self.last = found.or(self.last);
        found
    }
}

impl Around {
    fn holds(&self, x: f64, y: f64) -> bool {
        self.rectangle.is_some_and(|[sx, sy]| (sx[0]..=sx[1]).contains(&x) && (sy[0]..=sy[1]).contains(&y))
    }

    /// Gathers for a rectangle about the way on from `at`, as seen `from` where the ball was before; over it a point
    /// that is touched bounds the heights from below. Nothing where that does not reach.
    fn gather(&mut self, ball: &BallDrop, at: [f64; 2], from: [f64; 2], touched: Option<Point3>) {
        self.rectangle = None;
        self.items.clear();
        self.hulls.clear();
        let Some(p) = touched else { return };
        let r = ball.radius_mm();
        let away = (p.x - at[0]).hypot(p.y - at[1]);
        let ahead = ((FARTHEST * r - away) / (1.0 + std::f64::consts::SQRT_2 * ASIDE)).min(AHEAD_MM[0]);
        if ahead < AHEAD_MM[1] {
            return;
        }
        let way = [at[0] - from[0], at[1] - from[1]];
        let length = way[0].hypot(way[1]).max(f64::MIN_POSITIVE);
        let rectangle = [0, 1].map(|k| {
            let onward = ahead * way[k] / length;
            [at[k] + onward.min(0.0) - ASIDE * ahead, at[k] + onward.max(0.0) + ASIDE * ahead]
        });
        let farthest = away + ahead * (1.0 + std::f64::consts::SQRT_2 * ASIDE);
        let low = p.z + (r * r - farthest * farthest).sqrt();
        let (items, hulls) = (&mut self.items, &mut self.hulls);
        ball.over(rectangle, low, |item, points, delta| {
            let k = items.len() % 8;
            if k == 0 {
                hulls.push(Hulls::NONE);
            }
            items.push(item);
            if let Some(eight) = hulls.last_mut() {
                eight.put(k, points, delta);
            }
        });
        self.rectangle = Some(rectangle);
    }

    /// Looks at what was gathered.
    fn look(&self, search: &mut Search) {
        let arch = Arch::new();
        for (hulls, items) in self.hulls.iter().zip(self.items.chunks(8)) {
            let clear = arch.dispatch(Clears { floor: &search.floor, hulls });
            for (&item, clear) in items.iter().zip(clear) {
                if !clear {
                    search.visit(item);
                }
            }
        }
    }
}

struct Clears<'a> {
    floor: &'a Floor,
    hulls: &'a Hulls,
}

impl WithSimd for Clears<'_> {
    type Output = [bool; 8];

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> [bool; 8] {
        self.floor.clears_eight(self.hulls)
    }
}
