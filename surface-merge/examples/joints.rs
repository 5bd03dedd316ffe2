//! Every joint of a file on a line, for comparison with other programs: ends, length, class, largest angle, largest
//! curvature difference as a multiple of what is allowed, angle at mid-length, curvature floor.
//! `cargo run --release --example joints -- FILE`.

use std::io::Write;

use claymill_surface_merge::{MergeOptions, merge};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let file = std::env::args().nth(1).ok_or("name a file")?;
    let model = claymill_exchange::read(file.as_ref())?.model;
    let merged = merge(&model, &MergeOptions::default())?;
    let mut out = std::io::BufWriter::new(std::io::stdout().lock());
    for j in &merged.joints {
        let [a, b] = j.ends[0];
        // How many times the least difference that makes a joint G1 and not G2 the worst one is.
        let jump = j.samples.iter().map(|s| {
            let larger = s.curvature_per_mm.map_or(0.0, |[a, b]| a.abs().max(b.abs()));
            s.curvature_jump_per_mm() / (0.1 * larger).max(j.curvature_floor_per_mm)
        });
        let [angle, jump] =
            [j.samples.iter().map(|s| s.angle_deg.abs()).fold(0.0, f64::max), jump.fold(0.0, f64::max)];
        let floor = j.curvature_floor_per_mm;
        let (class, length, mid) = (j.continuity, j.length_mm, j.angle_deg.mid);
        writeln!(
            out,
            "{} {} {} {} {} {} {length} {class:?} {angle} {jump} {mid} {floor}",
            a.x, a.y, a.z, b.x, b.y, b.z
        )?;
    }
    Ok(())
}
