//! What setups see of places, kept for some faces together.
//!
//! ```text
//!      axis ↑   ┌╌╌╌╌╌╌╌╌┐        What a setup sees of a face follows from the faces above it and around it: what lies deeper
//!           │   ╎ ╭────╮ ╎        than the tool is high holds no ball up. Faces of one cell of space are one part, so that
//!           │  ─╎─┴face┴─╎─       there are not as many parts as faces.
//!               ╰╌╌╌╌╌╌╌╌╯
//! ```

use std::collections::BTreeMap;

use claymill_nurbs::{Aabb, BoxSet, FaceId, Vector3};
use claymill_toolpath::{KeyMaker, PartKey};
use rayon::prelude::*;

use crate::plan::keys::PlanKeys;
use crate::setup::probe::{Prober, Seen, SeenBefore, Views};
use crate::setup::seen_log::{Recorder, SeenLog};

/// Side of a cell, mm.
const CELL_MM: f64 = 256.0;
/// A ball beside a place, lowered or on its way out of the material, meets nothing farther aside than this, in radii of the tool,
/// and in heights of what may be left.
const ASIDE_RADII: f64 = 5.0;
const ASIDE_HEIGHTS: f64 = 4.0;
/// The room below an underside is looked at this far down, in radii.
const BELOW_RADII: f64 = 14.0;
/// Directions closer than this are one (sine).
const SAME: f64 = 1e-9;

/// Keys of what setups see of faces.
pub(crate) struct ProbeKeys<'a> {
    plan: &'a PlanKeys<'a>,
    /// Of what everything seen follows from.
    asked: PartKey,
    /// By setup, around each face, in its coordinates.
    boxes: &'a [Vec<Aabb>],
    /// So far aside, and so far down, faces have a say, mm.
    aside_mm: f64,
    below_mm: f64,
}

impl<'a> ProbeKeys<'a> {
    /// For a tool with this largest radius, where so much may be left.
    pub(crate) fn new(
        plan: &'a PlanKeys<'a>,
        views: &Views,
        boxes: &'a [Vec<Aabb>],
        up: Vector3,
        [widest_mm, height_mm]: [f64; 2],
    ) -> Self {
        let balls = views.balls.iter().chain(views.earlier);
        let borders: Vec<(bool, bool)> = balls.map(|ball| (ball.has_rims(), ball.has_material())).collect();
        let asked = plan.asked_of_setups("probes", views.frames).debug(&borders).finish();
        // Where no column is upright, the room below a place lies aside of it.
        let is_upright = views.frames.iter().any(|frame| frame.axis().cross(&up).norm() < SAME);
        let below_mm = BELOW_RADII * widest_mm + ASIDE_HEIGHTS * height_mm;
        let aside_mm = ASIDE_RADII * widest_mm + ASIDE_HEIGHTS * height_mm;
        ProbeKeys { plan, asked, boxes, aside_mm: if is_upright { aside_mm } else { below_mm }, below_mm }
    }

    /// Faces cell by cell.
    fn groups(&self) -> Vec<Vec<FaceId>> {
        let mut groups: BTreeMap<[i64; 3], Vec<FaceId>> = BTreeMap::new();
        let of_face = |face: FaceId| self.boxes.first().map_or_else(Aabb::empty, |boxes| boxes[face]);
        for face in 0..self.plan.faces().len() {
            let bounds = of_face(face);
            // A face that no setup has anything of is in the cell at the origin.
            let cell = [0, 1, 2].map(|k| match bounds.is_empty() {
                true => 0,
                false => (0.5 * (bounds.min[k] + bounds.max[k]) / CELL_MM).floor() as i64,
            });
            groups.entry(cell).or_default().push(face);
        }
        groups.into_values().collect()
    }

    fn key(&self, group: &[FaceId]) -> PartKey {
        let faces = self.plan.faces();
        let key = KeyMaker::new("seen").key(&self.asked);
        let mut key = group.iter().fold(key, |key, &face| key.key(&faces[face]));
        for boxes in self.boxes {
            let columns = BoxSet::of(group.iter().map(|&face| self.column(&boxes[face])));
            let met = boxes.iter().zip(faces).filter(|(b, _)| columns.meets(b));
            key = met.fold(key.text("setup"), |key, (_, face)| key.key(face));
        }
        key.finish()
    }

    /// Where faces have a say in what is seen of a face.
    fn column(&self, face: &Aabb) -> Aabb {
        face.inflated(self.aside_mm).upwards_from(face.min.z - self.below_mm)
    }
}

impl SeenBefore for ProbeKeys<'_> {
    fn all<'p>(&self, prober: &(dyn Fn(FaceId) -> Option<Prober<'p>> + Sync)) -> Vec<Vec<Seen>> {
        let setups = self.boxes.len();
        let known = |face: FaceId, log: &SeenLog| {
            let seen = |prober: Prober| prober.triangles(log.replay(setups, |uv| prober.probe(uv)));
            prober(face).map_or_else(Vec::new, seen)
        };
        let asked = |face: FaceId| {
            let mut recorder = Recorder::default();
            let seen = |prober: Prober| {
                prober.triangles(|uv| {
                    let seen = prober.probe(uv);
                    recorder.add(&seen);
                    seen
                })
            };
            (prober(face).map_or_else(Vec::new, seen), recorder.log())
        };
        let of_group = |group: &Vec<FaceId>| -> Vec<(FaceId, Vec<Seen>)> {
            let key = self.key(group);
            let logs = self.plan.kept().known::<Vec<SeenLog>>(&key).filter(|logs| logs.len() == group.len());
            if let Some(logs) = logs {
                return group.iter().zip(&logs).map(|(&face, log)| (face, known(face, log))).collect();
            }
            let (seen, logs): (Vec<Vec<Seen>>, Vec<SeenLog>) = group.par_iter().map(|&f| asked(f)).unzip();
            self.plan.kept().keep(&key, &logs);
            group.iter().copied().zip(seen).collect()
        };
        let groups = self.groups();
        let mut all: Vec<(FaceId, Vec<Seen>)> = groups.par_iter().flat_map(of_group).collect();
        all.sort_unstable_by_key(|(face, _)| *face);
        all.into_iter().map(|(_, seen)| seen).collect()
    }
}
