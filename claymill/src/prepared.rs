//! A job with what the model makes of it: regions, material sides, what is cut, obstacles.

use std::path::PathBuf;

use claymill_exchange::{ObstacleMesh, read_mesh};
use claymill_paths::{Axis, Frame, Orientation, OrientationGuess, PlanOptions};
use claymill_toolpath::{Bounds, Contain, sha256_of};

use crate::error::Error;
use crate::job::{AUTO_SETUPS, Job};
use crate::job_error::JobError;
use crate::material::free_sides;
use crate::merged::{Merged, merge};
use crate::merging::Merging;
use crate::model_file::ModelFile;
use crate::reach::{ReachAsked, find_reach};
use crate::select;

/// A job with what the model makes of it: all that is known before it is planned.
#[derive(Debug)]
pub struct Prepared<'m> {
    pub(crate) job: Job,
    pub(crate) file: &'m ModelFile,
    pub(crate) model_sha256: String,
    pub(crate) merged: Merged,
    pub(crate) options: PlanOptions,
    pub(crate) obstacles: Vec<ObstacleFile>,
    orientation: OrientationGuess,
    pub(crate) excluded: Vec<bool>,
}

/// An obstacle as it was read.
#[derive(Debug, Clone)]
pub struct ObstacleFile {
    /// Where it was read.
    pub path: PathBuf,
    /// Its triangles, mm. Nothing guards its inside where it has open edges.
    pub mesh: ObstacleMesh,
    /// SHA-256 of the file, hexadecimal.
    pub sha256: String,
}

/// The axes of a model: as given, and otherwise as guessed from it.
///
/// # Errors
/// The axes that are given are parallel.
pub fn orientation(
    file: &ModelFile,
    up: Option<Axis>,
    front: Option<Axis>,
) -> Result<OrientationGuess, Error> {
    Ok(Orientation::guess(file.model(), &file.face_area_mm2, up, front)?)
}

/// The setups that were asked for; none if all five usual ones may be used. `auto` stands for the fewest that reach what
/// those of a head over the upper half reach, besides the others.
fn chosen_setups(
    job: &Job,
    (file, merged): (&ModelFile, &Merged),
    orientation: Orientation,
) -> Result<Vec<Frame>, Error> {
    let frame =
        |text: &String| -> Result<Frame, Error> { Ok(orientation.setup(text).map_err(JobError::Setup)?) };
    let (auto, named): (Vec<&String>, Vec<&String>) =
        job.setups.iter().partition(|text| *text == AUTO_SETUPS);
    let mut frames = named.into_iter().map(frame).collect::<Result<Vec<Frame>, Error>>()?;
    if !auto.is_empty() {
        let forced = frames.iter().map(|f| f.axis().into()).collect();
        let holder = job.holder_in_the_way().cloned();
        let asked = ReachAsked { holder, forced, ..ReachAsked::of(*job.tool()) };
        let found = find_reach(file, merged, orientation, &asked, &())?;
        let texts = found.setups(orientation).into_iter().skip(frames.len());
        let more = texts.map(|text| frame(&text)).collect::<Result<Vec<Frame>, Error>>()?;
        if job.passes.bounds.contain != Contain::Contact && more.iter().any(Frame::is_tilted) {
            return Err(JobError::TiltedContainment.into());
        }
        frames.extend(more);
    }
    Ok(frames)
}

fn read_obstacles(job: &Job) -> Result<Vec<ObstacleFile>, Error> {
    let read = |path: &PathBuf| {
        let mesh = read_mesh(path, job.obstacle_unit_mm)?;
        Ok(ObstacleFile { path: path.clone(), mesh, sha256: sha256_of(path)? })
    };
    job.obstacles.iter().map(read).collect()
}

impl Job {
    /// Merges the faces of a model and finds what is to be cut: all that comes before planning.
    ///
    /// # Errors
    /// The job cannot be meant, names what the model has not, or a file cannot be read.
    pub fn prepare<'m>(&self, file: &'m ModelFile) -> Result<Prepared<'m>, Error> {
        self.check()?;
        Prepared::new(self, file)
    }
}

impl<'m> Prepared<'m> {
    fn new(job: &Job, file: &'m ModelFile) -> Result<Self, Error> {
        let model_sha256 = sha256_of(&file.path)?;
        let orientation = orientation(file, job.up, job.front)?;
        let mut merging: Merging = job.merging.clone();
        merging.options.ball_radius_mm = job.tool().radius_mm();
        merging.options.feed_mm_per_min = job.passes.feeds.cut_mm_per_min;
        let mut merged = merge(file, &merging)?;
        merged.measure_quality(file);
        merged.find_sides(file, orientation.orientation.up.vector(), &job.material_side)?;
        let obstacles = read_obstacles(job)?;
        Prepared::on_regions(job, file, model_sha256, orientation, merged, obstacles)
    }

    /// Another job on the same regions: joints and regions are those that were found for this one.
    ///
    /// # Errors
    /// As [`Job::prepare`].
    pub fn again(&self, job: &Job) -> Result<Self, Error> {
        job.check()?;
        let (file, orientation) = (self.file, self.orientation.clone());
        let mut merged = self.merged.clone();
        if job.material_side != self.job.material_side {
            merged.find_sides(file, orientation.orientation.up.vector(), &job.material_side)?;
        }
        let obstacles_of = |job: &Job| (job.obstacles.clone(), job.obstacle_unit_mm);
        let obstacles = match obstacles_of(job) == obstacles_of(&self.job) {
            true => self.obstacles.clone(),
            false => read_obstacles(job)?,
        };
        Prepared::on_regions(job, file, self.model_sha256.clone(), orientation, merged, obstacles)
    }

    fn on_regions(
        job: &Job,
        file: &'m ModelFile,
        model_sha256: String,
        orientation: OrientationGuess,
        merged: Merged,
        obstacles: Vec<ObstacleFile>,
    ) -> Result<Self, Error> {
        let model = file.model();
        let region_of_face = &merged.found.region_of_face;
        let (excluded, avoid) = select::left_out(model, region_of_face, &job.only, &job.skip, &job.avoid)?;
        let bounds = &job.passes.bounds;
        let options = PlanOptions {
            free_sides: free_sides(&merged.record.sheets, model.faces.len()),
            bounds: Bounds {
                avoid,
                avoid_mm: if job.avoid.is_empty() { 0.0 } else { bounds.avoid_mm },
                ..bounds.clone()
            },
            orientation: orientation.orientation,
            setups: chosen_setups(job, (file, &merged), orientation.orientation)?,
            holder: job.holder_in_the_way().cloned(),
            holder_clearance_mm: job.holder_clearance_mm,
            ..job.passes.clone()
        };
        let job = job.clone();
        Ok(Prepared { job, file, model_sha256, merged, options, obstacles, orientation, excluded })
    }

    /// The model's axes, and what they follow from.
    #[must_use]
    pub fn orientation(&self) -> &OrientationGuess {
        &self.orientation
    }

    /// The regions and, in their record, the sheets with their material sides.
    #[must_use]
    pub fn merged(&self) -> &Merged {
        &self.merged
    }

    /// Whether each face is left out on request.
    #[must_use]
    pub fn excluded(&self) -> &[bool] {
        &self.excluded
    }

    /// What must not be touched.
    #[must_use]
    pub fn obstacles(&self) -> &[ObstacleFile] {
        &self.obstacles
    }

    /// How passes will be laid on this model.
    #[must_use]
    pub fn options(&self) -> &PlanOptions {
        &self.options
    }
}
