//! Gouge and contact of an end along its paths: the distance of the whole tool from the exact faces.

use claymill_nurbs::{Hint, Point3, Vector3};
use claymill_toolpath::MoveKind;

use super::body::EndBody;
use super::faces::Nearest;
use crate::contact::{Along, GOUGE_MM, MARKED};
use crate::reach::Reach;
use crate::report::GougeSample;
use crate::scene::Scene;
use crate::track::Track;

/// Between two places the distance is taken for straight where that is right to this in the middle, mm.
const STRAIGHT_MM: f64 = 3e-4;
/// Nor does it have to be where both gaps are more than this share of the way between two places: the distance changes no faster than
/// the tip moves, so that nothing enters the tool there. A half would do for a straight way.
const FAR: f64 = 0.6;
/// Stretches between two places are halved so often, at most.
const HALVINGS: u32 = 6;
/// A border that the tool touches is part of the face where the tool stands over it along the face's normal (cosine).
const SQUARE: f64 = 0.9994;

/// The end at one place of a track.
#[derive(Clone, Copy)]
struct Place {
    t: f64,
    nearest: Option<Nearest>,
}

/// Looks along one track. Gaps beyond `margin_mm` are not measured.
pub(crate) struct EndWalk<'a> {
    pub(crate) scene: &'a Scene<'a>,
    pub(crate) reach: &'a Reach<'a>,
    pub(crate) track: &'a Track,
    pub(crate) body: EndBody,
    pub(crate) margin_mm: f64,
}

impl EndWalk<'_> {
    pub(crate) fn run(&self) -> Along {
        let stations = self.track.stations(self.scene.options.path_spacing_mm);
        let mut places: Vec<Place> = Vec::with_capacity(2 * stations.len());
        for t in stations {
            let last = places.last().copied();
            let station = self.place(t, last.as_ref());
            if let Some(last) = last {
                self.between(&last, &station, HALVINGS, &mut places);
            }
            places.push(station);
        }
        let mut along = Along::default();
        let mut hint = Hint::default();
        for (i, place) in places.iter().enumerate() {
            let before = if i > 0 { place.t - places[i - 1].t } else { 0.0 };
            let after = places.get(i + 1).map_or(0.0, |next| next.t - place.t);
            self.record(place, 0.5 * (before + after), &mut along);
            self.tell_side(place, 0.5 * (before + after), &mut hint, &mut along);
        }
        along
    }

    /// `last` is the place before it, if there is one.
    fn place(&self, t: f64, last: Option<&Place>) -> Place {
        let (tip, axis) = (self.track.tip(t), self.track.axis_at(t));
        let (at, last) = ([&tip.coords, &axis], last.and_then(|last| last.nearest.as_ref()));
        let found = self.reach.nearest_to_end(self.track.setup, at, &self.body, self.margin_mm, last);
        let nearest = found.map(|nearest| {
            let gap_mm = nearest.gap_mm.min(self.depth_mm(&nearest, &tip, &axis).unwrap_or(0.0));
            if nearest.gap_mm < 0.0 { Nearest { gap_mm, ..nearest } } else { nearest }
        });
        Place { t, nearest }
    }

    /// How deep a corner, which is nearest to the side or to the bottom of the tool, is below the face that it enters: no deeper
    /// than √2 times as far.
    fn depth_mm(&self, nearest: &Nearest, tip: &Point3, axis: &Vector3) -> Option<f64> {
        let face = nearest.face.filter(|_| !nearest.on_border)?;
        let (n, _) = self.scene.model.faces[face].surface.normal(nearest.uv.x, nearest.uv.y)?;
        let n = if n.dot(axis) < 0.0 { -n } else { n };
        let resting = self.body.tip_over(&nearest.point, &n, axis);
        Some((tip - resting).dot(&n).max(std::f64::consts::SQRT_2 * nearest.gap_mm))
    }

    fn gap(&self, place: &Place) -> f64 {
        place.nearest.map_or(self.margin_mm, |nearest| nearest.gap_mm)
    }

    /// Places between two, where the distance is not straight.
    fn between(&self, from: &Place, to: &Place, halvings: u32, found: &mut Vec<Place>) {
        let middle = self.place(0.5 * (from.t + to.t), Some(from));
        let gaps = [from, &middle, to].map(|place| self.gap(place));
        let is_straight = (gaps[1] - 0.5 * (gaps[0] + gaps[2])).abs() <= STRAIGHT_MM;
        let is_far = || {
            let tips = [from, &middle, to].map(|place| self.track.tip(place.t));
            let [first, second] = [(tips[1] - tips[0]).norm(), (tips[2] - tips[1]).norm()];
            let axis = self.track.axis_at(from.t);
            self.track.stands_along(&axis)
                && gaps[0].min(gaps[1]) > FAR * first
                && gaps[1].min(gaps[2]) > FAR * second
        };
        if is_straight || halvings == 0 || is_far() {
            found.push(middle);
            return;
        }
        self.between(from, &middle, halvings - 1, found);
        found.push(middle);
        self.between(&middle, to, halvings - 1, found);
    }

    /// Takes extremes and lengths.
    fn record(&self, place: &Place, length_mm: f64, along: &mut Along) {
        along.samples += 1;
        let cutting = self.track.kind == MoveKind::Cut;
        if cutting {
            along.cut_mm += length_mm;
        }
        let Some(nearest) = place.nearest else {
            along.air_mm += if cutting { length_mm } else { 0.0 };
            return;
        };
        let gap = nearest.gap_mm;
        for (count, limit) in along.deeper.iter_mut().zip([1e-3, 2e-3, 5e-3]) {
            *count += u64::from(gap < -limit);
        }
        if gap < -GOUGE_MM && along.gouges.len() < MARKED {
            let move_seq = self.track.seq;
            along.gouges.push(GougeSample { foot: nearest.point, depth_mm: -gap, move_seq });
        }
        if gap < along.deepest.as_ref().map_or(0.0, |d| d.0) {
            along.deepest = Some((gap, self.report(place, &nearest)));
        }
        if !cutting || nearest.face.is_none() {
            return;
        }
        let rests = self.rests(&nearest);
        let highest = if rests { &mut along.excess } else { &mut along.edge_excess };
        if gap > highest.as_ref().map_or(0.0, |e| e.0) {
            *highest = Some((gap, self.report(place, &nearest)));
        }
        if !rests {
            along.edge_mm += length_mm;
            return;
        }
        along.contact_samples += 1;
        along.contact_mm += length_mm;
        along.gaps.add(gap, length_mm);
        let [below, above] = crate::contact::limits_mm(self.scene);
        if !(-below..=above).contains(&gap) {
            along.outside += 1;
            along.outside_mm += length_mm;
        }
    }

    /// Adds to the length in the material, by the ball that is as wide and as low as the end: it lies within.
    fn tell_side(&self, place: &Place, length_mm: f64, hint: &mut Hint, along: &mut Along) {
        if place.nearest.is_none() || self.scene.free_sides.iter().all(|side| side.is_both()) {
            return;
        }
        let centre = self.track.tip(place.t) + self.track.axis_at(place.t) * self.body.radius_mm;
        let foot = self.scene.closest.closest_from(&centre, self.body.radius_mm + self.margin_mm, hint);
        if let Some(foot) = foot.filter(|foot| self.scene.is_in_material(foot, &centre)) {
            along.material.length_mm += length_mm;
            let at = || self.scene.place(foot.point, Some(foot.face));
            along.material.at.get_or_insert_with(at);
        }
    }

    /// Whether the end rests on the inside of a face, or over its border along the normal there.
    fn rests(&self, nearest: &Nearest) -> bool {
        let normal = || {
            let surface = &self.scene.model.faces[nearest.face?].surface;
            surface.normal(nearest.uv.x, nearest.uv.y).map(|(n, _)| n)
        };
        let square = |n: Vector3| n.dot(&nearest.gradient).abs() >= SQUARE;
        !nearest.on_border || normal().is_some_and(square)
    }

    fn report(&self, place: &Place, nearest: &Nearest) -> crate::report::Place {
        crate::report::Place {
            move_seq: Some(self.track.seq),
            parameter: Some(place.t),
            ..self.scene.place(nearest.point, nearest.face)
        }
    }
}
