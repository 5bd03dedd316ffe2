//! How high the crest is that two neighbouring passes of a sweep leave beside a place.
//!
//! ```text
//!              x           x: where the balls meet
//!      ●  ___╱   ╲__        m: the place that was looked at, halfway in level
//!       ╱      m     ╲  ●
//! ```
//!
//! Where the surface bends sharply that is not halfway in level. Mostly the curvature at the place tells where both balls
//! are, and so how high they leave it; elsewhere the ball is dropped halfway between them.

use claymill_contact::{EndShape, Support};
use claymill_nurbs::{Point2, Point3, Vector3};

use crate::pattern::levels::pattern::Spot;
use crate::pattern::levels::strokes::Place;
use crate::pattern::near::{PassIndex, Touch, cut_to_mm};
use crate::pattern::part_region::PartRegion;
use crate::pattern::rows::crests::WORTH_A_PASS;
use crate::setup::context::SetupContext;

/// Between passes whose balls are no further apart than this, in flat step-overs, no crest is too high but in a valley.
const FAR_APART: f64 = 1.02;
/// A crest beside the places that are looked at is worth a pass from this share of the scallop height on.
const HIGH_CREST: f64 = 1.1;
/// Another pass cuts a crest when it leaves less than this share of what the two on both sides leave.
const OTHERS: f64 = 0.9;
/// Balls are where the curvature at a place says, when they are no further from there than this share of the scallop height.
const EVEN: f64 = 0.05;
/// Where a part ends is looked for by so many halvings of the way to the next level.
const HALVINGS: usize = 4;

/// What is laid of a part so far.
pub(crate) struct SoFar<'s, 'b, 'a, 'm> {
    pub(crate) near: [&'s PassIndex<'s>; 3],
    pub(crate) ground: &'s PartRegion<'b, 'a, 'm>,
}

impl SoFar<'_, '_, '_, '_> {
    /// Whether a pass comes past that cuts to no more than `most_mm` over a place.
    pub(crate) fn is_cut(&self, touch: &Touch, end: &EndShape, most_mm: f64) -> bool {
        self.near.iter().any(|near| near.is_cut(touch, end, most_mm))
    }
}

impl SetupContext<'_> {
    /// Whether the crest between the passes to the left and to the right of a place is low enough, too: where the surface
    /// bends sharply beside the place, that is where the two balls meet, and not halfway in level. Where no pass comes by on
    /// one side within `beside_mm`, what the part cuts may end there.
    pub(crate) fn is_crest_cut(&self, place: &Place, touch: &Touch, beside_mm: f64, so_far: &SoFar) -> bool {
        let beside = so_far.near.map(|near| near.beside(touch));
        let nearest = |side: usize| {
            let balls = beside.iter().filter_map(|balls| balls[side]);
            balls.min_by(|a, b| (a - touch.centre).norm().total_cmp(&(b - touch.centre).norm()))
        };
        let (left, right) = match (nearest(0), nearest(1)) {
            (Some(left), Some(right)) => (left, right),
            (None, Some(_)) => return self.is_end_cut(touch, beside_mm, so_far),
            (Some(_), None) => return self.is_end_cut(touch, -beside_mm, so_far),
            (None, None) => return true,
        };
        let apart_mm = (right - left).norm();
        let over_mm = (left - place.centre).dot(&place.normal) + (right - place.centre).dot(&place.normal);
        if apart_mm <= FAR_APART * self.flat_step_mm() && over_mm <= EVEN * self.scallop_mm {
            return true;
        }
        let most_mm = HIGH_CREST * self.scallop_mm;
        if self.crest_on_even_ground(place, &left, &right).is_some_and(|high_mm| high_mm <= most_mm) {
            return true;
        }
        let halfway = nalgebra::center(&left, &right);
        let Some(crest) = self.own_touch(halfway.xy(), touch.feed, so_far) else { return true };
        let left_mm =
            [left, right].map(|b| cut_to_mm(&crest.point, &crest.normal, &b, self.ball.radius_mm()));
        // The two meet between what the one and the other leave there.
        let is_high = 0.5 * (left_mm[0] + left_mm[1]) > most_mm;
        let others_mm = OTHERS * left_mm[0].min(left_mm[1]);
        !is_high || so_far.is_cut(&crest, &self.ball.end(), others_mm)
    }

    /// Whether the passes have cut what the part cuts up to its end, which is looked for by halving, within `mm` to the left
    /// (if positive) or to the right of a place.
    fn is_end_cut(&self, touch: &Touch, mm: f64, so_far: &SoFar) -> bool {
        let Some(left) = touch.normal.cross(&touch.feed).xy().try_normalize(0.0) else { return true };
        let (mut on_mm, mut off_mm) = (0.0, mm);
        let mut end = None;
        for _ in 0..HALVINGS {
            let middle_mm: f64 = 0.5 * (on_mm + off_mm);
            match self.own_touch(touch.centre.xy() + left * middle_mm, touch.feed, so_far) {
                Some(own) => (on_mm, end) = (middle_mm, Some(own)),
                None => off_mm = middle_mm,
            }
        }
        let most_mm = WORTH_A_PASS * self.scallop_mm;
        end.is_none_or(|end| so_far.is_cut(&end, &self.ball.end(), most_mm))
    }

    /// Where the ball rests at a place, if it touches something there that the part cuts.
    fn own_touch(&self, at: Point2, feed: Vector3, so_far: &SoFar) -> Option<Touch> {
        let rest = self.ball.drop(at.x, at.y)?;
        let Support::Face { u, v } = rest.support else { return None };
        let is_facing = rest.normal.z >= self.least_facing;
        let is_own = is_facing && so_far.ground.owns(rest.face) && self.claims_at(rest.face, u, v);
        is_own.then(|| Touch::of(&rest, feed, self.ball.contact(&rest)))
    }

    /// Height of the crest between two balls at rest to the left and to the right of a place, if the curvature there tells
    /// where both are.
    fn crest_on_even_ground(&self, place: &Place, left: &Point3, right: &Point3) -> Option<f64> {
        let Place { spot: Spot { face, u, v, .. }, normal, centre, .. } = place;
        let radius_mm = self.ball.radius_mm();
        let apart = right - left;
        let across = (apart - normal * apart.dot(normal)).try_normalize(0.0)?;
        let kappa = self.ball.surface(*face).jet(*u, *v).normal_curvature(&across, normal)?;
        let bend = 1.0 - kappa * radius_mm;
        let half_mm = 0.5 * apart.norm();
        if bend <= 0.0 || half_mm >= radius_mm {
            return None;
        }
        // Of the surface of ball centres.
        let rise_mm = |t: f64| 0.5 * kappa / bend * t * t;
        let [l, r] = [left, right].map(|ball| {
            let away = ball - centre;
            [away.dot(&across), away.dot(normal)]
        });
        let is_even = |[t, z]: [f64; 2]| (z - rise_mm(t)).abs() <= EVEN * self.scallop_mm;
        let rise_over_chord_mm = rise_mm(0.5 * (l[0] + r[0])) - 0.5 * (l[1] + r[1]);
        let sagitta_mm = radius_mm - (radius_mm * radius_mm - half_mm * half_mm).sqrt();
        (is_even(l) && is_even(r)).then_some(sagitta_mm - rise_over_chord_mm)
    }
}
