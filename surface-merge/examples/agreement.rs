//! How far two models of one thing have the same regions, by area.
//!
//! ```text
//! cargo run --release -p claymill-surface-merge --example agreement -- MODEL OTHER
//! ```
//!
//! Every triangle of MODEL votes with its area for the region of OTHER that its middle lies on. A region of MODEL
//! counts as far as its largest partner also has it as its largest partner. Printed is the share of MODEL's area
//! that lies on OTHER, the share of that which agrees, and what does not. Fails when less than 99 % agrees.

use std::collections::BTreeMap;

use claymill_nurbs::{ClosestPoints, MeshOptions, Point3, tessellate};
use claymill_surface_merge::{MergeOptions, merge};
use rayon::prelude::*;

/// Farther away than this is another part of the vehicle, mm.
const SAME_MM: f64 = 1.0;
const MESH: MeshOptions = MeshOptions { deviation_mm: 0.2, longest_edge_mm: 25.0 };

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let files: Vec<String> = std::env::args().skip(1).collect();
    let [file, other] = &files[..] else { return Err("name two models".into()) };
    let model = claymill_exchange::read(file.as_ref())?.model;
    let other = claymill_exchange::read(other.as_ref())?.model;
    let merged = [merge(&model, &MergeOptions::default())?, merge(&other, &MergeOptions::default())?];
    let closest = ClosestPoints::new(&other);
    let votes: Vec<(usize, Option<usize>, f64)> = (0..model.faces.len())
        .into_par_iter()
        .flat_map_iter(|face| {
            let mesh = tessellate(&model.faces[face], &MESH).unwrap_or_default();
            let (closest, merged) = (&closest, &merged);
            mesh.triangles
                .clone()
                .into_iter()
                .map(move |t| {
                    let [a, b, c] = t.map(|i| mesh.points[i as usize]);
                    let middle = Point3::from((a.coords + b.coords + c.coords) / 3.0);
                    let foot = closest.closest(&middle, SAME_MM);
                    let there = foot.map(|f| merged[1].region_of_face[f.face]);
                    (merged[0].region_of_face[face], there, 0.5 * (b - a).cross(&(c - a)).norm())
                })
                .collect::<Vec<_>>()
        })
        .collect();
    let mut overlap: BTreeMap<(usize, usize), f64> = BTreeMap::new();
    let mut total = 0.0;
    for (here, there, area) in votes {
        total += area;
        if let Some(there) = there {
            *overlap.entry((here, there)).or_default() += area;
        }
    }
    let best = |of: usize, side: usize| {
        let mine = overlap.iter().filter(|(k, _)| [k.0, k.1][side] == of);
        let best = mine.fold((usize::MAX, 0.0), |b, (k, &a)| if a > b.1 { ([k.1, k.0][side], a) } else { b });
        best.0
    };
    let shared: f64 = overlap.values().sum();
    let agreed: f64 =
        overlap.iter().filter(|((a, b), _)| best(*a, 0) == *b && best(*b, 1) == *a).map(|(_, v)| v).sum();
    println!(
        "{} regions against {}: {:.4} % of the area is common, {:.4} % of it agrees",
        merged[0].regions.len(),
        merged[1].regions.len(),
        100.0 * shared / total,
        100.0 * agreed / shared
    );
    for ((a, b), area) in &overlap {
        if best(*a, 0) != *b || best(*b, 1) != *a {
            let faces = [merged[0].regions[*a].faces.len(), merged[1].regions[*b].faces.len()];
            let areas = [merged[0].regions[*a].area_mm2, merged[1].regions[*b].area_mm2];
            let centre = merged[0].regions[*a].bounds.centre();
            println!(
                "  {area:9.1} mm² of region {a} ({} faces, {:.0} mm², at {:.0} {:.0} {:.0}) lie on region {b} ({} faces, {:.0} mm²)",
                faces[0], areas[0], centre.x, centre.y, centre.z, faces[1], areas[1]
            );
        }
    }
    if agreed < 0.99 * shared { Err("less than 99 % agrees".into()) } else { Ok(()) }
}
