//! `reach.json`, judged by the separate program.

use std::process::Command;

use claymill_contact::Axis;
use claymill_nurbs::Point3;
use claymill_reach::{Reach, ReachFile, Reacher, choose, gains, sphere};

use crate::shapes::{Shape, block};

fn checked(record: &ReachFile) -> Option<(bool, String)> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("reach.json");
    std::fs::write(&path, serde_json::to_vec(record).unwrap()).unwrap();
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/../scripts/check-cover.py");
    let output = Command::new("python3").arg(script).arg(&path).output().ok()?;
    let text = String::from_utf8_lossy(&[output.stdout, output.stderr].concat()).into_owned();
    Some((output.status.success(), text))
}

#[test]
fn a_separate_program_accepts_the_proof_and_finds_a_forged_one() {
    let axis = |text: &str| text.parse::<Axis>().unwrap();
    let cube = Shape::around(Point3::new(20.0, 20.0, 20.0), block([40.0; 3]));
    let part = cube.part();
    for (steepest_deg, forced) in [(50.0, vec![]), (50.0, vec![[0.0, 0.0, 1.0]]), (60.0, vec![])] {
        let directions = sphere(&part, &forced, 180.0, 1, (axis("+z"), axis("-y"))).unwrap();
        let reacher = Reacher { steepest_deg, walls: false, ..Reacher::of("ball:2".parse().unwrap()) };
        let reach = Reach::new(&part, &reacher, &directions, &()).unwrap();
        let fixed: Vec<usize> = (0..forced.len()).collect();
        let cover = choose(&reach.table, &reach.weights(), &fixed, 0.0, &()).unwrap();
        let gains = gains(&reach.table, &reach.weights(), &fixed, 2);
        let record = ReachFile::new(("cube", &part, &reacher), &directions, &reach, &cover, &gains);
        let Some((is_accepted, text)) = checked(&record) else { return };
        assert!(is_accepted && text.contains(": proven"), "{text}");
        // It is the same again from its file.
        let again: ReachFile = serde_json::from_str(&serde_json::to_string(&record).unwrap()).unwrap();
        assert_eq!(again, record);
        let more = ReachFile { least: record.least + 1, is_optimal: false, ..record.clone() };
        assert!(!checked(&more).unwrap().0);
        let fewer = ReachFile { chosen: record.chosen[1..].to_vec(), is_optimal: false, ..record };
        assert!(!checked(&fewer).unwrap().0);
    }
}
