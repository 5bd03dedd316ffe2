//! Drops a tool on a model, on a line across its middle: where it comes to rest, and what it touches.
//!
//! `cargo run --release -p claymill --example drop_a_tool [MODEL]`

use std::error::Error;
use std::path::PathBuf;

use claymill::paths::{Covered, CutterDrop};
use claymill::{Point3, Tool};

/// Places on the line.
const PLACES: usize = 9;

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
    let faces = file.model();
    let tool: Tool = "bull:10:2".parse()?;
    let orientation = claymill::orientation(&file, Some("+z".parse()?), None)?.orientation;
    // Triangles that enclose the faces: they say where to look, the exact surfaces where the tool rests.
    let area_mm2 = file.face_area_mm2.iter().sum();
    let covered = Covered::new(faces, &vec![false; faces.faces.len()], area_mm2, tool.radius_mm())
        .map_err(|(face, error)| format!("face {face}: {error}"))?;
    let [top, ..] = orientation.five_setups()?;
    let drop = CutterDrop::new(&covered.model, &covered.covering, &top, &tool);

    let (from, to) = (file.bounds.min, file.bounds.max);
    for k in 0..PLACES {
        let share = k as f64 / (PLACES - 1) as f64;
        let line = Point3::new(from.x + share * (to.x - from.x), 0.5 * (from.y + to.y), 0.0);
        let at = top.to_setup(&line);
        match drop.drop(at.x, at.y) {
            Some(rest) => println!(
                "x {:8.2}: tip at {:.4} mm, proven to {:.5} mm, on face {}",
                line.x,
                top.to_model(&rest.tip).z,
                rest.gap_mm,
                covered.own_face(rest.face)
            ),
            None => println!("x {:8.2}: nothing below", line.x),
        }
    }
    Ok(())
}
