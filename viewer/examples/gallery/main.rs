//! Pictures of a wavy panel and a torus with made-up strokes: `cargo run --release --example gallery [FOLDER]`.

mod shapes;

use std::path::PathBuf;
use std::time::Instant;

use claymill_nurbs::Aabb;
use claymill_nurbs::Point3;
use claymill_viewer::{
    Axes, Colouring, LegendEntry, Mark, ModelView, PictureOptions, Renderer, Scene, StrokeStyle, View,
    region_colours, render_png,
};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let folder = PathBuf::from(std::env::args().nth(1).unwrap_or_else(|| ".".into()));
    let (model, meshes, regions) = shapes::model();
    let view = ModelView {
        model: &model,
        meshes: &meshes,
        region_of_face: &regions,
        cut: None,
        joint_tolerance_mm: 0.01,
        free_sides: None,
    };
    let renderer = Renderer::new()?;
    println!("{}", renderer.adapter());
    let colours = region_colours(&view);

    let mut scene = Scene::of_model(&view, Colouring::Region)?;
    scene.caption = vec![
        "Wavy panel and torus".into(),
        format!("{} faces, {} regions", model.faces.len(), colours.len()),
    ];
    for (region, &colour) in colours.iter().enumerate() {
        scene.legend.push(LegendEntry { mark: Mark::Area, colour, text: format!("region {region}") });
    }
    let mut painted = scene.clone();
    let style = StrokeStyle { region_colours: Some(&colours), ..StrokeStyle::new(0.05) };
    painted.add_paths(&shapes::program(), &style);

    let axes = Axes::default();
    let detail = Aabb { min: Point3::new(-60.0, -40.0, -20.0), max: Point3::new(40.0, 40.0, 60.0) };
    let pictures = [
        ("iso", &scene, View::iso(&axes)),
        ("top", &scene, View::top(&axes)),
        ("strokes", &painted, View::iso(&axes)),
        ("detail", &painted, View::iso(&axes).focused("detail", detail)),
    ];
    for (name, scene, view) in pictures {
        let start = Instant::now();
        let path = folder.join(format!("{name}.png"));
        render_png(&renderer, scene, &view, &PictureOptions::default(), &path)?;
        println!("{name}: {:.2} s", start.elapsed().as_secs_f64());
    }
    Ok(())
}
