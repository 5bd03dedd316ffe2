//! What a command is asked to look at: a model, or a job and the model that it cuts.

use std::path::{Path, PathBuf};

use claymill::{Merging, ModelFile};
use claymill_toolpath::{Job, RegionsFile, read_job, read_regions};
use claymill_verify::model_of;
use claymill_viewer::Axes;

use super::{Context, orientation, pictures, region_of_face};
use crate::args::AxisArgs;
use crate::failure::Failure;

/// The job of a folder; none of a model file.
pub(crate) fn job_in(what: &Path) -> Result<Option<Job>, Failure> {
    if what.is_dir() { Ok(Some(read_job(what)?)) } else { Ok(None) }
}

/// A model that was read, and the axes by which it is looked at.
pub(crate) struct Subject {
    pub(crate) title: String,
    pub(crate) loaded: ModelFile,
    pub(crate) axes: Axes,
}

impl Subject {
    /// Of the file `what`, or of what its `job` cuts; `model` says where that is now. Axes not told are the job's.
    pub(crate) fn read(
        context: &Context,
        what: &Path,
        job: Option<&Job>,
        model: Option<&Path>,
        axes: &AxisArgs,
    ) -> Result<Self, Failure> {
        // Nothing is said of a job on another model than its own.
        let path: PathBuf = match job {
            Some(job) => model_of(what, job, model)?,
            None => model.unwrap_or(what).to_owned(),
        };
        let loaded = context.load(&path, job.and_then(|job| job.model.mirror))?;
        let of_job = |told: &Option<String>, asked: fn(&Job) -> &String| {
            told.clone().or_else(|| job.map(|job| asked(job).clone()))
        };
        let axes = AxisArgs {
            up: of_job(&axes.up, |job| &job.request.up),
            length: of_job(&axes.length, |job| &job.request.length),
        };
        let axes = pictures::axes(orientation(context.console, &axes, &loaded)?);
        let title = path.file_name().map_or_else(String::new, |n| n.to_string_lossy().into_owned());
        Ok(Subject { title, loaded, axes })
    }

    /// The regions of the job in the folder `what`, or merged anew, and the region of each face.
    pub(crate) fn regions(
        &self,
        what: &Path,
        job: Option<&Job>,
    ) -> Result<(RegionsFile, Vec<usize>), Failure> {
        let model = &self.loaded.import.model;
        if job.is_some() {
            let regions = read_regions(what)?;
            let of_face = region_of_face(&regions, model.faces.len())?;
            return Ok((regions, of_face));
        }
        let mut merged = claymill::merge(&self.loaded, &Merging::default())?;
        merged.find_sides(&self.loaded, self.axes.up, &[])?;
        Ok((merged.record, merged.found.region_of_face))
    }
}
