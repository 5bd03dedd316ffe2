//! From faces to regions: what was found, also as files hold it.

use claymill_nurbs::Vector3;
use claymill_surface_merge::{Merge, MergeOptions};
use claymill_toolpath::RegionsFile;

use crate::error::Error;
use crate::merging::Merging;
use crate::model_file::ModelFile;
use crate::{material, record};

/// The regions of a model.
#[derive(Debug, Clone)]
pub struct Merged {
    /// Joints and regions, in full.
    pub found: Merge,
    /// The same as `regions.json` holds it. Its qualities and sheets are measured on request.
    pub record: RegionsFile,
    /// What it was made by.
    pub options: MergeOptions,
}

/// Joins the faces of a model into regions.
///
/// # Errors
/// An option that makes no sense, a wish that names nothing of this model, a face that cannot be evaluated.
pub fn merge(file: &ModelFile, merging: &Merging) -> Result<Merged, Error> {
    let options = merging.options_for(file.model())?;
    let found = claymill_surface_merge::merge(file.model(), &options)?;
    let record = record::regions(&found, options.preset);
    Ok(Merged { found, record, options })
}

impl Merged {
    /// Measures every region for the ball of the options; one that cannot be triangulated has no quality.
    pub fn measure_quality(&mut self, file: &ModelFile) {
        record::add_quality(&mut self.record, file.model(), &self.found, self.options.ball_radius_mm);
    }

    /// Finds the sheets, largest first, and their material sides; `wishes` say otherwise, as
    /// [`Job::material_side`](crate::Job::material_side) does.
    ///
    /// # Errors
    /// A wish names no side, or nothing of this model.
    pub fn find_sides(&mut self, file: &ModelFile, up: Vector3, wishes: &[String]) -> Result<(), Error> {
        self.record.sheets = material::find(&file.import, &self.found, up, wishes)?;
        Ok(())
    }
}
