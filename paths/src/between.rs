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

use claymill_nurbs::Point3;

use crate::contact::{Location, Support};
use crate::levels::{Place, Spot};
use crate::near::{LaidNear, Touch, cut_to_mm};
use crate::part::SetupContext;
use crate::reach::LEAST_FACING;

/// Between passes whose balls are no further apart than this, in flat step-overs, no crest on a bulge is too high.
const FAR_APART: f64 = 1.02;
/// A crest beside the places that are looked at is worth a pass from this share of the scallop height on.
const HIGH_CREST: f64 = 1.1;
/// Another pass cuts a crest when it leaves less than this share of what the two on both sides leave.
const OTHERS: f64 = 0.9;
/// Balls are where the curvature at a place says, when they are no further from there than this share of the scallop height.
const EVEN: f64 = 0.05;

impl SetupContext<'_> {
    /// Whether the crest between the passes to the left and to the right of a place is low enough, too: where the surface
    /// bends sharply beside the place, that is where the two balls meet, and not halfway in level.
    pub(crate) fn is_crest_cut(&self, place: &Place, touch: &Touch, near: &[&LaidNear]) -> bool {
        let beside: Vec<[Option<Point3>; 2]> = near.iter().map(|near| near.beside(touch)).collect();
        let nearest = |side: usize| {
            let balls = beside.iter().filter_map(|balls| balls[side]);
            balls.min_by(|a, b| (a - touch.centre).norm().total_cmp(&(b - touch.centre).norm()))
        };
        let (Some(left), Some(right)) = (&nearest(0), &nearest(1)) else { return true };
        let apart_mm = (right - left).norm();
        if apart_mm <= FAR_APART * self.flat_step_mm() {
            return true;
        }
        let most_mm = HIGH_CREST * self.scallop_mm;
        if self.crest_on_even_ground(place, left, right).is_some_and(|high_mm| high_mm <= most_mm) {
            return true;
        }
        let halfway = nalgebra::center(left, right);
        let Some(Location { centre, normal, face, support: Support::Face { u, v }, .. }) =
            self.ball.drop(halfway.x, halfway.y)
        else {
            return true;
        };
        let point = centre - normal * self.ball.radius_mm();
        let left_mm = [left, right].map(|ball| cut_to_mm(&point, &normal, ball, self.ball.radius_mm()));
        // The two meet between what the one and the other leave there.
        let is_high = 0.5 * (left_mm[0] + left_mm[1]) > most_mm;
        if !is_high || normal.z < LEAST_FACING || !self.claims_at(face, u, v) {
            return true;
        }
        let crest = Touch { point, normal, centre, feed: touch.feed };
        let others_mm = OTHERS * left_mm[0].min(left_mm[1]);
        near.iter().any(|near| near.is_cut(&crest, self.ball.radius_mm(), others_mm))
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
