//! Mechanical parts of the corpus, planned by all usual strategies.

use claymill_paths::Strategy;
use claymill_verify::{SurfaceState, VerifyOptions, verify_program};

use super::{planned, size_mm};

/// A ball's diameter is so many times smaller than a part.
const SMALLER: f64 = 40.0;

/// `CLAYMILL_PART=tie_rod CLAYMILL_BALL=3` chooses parts by their names, and a ball.
#[test]
#[ignore = "minutes to an hour: for the figures of a part"]
fn parts_pass_or_say_why() {
    let Some(folder) = claymill_tests::corpus() else { return };
    let asked = std::env::var("CLAYMILL_PART").unwrap_or_default();
    let ball_mm: Option<f64> = std::env::var("CLAYMILL_BALL").ok().and_then(|mm| mm.parse().ok());
    let files = ["solids", "nist"].into_iter().flat_map(|sub| std::fs::read_dir(folder.join(sub)).unwrap());
    let mut files: Vec<_> = files.map(|f| f.unwrap().path()).collect();
    files.retain(|f| f.to_string_lossy().contains(&asked));
    files.sort();
    for file in files {
        let model = match claymill_exchange::read(&file) {
            Ok(import) => import.model,
            Err(why) => {
                eprintln!("{}: {why}", file.display());
                continue;
            }
        };
        let radius_mm = ball_mm.unwrap_or(size_mm(&model) / SMALLER / 2.0);
        for strategy in [Strategy::Planar, Strategy::Scallop, Strategy::Auto] {
            let what = format!("{} {strategy} ball {radius_mm:.3}", file.display());
            let (job, plan) = match planned(&model, strategy, radius_mm, 0.02 * radius_mm) {
                Ok(planned) => planned,
                Err(why) => {
                    eprintln!("{what}: {why}");
                    continue;
                }
            };
            let options = VerifyOptions::default();
            let found = verify_program(&model, &job, &plan.program, &options, &()).unwrap();
            let verdict = if found.verdict.passed { "PASSED" } else { "NOT PASSED" };
            eprintln!("{what}: {verdict} {:?}", found.coverage.by_state_mm2);
            for finding in &found.verdict.findings {
                eprintln!("  {:?} {:?}: {}", finding.severity, finding.code, finding.message);
            }
            for left in &found.coverage.reachable_left_at {
                let face = left.at.face.unwrap_or(0);
                let left_by = found.coverage.faces[face].by_state_mm2.get(&SurfaceState::ReachableLeft);
                eprintln!("  face {face}: {left_by:.2?} at {:.3?}, {:?}", left.at.point_mm, job.faces[face]);
            }
        }
    }
}
