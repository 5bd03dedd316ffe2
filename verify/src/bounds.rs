//! How far the tool goes beyond its boxes and borders, and how near it comes to avoided faces,
//! along all moves but rapids. Samples are halved where something could hide between them.

use claymill_nurbs::{FaceId, Foot, Hint, Point3};
use claymill_toolpath::{Cancelled, Contain, MoveKind};
use rayon::prelude::*;

use crate::asked::avoided_faces;
use crate::limits::Limits;
use crate::obstacles::{SAG_MARGIN, UNSEEN_MM};
use crate::report::{BoundsKept, Place};
use crate::scene::{Scene, Stage};
use crate::track::Track;

/// Boxes and distances from faces are kept within this, mm.
const KEPT_MM: f64 = 0.02;
/// The ball touches what is this near to it, mm.
const TOUCHES_MM: f64 = 0.02;
/// Places by a box's side are looked at this close to each other, mm.
const BY_SIDES_MM: f64 = 0.125;

/// The ball at one place of a track.
#[derive(Debug, Clone, Copy)]
struct Probe {
    t: f64,
    centre: Point3,
    /// How far it goes beyond the boxes, negative inside, mm; `None` where nothing is held.
    boxes_mm: Option<f64>,
    /// Distance from the faces to be avoided; far ones are not measured.
    gap_mm: f64,
}

/// What was found along one track.
#[derive(Default)]
struct Along {
    samples: u64,
    beyond: Option<(f64, Place)>,
    is_beyond: bool,
    nearest: Option<(f64, Place)>,
    is_too_near: bool,
}

/// Measures on all moves but rapids how far the tool goes beyond its bounds and how near it comes to faces to be avoided:
/// samples at equal spacing and at knots. By the sides of boxes and close to avoided faces the way between two of them
/// is halved.
pub(crate) fn measure(
    scene: &Scene<'_>,
    limits: Option<&Limits<'_>>,
    stage: &Stage<'_>,
) -> Result<Option<BoundsKept>, Cancelled> {
    let Some(limits) = limits else { return Ok(None) };
    let moving = |t: &&Track| t.sweeps() && limits.hold_anything();
    let tracks: Vec<&Track> = scene.tracks.iter().filter(moving).collect();
    let avoided: Vec<FaceId> = avoided_faces(scene.model, scene.job).collect();
    let along = |track: &&Track| {
        let (below, beside) = (Hint::default(), Hint::default());
        Walk { scene, limits, track, avoided: &avoided, below, beside, along: Along::default() }.run()
    };
    let part = |track| stage.part(tracks.len(), || along(track));
    let found: Vec<Along> = tracks.par_iter().map(part).collect::<Result<_, _>>()?;
    let count = |is: fn(&Along) -> bool| found.iter().filter(|a| is(a)).count() as u64;
    let mut kept = BoundsKept {
        samples: found.iter().map(|a| a.samples).sum(),
        beyond: count(|a| a.is_beyond),
        too_near: count(|a| a.is_too_near),
        avoid_mm: (!avoided.is_empty()).then_some(scene.job.request.bounds.avoid_mm),
        ..BoundsKept::default()
    };
    for along in found {
        if let Some((mm, at)) = along.beyond.filter(|(mm, _)| *mm > kept.beyond_max_mm) {
            (kept.beyond_max_mm, kept.beyond_at) = (mm, Some(at));
        }
        if let Some((mm, at)) =
            along.nearest.filter(|(mm, _)| kept.avoided_min_mm.is_none_or(|least| *mm < least))
        {
            (kept.avoided_min_mm, kept.avoided_min_at) = (Some(mm), Some(at));
        }
    }
    Ok(Some(kept))
}

struct Walk<'a> {
    scene: &'a Scene<'a>,
    limits: &'a Limits<'a>,
    track: &'a Track,
    /// Faces of the avoided model, as the whole model counts them.
    avoided: &'a [FaceId],
    below: Hint,
    beside: Hint,
    along: Along,
}

impl Walk<'_> {
    fn run(mut self) -> Along {
        let stations = self.track.stations(self.scene.options.path_spacing_mm);
        let probes: Vec<Probe> = stations.iter().map(|&t| self.probe(t)).collect();
        for (i, probe) in probes.iter().enumerate() {
            // Where a move begins, all that is below the ball is looked at.
            self.border(probe, i == 0);
        }
        for pair in probes.windows(2) {
            self.between(&pair[0], &pair[1]);
        }
        self.along
    }

    fn probe(&mut self, t: f64) -> Probe {
        self.along.samples += 1;
        let (centre, radius_mm, setup) = (self.track.centre(t).0, self.track.radius_mm, self.track.setup);
        let foot = self.contact(&centre);
        let contact = foot.map(|f| f.point);
        let boxes_mm = self.limits.beyond_boxes_mm(setup, &centre, contact.as_ref(), radius_mm);
        if let Some(mm) = boxes_mm {
            let held = self.scene.job.request.bounds.contain;
            let touched = foot.filter(|_| held == Contain::Contact);
            self.goes_beyond(mm, KEPT_MM, t, touched.map_or((centre, None), |f| (f.point, Some(f.face))));
        }
        Probe { t, centre, boxes_mm, gap_mm: self.gap_mm(t, &centre) }
    }

    fn border(&mut self, probe: &Probe, whole: bool) {
        let (radius_mm, setup) = (self.track.radius_mm, self.track.setup);
        let mm = self.limits.beyond_border_mm(setup, &probe.centre, radius_mm, whole);
        self.goes_beyond(mm, 0.0, probe.t, (probe.centre, None));
    }

    fn goes_beyond(&mut self, mm: f64, bar_mm: f64, t: f64, (point, face): (Point3, Option<FaceId>)) {
        self.along.is_beyond |= mm > bar_mm;
        if mm > self.along.beyond.as_ref().map_or(0.0, |b| b.0) {
            self.along.beyond = Some((mm, self.on_path(t, self.scene.place(point, face))));
        }
    }

    /// Where the ball touches, on passes and on ways that stay down.
    fn contact(&mut self, centre: &Point3) -> Option<Foot> {
        let stays_down = matches!(self.track.kind, MoveKind::Cut | MoveKind::Link);
        if !stays_down || !self.limits.heeds_contact() {
            return None;
        }
        self.scene.closest.closest_from(centre, self.track.radius_mm + TOUCHES_MM, &mut self.below)
    }

    fn gap_mm(&mut self, t: f64, centre: &Point3) -> f64 {
        let asked_mm = self.scene.job.request.bounds.avoid_mm;
        let radius_mm = self.track.radius_mm;
        let margin_mm = asked_mm + self.scene.options.path_spacing_mm;
        if self.avoided.is_empty() {
            return f64::INFINITY;
        }
        let Some(foot) = self.scene.avoided.closest_from(centre, radius_mm + margin_mm, &mut self.beside)
        else {
            return margin_mm;
        };
        let gap_mm = foot.distance_mm - radius_mm;
        self.along.is_too_near |= gap_mm < asked_mm - KEPT_MM;
        if self.along.nearest.as_ref().is_none_or(|n| gap_mm < n.0) {
            let place = self.scene.place(foot.point, self.avoided.get(foot.face).copied());
            self.along.nearest = Some((gap_mm, self.on_path(t, place)));
        }
        gap_mm
    }

    fn on_path(&self, t: f64, place: Place) -> Place {
        Place { move_seq: Some(self.track.seq), parameter: Some(t), ..place }
    }

    /// Halves the way between two probes until nothing can hide there.
    fn between(&mut self, a: &Probe, b: &Probe) {
        let step = (b.centre - a.centre).norm();
        let sag = SAG_MARGIN * step * step / (8.0 * self.track.radius_mm);
        let asked_mm = self.scene.job.request.bounds.avoid_mm;
        let is_near = sag > UNSEEN_MM && a.gap_mm.min(b.gap_mm) - asked_mm <= sag;
        let is_by_side = |p: &Probe| p.boxes_mm.is_some_and(|mm| mm.abs() <= step);
        if is_near || (step > BY_SIDES_MM && (is_by_side(a) || is_by_side(b))) {
            let middle = self.probe(0.5 * (a.t + b.t));
            self.between(a, &middle);
            self.between(&middle, b);
        }
    }
}
