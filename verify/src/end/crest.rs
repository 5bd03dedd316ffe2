//! Crests between the passes of an end: along the surface from the contact of one pass to that of the next, whatever all passes
//! together leave.
//!
//! ```text
//!    contact  x crest  contact of the neighbour     No two tubes meet in one point here: the
//!     ●───────┴──────●                                residual is looked at all the way between.
//! ```

use claymill_nurbs::{Hint, Point3, Vector3};

use crate::crest::{Along, Standing, crossing, neighbours, own_beside};
use crate::crest_peak::{OF_PASS, Seed, keep_best};
use crate::end::body::EndBody;
use crate::golden::golden_section;
use crate::reach::Reach;
use crate::report::{CrestSample, Place};
use crate::scene::Scene;
use crate::swept::Swept;
use crate::track::Track;

/// Places between two contacts, and how far the best of them is then narrowed down, in steps of the golden section.
const LOOKS: u32 = 9;
const STEPS: u32 = 28;
/// Heights above so many scallop heights are no crests: nobody cut there.
const CAP: f64 = 5.0;
/// A tool that is off a face by more than this does not cut it there, mm.
const TOUCHES_MM: f64 = 0.05;

/// One pass of an end, and all others.
pub(crate) struct EndCrests<'a, 'b> {
    pub(crate) scene: &'b Scene<'a>,
    pub(crate) swept: &'b Swept<'b>,
    pub(crate) reach: &'b Reach<'a>,
    pub(crate) track: &'b Track,
    pub(crate) body: &'b EndBody,
}

/// The highest place between two contacts.
#[derive(Clone, Copy)]
struct Top {
    foot: Point3,
    normal: Vector3,
    height_mm: f64,
    face: usize,
}

impl EndCrests<'_, '_> {
    pub(crate) fn along(&self) -> Along {
        let Self { scene, track, .. } = self;
        let limit = scene.options.scallop_limit * scene.scallop_mm();
        let spare = limit - scene.scallop_mm();
        let mut along = Along::default();
        let mut hint = Hint::default();
        let stations = track.stations(scene.options.crest_spacing_mm);
        // Interval middles: knots and ends of passes have no perpendicular plane of their own.
        for pair in stations.windows(2) {
            let t = 0.5 * (pair[0] + pair[1]);
            let (middle, speed) = track.centre(t);
            let Some(feed) = speed.try_normalize(1e-9) else { continue };
            let axis = track.axis_at(t);
            let Some(contact) = self.contact(track, t) else { continue };
            let up = (axis - feed * axis.dot(&feed)).normalize();
            // No two passes are farther apart than the tool is wide.
            let reach_mm = 2.0 * self.body.radius_mm;
            let sides = neighbours(self.swept, track, &middle, &feed, &up, reach_mm);
            let own = own_beside(self.swept, track, &sides);
            for (side, [nearest, _]) in sides.iter().enumerate() {
                let Some(piece) = nearest else { continue };
                let other = self.swept.track(piece);
                let (_, _, at) = crossing(other, piece.parameters, &middle, &feed);
                let Some(theirs) = self.contact(other, at) else { continue };
                let Some(top) = self.top(&contact, &theirs, &mut hint) else { continue };
                let is_both = scene.free_sides[top.face].is_both();
                if top.height_mm > limit && !self.reach.is_left(&top.foot, &top.normal, spare, is_both) {
                    along.out_of_reach += 1;
                    continue;
                }
                let standing = Standing {
                    crest: CrestSample { foot: top.foot, height_mm: top.height_mm },
                    length_mm: (pair[1] - pair[0]) as f32,
                    inside: own[side] == [true; 2] && own[1 - side][0],
                };
                along.stand(standing, || Place {
                    move_seq: Some(track.seq),
                    parameter: Some(t),
                    ..scene.place(top.foot + top.normal * top.height_mm, Some(top.face))
                });
                along.seeds.push(Seed { at: top.foot, promise_mm: top.height_mm });
            }
        }
        keep_best(&mut along.seeds, OF_PASS);
        along
    }

    /// Where the tool touches, on a track, if it does.
    fn contact(&self, track: &Track, t: f64) -> Option<Point3> {
        let (tip, axis) = (track.tip(t).coords, track.axis_at(t));
        let nearest =
            self.reach.nearest_to_end(track.setup, [&tip, &axis], track.end.as_ref()?, TOUCHES_MM, None)?;
        Some(nearest.point)
    }

    /// The highest place on the surface between two contacts.
    fn top(&self, from: &Point3, to: &Point3, hint: &mut Hint) -> Option<Top> {
        let mut lowest = None;
        let mut look = |share: f64| {
            let near = from + (to - from) * share;
            let foot = self.scene.closest.closest_from(&near, self.body.radius_mm, hint)?;
            if foot.on_boundary {
                return None;
            }
            let (n, _) = self.scene.model.faces[foot.face].surface.normal(foot.u, foot.v)?;
            let (cap_mm, free) = (CAP * self.scene.scallop_mm(), self.scene.free_sides[foot.face]);
            let left = self.swept.residual_after(&mut lowest, &foot.point, &n, cap_mm, free);
            let (height_mm, side) = left.map_or((cap_mm, 1.0), |left| (left.height_mm, left.side));
            Some(Top { foot: foot.point, normal: n * side, height_mm, face: foot.face })
        };
        let shares = (0..=LOOKS).map(|k| f64::from(k) / f64::from(LOOKS));
        let mut found: Vec<(f64, Top)> = shares.filter_map(|share| Some((share, look(share)?))).collect();
        let best = (0..found.len()).max_by(|&a, &b| found[a].1.height_mm.total_cmp(&found[b].1.height_mm))?;
        let (middle, mut top) = found.swap_remove(best);
        let step = 1.0 / f64::from(LOOKS);
        let height = |share: f64| {
            let seen = look(share);
            if let Some(higher) = seen.filter(|seen| seen.height_mm > top.height_mm) {
                top = higher;
            }
            seen.map_or(f64::NEG_INFINITY, |seen| seen.height_mm)
        };
        golden_section([(middle - step).max(0.0), (middle + step).min(1.0)], STEPS, height);
        Some(top)
    }
}
