//! What all measurements look at: the model, its closest points, the moves and the free sides of faces.

use std::sync::atomic::{AtomicUsize, Ordering};

use claymill_nurbs::{Aabb, ClosestPoints, FaceId, Foot, Model, Point3, Vector3};
use claymill_toolpath::{CHECK_CLEARANCE_MM, Cancelled, FreeSide, Holder, Job, Monitor};
use tracing::info_span;

use crate::obstacles::ObstacleSet;
use crate::options::VerifyOptions;
use crate::report::Place;
use crate::track::Track;

/// A nearest point on the rim of a face still counts as contact on the face when the ball stands over it
/// along the face's normal: this cosine (2°). So rows along a smooth joint of two faces count, and a ball that
/// hangs over an edge does not.
const SQUARE_COSINE: f64 = 0.9994;

/// A ball is in the material where the face around the place that is nearest to it says so too, this far away, mm.
const ALL_AROUND_MM: f64 = 0.2;

/// What is no nearer than a box that is kept clear by more than this, mm, does not carry the ball there.
const BOX_MARGIN_MM: f64 = 0.01;

/// Everything that the measurements look at.
pub(crate) struct Scene<'a> {
    pub(crate) model: &'a Model,
    pub(crate) job: &'a Job,
    pub(crate) options: VerifyOptions,
    pub(crate) closest: ClosestPoints<'a>,
    pub(crate) tracks: Vec<Track>,
    pub(crate) obstacles: ObstacleSet,
    /// Of the faces to be avoided alone, by their number among these.
    pub(crate) avoided: ClosestPoints<'a>,
    /// Around the faces that the planner left out since it could not triangulate them.
    pub(crate) kept_clear: Vec<Aabb>,
    /// The side of each face that is free of material, as the job says.
    pub(crate) free_sides: Vec<FreeSide>,
}

/// The free side of each face of a model, as a job says.
pub(crate) fn free_sides(model: &Model, job: &Job) -> Vec<FreeSide> {
    let mut sides = vec![FreeSide::Both; model.faces.len()];
    for account in &job.faces {
        if let Some(side) = sides.get_mut(account.face) {
            *side = account.free_side;
        }
    }
    sides
}

impl Scene<'_> {
    /// Scallop height that was asked for, mm.
    pub(crate) fn scallop_mm(&self) -> f64 {
        self.job.request.scallop_mm
    }

    /// The step-over of a ball on a plane, mm.
    pub(crate) fn step_over_mm(&self, radius_mm: f64) -> f64 {
        let h = self.scallop_mm().min(radius_mm);
        2.0 * (2.0 * radius_mm * h - h * h).sqrt()
    }

    /// The tool axis of the setup that a track is of.
    pub(crate) fn axis_of(&self, track: &Track) -> Vector3 {
        Vector3::from(self.job.setups[track.setup].axis).normalize()
    }

    /// What holds a tool in a setup: what is asked about, or else what the job says.
    pub(crate) fn holder(&self, tool: usize, setup: usize) -> Option<Holder> {
        let record = &self.job.tools[tool];
        let of_job = || match self.job.setups.get(setup) {
            Some(setup) => record.in_setup(&setup.name).holder,
            None => record.holder.clone(),
        };
        self.options.holder.clone().or_else(of_job)
    }

    /// Distance that holders have to keep, mm.
    pub(crate) fn holder_clearance_mm(&self) -> f64 {
        self.options.holder_clearance_of_mm(&self.job.request)
    }

    /// Distance that the ball has to keep from obstacles, mm: as asked about, as the job was planned, or as usual where it was not
    /// planned around any.
    pub(crate) fn check_clearance_mm(&self) -> f64 {
        let request = &self.job.request;
        let of_job = if request.check.is_empty() { CHECK_CLEARANCE_MM } else { request.check_clearance_mm };
        self.options.check_clearance_mm.unwrap_or(of_job)
    }

    /// Whether a box that is kept clear is as near to `from` as its nearest point: a ball there may rest on the box.
    pub(crate) fn is_over_a_box(&self, foot: &Foot, from: &Point3) -> bool {
        let nearest_squared = (foot.distance_mm + BOX_MARGIN_MM).powi(2);
        self.kept_clear.iter().any(|b| b.distance_squared(from) <= nearest_squared)
    }

    /// Whether `from` stands over its nearest point along the face's normal, and over no box that is nearer.
    pub(crate) fn faces_squarely(&self, foot: &Foot, from: &Point3) -> bool {
        if self.is_over_a_box(foot, from) {
            return false;
        }
        if !foot.on_boundary {
            return true;
        }
        let arm = from - foot.point;
        let normal = self.model.faces[foot.face].surface.normal(foot.u, foot.v);
        normal.is_some_and(|(n, _)| n.dot(&arm).abs() >= SQUARE_COSINE * arm.norm())
    }

    /// A ball with its centre here is in the material where what is nearest is the inside of a face, whose material is on that
    /// side: nothing lies between.
    pub(crate) fn is_in_material(&self, foot: &Foot, centre: &Point3) -> bool {
        let free = self.free_sides[foot.face];
        if foot.on_boundary || free.is_both() {
            return false;
        }
        let surface = &self.model.faces[foot.face].surface;
        let is_of_material = |u: f64, v: f64| {
            let away = centre - surface.point(u, v);
            surface.normal(u, v).is_some_and(|(n, _)| !free.allows(n.dot(&away) > 0.0))
        };
        if !is_of_material(foot.u, foot.v) {
            return false;
        }
        // Files let faces curl over at their borders, by less than this: it has to be so all around.
        let (jet, ((u0, u1), (v0, v1))) = (surface.jet(foot.u, foot.v), surface.domain());
        let step = |slope: Vector3| ALL_AROUND_MM / slope.norm().max(f64::MIN_POSITIVE);
        let (du, dv) = (step(jet.su), step(jet.sv));
        let around = [(du, 0.0), (-du, 0.0), (0.0, dv), (0.0, -dv)].map(|(a, b)| (foot.u + a, foot.v + b));
        let is_inside = |&(u, v): &(f64, f64)| (u0..=u1).contains(&u) && (v0..=v1).contains(&v);
        around.iter().all(|at| is_inside(at) && is_of_material(at.0, at.1))
    }

    /// A place on the model.
    pub(crate) fn place(&self, point: Point3, face: Option<FaceId>) -> Place {
        Place {
            point_mm: point.into(),
            move_seq: None,
            parameter: None,
            face,
            entity: face.map(|f| self.model.faces[f].source.entity.clone()),
        }
    }
}

/// One stage of the work, for its progress.
pub(crate) struct Stage<'a> {
    stage: claymill_toolpath::Stage,
    monitor: &'a dyn Monitor,
    done: AtomicUsize,
}

impl<'a> Stage<'a> {
    /// Announces the stage.
    pub(crate) fn begin(stage: claymill_toolpath::Stage, monitor: &'a dyn Monitor) -> Self {
        monitor.at(stage, 0.0);
        Stage { stage, monitor, done: AtomicUsize::new(0) }
    }

    /// Does one of `total` parts, unless the work is to end.
    pub(crate) fn part<T>(&self, total: usize, work: impl FnOnce() -> T) -> Result<T, Cancelled> {
        self.monitor.go_on()?;
        let result = info_span!("verify", stage = %self.stage).in_scope(work);
        self.advance(1, total);
        Ok(result)
    }

    /// Passes over so many of `total` parts that are known, unless the work is to end.
    pub(crate) fn pass(&self, parts: usize, total: usize) -> Result<(), Cancelled> {
        self.monitor.go_on()?;
        self.advance(parts, total);
        Ok(())
    }

    fn advance(&self, parts: usize, total: usize) {
        let before = self.done.fetch_add(parts, Ordering::Relaxed);
        let done = before + parts;
        // About a hundred calls a stage are enough for any display.
        let step = total.div_ceil(100).max(1);
        if before / step != done / step || done == total {
            self.monitor.at(self.stage, done as f64 / total as f64);
        }
    }
}
