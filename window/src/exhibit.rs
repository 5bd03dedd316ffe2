//! What a window shows.

use std::sync::Arc;

use claymill_nurbs::{Aabb, FaceMesh, Model, Point3};
use claymill_toolpath::{FreeSide, Job, Program, RegionsFile};
use claymill_verify::Verification;
use claymill_viewer::{Axes, ModelView};

/// A model, and the job that cuts it if there is one.
#[derive(Debug)]
pub struct Exhibit {
    /// Name for the title bar.
    pub title: String,
    /// The model.
    pub model: Model,
    /// One mesh a face; an empty one where the face cannot be meshed.
    pub meshes: Vec<FaceMesh>,
    /// Region of each face, from 0.
    pub region_of_face: Vec<usize>,
    /// Regions and joints.
    pub regions: RegionsFile,
    /// The side of each face that is free of material: the other one is hatched. Empty: both are alike.
    pub free_sides: Vec<FreeSide>,
    /// Which way is up and to the front.
    pub axes: Axes,
    /// The job; none when only a model is looked at.
    pub job: Option<JobToShow>,
}

/// A job and what is known of it.
#[derive(Debug)]
pub struct JobToShow {
    /// What was asked and done.
    pub job: Job,
    /// Its moves.
    pub program: Program,
    /// Predicted time of each move, s.
    pub seconds: Vec<f64>,
    /// What verification measured, where it was written.
    pub verification: Option<Verification>,
    /// Scallop crests as measured: place and height, mm; where that was written.
    pub crests: Option<Arc<Vec<(Point3, f64)>>>,
}

impl Exhibit {
    /// The model as pictures see it; `cut` says which faces are.
    pub(crate) fn view<'a>(&'a self, cut: Option<&'a [bool]>) -> ModelView<'a> {
        ModelView {
            model: &self.model,
            meshes: &self.meshes,
            region_of_face: &self.region_of_face,
            cut,
            joint_tolerance_mm: self.regions.tolerance_mm,
            free_sides: (!self.free_sides.is_empty()).then_some(&self.free_sides[..]),
        }
    }

    /// Points of the faces that are shown, some of many: what has to be framed.
    pub(crate) fn outline(&self, shown: impl Fn(usize) -> bool) -> Vec<Point3> {
        const ENOUGH: usize = 200;
        let faces = self.meshes.iter().enumerate().filter(|(f, _)| shown(*f));
        faces
            .flat_map(|(_, m)| m.points.iter().step_by(m.points.len().div_ceil(ENOUGH).max(1)))
            .copied()
            .collect()
    }

    /// The same of the moves, for jobs without faces.
    pub(crate) fn bounds(&self) -> Aabb {
        let model = self.meshes.iter().fold(Aabb::empty(), |b, m| b.union(&Aabb::of(&m.points)));
        let moves = self.job.iter().flat_map(|j| &j.program.moves);
        moves.flat_map(|m| &m.points).fold(model, |mut b, p| {
            b.add(&Point3::from(*p));
            b
        })
    }

    /// Name of a face for people: what the designer called it, else the entity of the file.
    #[must_use]
    pub fn face_name(&self, face: usize) -> String {
        let source = &self.model.faces[face].source;
        match (&source.name, source.entity.as_str()) {
            (Some(name), "") => name.clone(),
            (Some(name), entity) => format!("{name} ({entity})"),
            (None, "") => format!("face {face}"),
            (None, entity) => entity.to_owned(),
        }
    }
}

/// An exhibit that threads can share.
pub(crate) type Shared = Arc<Exhibit>;
