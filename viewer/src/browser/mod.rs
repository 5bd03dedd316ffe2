//! A job as a glTF file for browsers: small enough to travel inside the report, coarse enough to turn.
//!
//! ```text
//!   faces ──► triangles, coarser the larger the model ──► a node a region (cut, not cut), crest height a vertex
//!   moves ──► where the ball touches the triangles ──► thinned out to a tolerance ──► a node for each kind,
//!             setup, region and level: coarse levels alone when seen from far, all when near
//! ```

mod glb;
mod simplify;
pub(crate) mod way;

use std::collections::BTreeMap;

use claymill_nurbs::{FaceMesh, MeshOptions, Model, Point3, tessellate};
use claymill_toolpath::{FreeSide, Job, MoveKind, Program, Request};
use rayon::prelude::*;
use serde_json::json;

use crate::borders::{BorderKind, classify_borders};
use crate::camera::Axes;
use crate::heat::{HeatScale, HighestNear};
use crate::model_view::{Colouring, ModelView};
use crate::palette::{NOT_CUT, Rgb, stroke_shade};
use crate::scene::{Scene, face_vertices};
use crate::shapes::LineLayer;
use crate::strokes::{StrokeStyle, consecutive_passes, drawn_moves, kind_colour};
use crate::thinning::evenly_spaced;
use crate::{ViewError, region_colours};
use glb::{Cube, Glb, Triangles};
use simplify::simplified;

/// Triangles that browsers get at most, about.
const MOST_TRIANGLES: usize = 500_000;
/// Vertices of tool paths that browsers get at most, about.
const MOST_PATH_POINTS: usize = 1_500_000;
/// The finest triangles and lines, mm: a pixel of a whole vehicle is larger.
const DEVIATION_MM: f64 = 0.3;
const EDGE_MM: f64 = 12.0;
const CHORD_MM: f64 = 0.15;
/// Passes of level k + 1 are drawn when passes of level k would stand too close; distance in step-overs.
const LEVELS_STEPS: [f32; 2] = [3.5, 9.0];
/// A pass belongs to a level when it has this share of its length there.
const LEVEL_SHARE: f32 = 0.6;
/// Crest heights are written in hundredths of the height asked for; this stands for no crest.
pub(crate) const NO_CREST: u8 = 255;

/// What goes into the file.
#[derive(Debug, Clone, Copy)]
pub struct BrowserInput<'a> {
    /// The model.
    pub model: &'a Model,
    /// Region of each face.
    pub region_of_face: &'a [usize],
    /// Which faces are cut; `None`: all.
    pub cut: Option<&'a [bool]>,
    /// Distance within which edges of two faces count as one joint, mm.
    pub joint_tolerance_mm: f64,
    /// The vehicle's axes.
    pub axes: Axes,
    /// The job: tools, height asked for, area.
    pub job: &'a Job,
    /// Its moves.
    pub program: &'a Program,
    /// Scallop crests as measured: foot on the surface and height, mm.
    pub crests: &'a [(Point3, f64)],
}

/// The job as binary glTF 2.0 with `KHR_mesh_quantization`, in metres with x to the vehicle's left, y up and z to its
/// front. The nodes' `extras` say what each is: `kind` (`region`, `border`, `cut`, `link`, `lead`, `rapid`) and, where
/// it applies, `region`, `cut`, `one_sided` (the backs of triangles are the side of the material), `setup`, `level` and `faces`
/// (pairs of first triangle and face). Vertices of regions have the attribute `_SCALLOP`: the crest height there in hundredths of what was asked, 255 for none.
///
/// # Errors
/// The lists do not have one entry a face.
pub fn browser_glb(input: &BrowserInput<'_>) -> Result<Vec<u8>, ViewError> {
    let meshes = meshes(input);
    let view = ModelView {
        model: input.model,
        meshes: &meshes,
        region_of_face: input.region_of_face,
        cut: input.cut,
        joint_tolerance_mm: input.joint_tolerance_mm,
        free_sides: None,
    };
    let scene = Scene::of_model(&view, Colouring::Region)?;
    let colours = region_colours(&view);
    let (lines, tolerance_mm) = path_lines(input, &scene, &colours);
    let surface_points = scene.surfaces.iter().flat_map(|s| s.vertices.iter().map(|v| &v.position));
    let path_points = lines.iter().flat_map(|l| l.points.iter());
    let mut glb = Glb::new(Cube::around(surface_points.chain(path_points)));
    add_regions(&mut glb, &view, &scene, &colours, input);
    add_borders(&mut glb, &view, &scene);
    add_paths(&mut glb, &lines, &colours);
    let Axes { up, forward } = input.axes;
    let left = up.cross(&forward);
    let lift_mm = scene.deviation_mm + f64::from(tolerance_mm);
    Ok(glb.bytes([left, up, forward].map(Into::into), scene.origin.into(), lift_mm))
}

/// Triangles fine enough for a map of heights on what is cut, and as coarse as it takes for the model to stay small.
fn meshes(input: &BrowserInput<'_>) -> Vec<FaceMesh> {
    let cut = |f: usize| input.cut.is_none_or(|cut| cut.get(f).copied().unwrap_or(true));
    let even_mm = (2.0 * input.job.area.cut_mm2 / (0.5 * MOST_TRIANGLES as f64)).sqrt();
    let mut longest_mm = even_mm.max(EDGE_MM);
    let mut deviation_mm = DEVIATION_MM;
    loop {
        let fine = MeshOptions { deviation_mm, longest_edge_mm: longest_mm };
        let coarse = MeshOptions { deviation_mm: 2.0 * deviation_mm, longest_edge_mm: 10.0 * longest_mm };
        let mesh = |(f, face)| tessellate(face, if cut(f) { &fine } else { &coarse }).unwrap_or_default();
        let meshes: Vec<FaceMesh> = input.model.faces.par_iter().enumerate().map(mesh).collect();
        // A face is two triangles at least: with very many of them there is an end to coarseness.
        let triangles: usize = meshes.iter().map(|m| m.triangles.len()).sum();
        if triangles <= MOST_TRIANGLES.max(8 * meshes.len()) || deviation_mm > 50.0 {
            return meshes;
        }
        (longest_mm, deviation_mm) = (1.6 * longest_mm, 2.0 * deviation_mm);
    }
}

fn add_regions(
    glb: &mut Glb,
    view: &ModelView<'_>,
    scene: &Scene,
    colours: &[Rgb],
    input: &BrowserInput<'_>,
) {
    let asked_mm = input.job.request.scallop_mm;
    let heights = HighestNear::new(input.crests, &HeatScale::of_request(&input.job.request));
    let hundredths = |p: &[f32; 3]| {
        let found = heights.at(&(Point3::from(p.map(f64::from)) + scene.origin.coords));
        found.map_or(NO_CREST, |h| (100.0 * h / asked_mm).round().clamp(0.0, f64::from(NO_CREST - 1)) as u8)
    };
    let is_cut = |f: usize| view.cut.is_none_or(|cut| cut[f]);
    let free_side = |f: usize| input.job.faces.get(f).map_or(FreeSide::Both, |account| account.free_side);
    // Fronts of triangles are the free side, where there is one.
    let is_turned = |f: usize| match free_side(f) {
        FreeSide::Both => view.model.faces[f].reversed,
        side => side == FreeSide::Against,
    };
    let mut faces_of: BTreeMap<(usize, bool, bool), Vec<usize>> = BTreeMap::new();
    for f in (0..view.meshes.len()).filter(|&f| !view.meshes[f].triangles.is_empty()) {
        let one_sided = !free_side(f).is_both();
        faces_of.entry((view.region_of_face[f], is_cut(f), one_sided)).or_default().push(f);
    }
    let built: Vec<(Triangles, Vec<[usize; 2]>)> = faces_of
        .par_iter()
        .map(|(&(_, cut, _), faces)| {
            let (mut mesh, mut firsts) = (Triangles::default(), Vec::new());
            for &f in faces {
                let first = mesh.points.len() as u32;
                firsts.push([mesh.corners.len(), f]);
                let turned = is_turned(f);
                for v in face_vertices(view, f, NOT_CUT, &scene.origin) {
                    mesh.points.push(v.position);
                    mesh.normals.push(if turned { v.normal.map(|c| -c) } else { v.normal });
                    mesh.heights.push(if cut { hundredths(&v.position) } else { NO_CREST });
                }
                mesh.corners.extend(view.meshes[f].triangles.iter().map(|t| {
                    let [a, b, c] = t.map(|i| first + i);
                    if turned { [a, c, b] } else { [a, b, c] }
                }));
            }
            (mesh, firsts)
        })
        .collect();
    let grey = glb.material(NOT_CUT, true);
    for (&(region, cut, one_sided), (mesh, faces)) in faces_of.keys().zip(&built) {
        let material = if cut { glb.material(colours[region], true) } else { grey };
        let name = format!("region {region}{}", if cut { "" } else { ", not cut" });
        let mut extras = json!({ "kind": "region", "region": region, "cut": cut, "faces": faces });
        if one_sided {
            extras["one_sided"] = true.into();
        }
        glb.triangles(&name, material, mesh, extras);
    }
}

/// Outlines of regions, and borders between the patches inside.
fn add_borders(glb: &mut Glb, view: &ModelView<'_>, scene: &Scene) {
    let borders = classify_borders(view);
    for (kind, name, colour) in
        [(BorderKind::Region, "outlines", [28, 28, 34]), (BorderKind::Patch, "patches", [90, 90, 96])]
    {
        let relative = |p: &Point3| (p - scene.origin).map(|c| c as f32).into();
        let lines: Vec<Vec<[f32; 3]>> = (borders.iter().filter(|b| b.kind == kind))
            .map(|b| simplified(&b.points.iter().map(relative).collect::<Vec<_>>(), CHORD_MM as f32))
            .collect();
        let slices: Vec<&[[f32; 3]]> = lines.iter().map(Vec::as_slice).collect();
        let material = glb.material(colour, false);
        glb.lines(name, material, &slices, json!({ "kind": name }));
    }
}

/// A polyline of the tool paths, relative to the scene's origin.
struct PathLine {
    kind: MoveKind,
    setup: String,
    region: usize,
    /// 0 for what is drawn only from near.
    level: usize,
    points: Vec<[f32; 3]>,
}

/// The paths, and how far they leave what they stand for, mm.
fn path_lines(input: &BrowserInput<'_>, scene: &Scene, colours: &[Rgb]) -> (Vec<PathLine>, f32) {
    let style =
        StrokeStyle { region_colours: Some(colours), tools: &input.job.tools, ..StrokeStyle::new(CHORD_MM) };
    let drawn = drawn_moves(scene, input.program, &style);
    let numbers = consecutive_passes(&input.program.moves);
    let relative = |p: &Point3| -> [f32; 3] { (p - scene.origin).map(|c| c as f32).into() };
    let mut layer = LineLayer::default();
    let mut lines = Vec::new();
    for ((m, parts), &pass) in input.program.moves.iter().zip(&drawn).zip(&numbers) {
        for part in parts.iter().flatten().filter(|part| part.len() > 1) {
            lines.push(PathLine {
                kind: if m.kind == MoveKind::LeadOut { MoveKind::LeadIn } else { m.kind },
                setup: m.setup.clone(),
                region: m.region,
                level: 0,
                points: part.iter().map(relative).collect(),
            });
            // Every line, so that its strip has the same index.
            layer.add(part.iter(), &scene.origin, [0; 3], pass);
        }
    }
    drop(drawn);
    sort_into_levels(&mut lines, &layer, step_over_mm(&input.job.request));
    let mut tolerance_mm = CHORD_MM as f32;
    loop {
        lines.par_iter_mut().for_each(|l| l.points = simplified(&l.points, tolerance_mm));
        if lines.iter().map(|l| l.points.len()).sum::<usize>() <= MOST_PATH_POINTS.max(4 * lines.len()) {
            return (lines, tolerance_mm);
        }
        tolerance_mm *= 2.0;
    }
}

/// Distance of passes on a plane: the chord of the ball at the scallop height, mm.
pub(crate) fn step_over_mm(request: &Request) -> f64 {
    let (r, h) = (request.tool.radius_mm(), request.scallop_mm);
    2.0 * (2.0 * r * h - h * h).max(0.0).sqrt()
}

/// Cuts and links that keep a wide distance among each other get a high level.
fn sort_into_levels(lines: &mut [PathLine], layer: &LineLayer, step_over_mm: f64) {
    let thinnable = |l: &PathLine| matches!(l.kind, MoveKind::Cut | MoveKind::Link);
    let shown: Vec<usize> = (0..lines.len()).filter(|&i| thinnable(&lines[i])).collect();
    let rows = LineLayer {
        strips: shown.iter().map(|&i| layer.strips[i]).collect(),
        points: layer.points.clone(),
        ..LineLayer::default()
    };
    for (level, steps) in LEVELS_STEPS.iter().enumerate() {
        let thinned = evenly_spaced(&rows, steps * step_over_mm as f32, |_, _| true);
        let mut kept_mm = vec![0.0; shown.len()];
        for run in &thinned.runs {
            kept_mm[run.strip] += length_mm(&run.points);
        }
        for (&i, kept) in shown.iter().zip(kept_mm) {
            if kept > 0.0 && kept >= LEVEL_SHARE * length_mm(&lines[i].points) {
                lines[i].level = level + 1;
            }
        }
    }
}

fn length_mm(points: &[[f32; 3]]) -> f32 {
    let step = |ab: &[[f32; 3]]| (0..3).map(|i| (ab[1][i] - ab[0][i]).powi(2)).sum::<f32>().sqrt();
    points.windows(2).map(step).sum()
}

fn add_paths(glb: &mut Glb, lines: &[PathLine], colours: &[Rgb]) {
    /// Kind, setup, region, level.
    type Key<'a> = (MoveKind, &'a str, usize, usize);
    let mut groups: BTreeMap<Key<'_>, Vec<&[[f32; 3]]>> = BTreeMap::new();
    for l in lines {
        // Only cuts have their region's colour.
        let region = if l.kind == MoveKind::Cut { l.region } else { 0 };
        groups.entry((l.kind, &l.setup, region, l.level)).or_default().push(&l.points);
    }
    let mut materials: BTreeMap<Rgb, usize> = BTreeMap::new();
    for ((kind, setup, region, level), lines) in groups {
        let (name, colour) = match kind {
            MoveKind::Cut => ("cut", colours.get(region).map_or([60, 60, 64], |&c| stroke_shade(c))),
            MoveKind::Link => ("link", kind_colour(kind)),
            MoveKind::LeadIn | MoveKind::LeadOut => ("lead", kind_colour(kind)),
            MoveKind::Rapid => ("rapid", kind_colour(kind)),
        };
        let material = *materials.entry(colour).or_insert_with(|| glb.material(colour, false));
        let mut extras = json!({ "kind": name, "setup": setup, "level": level });
        if kind == MoveKind::Cut {
            extras["region"] = json!(region);
        }
        glb.lines(&format!("{setup} {name}"), material, &lines, extras);
    }
}
