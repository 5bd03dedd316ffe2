//! Plans a job and writes it as a program for a control, but only if it passed its verification.
//!
//! `cargo run --release -p claymill --example post_a_program [MODEL [PROGRAM]]`

use std::error::Error;
use std::path::PathBuf;

use claymill::controller::{Dialect, Machine};
use claymill::{Job, JobFolder};

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args_os().skip(1).map(PathBuf::from);
    run(arguments.next(), arguments.next())
}

/// The example, on a model or on a generated one.
pub(crate) fn run(model: Option<PathBuf>, program: Option<PathBuf>) -> Result<(), Box<dyn Error>> {
    let place = tempfile::tempdir()?;
    let path = match model {
        Some(path) => path,
        None => {
            let path = place.path().join("ribbon.igs");
            claymill_models::ribbon(6, 1, &[])?.write(&path)?;
            path
        }
    };
    let program = program.unwrap_or_else(|| place.path().join("ribbon.ngc"));

    let machine = Machine::default();
    let file = claymill::read(&path)?;
    let job = Job::new("ball:10".parse()?, 0.5).axes("+z".parse()?, "+x".parse()?).machine(&machine);
    let folder = place.path().join("job");
    job.plan(&file, &())?.verify(&folder, &())?.write()?;

    // The folder is read again: what is posted is what was verified, byte for byte.
    let cleared = match JobFolder::open(&folder)?.cleared() {
        Ok(cleared) => cleared,
        Err(refusal) => {
            println!("{refusal}");
            println!("{}", refusal.advice());
            return Ok(());
        }
    };
    let totals = cleared.post(Dialect::LinuxCnc29, &machine, &program)?;
    for written in &totals.files {
        println!("{}: {} lines, {} bytes", written.path.display(), written.lines, written.bytes);
    }
    println!("read back: {:.6} mm from the job at most", totals.read_back.largest_mm);
    Ok(())
}
