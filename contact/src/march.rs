//! Incremental drops along a curve: each starts from the contact before, and candidates are
//! gathered once for a whole stretch.

use claymill_nurbs::{Point2, Point3};
use nalgebra::Vector2;
use pulp::{Arch, Simd, WithSimd};

use crate::Location;
use crate::certificate::support_bound::{Hulls, SupportBound};
use crate::drop::{BallDrop, Search};
use crate::exact::face::Pace;

/// Drops one after the other at places close together: each begins where the one before ended, and what could hold the
/// ball up anywhere around is gathered once for many.
#[derive(Debug)]
pub struct March<'a> {
    ball: &'a BallDrop<'a>,
    last: Option<Location>,
    /// The ball has found nothing since.
    lost: bool,
    /// The triangle that its contact lies in, if it is known.
    triangle: Option<u32>,
    /// Of the contact on the face where the last ball rested, there and at the place before.
    pace: Option<Pace>,
    pace_before: Option<Pace>,
    around: Around,
}

/// So far ahead of the ball is gathered at once, at most in mm and in ball radii, and at least.
const AHEAD_MM: f64 = 6.0;
const AHEAD_RADII: f64 = 0.8;
const LEAST_AHEAD_MM: f64 = 0.4;
/// And so far aside and behind, as a part of that.
const ASIDE: f64 = 0.05;
/// No corner is further than this from the touched point that bounds heights from below, in ball radii.
const FARTHEST: f64 = 0.95;

/// What could hold the ball up over a rectangle.
#[derive(Debug, Default)]
struct Around {
    rectangle: Option<[[f64; 2]; 2]>,
    items: Vec<usize>,
    hulls: Vec<Hulls>,
}

impl<'a> March<'a> {
    /// Begins anywhere.
    #[must_use]
    pub fn new(ball: &'a BallDrop<'a>) -> Self {
        March {
            ball,
            last: None,
            lost: false,
            triangle: None,
            pace: None,
            pace_before: None,
            around: Around::default(),
        }
    }

    /// Whether the ball rests on the side of the material there.
    #[must_use]
    pub fn touches_material(&self, at: &Location) -> bool {
        self.ball.touches_material(at)
    }

    /// [`BallDrop::drop`] at `(x, y)`.
    pub fn drop(&mut self, x: f64, y: f64) -> Option<Location> {
        if !self.ball.end().is_ball() {
            let found = self.ball.rest_of_end([x, y], self.last.as_ref(), f64::NEG_INFINITY);
            self.last = found.or(self.last);
            return found;
        }
        let mut search = Search::new(self.ball, x, y);
        // Where several contacts compete, the pace may belong to another one: it only says where to begin.
        let likely = match (self.pace, self.pace_before) {
            (Some(pace), Some(before)) => pace.onward(&before),
            (pace, _) => pace.unwrap_or_default(),
        };
        // Where the ball found nothing a moment ago it has left that face, and what it touched is far away.
        let near = self.last.filter(|_| !self.lost);
        let pace = near.and_then(|last| search.start_from(&last, self.triangle, &likely));
        self.pace_before = std::mem::replace(&mut self.pace, pace);
        if !search.is_certified() {
            self.look(&mut search);
        }
        let found = search.finish();
        if found.map(|l| l.face) != self.last.map(|l| l.face) {
            self.pace_before = None;
        }
        self.triangle = search.triangle;
        self.last = found.or(self.last);
        self.lost = found.is_none();
        found
    }

    /// Looks at all that could hold the ball higher.
    fn look(&mut self, search: &mut Search) {
        let (x, y) = (search.x, search.y);
        let solid = search.best.as_ref().or(self.last.as_ref()).filter(|l| l.support.is_touched());
        if !self.around.holds(x, y) {
            let from = self.last.map_or([x, y], |l| [l.centre.x, l.centre.y]);
            self.around.gather(self.ball, [x, y], from, solid, &self.pace.unwrap_or_default());
        }
        if self.around.rectangle.is_some() {
            self.around.look(search);
        } else {
            search.descend();
        }
    }
}

impl Around {
    fn holds(&self, x: f64, y: f64) -> bool {
        self.rectangle.is_some_and(|[sx, sy]| (sx[0]..=sx[1]).contains(&x) && (sy[0]..=sy[1]).contains(&y))
    }

    /// Gathers for a rectangle about the way on from `at`, as seen `from` where the ball was before; over it points of
    /// the model bound the heights from below: the one that is `touched` and, if the ball stays on that face, the one
    /// at the end of the way. Nothing where these do not reach.
    fn gather(
        &mut self,
        ball: &BallDrop,
        at: [f64; 2],
        from: [f64; 2],
        touched: Option<&Location>,
        pace: &Pace,
    ) {
        self.rectangle = None;
        self.items.clear();
        self.hulls.clear();
        let Some(location) = touched else { return };
        let r = ball.radius_mm();
        let near = ball.touched(location);
        let away = (near.x - at[0]).hypot(near.y - at[1]);
        let way = Vector2::new(at[0] - from[0], at[1] - from[1]).try_normalize(0.0).unwrap_or_default();
        let at = Point2::from(at);
        let mut ahead = AHEAD_MM.min(AHEAD_RADII * r);
        let mut aside = ASIDE * ahead;
        let mut low = f64::NEG_INFINITY;
        if let Some(far) = ball.point_ahead(location, pace, at + way * ahead) {
            for share in [0.25, 0.5, 0.75] {
                let (middle, end) = (at + way * (share * ahead), at + way * ahead);
                low =
                    low.max(lowest(&near, [at, middle], aside, r).min(lowest(&far, [middle, end], aside, r)));
            }
        }
        if low == f64::NEG_INFINITY {
            ahead = ((FARTHEST * r - away) / (1.0 + std::f64::consts::SQRT_2 * ASIDE)).min(ahead);
            if ahead < LEAST_AHEAD_MM {
                return;
            }
            aside = ASIDE * ahead;
            low = lowest(&near, [at, at + way * ahead], aside, r);
        }
        let rectangle = [0, 1].map(|k| {
            let onward = ahead * way[k];
            [at[k] + onward.min(0.0) - aside, at[k] + onward.max(0.0) + aside]
        });
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
                    search.visit_uncleared(item);
                }
            }
        }
    }
}

/// A ball within `aside` of the way from `a` to `b` is nowhere lower, as `p` is there.
fn lowest(p: &Point3, [a, b]: [Point2; 2], aside: f64, r: f64) -> f64 {
    let away = (p.xy() - a).norm().max((p.xy() - b).norm()) + std::f64::consts::SQRT_2 * aside;
    if away < r { p.z + (r * r - away * away).sqrt() } else { f64::NEG_INFINITY }
}

struct Clears<'a> {
    floor: &'a SupportBound,
    hulls: &'a Hulls,
}

impl WithSimd for Clears<'_> {
    type Output = [bool; 8];

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> [bool; 8] {
        self.floor.clears_eight(self.hulls)
    }
}
