//! Samples as files.

use claymill_models::{Answers, RoadsterOptions, SampleError, panel, write_sample};

#[test]
fn a_written_sample_reads_back_to_the_same_faces_and_answers() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("roadster.igs");
    let options = RoadsterOptions { patches: 500, seed: 11 };
    let sample = write_sample("roadster", &options, &path).unwrap();
    let bytes = std::fs::read(&path).unwrap();

    let import = claymill_exchange::read(&path).unwrap();
    assert_eq!(import.model.faces.len(), sample.model.faces.len());
    for (read, written) in import.model.faces.iter().zip(&sample.model.faces) {
        assert_eq!(read.surface, written.surface);
    }
    let text = std::fs::read_to_string(folder.path().join("roadster.answers.json")).unwrap();
    let answers: Answers = serde_json::from_str(&text).unwrap();
    assert_eq!(answers, sample.answers);
    let file = String::from_utf8_lossy(&bytes);
    for region in &answers.regions {
        assert!(!file.contains(&region.name), "{} is told in the file", region.name);
    }

    write_sample("roadster", &options, &path).unwrap();
    assert!(std::fs::read(&path).unwrap() == bytes, "the same options give the same bytes");
}

#[test]
fn an_unknown_sample_names_those_that_exist() {
    let error = write_sample("lorry", &RoadsterOptions::default(), "x.igs".as_ref()).unwrap_err();
    assert!(matches!(error, SampleError::Unknown { .. }));
    assert!(error.to_string().contains("roadster"), "{error}");
}

#[test]
fn the_panel_is_one_region() {
    let sample = panel(200, 1);
    assert_eq!(sample.answers.regions.len(), 1);
    assert_eq!(sample.answers.totals.joints_c0, 0);
    assert!(sample.answers.totals.joints_g1 > 0 && sample.answers.totals.joints_g2 > 0);
    assert!(sample.model.faces.len().abs_diff(200) <= 20);
}
