use claymill_nurbs::{FaceId, Point3};

use super::body::Frustum;
use super::gap::Gap;
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
    pub(super) radius_mm: f64,
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
                self.found = self.depth(&spot).map(|depth| (depth, spot));
            }
        }
    }
}

impl Entry<'_> {
    /// How deep the surface itself enters: triangles at a rim may reach beyond the face that they stand for.
    fn depth(&self, spot: &Spot) -> Option<f64> {
        let bar = self.scene.options.gouge_limit_mm;
        let on_axis = Point3::new(spot.tip.x, spot.tip.y, spot.point.z);
        let distance_mm = if spot.face.is_some() {
            let foot = self.scene.closest.closest(&self.view.in_model(&on_axis), self.radius_mm)?;
            let above = self.view.in_frame(&foot.point).z - (spot.tip.z + self.radius_mm);
            if above < -bar {
                return None;
            }
            foot.distance_mm
        } else {
            (spot.point - on_axis).norm()
        };
        let depth = self.radius_mm - distance_mm;
        (depth > bar).then_some(depth)
    }
}
