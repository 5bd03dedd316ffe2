//! Regions of a model file and made-up parallel strokes on it, with times:
//! `cargo run --release --example vehicle -- FILE [FOLDER] [STEP_OVER_MM]`.

use std::path::PathBuf;
use std::time::Instant;

use claymill_nurbs::{FaceMesh, MeshOptions, Model, Point3, tessellate};
use claymill_surface_merge::{MergeOptions, merge};
use claymill_viewer::{
    Axes, Colouring, LegendEntry, LineLayer, Mark, ModelView, PictureOptions, Renderer, Rgb, Scene, View,
    region_colours, render_png, stroke_shade,
};
use rayon::prelude::*;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let file = arguments.next().ok_or("usage: vehicle FILE [FOLDER] [STEP_OVER_MM]")?;
    let folder = PathBuf::from(arguments.next().unwrap_or_else(|| ".".into()));
    let step_over_mm: f64 = arguments.next().map_or(Ok(2.8), |text| text.parse())?;

    let mut clock = Clock(Instant::now());
    let model = claymill_exchange::read(file.as_ref())?.model;
    clock.lap("reading");
    let options = MeshOptions { deviation_mm: 0.2, longest_edge_mm: 60.0 };
    let mesh = |face| tessellate(face, &options).unwrap_or_default();
    let meshes: Vec<FaceMesh> = model.faces.par_iter().map(mesh).collect();
    clock.lap("meshing");
    let merged = merge(&model, &MergeOptions::default())?;
    clock.lap("merging");
    let view = ModelView {
        model: &model,
        meshes: &meshes,
        region_of_face: &merged.region_of_face,
        cut: None,
        joint_tolerance_mm: merged.tolerance.value_mm,
    };
    let colours = region_colours(&view);
    let mut regions = Scene::of_model(&view, Colouring::Region)?;
    regions.caption =
        vec![file.rsplit('/').next().unwrap_or_default().to_owned(), facts(&model, &meshes, colours.len())];
    for region in merged.regions.iter().take(8) {
        regions.legend.push(LegendEntry {
            mark: Mark::Area,
            colour: colours[region.id],
            text: format!(
                "region {}: {} faces, {:.3} m²",
                region.id,
                region.faces.len(),
                region.area_mm2 / 1e6
            ),
        });
    }
    clock.lap("scene");
    let mut painted = Scene::of_model(&view, Colouring::Clay)?;
    painted.caption = regions.caption.clone();
    painted.lines.push(strokes(&view, &painted.origin, &colours, step_over_mm));
    clock.lap("strokes");
    let ends: usize = painted.lines.iter().map(|l| l.points.len()).sum();
    println!("{} line vertices", ends);

    let renderer = Renderer::new()?;
    clock.lap(renderer.adapter());
    let axes = Axes::default();
    for name in ["iso", "top", "left", "front", "rear"] {
        let view = View::named(name, &axes).ok_or("no such view")?;
        for (what, scene) in [("regions", &regions), ("strokes", &painted)] {
            let path = folder.join(format!("{what}_{name}.png"));
            render_png(&renderer, scene, &view, &PictureOptions::default(), &path)?;
            clock.lap(&format!("{what} {name}"));
        }
    }
    Ok(())
}

struct Clock(Instant);

impl Clock {
    fn lap(&mut self, what: &str) {
        println!("{:8.2} s  {what}", self.0.elapsed().as_secs_f64());
        self.0 = Instant::now();
    }
}

fn facts(model: &Model, meshes: &[FaceMesh], regions: usize) -> String {
    let triangles: usize = meshes.iter().map(|m| m.triangles.len()).sum();
    format!("{} faces, {regions} regions, {triangles} triangles", model.faces.len())
}

/// Where planes `x = k · step` cut the triangles that look up: the looks of a raster, good enough to draw.
fn strokes(view: &ModelView<'_>, origin: &Point3, colours: &[Rgb], step_mm: f64) -> LineLayer {
    let mut layer =
        LineLayer { width_px: 1.5, opacity: 1.0, spacing_mm: Some(step_mm), ..LineLayer::default() };
    for (mesh, &region) in view.meshes.iter().zip(view.region_of_face) {
        let colour = stroke_shade(colours[region]);
        for triangle in &mesh.triangles {
            let corners = triangle.map(|i| mesh.points[i as usize]);
            let low = corners.iter().map(|p| p.x).fold(f64::INFINITY, f64::min);
            let high = corners.iter().map(|p| p.x).fold(f64::NEG_INFINITY, f64::max);
            for k in (low / step_mm).ceil() as i64..=(high / step_mm).floor() as i64 {
                let x = k as f64 * step_mm;
                let ends: Vec<Point3> = (0..3)
                    .filter_map(|i| {
                        let (a, b) = (corners[i], corners[(i + 1) % 3]);
                        let t = (x - a.x) / (b.x - a.x);
                        (t.is_finite() && (0.0..1.0).contains(&t)).then(|| a + (b - a) * t)
                    })
                    .collect();
                layer.add(ends.iter(), origin, colour, (k + 1_000_000) as u32);
            }
        }
    }
    layer
}
