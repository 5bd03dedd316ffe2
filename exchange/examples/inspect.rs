//! Prints what a model file holds: `cargo run --release --example inspect -- body.igs`.

fn main() {
    for path in std::env::args().skip(1) {
        let start = std::time::Instant::now();
        match claymill_exchange::read(path.as_ref()) {
            Err(error) => println!("{error}\n  {}", error.advice()),
            Ok(import) => {
                let report = &import.report;
                println!("{path}: {} faces in {:.2?}", report.faces_read, start.elapsed());
                let trimmed = import.model.faces.iter().filter(|f| !f.loops.is_empty()).count();
                println!(
                    "  {trimmed} trimmed, {:?}, tolerance {} mm, coordinate step {} mm",
                    report.units, report.tolerance_mm, import.model.coordinate_step_mm
                );
                for warning in &report.warnings {
                    println!("  {warning}");
                }
                for skipped in &report.skipped {
                    println!("  {} {}: {} {}", skipped.entity, skipped.what, skipped.reason, skipped.advice);
                }
                for repair in &report.repairs {
                    println!("  {} {} ({:.4} mm)", repair.entity, repair.what, repair.size_mm);
                }
            }
        }
    }
}
