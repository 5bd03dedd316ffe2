//! Every file of the corpus against `answers_solids.json` and against its own edges: counts, areas, and each face.

use claymill_exchange::{read, read_solid};
use claymill_tests::corpus;
use rayon::prelude::*;

/// Relative difference of areas ...
const AREA: f64 = 1e-5;
/// ... beside the last digit of the answers, mm².
const DIGIT_MM2: f64 = 6e-4;

/// Where this reader and the answers differ, by how many faces and by how much, and why it stands by its own.
const DISSENT: [(&str, i64, f64, &str); 3] = [
    (
        "nist/nist_ctc_02_asme1_rc.stp",
        1,
        2e-3,
        "the answer is of the solid alone; the part has one more face in an open shell, of 4415.662 mm²",
    ),
    ("solids/tie_rod.step", -8, AREA, "the file has 60 faces: the other kernel cuts closed ones"),
    (
        "solids/bearing.igs",
        -1,
        0.05,
        "0.16 mm small by its unit: the face left out is smaller than a square micrometre, the answer has two digits",
    ),
];

/// Faces of which the file's own edges say something else, and why.
const IN_DOUBT: [(&str, usize, &str); 0] = [];

#[test]
fn solids_are_read_once_and_whole() {
    let Some(folder) = corpus() else { return };
    let answers = std::fs::read_to_string(folder.join("answers_solids.json")).unwrap();
    let answers: serde_json::Value = serde_json::from_str(&answers).unwrap();
    let names: Vec<&String> = answers.as_object().unwrap().keys().collect();
    let wrong: Vec<String> = names
        .par_iter()
        .filter_map(|name| {
            let import = read(&folder.join(name)).unwrap();
            let report = &import.report;
            let answer = &answers[name.as_str()];
            let area: f64 = report.faces.iter().map(|f| f.area_read_mm2).sum();
            let (faces, answer) = (answer["faces"].as_i64().unwrap(), answer["area_mm2"].as_f64().unwrap());
            let dissent = DISSENT.iter().find(|d| d.0 == name.as_str());
            let (more, limit) = dissent.map_or((0, AREA), |d| (d.1, d.2));
            let off = (area - answer).abs();
            let right = report.skipped.len() as i64 == (-more).max(0) * i64::from(name.ends_with(".igs"))
                && report.faces_read as i64 == faces + more
                && off <= limit * answer + DIGIT_MM2;
            (!right).then(|| {
                format!(
                    "{name}: {} faces of {faces}, {} skipped, area {:+.1e}",
                    report.faces_read,
                    report.skipped.len(),
                    area / answer - 1.0
                )
            })
        })
        .collect();
    assert!(wrong.is_empty(), "{wrong:#?}");
}

#[test]
fn every_face_is_what_its_own_edges_say() {
    let Some(folder) = corpus() else { return };
    let mut files = Vec::new();
    for part in ["", "solids", "nist", "mfcad", "mftrcad", "hard_cases"] {
        for entry in std::fs::read_dir(folder.join(part)).unwrap() {
            let path = entry.unwrap().path();
            let kind = path.extension().and_then(|e| e.to_str()).unwrap_or_default().to_ascii_lowercase();
            if matches!(kind.as_str(), "stp" | "step" | "igs" | "iges" | "3dm") {
                files.push(path);
            }
        }
    }
    files.sort();
    let told: Vec<(String, Vec<String>, [usize; 3])> = files
        .par_iter()
        .map(|path| {
            let import = read(path).unwrap();
            let name = path.strip_prefix(&folder).unwrap().display().to_string();
            let faces = &import.report.faces;
            let doubts =
                faces.iter().filter_map(|f| f.doubt.as_ref().map(|d| format!("{name} {}: {d}", f.entity)));
            let judged = faces.iter().filter(|f| f.area_in_file_mm2.is_some()).count();
            let odd =
                faces.iter().filter(|f| f.bounds_in_file != f.loops_read && f.bounds_in_file > 0).count();
            (name.clone(), doubts.collect(), [faces.len(), judged, odd])
        })
        .collect();
    let mut wrong = Vec::new();
    for (name, doubts, [faces, judged, odd]) in told {
        if !name.contains('/') || name.starts_with("solids") || name.starts_with("nist") {
            eprintln!(
                "{name}: {faces} faces, {judged} by area, {odd} with another count of loops, {} in doubt",
                doubts.len()
            );
        }
        let known = IN_DOUBT.iter().find(|d| d.0 == name).map_or(0, |d| d.1);
        if doubts.len() != known {
            wrong.extend(doubts);
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

/// Volumes of closed meshes against those of the other kernel: chords of 0.02 mm on bodies of some millimetres.
const VOLUME: f64 = 1e-3;

#[test]
fn solids_are_closed_and_as_large_as_they_are() {
    let Some(folder) = corpus() else { return };
    let answers = std::fs::read_to_string(folder.join("answers_solids.json")).unwrap();
    let answers: serde_json::Value = serde_json::from_str(&answers).unwrap();
    let volume = |name: &String| answers[name.as_str()]["volume_mm3"].as_f64();
    // Its part has an open shell beside the solid.
    let open = "nist/nist_ctc_02_asme1_rc.stp";
    let names: Vec<(&String, f64)> =
        answers.as_object().unwrap().keys().filter_map(|name| Some((name, volume(name)?))).collect();
    assert!(names.len() > 300, "{}", names.len());
    let wrong: Vec<String> = names
        .par_iter()
        .filter_map(|(name, volume)| match read_solid(&folder.join(name), 1.0) {
            Ok(mesh) => {
                let off = mesh.volume_mm3() / volume - 1.0;
                (off.abs() > VOLUME || *name == open).then(|| format!("{name}: {off:+.1e}"))
            }
            Err(error) => (*name != open).then(|| error.to_string()),
        })
        .collect();
    assert!(wrong.is_empty(), "{wrong:#?}");
}
