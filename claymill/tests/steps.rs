//! What must be true of the steps: nothing unverified gets out, mistakes are named, and what is dropped leaves nothing.

use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};

use claymill::toolpath::{JOB_FILE, TOOLPATHS_FILE};
use claymill::{Error, Job, JobError, JobFolder, ModelFile, Monitor, Stage, Standing};

/// A small model in a folder of its own.
fn ribbon() -> (tempfile::TempDir, ModelFile) {
    let place = tempfile::tempdir().unwrap();
    let path = place.path().join("ribbon.stp");
    claymill_models::ribbon(4, 1, &[]).unwrap().write(&path).unwrap();
    let file = claymill::read(&path).unwrap();
    (place, file)
}

fn job() -> Job {
    Job::new("ball:10".parse().unwrap(), 1.0).axes("+z".parse().unwrap(), "+x".parse().unwrap())
}

#[test]
fn only_the_very_moves_that_passed_are_cleared() {
    let (place, file) = ribbon();
    let out = place.path().join("job");
    let verified = job().plan(&file, &()).unwrap().verify(&out, &()).unwrap();
    assert!(verified.passed());
    // Until it is written there is nothing to open.
    assert!(JobFolder::open(&out).is_err());
    let (results, kept) = verified.write().unwrap();
    assert_eq!((results.passed(), kept), (true, None));
    assert_eq!(JobFolder::open(&out).unwrap().cleared().unwrap().note(), None);

    let moves = out.join(TOOLPATHS_FILE);
    let text = std::fs::read_to_string(&moves).unwrap();
    std::fs::write(&moves, text.lines().skip(1).map(|line| format!("{line}\n")).collect::<String>()).unwrap();
    let changed = || JobFolder::open(&out).unwrap();
    let refusal = changed().cleared().unwrap_err();
    assert!(matches!(&refusal, Error::NotCleared { standing: Standing::Stale { .. }, .. }), "{refusal}");
    assert!(!refusal.advice().is_empty());
    assert!(changed().cleared_on_request().note().unwrap().contains("UNVERIFIED"));
}

#[test]
fn a_job_that_is_dropped_leaves_nothing() {
    let (place, file) = ribbon();
    let out = place.path().join("deep/job");
    let before: Vec<PathBuf> = files(&place);
    drop(job().plan(&file, &()).unwrap().verify(&out, &()).unwrap());
    assert_eq!(files(&place), before);
    assert!(!out.join(JOB_FILE).exists());
}

fn files(place: &tempfile::TempDir) -> Vec<PathBuf> {
    let mut all: Vec<PathBuf> =
        std::fs::read_dir(place).unwrap().map(|entry| entry.unwrap().path()).collect();
    all.sort();
    all
}

/// Ends the work at a stage.
struct EndsAt {
    stage: Stage,
    is_reached: AtomicBool,
}

impl Monitor for EndsAt {
    fn at(&self, stage: Stage, _: f64) {
        self.is_reached.fetch_or(stage == self.stage, Ordering::Relaxed);
    }

    fn is_cancelled(&self) -> bool {
        self.is_reached.load(Ordering::Relaxed)
    }
}

#[test]
fn a_step_that_is_cancelled_has_no_result_and_leaves_nothing() {
    let ends_at = |stage| EndsAt { stage, is_reached: AtomicBool::new(false) };
    let (place, file) = ribbon();
    let before = files(&place);
    for stage in [Stage::Setups, Stage::RegionMeshes] {
        assert!(matches!(job().plan(&file, &ends_at(stage)), Err(Error::Cancelled(_))), "{stage}");
    }
    let stages = [
        Stage::PreparingModel,
        Stage::GougeAndContact,
        Stage::Rapids,
        Stage::Shank,
        Stage::ScallopCrests,
        Stage::Coverage,
    ];
    for stage in stages {
        let planned = job().plan(&file, &()).unwrap();
        let verified = planned.verify(place.path().join("job"), &ends_at(stage));
        assert!(matches!(verified, Err(Error::Cancelled(_))), "{stage}");
        assert_eq!(files(&place), before, "{stage}");
    }
}

#[test]
fn what_cannot_be_meant_is_refused_before_anything_is_done() {
    let refused = |change: fn(&mut Job)| {
        let mut job = job();
        change(&mut job);
        match job.check() {
            Err(Error::Job(error)) => error,
            other => panic!("{other:?}"),
        }
    };
    let feed = |job: &mut Job| job.passes.feeds.cut_mm_per_min = f64::NAN;
    assert!(matches!(refused(feed), JobError::Feed { .. }));
    assert_eq!(refused(|job| job.passes.lines = Some(3)), JobError::LinesOfOthers);
    let empty = refused(|job| job.passes.bounds.within_mm = vec![[0.0, 5.0, 0.0, 9.0, 5.0, 9.0]]);
    assert_eq!(empty.to_string(), "box 1 is empty: its y runs from 5 to 5 mm");
    assert_eq!(refused(|job| job.tool_number = Some(0)), JobError::ToolNumber);
    let clearance = refused(|job| job.holder_clearance_mm = -1.0);
    assert!(matches!(clearance, JobError::HolderClearance { .. }) && !clearance.advice().is_empty());
    assert!(matches!(
        job().only(["layer:nowhere"]).plan(&ribbon().1, &()),
        Err(Error::Select(claymill::SelectError::Absent { .. }))
    ));
}
