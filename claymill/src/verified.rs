//! A job that was measured from its written moves, with the verdict, and its folder.

use std::path::{Path, PathBuf};

use claymill_nurbs::Model;
use claymill_paths::{Orientation, times_s};
use claymill_toolpath::{
    FolderWriter, JOB_FILE, Job as JobRecord, Judged, Monitor, Move, Program, REGIONS_FILE, RegionsFile,
    Setup, StageTiming, VERIFY_FILE, read_moves,
};
use claymill_verify::{CrestSample, Verification, VerifyOptions, stick_outs_needed_mm, write_crests};
use rayon::prelude::*;

use crate::error::Error;
use crate::job_record::job_record;
use crate::kept_verdict::verify_or_know;
use crate::model_file::ModelFile;
use crate::planned::Planned;
use crate::prepared::Prepared;

/// A job that was measured from its written moves, whatever the verdict. Its folder is whole, and in place, after
/// [`Verified::write`]; dropping it before leaves nothing.
#[derive(Debug)]
pub struct Verified<'m> {
    folder: FolderWriter,
    file: &'m ModelFile,
    orientation: Orientation,
    region_of_face: Vec<usize>,
    stick_outs: Vec<StickOut>,
    crests: Vec<CrestSample>,
    seconds: Vec<f64>,
    results: Results,
}

/// What is of interest after a job.
#[derive(Debug, Clone)]
pub struct Results {
    /// `job.json`.
    pub job: JobRecord,
    /// All moves, as they were read back.
    pub program: Program,
    /// `regions.json`.
    pub regions: RegionsFile,
    /// `verify.json`.
    pub verification: Verification,
}

/// How far a tool sticks out of its holder in a setup, where that was left to the paths.
#[derive(Debug, Clone, PartialEq)]
pub struct StickOut {
    /// Name of the setup.
    pub setup: String,
    /// The least that does, mm.
    pub needed_mm: f64,
    /// What is taken, mm.
    pub taken_mm: f64,
}

/// A job with all that its pictures and its report are made of.
#[derive(Debug, Clone, Copy)]
pub struct Finished<'a> {
    /// The faces.
    pub model: &'a Model,
    /// `job.json`.
    pub job: &'a JobRecord,
    /// `regions.json`.
    pub regions: &'a RegionsFile,
    /// Region of each face.
    pub region_of_face: &'a [usize],
    /// All moves.
    pub program: &'a Program,
    /// Time of each, s.
    pub seconds: &'a [f64],
    /// `verify.json`.
    pub found: &'a Verification,
    /// The measured crests.
    pub crests: &'a [CrestSample],
    /// How the model lies in its file.
    pub orientation: Orientation,
}

impl<'m> Planned<'m> {
    /// Writes the moves beside `out`, reads them back, and measures what was read against the model. The folder `out` itself
    /// is there after [`Verified::write`].
    ///
    /// # Errors
    /// The folder cannot be written, or would replace what claymill did not write. A job that fails its verification is no
    /// error: see [`Verified::passed`].
    pub fn verify(self, out: impl AsRef<Path>, monitor: &dyn Monitor) -> Result<Verified<'m>, Error> {
        self.verify_into(FolderWriter::begin(out.as_ref())?, monitor)
    }

    /// As [`Planned::verify`], into a folder that was begun before, so that no plan is made for a place that cannot be written.
    ///
    /// # Errors
    /// As [`Planned::verify`].
    pub fn verify_into(self, folder: FolderWriter, monitor: &dyn Monitor) -> Result<Verified<'m>, Error> {
        Verified::new(self, folder, monitor)
    }
}

impl<'m> Verified<'m> {
    fn new(planned: Planned<'m>, folder: FolderWriter, monitor: &dyn Monitor) -> Result<Self, Error> {
        let job = job_record(&planned, folder.destination());
        folder.moves(&planned.plan.program)?;
        let Planned { prepared, plan } = planned;
        let seconds = plan.seconds;
        drop(plan.program);
        Verified::of_record(prepared, job, seconds, folder, monitor)
    }

    /// Of a folder whose moves are written.
    pub(crate) fn of_record(
        prepared: Prepared<'m>,
        mut job: JobRecord,
        seconds: Vec<f64>,
        folder: FolderWriter,
        monitor: &dyn Monitor,
    ) -> Result<Self, Error> {
        let file = prepared.file;
        let program = read_moves(folder.path())?;
        let stick_outs = match prepared.job.least_stick_out {
            true => choose_stick_outs(file.model(), &mut job, &program, monitor)?,
            false => Vec::new(),
        };
        let judged = Judged::of(folder.path(), &job)?;
        let measured = (file.model(), &job, &program);
        let (mut verification, crests) = verify_or_know(&prepared.options.kept, &judged, measured, monitor)?;
        verification.judged = Some(judged.clone());
        let mut regions = prepared.merged.record;
        for needed in verification.holder.iter().flat_map(|h| &h.regions) {
            let record = regions.regions.iter_mut().find(|r| r.id == needed.region);
            let record = record.map(|r| &mut r.stick_out_needed_mm);
            record.map(|r| r.insert(needed.setup.clone(), needed.stick_out_needed_mm));
        }
        folder.json(REGIONS_FILE, &regions)?;
        folder.json(VERIFY_FILE, &verification)?;
        write_crests(folder.path(), &judged, &crests)?;
        Ok(Verified {
            folder,
            file,
            orientation: prepared.options.orientation,
            region_of_face: prepared.merged.found.region_of_face,
            stick_outs,
            crests,
            seconds,
            results: Results { job, program, regions, verification },
        })
    }

    /// Whether every bar was met.
    #[must_use]
    pub fn passed(&self) -> bool {
        self.results.passed()
    }

    /// Job, moves, regions and verdict.
    #[must_use]
    pub fn results(&self) -> &Results {
        &self.results
    }

    /// How far the tool sticks out in each setup, where that was left to the paths.
    #[must_use]
    pub fn stick_outs(&self) -> &[StickOut] {
        &self.stick_outs
    }

    /// What pictures and a report are made of.
    #[must_use]
    pub fn finished(&self) -> Finished<'_> {
        Finished {
            model: self.file.model(),
            job: &self.results.job,
            regions: &self.results.regions,
            region_of_face: &self.region_of_face,
            program: &self.results.program,
            seconds: &self.seconds,
            found: &self.results.verification,
            crests: &self.crests,
            orientation: self.orientation,
        }
    }

    /// Where the files are until the folder is whole: pictures and a report may join them.
    #[must_use]
    pub fn path(&self) -> &Path {
        self.folder.path()
    }

    /// Records how long the stages took, and how much memory.
    pub fn measured(&mut self, timings: Vec<StageTiming>, peak_memory_mb: f64) {
        (self.results.job.timings, self.results.job.peak_memory_mb) = (timings, peak_memory_mb);
    }

    /// Moves the folder into place, verdict included, also where that is that the job did not pass. The folder that is returned
    /// with the results keeps what somebody else put into the place meanwhile.
    ///
    /// # Errors
    /// Writing fails.
    pub fn write(self) -> Result<(Results, Option<PathBuf>), Error> {
        self.folder.json(JOB_FILE, &self.results.job)?;
        let kept = self.folder.finish()?;
        Ok((self.results, kept))
    }
}

impl Results {
    /// Whether every bar was met.
    #[must_use]
    pub fn passed(&self) -> bool {
        self.verification.verdict.passed
    }
}

/// Seconds of every move: every setup begins and ends at rest.
#[must_use]
pub fn seconds_of_moves(job: &JobRecord, program: &Program) -> Vec<f64> {
    let setups: Vec<&[Move]> = program.moves.chunk_by(|a, b| a.setup == b.setup).collect();
    setups.par_iter().flat_map_iter(|moves| times_s(moves, &job.request.machine)).collect()
}

/// Lets the tool stick out in each setup as far as it has to there, in whole millimetres.
fn choose_stick_outs(
    model: &Model,
    job: &mut JobRecord,
    program: &Program,
    monitor: &dyn Monitor,
) -> Result<Vec<StickOut>, Error> {
    let needed = stick_outs_needed_mm(model, job, program, &VerifyOptions::default(), monitor)?;
    let mut chosen = Vec::new();
    for tool in &mut job.tools {
        let of_setup =
            |setup: &Setup| Some((setup.name.clone(), *needed.get(&(tool.id.clone(), setup.name.clone()))?));
        let mine: Vec<(String, f64)> = job.setups.iter().filter_map(of_setup).collect();
        let Some(holder) = &mut tool.holder else { continue };
        let stick_out = |(setup, needed_mm): &(String, f64)| StickOut {
            setup: setup.clone(),
            needed_mm: *needed_mm,
            taken_mm: needed_mm.ceil(),
        };
        chosen.extend(mine.iter().map(stick_out));
        tool.setup_stick_out_mm = mine.into_iter().map(|(setup, mm)| (setup, mm.ceil())).collect();
        // Whoever does not look at setups has one that does in all of them.
        if let Some(most_mm) = tool.setup_stick_out_mm.values().copied().reduce(f64::max) {
            holder.stick_out_mm = most_mm;
        }
    }
    Ok(chosen)
}
