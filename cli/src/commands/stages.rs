//! Pictures of the stock before the first operation and after each: what stands over the surface, by its thickness.

use std::collections::HashMap;
use std::path::Path;

use claymill::{InProcessStock, PlannedOperations};
use claymill_nurbs::{ClosestPoints, Model, Point3};
use claymill_toolpath::{Job, Program};
use claymill_viewer::{Axes, LegendEntry, Mark, PictureOptions, Renderer, ReportPicture, Rgb, Scene, View};
use rayon::prelude::*;

use super::pictures::{SHOWN_SMALL, options};
use crate::console::Console;
use crate::failure::Failure;

/// Stock up to this thickness has one colour, mm: light where the surface is, brown where there is much to go.
const BANDS: [(f64, Rgb); 5] = [
    (0.5, [222, 216, 204]),
    (2.0, [214, 190, 150]),
    (6.0, [196, 152, 104]),
    (20.0, [160, 112, 74]),
    (f64::INFINITY, [118, 84, 62]),
];

/// Beyond the last band but one all is alike, mm.
const FARTHEST_MM: f64 = BANDS[BANDS.len() - 2].0;

/// The stock of a job between two operations.
pub(super) struct StockState {
    /// Name of the operation before; none before the first.
    after: Option<String>,
    state: InProcessStock,
}

/// All states of a job that was planned.
pub(super) fn of(planned: &PlannedOperations<'_>) -> Vec<StockState> {
    let names = std::iter::once(None).chain(planned.iter().map(|(o, _)| Some(o.name.clone())));
    names.zip(planned.states()).map(|(after, state)| StockState { after, state: state.clone() }).collect()
}

/// The same from the files of a job.
pub(super) fn of_job(
    console: &Console,
    model: &Model,
    (job, folder): (&Job, &Path),
    program: &Program,
) -> Result<Vec<StockState>, Failure> {
    let names = std::iter::once(None).chain(job.operations.iter().map(|o| Some(o.name.clone())));
    let states = InProcessStock::states_of(model, (job, folder), program, None, console)?;
    Ok(names.zip(states).map(|(after, state)| StockState { after, state }).collect())
}

/// Writes a picture of each state, and returns them for the report.
pub(super) fn save(
    console: &Console,
    renderer: &Renderer,
    states: &[StockState],
    (model, title): (&Model, &str),
    axes: &Axes,
    folder: &Path,
) -> Result<Vec<ReportPicture>, Failure> {
    let closest = ClosestPoints::new(model);
    // All pictures show the same place, the one that the whole stock takes.
    let mut framed = Vec::new();
    // What an operation does not cut keeps its colour.
    let mut known = HashMap::new();
    let mut pictures = Vec::new();
    for (k, StockState { after, state }) in states.iter().enumerate() {
        console.at("stock", k as f64 / states.len() as f64);
        let (words, file) = match after {
            None => ("Stock before the first operation".to_owned(), "stock-0.png".to_owned()),
            Some(name) => (format!("Stock after {name}"), format!("stock-{k}-{}.png", plain(name))),
        };
        let mut scene = scene(state, &closest, &mut known)?;
        if framed.is_empty() {
            framed = scene.points().collect();
        }
        scene.framed.clone_from(&framed);
        scene.caption = vec![title.to_owned(), format!("{words}: {:.1} l", state.volume_mm3() / 1e6)];
        let options = PictureOptions { lettering: SHOWN_SMALL, ..options(axes) };
        let png = renderer.render(&scene, &View::iso(axes), &options)?.save(&folder.join(file))?;
        let alt = format!("{words}, {title}, view iso");
        pictures.push(ReportPicture { caption: words, alt, png });
    }
    Ok(pictures)
}

/// The surface of the stock, coloured by its distance from the model.
fn scene(
    state: &InProcessStock,
    closest: &ClosestPoints<'_>,
    known: &mut HashMap<[u64; 3], Rgb>,
) -> Result<Scene, Failure> {
    let mesh = state.surface()?;
    let bounds = state.stock().grid().bounds();
    let mut scene = Scene::new(bounds.centre());
    let key = |p: &Point3| [p.x, p.y, p.z].map(f64::to_bits);
    let colour = |p: &Point3| {
        known.get(&key(p)).copied().unwrap_or_else(|| {
            let mm = closest.closest(p, FARTHEST_MM).map_or(f64::INFINITY, |foot| foot.distance_mm);
            BANDS.iter().find(|(most, _)| mm <= *most).map_or(BANDS[4].1, |band| band.1)
        })
    };
    let colours: Vec<Rgb> = mesh.points_mm.par_iter().map(colour).collect();
    *known = mesh.points_mm.iter().map(key).zip(colours.iter().copied()).collect();
    scene.add_solid(&mesh.points_mm, &mesh.triangles, &colours);
    let mut from_mm = 0.0;
    for (most_mm, colour) in BANDS {
        let text = match (from_mm, most_mm) {
            (0.0, mm) => format!("within {mm} mm of the surface"),
            (mm, f64::INFINITY) => format!("more than {mm} mm above it"),
            (low, high) => format!("{low} to {high} mm above it"),
        };
        scene.legend.push(LegendEntry { mark: Mark::Area, colour, text });
        from_mm = most_mm;
    }
    Ok(scene)
}

/// A name as part of a file's.
fn plain(name: &str) -> String {
    let kept = |c: char| if c.is_ascii_alphanumeric() || "-_".contains(c) { c } else { '_' };
    name.chars().map(kept).take(60).collect()
}
