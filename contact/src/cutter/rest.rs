//! Where a flat or bull-nosed end comes to rest: a contact near the last one, by Newton, and the search, which proves it or
//! finds another.

use claymill_nurbs::Point3;

use super::offset::{Contact, contact_along, contact_at};
use super::search::{Effort, Stand, Touch, held_above, stand};
use super::{CUTTER_EPSILON_MM, EndShape, ToolPart};
use crate::blocked::KeptOff;
use crate::{BallDrop, Blocked, CONTACT_EPSILON_MM, Location, Support};

/// What a search that is not ended early leaves open, and a little for rounding, mm.
const SETTLED_MM: f64 = 1.01 * CONTACT_EPSILON_MM;
/// No pass runs where the ground is steeper than this (`n·axis`): how high an end is held there need not be known.
const STEEP_NZ: f64 = 0.1;
/// The tool and a face that it touches inside have one normal, but for this (cosine, 3 degrees): what the search leaves open turns it.
const ALIGNED: f64 = 0.998_6;
/// Whether something is in the way is known well enough to this, mm; and how deep a tool would enter.
const IN_THE_WAY: Effort = Effort { epsilon: 1e-4, known_to: 0.1, cuts: 400 };
const ENTERED: Effort = Effort { epsilon: 2e-4, known_to: 5e-4, cuts: 1000 };

impl BallDrop<'_> {
    /// Where an end that is no ball rests at a place; `near` is where one does close by. Only what is higher than `low`, a
    /// height of its middle, counts.
    pub(crate) fn rest_of_end(&self, at: [f64; 2], near: Option<&Location>, low: f64) -> Option<Location> {
        let end = self.end();
        let from = near.and_then(|near| match near.support {
            Support::Face { u, v } => self.contact_of_end((near.face, [u, v]), at, &end),
            _ => None,
        });
        let floor = from.map_or(low, |(contact, _)| contact.middle.z.max(low)) - end.corner_mm;
        let held = held_above(self, &self.bodies, at, floor, Effort::OF_PASS).and_then(|held| {
            let is_known = held.gap_mm <= SETTLED_MM || held.normal.z.abs() < STEEP_NZ;
            if is_known { Some(held) } else { held_above(self, &self.bodies, at, floor, Effort::AT_LENGTH) }
        });
        match held {
            Some(held) => Some(self.location(&held, at)),
            None => from.filter(|(contact, _)| contact.middle.z > low).map(|(_, location)| location),
        }
    }

    /// Whether something holds an end that is no ball up with its middle above a height.
    pub(crate) fn is_end_blocked_at(&self, at: [f64; 2], height: f64) -> bool {
        let floor = height - self.end().corner_mm;
        !matches!(stand(self, &self.bodies, at, floor, Effort::AT_LENGTH), Stand::Free)
    }

    /// Whether something keeps an end that is no ball off a place with its middle at a height; `None` where that takes more effort.
    pub(crate) fn is_end_kept_off(&self, at: [f64; 2], height: f64, effort: Effort) -> Option<bool> {
        match stand(self, &self.bodies, at, height - self.end().corner_mm, effort) {
            Stand::Free => Some(false),
            Stand::Held(_) => Some(true),
            Stand::Unknown => None,
        }
    }

    /// Whether something keeps an end that is no ball off a place, and how far along a unit vector.
    pub(crate) fn end_kept_off(&self, from: [f64; 2], along: [f64; 2], height: f64) -> KeptOff {
        let floor = height - self.end().corner_mm;
        let touch = match stand(self, &self.bodies, from, floor, Effort::OF_BORDER) {
            Stand::Free => return KeptOff::No,
            Stand::Unknown => return KeptOff::Perhaps,
            Stand::Held(touch) => touch,
        };
        let on_the_way = |[x, y]: [f64; 2]| {
            let (x, y) = (x - from[0], y - from[1]);
            [x * along[0] + y * along[1], x * along[1] - y * along[0]]
        };
        // A point of the model keeps the axis as far away as the tool is wide where it is.
        let Point3 { coords: first, .. } = touch.contact;
        let [ahead_mm, beside_mm] = on_the_way([first.x, first.y]);
        let wide_mm = self.bodies[touch.body].radius_at(first.z - floor - 0.5 * CONTACT_EPSILON_MM);
        let first_mm = ahead_mm + (wide_mm * wide_mm - beside_mm * beside_mm).max(0.0).sqrt();
        // The first point found is anywhere inside of the tool. The last one that is touched on the way out is on its rim.
        let last_mm = touch.uv.filter(|_| touch.body == 0).and_then(|uv| {
            let of = &self.faces[touch.face];
            let last = contact_along(&of.leaves, uv.into(), (from, along), height, &self.end())?;
            let is_inside = of.domain.as_ref().is_none_or(|d| d.contains(last.u, last.v));
            is_inside.then(|| on_the_way([last.middle.x, last.middle.y])[0])
        });
        KeptOff::Until { along_mm: first_mm.max(last_mm.unwrap_or(0.0)).max(0.0) }
    }

    /// A contact inside of the trims of a face, near a place on it.
    fn contact_of_end(
        &self,
        (face, [u, v]): (usize, [f64; 2]),
        at: [f64; 2],
        end: &EndShape,
    ) -> Option<(Contact, Location)> {
        let of = &self.faces[face];
        let contact = contact_at(&of.leaves, (u, v), at, end)?;
        let Contact { middle, normal, u, v } = contact;
        let inside = of.domain.as_ref().is_none_or(|d| d.contains(u, v));
        inside.then(|| (contact, Location::touching(middle, normal, face, [u, v])))
    }

    /// What the search found, as exact as the surface tells.
    fn location(&self, held: &Touch, at: [f64; 2]) -> Location {
        let end = self.end();
        let middle = Point3::new(at[0], at[1], held.tip + end.corner_mm);
        let location = |support| Location {
            centre: middle,
            normal: held.normal,
            face: held.face,
            support,
            certified: false,
        };
        match held.uv {
            _ if held.part() == ToolPart::Side => location(Support::Side),
            _ if held.gap_mm > SETTLED_MM => location(Support::Bound),
            None if held.is_edge => location(Support::Edge),
            None => location(Support::Bound),
            // All of the disc may lie on the face: then it touches below its middle.
            Some(uv) if self.is_below_disc(held, at) => {
                let below =
                    self.contact_of_end((held.face, uv), at, &EndShape { flat_mm: 0.0, corner_mm: 0.0 });
                let below = below.filter(|(b, _)| b.middle.z >= held.tip - held.gap_mm - CUTTER_EPSILON_MM);
                let [u, v] = below.map_or(uv, |(b, _)| [b.u, b.v]);
                let upright = nalgebra::Vector3::z();
                Location { normal: upright, ..location(Support::Face { u, v }) }
            }
            Some(uv) => {
                let exact = self.contact_of_end((held.face, uv), at, &end).map(|(_, exact)| exact);
                let agrees = |l: &Location| (l.centre.z - middle.z).abs() <= held.gap_mm + CUTTER_EPSILON_MM;
                let ([u, v], body) = (uv, &self.bodies[held.body]);
                exact.filter(agrees).unwrap_or_else(|| {
                    let own = body.normal_at(&held.contact, at);
                    let is_across = body.corner > 0.0 && held.normal.dot(&own) < ALIGNED;
                    // A point of the border, which holds the end as an edge does, whatever way its face is turned.
                    if is_across {
                        Location { normal: own, ..location(Support::Edge) }
                    } else {
                        location(Support::Face { u, v })
                    }
                })
            }
        }
    }

    /// Whether the flat of the end, and not its corner, is what touches.
    fn is_below_disc(&self, held: &Touch, [x, y]: [f64; 2]) -> bool {
        const INSIDE: f64 = 0.999;
        (held.contact.x - x).hypot(held.contact.y - y) < INSIDE * self.end().flat_mm
    }

    /// What holds an end that is no ball up by more than `by_mm` where it would touch the model in `touch`.
    pub(crate) fn end_blocked_from(&self, touch: &Location, by_mm: f64, far_mm: f64) -> Option<Blocked> {
        let tip = touch.centre.z - self.end().corner_mm;
        let held = held_above(self, &self.bodies, [touch.centre.x, touch.centre.y], tip + by_mm, IN_THE_WAY)?;
        let is_far = held.part() == ToolPart::End && held.tip >= tip + far_mm;
        Some(if is_far { Blocked::Far } else { Blocked::Near })
    }

    /// How deep an end that is no ball enters the model with its tip at a place of the setup, mm along the normal where it
    /// does; 0 where it does not by more than a micrometre of height.
    #[must_use]
    pub fn entered_mm(&self, tip: &Point3) -> f64 {
        const MICROMETRE: f64 = 1e-3;
        let held = held_above(self, &self.bodies, [tip.x, tip.y], tip.z + MICROMETRE, ENTERED);
        held.map_or(0.0, |held| (held.tip - tip.z) * held.normal.z.abs())
    }

    /// The point of the model that the tool touches.
    #[must_use]
    pub fn contact(&self, location: &Location) -> Point3 {
        match location.support {
            Support::Face { u, v } if !self.end().is_ball() => self.faces[location.face].leaves.point(u, v),
            _ => location.centre - self.end().to_middle(&location.normal),
        }
    }
}
