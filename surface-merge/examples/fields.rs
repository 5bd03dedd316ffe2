//! Meshes and harmonic fields of all regions of a model: counts, cracks and times.
//!
//! ```text
//! cargo run --release -p claymill-surface-merge --example fields -- MODEL [EDGE_MM]
//! ```

use std::time::{Duration, Instant};

use claymill_surface_merge::{MergeOptions, RegionMesh, merge};

fn main() {
    let mut arguments = std::env::args().skip(1);
    let path = arguments.next().expect("a model file");
    let edge_mm: f64 = arguments.next().map_or(8.0, |a| a.parse().expect("an edge length in mm"));
    let model = claymill_exchange::read(path.as_ref()).expect("a model").model;
    let merged = merge(&model, &MergeOptions::default()).expect("regions");
    let mut border_mm = vec![0.0; merged.regions.len()];
    let region = |face: usize| merged.region_of_face[face];
    for j in &merged.joints {
        let [a, b] = j.sides.map(|s| region(s.face));
        if a != b || (!j.verdict.is_merged() && j.outdone) {
            border_mm[a] += j.length_mm;
            border_mm[b] += j.length_mm;
        }
    }
    merged.naked.iter().for_each(|n| border_mm[region(n.stretch.face)] += n.length_mm);
    merged.laps.iter().for_each(|l| border_mm[region(l.stretch.face)] += l.length_mm);
    let (mut meshing, mut solving, mut tracing) = (Duration::ZERO, Duration::ZERO, Duration::ZERO);
    let (mut vertices, mut triangles) = (0, 0);
    for r in &merged.regions {
        let start = Instant::now();
        let mesh = match RegionMesh::of_region(&model, &merged, r.id, edge_mm) {
            Ok(mesh) => mesh,
            Err(e) => {
                println!("region {:>3}: {e}", r.id);
                continue;
            }
        };
        let meshed = start.elapsed();
        let guides = mesh.guides();
        let start = Instant::now();
        let field = mesh.harmonic(&guides.from, &guides.to);
        let solved = start.elapsed();
        let start = Instant::now();
        let lines =
            field.as_ref().map_or(0, |f| (1..20).map(|k| f.iso_line(f64::from(k) / 20.0).len()).sum());
        tracing += start.elapsed();
        let around: f64 = mesh.loops().iter().map(|l| l.length_mm).sum();
        println!(
            "region {:>3}: {:>5} faces {:>7} vertices {:>7} triangles, area {:.6}, border {:.6} of {:.1} mm, loops {} ({}), skipped {}, {:?} {} lines, {:.2} s + {:.2} s{}",
            r.id,
            r.faces.len(),
            mesh.vertices().len(),
            mesh.triangles().len(),
            mesh.area_mm2() / r.area_mm2,
            around / border_mm[r.id],
            border_mm[r.id],
            mesh.loops().len(),
            r.boundary_loops,
            mesh.skipped().len(),
            guides.kind,
            lines,
            meshed.as_secs_f64(),
            solved.as_secs_f64(),
            field.as_ref().err().map_or(String::new(), ToString::to_string),
        );
        meshing += meshed;
        solving += solved;
        vertices += mesh.vertices().len();
        triangles += mesh.triangles().len();
    }
    println!(
        "{} regions, {vertices} vertices, {triangles} triangles: meshes {:.2} s, fields {:.2} s, 19 lines each {:.2} s",
        merged.regions.len(),
        meshing.as_secs_f64(),
        solving.as_secs_f64(),
        tracing.as_secs_f64()
    );
}
