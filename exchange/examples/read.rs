//! Reads model files and says how many faces they hold: for timing the readers alone.
//!
//! ```text
//! cargo run --release -p claymill-exchange --example read -- MODEL...
//! ```

fn main() {
    for path in std::env::args_os().skip(1) {
        match claymill_exchange::read(path.as_ref()) {
            Ok(import) => println!(
                "{}: {} faces, {} skipped",
                path.display(),
                import.report.faces_read,
                import.report.skipped.len()
            ),
            Err(error) => println!("{error}\n{}", error.advice()),
        }
    }
}
