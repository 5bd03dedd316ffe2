//! Whether a job may go to a machine: only one whose very moves passed verification, or that was asked for all the same.

use std::path::{Path, PathBuf};

use claymill_controller::{Dialect, Machine, MachineJob, PostTotals};
use claymill_toolpath::{Job as JobRecord, Program, Standing, read_judged};

use crate::error::Error;

/// A job folder that was read, and what its verdict is worth.
#[derive(Debug)]
pub struct JobFolder {
    path: PathBuf,
    job: JobRecord,
    program: Program,
    standing: Standing,
}

/// A job that may be run.
#[derive(Debug)]
pub struct Cleared {
    job: JobRecord,
    program: Program,
    note: Option<String>,
}

impl JobFolder {
    /// Reads a job folder, whether it passed or not.
    ///
    /// # Errors
    /// It cannot be read.
    pub fn open(path: impl AsRef<Path>) -> Result<Self, Error> {
        let path = path.as_ref();
        let (job, program, standing) = read_judged(path)?;
        Ok(JobFolder { path: path.to_owned(), job, program, standing })
    }

    /// Whether the very files that lie there passed verification.
    #[must_use]
    pub fn standing(&self) -> &Standing {
        &self.standing
    }

    /// The job, if these very moves passed verification.
    ///
    /// # Errors
    /// They did not.
    pub fn cleared(self) -> Result<Cleared, Error> {
        match self.standing {
            Standing::Passed => Ok(Cleared { job: self.job, program: self.program, note: None }),
            standing => Err(Error::NotCleared { folder: self.path, standing }),
        }
    }

    /// The job, whether it passed or not: its programs say so.
    #[must_use]
    pub fn cleared_on_request(self) -> Cleared {
        let note = (self.standing != Standing::Passed).then(|| {
            format!("UNVERIFIED JOB, {}: written on request, --unverified", self.standing.in_short())
        });
        Cleared { job: self.job, program: self.program, note }
    }
}

impl Cleared {
    /// `job.json`.
    #[must_use]
    pub fn job(&self) -> &JobRecord {
        &self.job
    }

    /// The moves whose bytes were compared with what was verified.
    #[must_use]
    pub fn program(&self) -> &Program {
        &self.program
    }

    /// What every program of the job has to say where it is not verified.
    #[must_use]
    pub fn note(&self) -> Option<&str> {
        self.note.as_deref()
    }

    /// The moves in a machine's coordinates, with what its programs have to say.
    ///
    /// # Errors
    /// The machine cannot do the job.
    pub fn on(&self, machine: &Machine) -> Result<MachineJob, Error> {
        let mut job = MachineJob::new(self.job.clone(), &self.program, machine)?;
        job.notes.extend(self.note.clone());
        Ok(job)
    }

    /// Writes the job as a program for a control, reads it back, and puts it in place when it is the job.
    ///
    /// # Errors
    /// The machine cannot do the job, a file cannot be written, or what was written is not the job.
    pub fn post(
        &self,
        dialect: Dialect,
        machine: &Machine,
        out: impl AsRef<Path>,
    ) -> Result<PostTotals, Error> {
        let job = self.on(machine)?;
        Ok(claymill_controller::post(&job, dialect, machine, out.as_ref(), &|_| ())?)
    }
}
