//! Drops a tool at random places on a model: how many a second, and how large the gaps are.
//! `cargo run --release -p claymill-paths --example ends -- MODEL TOOL [COUNT]`
use std::time::Instant;

use claymill_contact::{Covering, CutterDrop, Frame};
use claymill_nurbs::{Aabb, Point3};
use claymill_toolpath::Tool;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut args = std::env::args().skip(1);
    let (path, tool) = (args.next().ok_or("a model")?, args.next().ok_or("a tool")?);
    let count: u32 = args.next().map_or(Ok(20_000), |n| n.parse())?;
    let tool: Tool = tool.parse()?;
    let model = claymill_exchange::read(path.as_ref())?.model;
    let area_mm2: f64 = model.faces.iter().map(|f| f.area_mm2()).sum();
    let excluded = vec![false; model.faces.len()];
    let covering = Covering::new(&model, &excluded, area_mm2, tool.radius_mm()).map_err(|(_, e)| e)?;
    let frame = Frame::five("+z".parse()?, "-x".parse()?)?[0];
    let end = CutterDrop::new(&model, &covering, &frame, &tool);
    let net = model.faces.iter().flat_map(|f| f.surface.net());
    let bounds = net.fold(Aabb::empty(), |mut b, h| {
        b.add(&frame.to_setup(&Point3::from(h.xyz() / h.w)));
        b
    });
    let share = |k: u32, prime: f64| (f64::from(k) * 0.618_033_988_75 * prime).fract();
    let size = bounds.max - bounds.min;
    let begun = Instant::now();
    let mut gaps: Vec<f64> = (0..count)
        .filter_map(|k| {
            end.drop(bounds.min.x + size.x * share(k, 1.0), bounds.min.y + size.y * share(k, 7.3))
        })
        .map(|l| l.gap_mm)
        .collect();
    let took = begun.elapsed();
    gaps.sort_by(f64::total_cmp);
    let at = |share: f64| gaps.get(((gaps.len() as f64 - 1.0) * share) as usize).copied().unwrap_or(f64::NAN);
    let within = gaps.iter().filter(|g| **g <= 1e-3).count();
    println!(
        "{tool}: {} of {count} places met, {:.0} a second; gap: median {:.1e}, 99 % {:.1e}, worst {:.1e} mm; {:.3} % within 1 µm",
        gaps.len(),
        f64::from(count) / took.as_secs_f64(),
        at(0.5),
        at(0.99),
        at(1.0),
        100.0 * within as f64 / gaps.len().max(1) as f64
    );
    Ok(())
}
