//! Places of a model's faces, each for an equal share of its face's area.
//!
//! Triangles of a face are gone through in their order, cut until none is larger than a sample's share. A sample is
//! taken from each piece in which the area gone through passes a multiple of the share: no grid that could miss a thin
//! face, and no random numbers. It lies on the exact surface, inside of the trims as far as triangles tell.

use claymill_contact::Covering;
use claymill_nurbs::{FaceId, Model, Point2, Point3, Vector3};
use rayon::prelude::*;

use crate::part::Part;

/// Samples of a whole model at most, about.
pub const MOST_SAMPLES: f64 = 40_000.0;
/// And at least, so that small parts are known as well.
const FEWEST_SAMPLES: f64 = 4_000.0;
/// A piece of a triangle is cut this often along each side, at most.
const MOST_CUTS: u32 = 256;
/// Samples stand for squares of so many tool radii.
const SIDE_RADII: f64 = 2.0;

/// A place of the surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sample {
    /// The face.
    pub face: FaceId,
    /// Surface parameters.
    pub uv: Point2,
    /// Where it is, mm.
    pub point: Point3,
    /// Unit normal along `Su × Sv`.
    pub normal: Vector3,
    /// Area that it stands for, mm².
    pub area_mm2: f64,
}

/// Side of the square that a sample stands for, mm, where a tool of this radius cuts a model of this area.
#[must_use]
pub fn spacing_mm(area_mm2: f64, radius_mm: f64) -> f64 {
    let [finest, coarsest] = [MOST_SAMPLES, FEWEST_SAMPLES].map(|count| (area_mm2 / count).sqrt());
    (SIDE_RADII * radius_mm).clamp(finest, coarsest)
}

/// Samples of all faces that count, one for each square of `spacing_mm`, and one of each face at least.
#[must_use]
pub fn samples(part: &Part, covering: &Covering, spacing_mm: f64) -> Vec<Sample> {
    let of_face = |face: FaceId| {
        if part.excluded.get(face).copied().unwrap_or(false) {
            return Vec::new();
        }
        let places = of_face(part.model, covering, face, spacing_mm);
        let area_mm2 = part.face_area_mm2.get(face).copied().unwrap_or(0.0) / places.len().max(1) as f64;
        places.into_iter().map(|sample| Sample { area_mm2, ..sample }).collect()
    };
    let all: Vec<Vec<Sample>> = (0..part.model.faces.len()).into_par_iter().map(of_face).collect();
    all.into_iter().flatten().filter(|s| s.area_mm2 > 0.0).collect()
}

fn of_face(model: &Model, covering: &Covering, face: FaceId, spacing_mm: f64) -> Vec<Sample> {
    let mesh = &covering.meshes()[face];
    let share_mm2 = spacing_mm * spacing_mm;
    let surface = &model.faces[face].surface;
    let at = |uv: Point2| {
        let (normal, _) = surface.normal(uv.x, uv.y)?;
        let point = surface.point(uv.x, uv.y);
        let is_finite = point.iter().chain(normal.iter()).all(|c| c.is_finite());
        is_finite.then_some(Sample { face, uv, point, normal, area_mm2: 0.0 })
    };
    let mut samples = Vec::new();
    // The first one comes after half a share, or with the largest piece.
    let (mut gone_mm2, mut next_mm2) = (0.0, 0.5 * share_mm2);
    let mut largest: Option<(f64, Point2)> = None;
    for (triangle, area_mm2) in mesh.triangles.iter().zip(covering.areas_mm2(face)) {
        let uv = triangle.map(|i| mesh.uv[i as usize]);
        if !area_mm2.is_finite() || area_mm2 <= 0.0 {
            continue;
        }
        let cuts = ((area_mm2 / share_mm2).sqrt().ceil() as u32).clamp(1, MOST_CUTS);
        let piece_mm2 = area_mm2 / f64::from(cuts * cuts);
        for middle in middles(&uv, cuts) {
            if largest.is_none_or(|(most, _)| piece_mm2 > most) {
                largest = Some((piece_mm2, middle));
            }
            gone_mm2 += piece_mm2;
            if gone_mm2 >= next_mm2 {
                next_mm2 = gone_mm2.max(next_mm2 + share_mm2);
                samples.extend(at(middle));
            }
        }
    }
    if samples.is_empty() {
        samples.extend(largest.and_then(|(_, middle)| at(middle)));
    }
    samples
}

/// Middles of the pieces of a triangle that is cut `cuts` times along each side.
fn middles(corners: &[Point2; 3], cuts: u32) -> impl Iterator<Item = Point2> {
    let [a, b, c] = *corners;
    let third = 1.0 / 3.0;
    let at = move |i: f64, j: f64| a + ((b - a) * i + (c - a) * j) / f64::from(cuts);
    (0..cuts).flat_map(move |i| {
        let row = cuts - i;
        (0..row).flat_map(move |j| {
            let (x, y) = (f64::from(i), f64::from(j));
            let upright = Some(at(x + third, y + third));
            let turned = (j + 1 < row).then(|| at(x + 2.0 * third, y + 2.0 * third));
            [upright, turned].into_iter().flatten()
        })
    })
}
