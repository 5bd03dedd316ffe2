//! A plan, which nobody has verified yet: it can be looked at and verified, not written or run.

use std::collections::BTreeSet;

use claymill_nurbs::Point3;
use claymill_paths::{LeftOut, OrientationGuess, Plan, PlanPart, Regions, plan_around};
use claymill_toolpath::{LeftOutFace, Monitor, PartKey, RegionsFile};

use crate::error::Error;
use crate::job::Job;
use crate::job_error::JobError;
use crate::model_file::ModelFile;
use crate::prepared::Prepared;

/// A plan that is not verified yet. There is no way from it to a file but through [`Planned::verify`].
#[derive(Debug)]
pub struct Planned<'m> {
    pub(crate) prepared: Prepared<'m>,
    pub(crate) plan: Plan,
}

impl Job {
    /// Plans the job on a model.
    ///
    /// # Errors
    /// As [`Job::prepare`] and [`Prepared::plan`].
    pub fn plan<'m>(&self, file: &'m ModelFile, monitor: &dyn Monitor) -> Result<Planned<'m>, Error> {
        self.prepare(file)?.plan(monitor)
    }
}

impl<'m> Prepared<'m> {
    /// Plans the passes of all setups.
    ///
    /// # Errors
    /// The tool does not fit the model, or there is nothing to cut.
    pub fn plan(self, monitor: &dyn Monitor) -> Result<Planned<'m>, Error> {
        let (regions, triangles) = self.given()?;
        let plan = plan_around(self.file.model(), &regions, &triangles, &self.options, monitor)?;
        Ok(Planned::new(self, plan))
    }

    /// The parts that [`Prepared::plan`] joins, largest first; those that are `wanted` are laid and kept, where the store of the
    /// job's passes has not got them.
    ///
    /// # Errors
    /// As [`Prepared::plan`]; and there is no store.
    pub fn lay_parts(
        &self,
        wanted: &BTreeSet<PartKey>,
        monitor: &dyn Monitor,
    ) -> Result<Vec<PlanPart>, Error> {
        let (regions, triangles) = self.given()?;
        let model = self.file.model();
        Ok(claymill_paths::lay_parts(model, &regions, &triangles, &self.options, wanted, monitor)?)
    }

    /// Regions to plan, and triangles of obstacles.
    fn given(&self) -> Result<(Regions<'_>, Vec<[Point3; 3]>), Error> {
        if self.job.levels.is_some() {
            return Err(JobError::LevelsWithoutStock.into());
        }
        let regions = Regions {
            merged: &self.merged.found,
            of_face: &self.merged.found.region_of_face,
            excluded: &self.excluded,
            face_area_mm2: &self.file.face_area_mm2,
        };
        let triangles = (self.obstacles.iter())
            .flat_map(|o| o.mesh.triangles.iter().map(|t| t.map(|i| o.mesh.vertices[i as usize])))
            .collect();
        Ok((regions, triangles))
    }
}

impl<'m> Planned<'m> {
    pub(crate) fn new(mut prepared: Prepared<'m>, mut plan: Plan) -> Self {
        let records = &mut prepared.merged.record.regions;
        for (record, areas) in records.iter_mut().zip(&plan.region_setup_area_mm2) {
            record.setup_area_mm2.clone_from(areas);
        }
        let tool_id = prepared.job.tool_id();
        plan.program.moves.iter_mut().for_each(|m| m.tool.clone_from(&tool_id));
        Planned { prepared, plan }
    }

    /// Moves, times and totals.
    #[must_use]
    pub fn plan(&self) -> &Plan {
        &self.plan
    }

    /// The model's axes, and what they follow from.
    #[must_use]
    pub fn orientation(&self) -> &OrientationGuess {
        self.prepared.orientation()
    }

    /// The regions, with the area that each setup cuts of them.
    #[must_use]
    pub fn regions(&self) -> &RegionsFile {
        &self.prepared.merged.record
    }

    /// Faces that could not be triangulated: they are not cut, and their boxes are kept clear.
    #[must_use]
    pub fn left_out(&self) -> Vec<LeftOutFace> {
        left_out_faces(self.prepared.file, &self.plan.left_out)
    }
}

/// What is left out as the job records it.
#[must_use]
pub fn left_out_faces(file: &ModelFile, left_out: &[LeftOut]) -> Vec<LeftOutFace> {
    let record = |l: &LeftOut| LeftOutFace {
        face: l.face,
        entity: file.model().faces.get(l.face).map_or_else(String::new, |f| f.source.entity.clone()),
        area_mm2: file.face_area_mm2.get(l.face).copied().unwrap_or(0.0),
        reason: l.reason.to_string(),
        box_mm: l.bounds.corners(),
    };
    left_out.iter().map(record).collect()
}
