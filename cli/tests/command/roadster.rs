//! The generated vehicle through files: what was planted is found again.

use claymill_tests::same_partition;
use serde_json::Value;

use crate::run::run;
use crate::scratch;

#[test]
fn merge_finds_the_planted_regions_for_any_seed() {
    let folder = scratch();
    for seed in ["1", "2", "77"] {
        let made = run(folder.path(), ["sample", "roadster", "--seed", seed, "-o", "roadster.igs"]);
        assert_eq!(made.code, Some(0), "{made:?}");
        let answers = std::fs::read(folder.path().join("roadster.answers.json")).unwrap();
        let answers: Value = serde_json::from_slice(&answers).unwrap();
        let planted: Vec<usize> = serde_json::from_value(answers["region_of_face"].clone()).unwrap();

        let merged = run(folder.path(), ["merge", "roadster.igs", "--json"]);
        assert_eq!(merged.code, Some(0), "{}", merged.stderr);
        let merged = merged.json();
        let regions = merged["regions"].as_array().unwrap();
        assert_eq!(regions.len(), 37, "seed {seed}");
        let mut found = vec![usize::MAX; planted.len()];
        for (id, region) in regions.iter().enumerate() {
            for face in region["faces"].as_array().unwrap() {
                found[face.as_u64().unwrap() as usize] = id;
            }
        }
        assert!(same_partition(&found, &planted), "seed {seed}");
    }
}
