//! Ways down to the start of a pass, up from its end, and over from one to the other.
//!
//! ```text
//!      ┌──────── rapid, above everything ────────┐
//!      │ rapid                             rapid │
//!      ○ clear within 2 mm                       ○
//!       ╲ lead out                       lead in │
//!   wall │●═══════ pass ═══ … ═══ next pass ════●
//! ```
//!
//! A lead leaves its pass without a corner, on an arc in the upright plane through it, if nothing is in the way: a tool that stops
//! on the surface leaves a mark there. A pass often ends beside a wall, where no rapid may run down. The rapid then runs down a little aside, where
//! it is clear, and the lead slants from there. A ball that touches an upright wall goes off it before it goes up.

use claymill_contact::BallDrop;
use claymill_nurbs::{Curve3, Point3, Vector3};
use claymill_toolpath::{Move, MoveKind, round_to_written};

use crate::curve::drive::{DriveCurve, Line};
use crate::fit::written::{one_span, reversed_from_zero};
use crate::follow::profile::follow;
use crate::setup::context::SetupContext;

/// Rapids up and down keep this far away from walls, seen in so many directions, mm.
const ASIDE_MM: f64 = 2.0;
const DIRECTIONS: u32 = 8;
/// A slanted lead is this wide, mm.
const SLANT_MM: f64 = 2.0 * ASIDE_MM;
/// Parts of a slanted lead over which the ball's path is not known may be this long, mm.
const GAP_MM: f64 = 0.1;
/// A slanted lead starts on the model: rounding may be this much, mm.
const TOUCHING_MM: f64 = 1e-3;
/// So far aside an earlier ball is looked for where it did not get down, in its radii.
const BESIDE: [f64; 2] = [0.5, 0.9];
/// Ways over up to this length are looked at closely where the map of heights asks for a long way up, mm.
const SHORT_WAY_MM: f64 = 600.0;
/// Whether a slanted lead is in its bounds is looked at in so many places.
const LOOKS: u32 = 8;
/// Leads are slanted where that saves this much of their height, in clearances of rapids.
const WORTH: f64 = 2.0;

/// Radius of the arcs on which passes are left, in ball radii.
const ARC_RADII: f64 = 0.5;
/// A pass that goes down more steeply than this is not left on an arc, which would be most of a circle (cosine, 120°).
const LEFT_ON_ARC: f64 = -0.5;

/// An end of a pass, and the direction that leads on from there.
#[derive(Debug, Clone, Copy)]
pub(crate) struct End {
    pub(crate) at: Point3,
    pub(crate) onward: Vector3,
}

impl End {
    /// Where a curve begins.
    pub(crate) fn before(curve: &Curve3) -> Self {
        End { at: curve.start(), onward: -curve.derivatives(curve.domain().0)[1] }
    }

    /// Where it ends.
    pub(crate) fn behind(curve: &Curve3) -> Self {
        End { at: curve.end(), onward: curve.derivatives(curve.domain().1)[1] }
    }
}

/// Where the leads of a pass go.
struct Lead {
    /// On or above the model, at the end of the pass.
    end: Point3,
    off: Option<Off>,
    /// Where the rapid takes over.
    place: Point3,
}

/// The way off the surface, before a lead goes up.
enum Off {
    /// From a wall that the ball touches.
    Wall(Point3),
    /// In the open.
    Arc(Curve3),
}

impl Lead {
    /// Where it goes up from.
    fn foot(&self) -> Point3 {
        match &self.off {
            Some(Off::Wall(to)) => *to,
            Some(Off::Arc(arc)) => arc.end(),
            None => self.end,
        }
    }
}

impl SetupContext<'_> {
    /// Up, across at a proven height, down.
    pub(crate) fn lift_over(&self, from: End, to: End) -> Vec<Move> {
        let (a, b) = (self.lead(from), self.lead(to));
        let height = self.link_height(a.place, b.place);
        let mut moves = self.up(&a, height);
        moves.push(self.rapid(self.at_height(a.place, height), self.at_height(b.place, height)));
        moves.extend(self.down(&b, height));
        moves
    }

    /// Tip height in the setup at which a straight rapid between two places is proven clear.
    pub(crate) fn link_height(&self, from: Point3, to: Point3) -> f64 {
        let (a, b) = (self.frame.to_setup(&from), self.frame.to_setup(&to));
        let ends = a.z.max(b.z);
        // What an earlier ball has left is no higher than what it rests on.
        let aside = self.ball.widest_mm()
            + self.earlier.map_or(0.0, BallDrop::radius_mm)
            + self.obstacle_mm
            + self.stock_mm();
        let top = self.heights.over([a.x, a.y], [b.x, b.y], aside);
        let high = (top + self.stock_mm()).max(ends) + self.clearance_mm;
        // The map is coarse: a wall beside a short way counts as if it stood in it.
        let short = (b - a).xy().norm() <= SHORT_WAY_MM && high > ends + self.worth_mm();
        let low = if short { self.height_between(&a, &b).max(ends).min(high) } else { high };
        rounded_up(low)
    }

    /// The clear height along a straight way, from the ball dropped every few millimetres. Between two drops a
    /// bump could hide that rises by `(½ d)² / 2R`, far less than the clearance.
    fn height_between(&self, a: &Point3, b: &Point3) -> f64 {
        let looks = ((b - a).xy().norm() / ASIDE_MM).ceil().max(1.0) as u32;
        (0..=looks)
            .map(|k| a + (b - a) * (f64::from(k) / f64::from(looks)))
            .map(|p| self.clear_height(&p))
            .fold(f64::NEG_INFINITY, f64::max)
    }

    /// From above everything down to where a pass starts.
    pub(crate) fn approach(&self, to: End) -> Vec<Move> {
        self.down(&self.lead(to), self.safe_height())
    }

    /// Up from the end of a pass, above everything.
    pub(crate) fn retreat(&self, from: End) -> Vec<Move> {
        self.up(&self.lead(from), self.safe_height())
    }

    fn worth_mm(&self) -> f64 {
        WORTH * self.clearance_mm
    }

    fn safe_height(&self) -> f64 {
        rounded_up(self.heights.highest() + self.stock_mm() + self.clearance_mm)
    }

    /// Stock that may stand above what the job leaves, mm.
    fn stock_mm(&self) -> f64 {
        self.stock.map_or(0.0, |(_, stock_mm)| stock_mm)
    }

    /// Tip height at which the ball is clear of all stock over a place and a little aside, or this one if that is larger.
    fn over_stock(&self, foot: &Point3, height: f64) -> f64 {
        let Some((stock, _)) = self.stock else { return height };
        let radius_mm = self.ball.radius_mm();
        let over = |high: f64, (x, y): (f64, f64)| stock.tip_above(x, y, high, radius_mm);
        [(foot.x, foot.y)].into_iter().chain(around(foot.x, foot.y, ASIDE_MM)).fold(height, over)
    }

    fn lead(&self, End { at: end, onward }: End) -> Lead {
        let off_wall = self.off_wall(end).map(Off::Wall);
        let off = off_wall.or_else(|| self.arc_up(end, onward).map(Off::Arc));
        let lead = Lead { end, off, place: end };
        Lead { place: self.lead_place(lead.foot()), ..lead }
    }

    /// The arc that goes on from the end of a pass and turns upwards, if it is clear and leads over nothing that an earlier ball
    /// may have left.
    fn arc_up(&self, end: Point3, onward: Vector3) -> Option<Curve3> {
        let (axis, radius_mm) = (self.frame.axis(), ARC_RADII * self.ball.radius_mm());
        let way = onward.try_normalize(0.0)?;
        let inward = (axis - way * axis.dot(&way)).try_normalize(0.0)?;
        if axis.dot(&way) < LEFT_ON_ARC || self.earlier.is_some() {
            return None;
        }
        let turn = way.angle(&axis);
        let top = end + (way * turn.sin() + inward * (1.0 - turn.cos())) * radius_mm;
        // The cubic that comes nearest to an arc.
        let arm = 4.0 / 3.0 * (0.25 * turn).tan() * radius_mm;
        let points = [end, end + way * arm, top - axis * arm, top].map(|p| p.map(round_to_written));
        let length = round_to_written(radius_mm * turn);
        let arc = one_span(points, length)?;
        let foot = self.frame.to_setup(&arc.end());
        let is_free_above = || {
            let centre = foot + Vector3::z() * self.ball.end().corner_mm;
            self.ball.tip_above(foot.x, foot.y, foot.z, self.ball.end().corner_mm) <= foot.z
                && !self.ball.is_in_material_above(&centre)
        };
        (self.is_curve_clear(&arc) && is_free_above()).then_some(arc)
    }

    fn down(&self, lead: &Lead, height: f64) -> Vec<Move> {
        let place = lead.place;
        let onto = lead.off.as_ref().map(|off| match off {
            Off::Wall(from) => self.straight_lead(MoveKind::LeadIn, *from, lead.end),
            Off::Arc(arc) => self.lead_along(MoveKind::LeadIn, &reversed_from_zero(arc)),
        });
        let down = [
            self.rapid(self.at_height(place, height), place),
            self.straight_lead(MoveKind::LeadIn, place, lead.foot()),
        ];
        down.into_iter().chain(onto).collect()
    }

    fn up(&self, lead: &Lead, height: f64) -> Vec<Move> {
        let place = lead.place;
        let off = lead.off.as_ref().map(|off| match off {
            Off::Wall(to) => self.straight_lead(MoveKind::LeadOut, lead.end, *to),
            Off::Arc(arc) => self.lead_along(MoveKind::LeadOut, arc),
        });
        let up = [
            self.straight_lead(MoveKind::LeadOut, lead.foot(), place),
            self.rapid(place, self.at_height(place, height)),
        ];
        off.into_iter().chain(up).collect()
    }

    fn lead_along(&self, kind: MoveKind, curve: &Curve3) -> Move {
        Move::along(kind, curve, self.frame.axis(), self.feeds.lead_mm_per_min)
    }

    fn straight_lead(&self, kind: MoveKind, from: Point3, to: Point3) -> Move {
        Move::straight(kind, from, to, self.frame.axis(), self.feeds.lead_mm_per_min)
    }

    /// Where the lead to `p` begins: straight above it, or aside where that is much lower and the slanted way
    /// is clear. The columns of both are clear: the ball was dropped through them.
    fn lead_place(&self, p: Point3) -> Point3 {
        let at = self.frame.to_setup(&p);
        let above = Point3::new(at.x, at.y, self.clear_height(&at));
        let is_kept = |q: &Point3| {
            let up = Vector3::z() * self.ball.end().corner_mm;
            let way: Vec<Point3> =
                (0..=LOOKS).map(|k| at + (q - at) * (f64::from(k) / f64::from(LOOKS)) + up).collect();
            self.containment.is_none_or(|containment| containment.allows_way(&way))
        };
        let is_proven =
            |q: &Point3| self.enters_nothing_between(p, self.frame.to_model(q).map(round_to_written));
        let worth = |q: &Point3| {
            q.z < above.z - self.worth_mm()
                && is_kept(q)
                && !self.ball.is_in_material_above(&(q + Vector3::z() * self.ball.end().corner_mm))
                && (self.is_clear(q, &at)
                    || self.is_way_clear(p, self.frame.to_model(q).map(round_to_written)))
                && is_proven(q)
        };
        let aside = || {
            around(at.x, at.y, SLANT_MM).map(|(x, y)| {
                let foot = Point3::new(round_to_written(x), round_to_written(y), at.z);
                Point3::new(foot.x, foot.y, self.clear_height(&foot))
            })
        };
        // Without a wall in sight there is nothing to be saved.
        let low = at.z + self.clearance_mm + SLANT_MM;
        let lower = |a: &Point3, b: &Point3| a.z.total_cmp(&b.z);
        let best = match () {
            // What the end of a pass just touches may be in the way straight up.
            () if !is_proven(&above) => aside().filter(|q| is_kept(q) && is_proven(q)).min_by(lower),
            () if above.z < low + self.worth_mm() => None,
            () => aside().filter(worth).min_by(lower),
        };
        self.frame.to_model(&best.unwrap_or(above))
    }

    /// Tip height a clearance above `foot` and wherever the ball could rest there or a little aside.
    pub(crate) fn clear_height(&self, foot: &Point3) -> f64 {
        let places = [(foot.x, foot.y)].into_iter().chain(around(foot.x, foot.y, ASIDE_MM));
        let high =
            places.fold(foot.z, |high, (x, y)| self.ball.tip_above(x, y, high, self.ball.end().corner_mm));
        let high =
            self.containment.map_or(high, |containment| containment.over_obstacles(foot.x, foot.y, high));
        let high = self.over_stock(foot, self.above_left_by_earlier(foot, high));
        round_to_written(high + self.clearance_mm)
    }

    /// The height, or a larger one below which all is that an earlier ball has left within the ball's radius: that ball was
    /// there, or so near that its side was.
    fn above_left_by_earlier(&self, foot: &Point3, height: f64) -> f64 {
        let Some(earlier) = self.earlier else { return height };
        let radius_mm = self.ball.radius_mm();
        let earlier_mm = earlier.radius_mm();
        let left = |high: f64, (x, y): (f64, f64)| -> f64 {
            let over = earlier.tip_above(x, y, high, earlier_mm);
            if over <= high.max(foot.z + self.worth_mm()) {
                return over;
            }
            let mut sides = BESIDE.into_iter().flat_map(|share| {
                let aside_mm = share * earlier_mm;
                let rise_mm = earlier_mm - (earlier_mm * earlier_mm - aside_mm * aside_mm).sqrt();
                around(x, y, aside_mm).map(move |at| (at, rise_mm))
            });
            let lower = |least: f64, ((x, y), rise_mm): ((f64, f64), f64)| {
                let side = earlier.tip_above(x, y, high - rise_mm, earlier_mm) + rise_mm;
                // None is below `high`, so that the first one there decides; off the model it need not have been.
                match side <= high {
                    true if earlier.drop(x, y).is_some() => Err(high),
                    true => Ok(least),
                    false => Ok(least.min(side)),
                }
            };
            sides.try_fold(over, lower).unwrap_or_else(|high| high)
        };
        let places = [0.5, 1.0].into_iter().flat_map(|share| around(foot.x, foot.y, share * radius_mm));
        [(foot.x, foot.y)].into_iter().chain(places).fold(height, left)
    }

    /// Whether the straight way from the location `at` up to `place` stays above the exact path of the ball
    /// over it, which must be known all the way.
    fn is_clear(&self, place: &Point3, at: &Point3) -> bool {
        let (way, radius) = ((place - at).xy(), self.ball.end().corner_mm);
        let length = way.norm();
        let drive =
            DriveCurve::Straight(Line { origin: [at.x, at.y], direction: [way.x / length, way.y / length] });
        let followed = follow(self.ball, &drive, 0.0, length);
        let Some((first, last)) = followed.chains.first().zip(followed.chains.last()) else {
            return false;
        };
        let rise = (place.z - at.z) / length;
        let profiles = followed.chains.iter().flatten();
        let gaps = followed.chains.windows(2).map(|w| w[1][0].start().s - w[0][w[0].len() - 1].end().s);
        first[0].start().s <= GAP_MM
            && last[last.len() - 1].end().s >= length - GAP_MM
            && gaps.fold(0.0, f64::max) <= GAP_MM
            && profiles.flat_map(|p| p.samples.windows(2).map(move |w| (p, w[0].s, w[1].s))).all(
                |(p, from, to)| {
                    // A bump between two samples counts as well.
                    (0..=8)
                        .map(|k| from + (to - from) * f64::from(k) / 8.0)
                        .all(|s| p.at(s).0 - radius <= at.z + rise * s + TOUCHING_MM)
                },
            )
    }

    fn rapid(&self, from: Point3, to: Point3) -> Move {
        Move::straight(MoveKind::Rapid, from, to, self.frame.axis(), self.feeds.rapid_mm_per_min)
    }

    fn at_height(&self, p: Point3, height: f64) -> Point3 {
        let q = self.frame.to_setup(&p);
        self.frame.to_model(&Point3::new(q.x, q.y, height))
    }
}

/// A height that is written: not below the one that is proven.
fn rounded_up(height: f64) -> f64 {
    round_to_written((height * 10.0).ceil() / 10.0)
}

/// Places on a circle.
fn around(x: f64, y: f64, radius: f64) -> impl Iterator<Item = (f64, f64)> {
    (0..DIRECTIONS).map(move |k| {
        let (sine, cosine) = (std::f64::consts::TAU * f64::from(k) / f64::from(DIRECTIONS)).sin_cos();
        (x + radius * cosine, y + radius * sine)
    })
}
