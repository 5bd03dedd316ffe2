//! Jobs of a comparison that were planned before, and are not planned again.

use std::path::Path;

use claymill_paths::Orientation;
use claymill_toolpath::{
    Job, LONGEST_MADE, Standing, VERIFY_FILE, is_whole, read_job, read_judged, read_plain, read_regions,
    sha256_of,
};
use claymill_verify::Verification;

use super::job_file::{self, JOB_TOML};
use super::plan::Done;
use super::request::Request;
use super::{Context, guess, pictures, region_of_face, verify};
use crate::console::Console;
use crate::failure::Failure;

/// What jobs are held against: found once for all of them, and only where some job lies there.
pub(super) struct Before<'a> {
    context: &'a Context<'a>,
    model_sha256: Option<String>,
    orientation: Option<Orientation>,
}

impl<'a> Before<'a> {
    pub(super) fn new(context: &'a Context<'a>) -> Self {
        Before { context, model_sha256: None, orientation: None }
    }

    /// What `request` would make, where it lies in `folder` as this version wrote it from the same model; what cannot be read is
    /// planned again.
    pub(super) fn made(&mut self, request: &Request, folder: &Path) -> Result<Option<Done>, Failure> {
        let Ok(job) = read_job(folder) else { return Ok(None) };
        if job.claymill_version != env!("CARGO_PKG_VERSION") || !is_whole(folder) {
            return Ok(None);
        }
        if job.model.sha256 != self.model_sha256(request)? || !asks_for(request, &job) {
            return Ok(None);
        }
        let asked = job_file::text(request, self.orientation(request)?)?;
        let planned = std::fs::read_to_string(folder.join(JOB_TOML)).unwrap_or_default();
        Ok(if asked == planned { read(folder) } else { None })
    }

    fn model_sha256(&mut self, request: &Request) -> Result<String, Failure> {
        if let Some(known) = &self.model_sha256 {
            return Ok(known.clone());
        }
        let sha256 = sha256_of(&request.model)?;
        self.model_sha256 = Some(sha256.clone());
        Ok(sha256)
    }

    /// The axes as told, or as they are guessed from the model.
    fn orientation(&mut self, request: &Request) -> Result<Orientation, Failure> {
        if let Some(known) = self.orientation {
            return Ok(known);
        }
        let orientation = match (request.job.up, request.job.front) {
            (Some(up), Some(front)) => Orientation { up, front },
            _ => {
                // What is to be said of the model is said by the jobs.
                let console = Console::new(true);
                let context = Context { console: &console, json: false, force: self.context.force };
                guess(&request.options.axes, &context.load(&request.model, request.options.mirror)?)?
                    .orientation
            }
        };
        self.orientation = Some(orientation);
        Ok(orientation)
    }
}

/// Whether a job was made with what the files that a request names hold now: its options name these files only.
fn asks_for(request: &Request, job: &Job) -> bool {
    let (passes, made) = (&request.job.passes, &job.request);
    let asked = &passes.feeds;
    let machine = passes.machine == made.machine
        && asked.cut_mm_per_min == made.feed_mm_per_min
        && Some(asked.lead_mm_per_min) == made.lead_mm_per_min
        && asked.rapid_mm_per_min == made.rapid_mm_per_min;
    let obstacles = request.options.check.len() == made.check.len()
        && request
            .options
            .check
            .iter()
            .zip(&made.check)
            .all(|(path, obstacle)| sha256_of(path).is_ok_and(|sha256| sha256 == obstacle.sha256));
    machine && obstacles
}

/// A finished job with all that is told of it.
fn read(folder: &Path) -> Option<Done> {
    let (job, program, standing) = read_judged(folder).ok()?;
    if !matches!(standing, Standing::Passed | Standing::NotPassed { .. }) {
        return None;
    }
    let text = read_plain(&folder.join(VERIFY_FILE), LONGEST_MADE).ok()?;
    let found: Verification = serde_json::from_slice(&text).ok()?;
    Some(Done {
        region_of_face: region_of_face(&read_regions(folder).ok()?, job.model.faces()).ok()?,
        exit: verify::exit_code(&found),
        scallop_map: pictures::kept_scallop_map(&job, folder),
        job,
        program,
        found,
    })
}
