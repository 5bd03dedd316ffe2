//! What is looked for when a body is carried along moves: how far a holder must be raised, its
//! smallest distance, or a place where the shank enters the model.

use claymill_nurbs::{FaceId, Point3};
use claymill_toolpath::Tool;

use super::body::{Frustum, depth_in_sides};
use super::gap::Gap;
use super::patch::Patch;
use super::sweep::{Aim, Meeting};
use crate::drop::DropMesh;
use crate::report::Place;
use crate::scene::Scene;

/// Where something was found: a point of the model in the setup's frame and a parameter of the move.
#[derive(Debug, Clone, Copy)]
pub(super) struct Spot {
    pub(super) point: Point3,
    pub(super) tip: Point3,
    pub(super) parameter: f64,
    pub(super) face: Option<FaceId>,
}

impl Spot {
    fn of(meeting: &Meeting<'_>, gap: &Gap) -> Self {
        let w = &gap.weights;
        let corners = &meeting.patch.corners;
        let point = (0..3).map(|j| corners[j].coords * (w[j] + w[j + 3])).sum::<claymill_nurbs::Vector3>();
        let share = w[3] + w[4] + w[5];
        let [(t0, from), (t1, to)] = meeting.ends;
        Spot {
            point: point.into(),
            tip: from + (to - from) * share,
            parameter: t0 + (t1 - t0) * share,
            face: meeting.patch.face(),
        }
    }

    pub(super) fn place(&self, scene: &Scene<'_>, view: &DropMesh<'_>, seq: u64) -> Place {
        Place {
            move_seq: Some(seq),
            parameter: Some(self.parameter),
            ..scene.place(view.in_model(&self.point), self.face)
        }
    }
}

/// Heights and distances that differ by less are not told apart, mm.
pub(super) const SAME_MM: f64 = 0.01;
/// What surfaces may be from triangles where holders are concerned, and shanks, mm.
const FINE_MM: f64 = 5e-3;
const FINE_FOR_SHANKS_MM: f64 = 1e-3;
/// A point of a triangle is no further than this from the face, mm, or it reaches beyond the rim.
const NEAR_MM: f64 = 0.5;
/// Shares of the way to a corner that are no longer tried in looking for the deepest place.
const CLIMBED: f64 = 1e-5;
/// Ways that are tried, at most: each is a share of the one before, or leads higher.
const MOST_CLIMBS: usize = 1000;

/// The least that a body has to be raised for.
pub(super) struct Raise {
    pub(super) clearance_mm: f64,
    /// The most that was asked for so far; nothing asks for [`SAME_MM`] more.
    pub(super) raised_mm: f64,
    pub(super) spot: Option<Spot>,
}

impl Aim for Raise {
    fn fine_mm(&self) -> f64 {
        FINE_MM
    }

    fn clearance_mm(&self) -> f64 {
        self.clearance_mm
    }

    fn raised_mm(&self) -> f64 {
        self.raised_mm + SAME_MM
    }

    fn settled(&self) -> bool {
        false
    }

    fn try_point(&mut self, body: &[Frustum], height: f64, from_axis: f64, spot: &Spot) {
        for f in body {
            let raise = f.raise(height, from_axis, self.clearance_mm);
            if raise > self.raised_mm + SAME_MM {
                (self.raised_mm, self.spot) = (raise, Some(*spot));
            }
        }
    }

    fn meet(&mut self, meeting: &Meeting<'_>) {
        for body in meeting.body {
            let wanted = self.clearance_mm + meeting.margin_mm;
            if let Some((raised_mm, gap)) = meeting.prism.raise(body, wanted, self.raised_mm + SAME_MM) {
                self.raised_mm = raised_mm;
                self.spot = Some(Spot::of(meeting, &gap));
            }
        }
    }
}

/// The smallest distance from a body at its place.
pub(super) struct Nearest {
    pub(super) raised_mm: f64,
    /// Only what is nearer than this is of interest, mm: than the nearest so far by [`SAME_MM`].
    pub(super) within_mm: f64,
    /// The nearest so far, mm.
    pub(super) distance_mm: f64,
    pub(super) spot: Option<Spot>,
}

impl Nearest {
    fn take(&mut self, distance_mm: f64, spot: Spot) {
        if distance_mm < self.distance_mm {
            (self.distance_mm, self.spot) = (distance_mm.max(0.0), Some(spot));
            self.within_mm = self.within_mm.min(distance_mm - SAME_MM);
        }
    }
}

impl Aim for Nearest {
    fn fine_mm(&self) -> f64 {
        FINE_MM
    }

    fn clearance_mm(&self) -> f64 {
        self.within_mm
    }

    fn raised_mm(&self) -> f64 {
        self.raised_mm
    }

    fn settled(&self) -> bool {
        self.within_mm <= 0.0
    }

    fn try_point(&mut self, body: &[Frustum], height: f64, from_axis: f64, spot: &Spot) {
        for f in body {
            let distance_mm = f.distance(height - self.raised_mm, from_axis);
            if distance_mm < self.within_mm {
                self.take(distance_mm, *spot);
            }
        }
    }

    fn meet(&mut self, meeting: &Meeting<'_>) {
        for body in meeting.body {
            let enough = self.within_mm + meeting.margin_mm;
            let gap = meeting.prism.gap(body, self.raised_mm, enough);
            if gap.at_least < enough {
                self.take(gap.at_least - meeting.margin_mm, Spot::of(meeting, &gap));
            }
        }
    }
}

/// A place where the shank surely enters the model.
pub(super) struct Entry<'a> {
    pub(super) scene: &'a Scene<'a>,
    pub(super) view: &'a DropMesh<'a>,
    pub(super) tool: &'a Tool,
    pub(super) found: Option<(f64, Spot)>,
}

impl Aim for Entry<'_> {
    fn fine_mm(&self) -> f64 {
        FINE_FOR_SHANKS_MM
    }

    fn try_point(&mut self, _: &[Frustum], _: f64, _: f64, _: &Spot) {}

    fn clearance_mm(&self) -> f64 {
        0.0
    }

    fn raised_mm(&self) -> f64 {
        0.0
    }

    fn settled(&self) -> bool {
        self.found.is_some()
    }

    fn meet(&mut self, meeting: &Meeting<'_>) {
        for body in meeting.body {
            let gap = meeting.prism.gap(body, 0.0, meeting.margin_mm);
            if gap.at_least < meeting.margin_mm && self.found.is_none() {
                let spot = Spot::of(meeting, &gap);
                self.found = self.depth(&self.deepest(meeting.patch, spot));
            }
        }
    }
}

impl Entry<'_> {
    /// The place of a patch that lies deepest in flutes and shank, found by going ever shorter ways towards its corners: the
    /// depth is a concave function.
    fn deepest(&self, patch: &Patch, spot: Spot) -> Spot {
        if self.tool.is_straight() {
            return spot;
        }
        let mut best = (self.depth_at(&spot, &spot.point), spot.point);
        let mut share = 0.5;
        for _ in 0..MOST_CLIMBS {
            if share <= CLIMBED {
                break;
            }
            let ways = patch.corners.map(|corner| best.1 + (corner - best.1) * share);
            let higher = ways.map(|p| (self.depth_at(&spot, &p), p)).into_iter().find(|way| way.0 > best.0);
            match higher {
                Some(way) => best = way,
                None => share *= 0.5,
            }
        }
        Spot { point: best.1, ..spot }
    }

    /// How deep the surface itself enters: triangles at a rim may reach beyond the face that they stand for.
    fn depth(&self, spot: &Spot) -> Option<(f64, Spot)> {
        let (depth, point) = if self.tool.is_straight() {
            (self.depth_in_cylinder(spot)?, spot.point)
        } else {
            let point = match spot.face {
                Some(_) => {
                    let near = self.scene.closest.closest(&self.view.in_model(&spot.point), NEAR_MM)?;
                    self.view.in_frame(&near.point)
                }
                None => spot.point,
            };
            (self.depth_at(spot, &point), point)
        };
        (depth > self.scene.options.gouge_limit_mm).then_some((depth, Spot { point, ..*spot }))
    }

    fn depth_at(&self, spot: &Spot, point: &Point3) -> f64 {
        let arm = point - spot.tip;
        depth_in_sides(self.tool, arm.z, arm.x.hypot(arm.y))
    }

    /// The same for a shank as thick as the ball.
    fn depth_in_cylinder(&self, spot: &Spot) -> Option<f64> {
        let (bar, radius_mm) = (self.scene.options.gouge_limit_mm, self.tool.radius_mm());
        let on_axis = Point3::new(spot.tip.x, spot.tip.y, spot.point.z);
        let distance_mm = if spot.face.is_some() {
            let foot = self.scene.closest.closest(&self.view.in_model(&on_axis), radius_mm)?;
            let above = self.view.in_frame(&foot.point).z - (spot.tip.z + radius_mm);
            if above < -bar {
                return None;
            }
            foot.distance_mm
        } else {
            (spot.point - on_axis).norm()
        };
        Some(radius_mm - distance_mm)
    }
}
