//! Reads a model and joins its faces into regions.
//!
//! `cargo run --release -p claymill --example read_and_merge [MODEL]`

use std::error::Error;
use std::path::PathBuf;

use claymill::{Merging, Preset};

fn main() -> Result<(), Box<dyn Error>> {
    run(std::env::args_os().nth(1).map(PathBuf::from))
}

/// The example, on a model or on a generated one.
pub(crate) fn run(model: Option<PathBuf>) -> Result<(), Box<dyn Error>> {
    let folder = tempfile::tempdir()?;
    let path = match model {
        Some(path) => path,
        None => {
            let path = folder.path().join("panel.igs");
            claymill_models::panel(40, 7).write(&path)?;
            path
        }
    };
    let file = claymill::read(&path)?;
    let report = &file.import.report;
    println!("{}: {} faces, {} skipped", path.display(), report.faces_read, report.skipped.len());
    for skipped in &report.skipped {
        println!("  {} ({}): {}. {}", skipped.entity, skipped.what, skipped.reason, skipped.advice);
    }

    let merged = claymill::merge(&file, &Merging::new(Preset::Clay))?;
    for region in &merged.found.regions {
        println!("region {}: {} faces, {:.0} mm²", region.id, region.faces.len(), region.area_mm2);
    }
    // The stricter preset, with everything else as it was.
    let strict = claymill::merge(&file, &Merging::new(Preset::ClassA))?;
    println!("class-a: {} regions", strict.found.regions.len());
    Ok(())
}
