//! What merging found, drawn over the model: joints by class or by what is worst on them, iso-lines of the fields.

use claymill_nurbs::{Model, Point3};
use claymill_surface_merge::{
    Continuity, CurvatureLimit, Joint, Limits, Merge, MergeOptions, Polyline, RegionMesh,
};
use claymill_viewer::{LegendEntry, LineLayer, Mark, Rgb, Scene};
use rayon::prelude::*;

use crate::args::ShowName;

const LINE_PX: f32 = 2.2;
const C0: Rgb = [200, 40, 40];
const G1: Rgb = [230, 150, 30];
const G2: Rgb = [40, 130, 90];
const NAKED: Rgb = [30, 30, 36];
const GAP: Rgb = [130, 50, 160];
const ANGLE: Rgb = C0;
const CURVATURE: Rgb = G1;
const WITHIN: Rgb = [150, 170, 160];
/// Iso-lines take these in turns.
const TURNS: [Rgb; 2] = [[24, 60, 110], [235, 240, 248]];
/// Mean distance of the iso-lines drawn, as a part of the model's diagonal.
const ISO_STEP: f64 = 0.006;
/// A region's mesh has about this many triangle edges across it.
const EDGES_ACROSS: f64 = 120.0;

/// Draws everything that `show` names and that comes from the joints or the regions' fields.
pub(crate) fn draw(
    scene: &mut Scene,
    model: &Model,
    merged: &Merge,
    options: &MergeOptions,
    show: &[ShowName],
) {
    for what in show {
        match what {
            ShowName::Classes => add_classes(scene, merged),
            ShowName::Worst => add_worst(scene, merged, options),
            ShowName::IsoLines => add_iso_lines(scene, model, merged),
            _ => {}
        }
    }
}

/// How to read the stripes of `--zebra`.
pub(crate) fn explain_zebra(scene: &mut Scene) {
    for text in ["stripes broken: normals jump (C0)", "stripes kinked: curvature jumps (G1)"] {
        scene.legend.push(LegendEntry { mark: Mark::Area, colour: [20, 20, 24], text: text.to_owned() });
    }
}

fn add_classes(scene: &mut Scene, merged: &Merge) {
    let classes = [(Continuity::G2, G2, "G2"), (Continuity::G1, G1, "G1"), (Continuity::C0, C0, "C0")];
    for (class, colour, name) in classes {
        let of_class = || merged.joints.iter().filter(|j| j.continuity == class);
        let metres: f64 = of_class().map(|j| j.length_mm).sum::<f64>() / 1000.0;
        let lines: Vec<Vec<Point3>> = of_class().map(course).collect();
        add_layer(scene, &lines, colour, LINE_PX);
        let text = format!("{name}: {} joints, {metres:.1} m", lines.len());
        scene.legend.push(LegendEntry { mark: Mark::Line(LINE_PX), colour, text });
    }
    let lines: Vec<Vec<Point3>> = merged.naked.iter().map(|n| n.ends.to_vec()).collect();
    add_layer(scene, &lines, NAKED, LINE_PX);
    let metres: f64 = merged.naked.iter().map(|n| n.length_mm).sum::<f64>() / 1000.0;
    let text = format!("no neighbour: {metres:.1} m");
    scene.legend.push(LegendEntry { mark: Mark::Line(LINE_PX), colour: NAKED, text });
}

/// The measure that exceeds its limit by the largest factor decides the colour, the factor the width.
fn add_worst(scene: &mut Scene, merged: &Merge, options: &MergeOptions) {
    let kinds = [(WITHIN, "within all limits"), (CURVATURE, "curvature"), (ANGLE, "angle"), (GAP, "gap")];
    for (kind, (colour, name)) in kinds.into_iter().enumerate() {
        let mut count = 0;
        for (steps, from, to) in [(1.0, 0.0, 3.0), (1.7, 3.0, 10.0), (2.4, 10.0, f64::INFINITY)] {
            let lines: Vec<Vec<Point3>> = merged
                .joints
                .iter()
                .filter(|j| {
                    let (worst, factor) = worst(j, &options.low, options);
                    worst == kind && (from..to).contains(&factor)
                })
                .map(course)
                .collect();
            count += lines.len();
            add_layer(scene, &lines, colour, if kind == 0 { 1.2 } else { 1.8 * steps });
        }
        let text = format!("{name}: {count} joints");
        scene.legend.push(LegendEntry { mark: Mark::Line(LINE_PX), colour, text });
    }
    let text = "wide: 3 and 10 times the limit".to_owned();
    scene.legend.push(LegendEntry { mark: Mark::Line(4.3), colour: [90, 90, 96], text });
}

/// Which measure of a joint is worst against its limit, and how many times the limit it is: 0 for none, 1 for
/// curvature, 2 for the angle, 3 for the gap.
fn worst(joint: &Joint, limits: &Limits, options: &MergeOptions) -> (usize, f64) {
    let curvature = match limits.curvature {
        CurvatureLimit::Any => joint.curvature_machining.max / options.crossing,
        CurvatureLimit::Machining(limit) => joint.curvature_machining.max / limit,
        CurvatureLimit::Relative(limit) => joint.curvature_relative.max / limit,
    };
    let angle = joint.angle_deg.max / limits.angle_deg;
    let normal = joint.gap_normal_mm.max / limits.gap_normal_mm;
    let gap = normal.max(joint.gap_lateral_mm.max / limits.gap_lateral_mm);
    let factors = [(1, curvature), (2, angle), (3, gap)];
    let worst = factors.into_iter().fold((0, 0.0), |w, f| if f.1 > w.1 { f } else { w });
    if worst.1 > 1.0 { worst } else { (0, worst.1) }
}

fn course(joint: &Joint) -> Vec<Point3> {
    let ends = joint.ends[0];
    std::iter::once(ends[0]).chain(joint.samples.iter().map(|s| s.point)).chain([ends[1]]).collect()
}

/// The harmonic field between the guides of every region, as lines in two colours by turns.
fn add_iso_lines(scene: &mut Scene, model: &Model, merged: &Merge) {
    let bounds = merged.regions.iter().fold(claymill_nurbs::Aabb::empty(), |b, r| b.union(&r.bounds));
    let step_mm = ISO_STEP * bounds.diagonal();
    let lines: Vec<Vec<Polyline>> = merged
        .regions
        .par_iter()
        .map(|region| {
            let edge_mm = (region.area_mm2.sqrt() / EDGES_ACROSS).clamp(0.5, 0.5 * step_mm);
            let Ok(mesh) = RegionMesh::of_region(model, merged, region.id, edge_mm) else {
                return Vec::new();
            };
            let guides = mesh.guides();
            let Ok(field) = mesh.harmonic(&guides.from, &guides.to) else { return Vec::new() };
            let mut steep: Vec<f64> = field.gradients().iter().map(|g| g.norm()).collect();
            steep.sort_by(f64::total_cmp);
            let count = (1.0 / (steep[steep.len() / 2] * step_mm)).round().clamp(3.0, 400.0) as usize;
            (1..count).map(|k| field.iso_line(k as f64 / count as f64).into_iter().collect()).collect()
        })
        .map(|levels: Vec<Vec<Polyline>>| {
            let mut turns = vec![Vec::new(), Vec::new()];
            levels.into_iter().enumerate().for_each(|(k, lines)| turns[k % 2].extend(lines));
            turns
        })
        .reduce(
            || vec![Vec::new(), Vec::new()],
            |mut a, b| {
                a.iter_mut().zip(b).for_each(|(a, b)| a.extend(b));
                a
            },
        );
    for (k, (lines, colour)) in lines.iter().zip(TURNS).enumerate() {
        let points = |line: &Polyline| -> Vec<Point3> {
            let first = line.points.first().filter(|_| line.closed);
            line.points.iter().chain(first).map(|p| p.at.point).collect()
        };
        add_layer(scene, &lines.iter().map(points).collect::<Vec<_>>(), colour, 1.6);
        let text = ["iso-lines of the harmonic", "field, by turns"][k].to_owned();
        scene.legend.push(LegendEntry { mark: Mark::Line(LINE_PX), colour, text });
    }
}

fn add_layer(scene: &mut Scene, lines: &[Vec<Point3>], colour: Rgb, width_px: f32) {
    let mut layer = LineLayer { width_px, opacity: 1.0, ..LineLayer::default() };
    for (k, line) in lines.iter().enumerate() {
        layer.add(line.iter(), &scene.origin, colour, k as u32);
    }
    scene.lines.push(layer);
}
