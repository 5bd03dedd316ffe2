//! Draws a model by its regions, and the passes of a job over it.
//!
//! `cargo run --release -p claymill --example render [MODEL [PICTURE]]`

use std::error::Error;
use std::path::PathBuf;

use claymill::Job;
use claymill::nurbs::{FaceMesh, MeshOptions, tessellate};
use claymill::viewer::{
    Axes, Colouring, ModelView, PictureOptions, Renderer, Scene, StrokeStyle, View, render_png,
};

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args_os().skip(1).map(PathBuf::from);
    run(arguments.next(), arguments.next())
}

/// The example, on a model or on a generated one.
pub(crate) fn run(model: Option<PathBuf>, picture: Option<PathBuf>) -> Result<(), Box<dyn Error>> {
    let place = tempfile::tempdir()?;
    let path = match model {
        Some(path) => path,
        None => {
            let path = place.path().join("ribbon.stp");
            claymill_models::ribbon(6, 1, &[])?.write(&path)?;
            path
        }
    };
    let picture = picture.unwrap_or_else(|| place.path().join("passes.png"));

    let file = claymill::read(&path)?;
    let job = Job::new("ball:10".parse()?, 1.0).axes("+z".parse()?, "+x".parse()?);
    let planned = job.plan(&file, &())?;
    let verified = planned.verify(place.path().join("job"), &())?;

    let shown = verified.finished();
    let fineness = MeshOptions { deviation_mm: 0.1, longest_edge_mm: 40.0 };
    let meshes = shown.model.faces.iter().map(|face| tessellate(face, &fineness));
    let meshes: Vec<FaceMesh> = meshes.collect::<Result<_, _>>()?;
    let view = ModelView {
        model: shown.model,
        meshes: &meshes,
        region_of_face: shown.region_of_face,
        cut: None,
        joint_tolerance_mm: shown.regions.tolerance_mm,
        free_sides: None,
    };
    let mut scene = Scene::of_model(&view, Colouring::Region)?;
    scene.add_paths(shown.program, &StrokeStyle { tools: &shown.job.tools, ..StrokeStyle::new(0.1) });
    let axes = Axes { up: shown.orientation.up.vector(), forward: shown.orientation.front.vector() };
    match Renderer::new() {
        Ok(renderer) => {
            render_png(&renderer, &scene, &View::iso(&axes), &PictureOptions::default(), &picture)?;
            println!("{}: {} bytes", picture.display(), std::fs::metadata(&picture)?.len());
        }
        Err(error) => println!("no picture without a graphics driver: {error}"),
    }
    Ok(())
}
