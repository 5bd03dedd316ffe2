//! Plans a job, verifies it from its written moves, and puts the job folder in place.
//!
//! `cargo run --release -p claymill --example plan_and_verify [MODEL [FOLDER]]`

use std::error::Error;
use std::path::PathBuf;

use claymill::{Job, Strategy};

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args_os().skip(1).map(PathBuf::from);
    run(arguments.next(), arguments.next())
}

/// The example, on a model or on a generated one.
pub(crate) fn run(model: Option<PathBuf>, out: Option<PathBuf>) -> Result<(), Box<dyn Error>> {
    let place = tempfile::tempdir()?;
    let path = match model {
        Some(path) => path,
        None => {
            let path = place.path().join("ribbon.stp");
            claymill_models::ribbon(12, 1, &[])?.write(&path)?;
            path
        }
    };
    let out = out.unwrap_or_else(|| place.path().join("job"));

    let file = claymill::read(&path)?;
    let job = Job::new("ball:10".parse()?, 0.2)
        .strategy(Strategy::Scallop)
        .axes("+z".parse()?, "+x".parse()?)
        .feed_mm_per_min(4000.0);
    let planned = job.plan(&file, &())?;
    let totals = &planned.plan().totals;
    println!("{} passes, {:.1} m, {:.0} s", totals.passes, totals.length.cut_mm / 1000.0, totals.time_s);

    let verified = planned.verify(&out, &())?;
    let found = &verified.results().verification;
    println!("deepest gouge {:.2} µm", 1000.0 * found.gouge.deepest_mm);
    println!("highest crest {:.4} mm", found.scallop.crests.max_mm);
    for finding in &found.verdict.findings {
        println!("{:?}: {}", finding.severity, finding.message);
    }
    println!("{}", if verified.passed() { "passed" } else { "NOT passed" });
    let (results, _) = verified.write()?;
    println!("{}: {} moves", out.display(), results.program.moves.len());
    Ok(())
}
