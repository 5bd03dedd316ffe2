//! Planted flaws through files: found again, explained and swept.

use serde_json::Value;

use crate::run::run;
use crate::scratch;

#[test]
fn a_picture_marks_the_defects_in_the_colours_of_its_legend() {
    let folder = scratch();
    let sample = ["sample", "ribbon", "--patches", "200", "-o", "ribbon.igs", "--flaw", "duplicate:3"];
    assert_eq!(run(folder.path(), sample).code, Some(0));
    let size = ["--size", "640x480", "--view", "top"];
    let drawn =
        run(folder.path(), ["inspect", "ribbon.igs", "--json", "-o", "marked.png"].iter().chain(&size));
    assert_eq!(drawn.code, Some(0), "{drawn:?}");
    assert_eq!(drawn.json()["defect_counts"]["G-FA-DU"], 3);
    let file = std::fs::File::open(folder.path().join("marked.png")).unwrap();
    let mut reader = png::Decoder::new(std::io::BufReader::new(file)).read_info().unwrap();
    let mut rgb = vec![0; reader.output_buffer_size().unwrap()];
    let shown = reader.next_frame(&mut rgb).unwrap();
    assert_eq!((shown.width, shown.height), (640, 480));
    // Three squares and one in the legend, in the middle of their lines quite red.
    let red = rgb.chunks_exact(3).filter(|p| p[0] > 180 && p[1] < 80 && p[2] < 80).count();
    assert!((40..4000).contains(&red), "{red} red pixels");
    let refused = run(folder.path(), ["inspect", "ribbon.igs", "-o", "marked.png", "--view", "below"]);
    assert_eq!(refused.code, Some(2));
}

#[test]
fn flaws_planted_into_a_file_are_found_explained_and_swept() {
    let folder = scratch();
    let sample = ["sample", "ribbon", "--patches", "200", "-o", "ribbon.igs"];
    let flaws = ["--flaw", "kink:0.7", "--flaw", "kink:4", "--flaw", "duplicate:1", "--flaw", "lap:1"];
    let made = run(folder.path(), sample.iter().chain(&flaws));
    assert_eq!(made.code, Some(0), "{made:?}");
    let answers = std::fs::read(folder.path().join("ribbon.answers.json")).unwrap();
    let answers: Value = serde_json::from_slice(&answers).unwrap();

    let merged = run(folder.path(), ["merge", "ribbon.igs", "--json"]).json();
    let flaw =
        |kind: &str| answers["flaws"].as_array().unwrap().iter().find(|f| f["flaw"] == kind).unwrap().clone();
    assert_eq!(merged["duplicates"], Value::from(vec![flaw("duplicate:1")["faces"].clone()]));
    let lap = flaw("lap:1")["faces"].clone();
    let laps = merged["laps"].as_array().unwrap();
    assert!(!laps.is_empty() && laps.iter().all(|l| l["face"] == lap[0] && l["onto"] == lap[1]));
    let parts = ["matched", "lapped", "naked", "non_manifold"];
    let length = |part: &str| merged[format!("boundary_{part}_mm")].as_f64().unwrap();
    let sum: f64 = parts.into_iter().map(length).sum();
    assert!((sum - length("total")).abs() < 1e-9 * sum);
    // The kink of 0.7° is weak, that of 4° splits; the lap is a region of its own.
    assert_eq!(merged["regions"].as_array().unwrap().len(), 3);
    let split: Vec<&Value> =
        merged["joints"].as_array().unwrap().iter().filter(|j| j["failing"].is_object()).collect();
    assert_eq!(split.len(), flaw("kink:4")["joints"].as_array().unwrap().len());
    for joint in split {
        assert_eq!(joint["failing"]["measure"], "angle");
        assert!((joint["failing"]["value"].as_f64().unwrap() - 4.0).abs() < 1e-6);
        assert_eq!(joint["regions_if_merged"], 2);
    }

    let swept = run(folder.path(), ["merge", "ribbon.igs", "--sweep", "--why", "3", "-o", "out"]);
    assert_eq!(swept.code, Some(0), "{swept:?}");
    assert!(swept.stdout.contains("regions by angle: 4 at 0.02°"), "{}", swept.stdout);
    assert!(swept.stdout.contains("angle 4.000° (limit 1°)"), "{}", swept.stdout);
    let trees: Value =
        serde_json::from_slice(&std::fs::read(folder.path().join("out/sweep.json")).unwrap()).unwrap();
    let last = trees[0]["curve"].as_array().unwrap().last().unwrap();
    assert_eq!(last["regions"], 2);
    assert!((last["at"].as_f64().unwrap() - 4.0).abs() < 1e-6);
    let plot = std::fs::read_to_string(folder.path().join("out/sweep.svg")).unwrap();
    assert!(plot.starts_with("<svg") && plot.ends_with("</svg>\n"));

    let count = |options: &[&str]| {
        let merged = run(folder.path(), ["merge", "ribbon.igs", "--json"].iter().chain(options));
        assert_eq!(merged.code, Some(0), "{merged:?}");
        merged.json()["regions"].as_array().unwrap().len()
    };
    assert_eq!(count(&["--joint-angle", "0.3:0.5"]), 4);
    assert_eq!(count(&["--joint-angle", "5"]), 2);
    assert_eq!(count(&["--keep-together", "face:0-193"]), 2);
    let kinked = &flaw("kink:0.7")["joints"][0];
    let apart = format!("face:{}", kinked[0]);
    assert_eq!(count(&["--keep-apart", &apart]), 4);
    for (options, says) in [
        (["--joint-angle", "2:1"], "not a limit"),
        (["--joint-gap", "-1"], "must be positive"),
        (["--joint-tolerance", "1000"], "no neighbours"),
        (["--keep-apart", "layer:nowhere"], "no face has this layer"),
        (["--keep-apart", "region:0"], "names no region, layer, colour or face"),
        (["--keep-together", "face:9000"], "counted from 0"),
        (["--absorb-width", "0"], "must be positive"),
    ] {
        let refused = run(folder.path(), ["merge", "ribbon.igs"].iter().chain(&options));
        assert_eq!(refused.code, Some(2), "{refused:?}");
        assert!(refused.stderr.contains(says) && refused.stderr.contains("help: "), "{}", refused.stderr);
    }

    for (flaw, says) in [("kink:0", "above 0"), ("dent:3", "no flaw"), ("delete:5000", "faces only")] {
        let refused = run(folder.path(), ["sample", "ribbon", "-o", "x.igs", "--flaw", flaw]);
        assert_ne!(refused.code, Some(0));
        assert!(refused.stderr.contains(says), "{}", refused.stderr);
    }
}

#[test]
fn a_planted_gap_wider_than_the_tolerance_is_told_with_its_size() {
    let folder = scratch();
    let sample = ["sample", "ribbon", "--patches", "200", "-o", "ribbon.igs", "--flaw", "gap:0.1"];
    assert_eq!(run(folder.path(), sample).code, Some(0));
    let answers = std::fs::read(folder.path().join("ribbon.answers.json")).unwrap();
    let answers: Value = serde_json::from_slice(&answers).unwrap();
    let joints = answers["flaws"][0]["joints"].as_array().unwrap();
    let found = run(folder.path(), ["inspect", "ribbon.igs", "--json"]).json();
    let gaps: Vec<&Value> =
        found["defects"].as_array().unwrap().iter().filter(|d| d["code"] == "G-SH-LG").collect();
    assert_eq!(gaps.len(), joints.len());
    for gap in gaps {
        assert!(joints.contains(&gap["faces"]), "{gap}");
        assert!((gap["size"].as_f64().unwrap() - 0.1).abs() < 1e-6, "{gap}");
    }
    let merged = run(folder.path(), ["merge", "ribbon.igs"]);
    assert!(merged.stdout.contains("gape by up to 0.1000 mm"), "{}", merged.stdout);
}
