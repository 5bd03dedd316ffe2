//! Counts the joints and regions of a file, for comparison with other programs:
//! `cargo run --release --example count -- FILE`.

use claymill_surface_merge::{Continuity, MergeOptions, merge};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let file = std::env::args().nth(1).ok_or("name a file")?;
    let model = claymill_exchange::read(file.as_ref())?.model;
    let merged = merge(&model, &MergeOptions::default())?;
    let of = |class| merged.joints.iter().filter(|j| j.continuity == class).count();
    let [c0, g1, g2] = [Continuity::C0, Continuity::G1, Continuity::G2].map(of);
    let (joints, regions) = (merged.joints.len(), merged.regions.len());
    println!("{joints} joints (C0 {c0}, G1 {g1}, G2 {g2}), {regions} regions");
    Ok(())
}
