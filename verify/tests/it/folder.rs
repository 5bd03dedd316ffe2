//! Job folders that cannot be verified say why and what to do.

use std::path::Path;

use crate::synthetic::{self, R, job, options, program, rectangle, straight};
use claymill_exchange::write_iges;
use claymill_nurbs::{Model, Point3};
use claymill_toolpath::{FolderWriter, Job, Judged, MoveKind, Program, TOOLPATHS_FILE, sha256_of};
use claymill_verify::{
    CRESTS_FILE, CrestSample, VerifyError, VerifyOptions, read_crests, verify, verify_program, write_crests,
};

/// Writes a job on the model file `model` into `folder`.
fn write(folder: &Path, model: &Path, edit: impl FnOnce(&mut Job)) {
    let mut job = job(&Model::default());
    job.model.path = model.to_string_lossy().into_owned();
    job.model.sha256 = sha256_of(model).unwrap();
    edit(&mut job);
    let writer = FolderWriter::begin(folder).unwrap();
    writer.json("job.json", &job).unwrap();
    writer.moves(&Program::default()).unwrap();
    writer.finish().unwrap();
}

fn refused(folder: &Path, options: &VerifyOptions) -> VerifyError {
    let error = verify(folder, options, &()).unwrap_err();
    assert!(error.advice().ends_with('.'), "{}", error.advice());
    error
}

#[test]
fn a_sound_job_passes_from_its_files_alone() {
    let place = tempfile::tempdir().unwrap();
    let (folder, path) = (place.path().join("out"), place.path().join("plate.igs"));
    let model = synthetic::model([rectangle((0.0, 40.0), (0.0, 20.0), 0.0)]);
    write_iges(&path, &model, &[]).unwrap();
    let row = |k: u32| {
        let y = 1.26 * f64::from(k);
        straight(MoveKind::Cut, k, Point3::new(0.0, y, R), Point3::new(40.0, y, R))
    };
    let (mut job, program) = synthetic::whole(&model, (0..17).map(row));
    job.model.path = path.to_string_lossy().into_owned();
    job.model.sha256 = sha256_of(&path).unwrap();
    let writer = FolderWriter::begin(&folder).unwrap();
    writer.json("job.json", &job).unwrap();
    writer.moves(&program).unwrap();
    writer.finish().unwrap();

    let result = verify(&folder, &options(), &()).unwrap();
    assert!(result.verdict.passed, "{:?}", result.verdict);
    assert!(result.verdict.findings.is_empty(), "{:?}", result.verdict);
}

#[test]
fn crests_are_read_back_for_the_very_moves_they_were_measured_on() {
    let place = tempfile::tempdir().unwrap();
    let (folder, model) = (place.path().join("out"), place.path().join("car.igs"));
    std::fs::write(&model, "a model").unwrap();
    write(&folder, &model, |_| ());
    let mut job = claymill_toolpath::read_job(&folder).unwrap();
    assert_eq!(read_crests(&folder, &job), None);
    let crest = |k: u32| CrestSample {
        foot: Point3::new(4000.25, -0.5 * f64::from(k), 10.0),
        height_mm: 0.125 / f64::from(1 << k),
    };
    let crests: Vec<CrestSample> = (0..5).map(crest).collect();
    let judged = Judged::of(&folder, &job).unwrap();
    write_crests(&folder, &judged, &crests).unwrap();
    assert_eq!(read_crests(&folder, &job).as_ref(), Some(&crests));
    write_crests(&folder, &judged, &[]).unwrap();
    assert_eq!(read_crests(&folder, &job), Some(Vec::new()));

    // Another model, other moves, half a file: to be measured again.
    write_crests(&folder, &judged, &crests).unwrap();
    let sha256 = std::mem::replace(&mut job.model.sha256, "of another".into());
    assert_eq!(read_crests(&folder, &job), None);
    job.model.sha256 = sha256;
    let whole = std::fs::read(folder.join(CRESTS_FILE)).unwrap();
    for end in 0..whole.len() {
        std::fs::write(folder.join(CRESTS_FILE), &whole[..end]).unwrap();
        assert_eq!(read_crests(&folder, &job), None, "{end} bytes");
    }
    std::fs::write(folder.join(CRESTS_FILE), whole).unwrap();
    assert!(read_crests(&folder, &job).is_some());
    std::fs::write(folder.join(TOOLPATHS_FILE), "\n").unwrap();
    assert_eq!(read_crests(&folder, &job), None);
}

#[test]
fn a_model_that_changed_is_not_verified() {
    let place = tempfile::tempdir().unwrap();
    let (folder, model) = (place.path().join("out"), place.path().join("car.igs"));
    std::fs::write(&model, "a model").unwrap();
    write(&folder, &model, |_| ());
    std::fs::write(&model, "another model").unwrap();
    let error = refused(&folder, &VerifyOptions::default());
    assert!(matches!(&error, VerifyError::ModelChanged { path, .. } if *path == model));
    assert!(error.to_string().contains("car.igs") && error.advice().contains("--model"));
}

#[test]
fn a_moved_model_is_found_beside_the_folder_or_as_told() {
    let place = tempfile::tempdir().unwrap();
    let (folder, model) = (place.path().join("out"), place.path().join("car.igs"));
    std::fs::write(&model, "no model at all").unwrap();
    write(&folder, &model, |job| job.model.path = "elsewhere/car.igs".into());
    // It is found: the hash agrees, and the reader refuses its content.
    let beside = refused(&folder, &VerifyOptions::default());
    assert!(matches!(beside, VerifyError::Model(_)), "{beside}");

    let moved = place.path().join("renamed.igs");
    std::fs::rename(&model, &moved).unwrap();
    let missing = refused(&folder, &VerifyOptions::default());
    assert!(matches!(missing, VerifyError::Folder(_)), "{missing}");
    let options = VerifyOptions { model: Some(moved), ..VerifyOptions::default() };
    assert!(matches!(refused(&folder, &options), VerifyError::Model(_)));
}

#[test]
fn formats_and_files_that_do_not_fit() {
    let place = tempfile::tempdir().unwrap();
    let (folder, model) = (place.path().join("out"), place.path().join("car.igs"));
    let nothing = refused(&folder, &VerifyOptions::default());
    assert!(nothing.to_string().contains("job.json"), "{nothing}");

    std::fs::write(&model, "a model").unwrap();
    write(&folder, &model, |job| job.format_version = 99);
    let version = refused(&folder, &VerifyOptions::default());
    assert!(matches!(version, VerifyError::Version { found: 99, .. }));
    assert!(folder.join(TOOLPATHS_FILE).exists());
}

#[test]
fn moves_with_unknown_names_are_refused() {
    let model = Model::default();
    let job = job(&model);
    let (a, b) = (Point3::origin(), Point3::new(5.0, 0.0, 0.0));
    let refused = |edit: fn(&mut claymill_toolpath::Move)| {
        let mut m = straight(MoveKind::Cut, 0, a, b);
        edit(&mut m);
        let options = VerifyOptions::default();
        verify_program(&model, &job, &program([m]), &options, &()).unwrap_err()
    };
    let tool = refused(|m| m.tool = "T9".into()).to_string();
    assert!(tool.contains("move 0") && tool.contains("T9"), "{tool}");
    assert!(refused(|m| m.setup = "below".into()).to_string().contains("setup `below`"));
    assert!(matches!(refused(|m| m.points.clear()), VerifyError::Move(_)));
}
