//! What lies around moves, as keys: the faces and moves that findings along them follow from.

use std::collections::BTreeMap;
use std::path::PathBuf;

use claymill_nurbs::{Aabb, BoxSet, FaceId, Point3, Vector3};
use claymill_toolpath::{KeyMaker, PartKey};
use rayon::prelude::*;

use crate::directions::axis;
use crate::drop::DropMesh;
use crate::mesh::Mesh;
use crate::options::{REACH_STEPS, VerifyOptions};
use crate::parts::{Numbers, Outlook, Outward, Sees};
use crate::scene::Scene;
use crate::track::Track;

/// What is asked of the way of a ball out of the model looks no farther aside than this, in its radii.
const ASIDE_RADII: f64 = 12.0;
/// Room for rounding, mm.
const SPARE_MM: f64 = 1.0;
/// A place does not look along an axis that it faces less than this: somewhat less than what is a wall (`n·axis`).
const LEAST_FACING: f64 = -0.01;
/// So many places, one behind the other, have one box.
const TOGETHER: usize = 8;
/// Axes closer than this are one direction.
const SAME_AXIS: f64 = 1e-9;

/// Faces and moves with their keys and boxes.
pub(super) struct Surroundings<'a> {
    scene: &'a Scene<'a>,
    /// Tool axes and the model as it is seen along them, the job's setups first.
    views: Vec<(Vector3, &'a DropMesh<'a>)>,
    way_out_mm: Option<f64>,
    /// Of what all findings follow from.
    asked: PartKey,
    faces: Vec<PartKey>,
    boxes: Vec<Aabb>,
    /// In the order of the scene.
    moves: Vec<PartKey>,
    centres: Vec<BoxSet>,
    near_mm: f64,
    /// By view, around each face as seen along the axis.
    columns: Vec<Vec<Aabb>>,
}

/// The surroundings of a part.
pub(super) struct Around<'a, 's> {
    all: &'s Surroundings<'a>,
    own: &'s [&'a Track],
    key: PartKey,
    /// The faces that places may be on, in rising order.
    faces: Vec<FaceId>,
}

impl<'a> Surroundings<'a> {
    /// `None` where the tool leans, for what is along its axis is not told by columns; and where moves are not numbered in order.
    pub(super) fn new(scene: &'a Scene<'a>, (views, way_out_mm): Outward<'a>, mesh: &Mesh) -> Option<Self> {
        let is_upright = scene.tracks.iter().all(|track| track.stands_along(&scene.axis_of(track)));
        if !is_upright || !scene.tracks.is_sorted_by(|a, b| a.seq < b.seq) {
            return None;
        }
        let (model, job, options) = (scene.model, scene.job, &scene.options);
        let asked = KeyMaker::new("asked of moves")
            .debug(&VerifyOptions { model: None, folder: PathBuf::new(), ..options.clone() })
            .debug(&(&job.request.tool, &job.request.up, &job.request.material_side))
            .numbers([scene.scallop_mm(), model.tolerance_mm, model.coordinate_step_mm])
            .numbers(
                views.iter().flat_map(|(axis, view)| [axis.x, axis.y, axis.z, view.worst_deviation_mm()]),
            );
        let face = |face: FaceId| {
            KeyMaker::new("face").face(&model.faces[face]).debug(&scene.free_sides[face]).finish()
        };
        let tool = |track: &Track| &job.tools[track.tool].tool;
        let largest_mm = scene.tracks.iter().map(|t| t.radius_mm).fold(0.0, f64::max);
        let (h, step_over_mm) = (scene.scallop_mm(), scene.step_over_mm(largest_mm));
        // The nearest face, a ball of twice the size that touches it, the cusp, and what has been over or beyond that.
        let across_mm = 3.0 * largest_mm + step_over_mm + 6.0 * h + 2.0 * options.path_spacing_mm;
        Some(Surroundings {
            scene,
            way_out_mm,
            asked: asked.finish(),
            faces: (0..model.faces.len()).into_par_iter().map(face).collect(),
            boxes: (0..model.faces.len()).into_par_iter().map(|face| mesh.face_box(face)).collect(),
            moves: scene.tracks.par_iter().map(|track| track.key(tool(track))).collect(),
            centres: scene
                .tracks
                .par_iter()
                .map(|track| near(track.boxes_of_tips(|p| *p), track.radius_mm))
                .collect(),
            columns: views
                .iter()
                .map(|(_, view)| (0..model.faces.len()).map(|face| view.face_box(face)).collect())
                .collect(),
            views,
            near_mm: across_mm.max(REACH_STEPS * step_over_mm) + SPARE_MM,
        })
    }

    /// The key of a move.
    pub(super) fn key_of(&self, track: &Track) -> &PartKey {
        &self.moves[self.index(track)]
    }

    /// The surroundings of moves, one behind the other in the scene.
    pub(super) fn around<'s>(&'s self, name: &str, sees: Sees, own: &'s [&'a Track]) -> Around<'a, 's> {
        let index: Vec<usize> = own.iter().map(|track| self.index(track)).collect();
        let faces = match sees {
            Sees::Faces | Sees::Moves => {
                let near = self.near(&index);
                self.boxes.iter().enumerate().filter(|(_, b)| near.meets(b)).map(|(face, _)| face).collect()
            }
            Sees::Along => {
                let drop = self.views[own[0].setup].1;
                let boxes = own.iter().flat_map(|track| track.boxes_of_tips(|p| drop.in_frame(p)));
                self.column(own[0].setup, boxes, self.widest_mm() + SPARE_MM)
            }
        };
        let key = KeyMaker::new(name).key(&self.asked).count(own[0].setup);
        let key = faces.iter().fold(key.count(faces.len()), |key, &face: &FaceId| key.key(&self.faces[face]));
        let key = index.iter().fold(key.count(own.len()), |key, &i| key.key(&self.moves[i]));
        let key = if sees == Sees::Moves { self.moves_around(key, &index) } else { key };
        Around { all: self, own, key: key.finish(), faces }
    }

    /// Around the ball's centre on moves of these numbers, and as far as anything near has a say.
    fn near(&self, own: &[usize]) -> BoxSet {
        near(own.iter().flat_map(|&i| self.centres[i].each().iter().copied()), self.near_mm)
    }

    /// Goes on with the moves near those of these numbers: which of them are of one pass, and which passes of one region, whatever
    /// the order in which regions are cut.
    fn moves_around(&self, key: KeyMaker, own: &[usize]) -> KeyMaker {
        let near = self.near(own);
        let mut regions: BTreeMap<(usize, usize), BTreeMap<u32, KeyMaker>> = BTreeMap::new();
        for (i, track) in self.scene.tracks.iter().enumerate() {
            if track.sweeps() && near.meets_any(&self.centres[i]) {
                let passes = regions.entry((track.setup, track.region)).or_default();
                let pass = passes.entry(track.pass).or_insert_with(|| KeyMaker::new("pass"));
                *pass = pass.clone().key(&self.moves[i]).count(usize::from(own.contains(&i)));
            }
        }
        let of_region = |passes: BTreeMap<u32, KeyMaker>| {
            let passes = passes.into_values().map(KeyMaker::finish);
            passes.fold(KeyMaker::new("region"), |key, pass| key.key(&pass)).finish()
        };
        let mut regions: Vec<PartKey> = regions.into_values().map(of_region).collect();
        regions.sort_unstable();
        regions.iter().fold(key, |key, region| key.key(region))
    }

    /// Faces above boxes as a view sees them, and this far around.
    fn column(&self, view: usize, boxes: impl Iterator<Item = Aabb>, around_mm: f64) -> Vec<FaceId> {
        let columns = near(boxes.map(|b| b.upwards_from(b.min.z)), around_mm);
        (0..self.faces.len()).filter(|&face| columns.meets(&self.columns[view][face])).collect()
    }

    /// The key of the same moves where faces farther along the axes have a say, as seen from these places: along those that a
    /// place faces, and upwards, for undersides are looked for.
    pub(super) fn far(&self, around: &Around<'_, '_>, from: &[Outlook]) -> PartKey {
        let largest_mm = around.own.iter().map(|t| t.radius_mm).fold(0.0, f64::max);
        let aside_mm = (ASIDE_RADII * largest_mm).max(2.0 * largest_mm + self.widest_mm() + SPARE_MM);
        let up = axis(&self.scene.job.request.up);
        let is_up = |axis: &Vector3| up.is_some_and(|up| (axis - up).norm() < SAME_AXIS);
        let sees_up = up.is_none() || self.views.iter().any(|(axis, _)| is_up(axis));
        let mut key = KeyMaker::new("far").key(&around.key).debug(&self.way_out_mm);
        for (view, (axis, drop)) in self.views.iter().enumerate() {
            let faces_it = |one: &&Outlook| is_up(axis) || one.normal.dot(axis) >= LEAST_FACING;
            let turned: Vec<Point3> =
                from.iter().filter(faces_it).map(|one| drop.in_frame(&one.at)).collect();
            let faces = match sees_up {
                true => self.column(view, turned.chunks(TOGETHER).map(Aabb::of), aside_mm),
                false => (0..self.faces.len()).collect(),
            };
            key = faces.iter().fold(key.count(faces.len()), |key, &face| key.key(&self.faces[face]));
        }
        key.finish()
    }

    fn widest_mm(&self) -> f64 {
        let sides = self.scene.job.tools.iter().flat_map(|record| record.tool.sides());
        sides
            .flatten()
            .map(|[_, radius_mm]| radius_mm)
            .fold(self.scene.job.request.tool.radius_mm(), f64::max)
    }

    /// The number of a track in the scene.
    fn index(&self, track: &Track) -> usize {
        self.scene.tracks.partition_point(|other| other.seq < track.seq)
    }
}

impl Around<'_, '_> {
    pub(super) fn key(&self) -> PartKey {
        self.key
    }

    /// How many moves the part has.
    pub(super) fn moves(&self) -> usize {
        self.own.len()
    }

    pub(super) fn numbers(&self) -> Numbers<'_> {
        Numbers { model: self.all.scene.model, moves: self.own, faces: &self.faces }
    }
}

/// Boxes grown by as much.
fn near(boxes: impl IntoIterator<Item = Aabb>, near_mm: f64) -> BoxSet {
    BoxSet::of(boxes.into_iter().map(|b| b.inflated(near_mm)))
}
