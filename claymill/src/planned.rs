//! A plan, which nobody has verified yet: it can be looked at and verified, not written or run.

use std::path::Path;

use claymill_paths::{LeftOut, Plan};
use claymill_toolpath::{FolderWriter, LeftOutFace, RegionsFile};

use crate::{Error, ModelFile, Prepared, Progress, Verified};

/// A plan that is not verified yet. There is no way from it to a file but through [`Planned::verify`].
#[derive(Debug)]
pub struct Planned<'m> {
    pub(crate) prepared: Prepared<'m>,
    pub(crate) plan: Plan,
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

    /// Writes the moves beside `out`, reads them back, and measures what was read against the model. The folder `out` itself
    /// is there after [`Verified::write`].
    ///
    /// # Errors
    /// The folder cannot be written, or would replace what claymill did not write. A job that fails its verification is no
    /// error: see [`Verified::passed`].
    pub fn verify(self, out: impl AsRef<Path>, progress: Progress<'_>) -> Result<Verified<'m>, Error> {
        self.verify_into(FolderWriter::begin(out.as_ref())?, progress)
    }

    /// As [`Planned::verify`], into a folder that was begun before, so that no plan is made for a place that cannot be written.
    ///
    /// # Errors
    /// As [`Planned::verify`].
    pub fn verify_into(self, folder: FolderWriter, progress: Progress<'_>) -> Result<Verified<'m>, Error> {
        Verified::new(self, folder, progress)
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
