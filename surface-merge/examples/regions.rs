//! Prints what merging a file gives: `cargo run --release --example regions -- FILE [PRESET …]`.

use std::collections::BTreeMap;
use std::time::Instant;

use claymill_surface_merge::{MergeOptions, Preset, merge};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    for file in std::env::args().skip(1) {
        let import = claymill_exchange::read(file.as_ref())?;
        println!("{file}: {} faces, tolerance {} mm", import.model.faces.len(), import.model.tolerance_mm);
        for preset in [Preset::ClassA, Preset::Clay, Preset::Tangent, Preset::Paper] {
            let options: MergeOptions = preset.options();
            let start = Instant::now();
            let merged = merge(&import.model, &options)?;
            let seconds = start.elapsed().as_secs_f64();
            let mut verdicts: BTreeMap<String, usize> = BTreeMap::new();
            let mut classes: BTreeMap<String, usize> = BTreeMap::new();
            for joint in &merged.joints {
                *verdicts.entry(format!("{:?}", joint.verdict)).or_default() += 1;
                *classes.entry(format!("{:?}", joint.continuity)).or_default() += 1;
            }
            if preset == Preset::ClassA {
                let t = &merged.tolerance;
                println!("  tolerance {:.5} mm ({:?})  {classes:?}", t.value_mm, t.origin);
                println!("  {:?}", merged.account);
                let naked =
                    merged.naked.iter().map(|n| format!("{:.3}(face {})", n.length_mm, n.stretch.face));
                println!(
                    "  {} naked stretches: {}",
                    merged.naked.len(),
                    naked.take(40).collect::<Vec<_>>().join(" ")
                );
                let many = merged.joints.iter().filter(|j| j.non_manifold).count();
                println!("  {} joints, {many} of them non-manifold", merged.joints.len());
            }
            let areas =
                merged.regions.iter().take(12).map(|r| format!("{:.0}({})", r.area_mm2, r.faces.len()));
            println!(
                "  {preset:?}: {} regions in {seconds:.2} s; largest {}",
                merged.regions.len(),
                areas.collect::<Vec<_>>().join(" ")
            );
            println!("    {verdicts:?}");
        }
    }
    Ok(())
}
