//! Triangles with corners of their own become triangles that share corners.

use std::collections::HashMap;

use claymill_nurbs::Point3;
use claymill_nurbs::tolerance::LARGEST_COORDINATE_MM;

use super::error::MeshFault;

/// Collects triangles; corners at exactly one place become one.
#[derive(Debug)]
pub(super) struct Welder {
    mm_per_unit: f64,
    places: HashMap<[u64; 3], u32>,
    pub(super) vertices: Vec<Point3>,
    pub(super) triangles: Vec<[u32; 3]>,
    pub(super) without_area: usize,
}

impl Welder {
    pub(super) fn new(mm_per_unit: f64) -> Self {
        Welder {
            mm_per_unit,
            places: HashMap::new(),
            vertices: Vec::new(),
            triangles: Vec::new(),
            without_area: 0,
        }
    }

    /// Adds a triangle, file units; `place` names it where it cannot be.
    pub(super) fn add(&mut self, corners: [Point3; 3], place: impl Fn() -> String) -> Result<(), MeshFault> {
        let mut triangle = [0; 3];
        for (corner, out) in corners.iter().zip(&mut triangle) {
            // Adding zero makes -0 and 0 one place.
            let p = corner.map(|x| x * self.mm_per_unit + 0.0);
            if p.iter().any(|x| !x.is_finite() || x.abs() > LARGEST_COORDINATE_MM) {
                let what = "a coordinate is not a finite number, or absurdly large";
                return Err(MeshFault::wrong(place(), what));
            }
            let next = u32::try_from(self.vertices.len())
                .map_err(|_| MeshFault::Unsupported("a mesh of more than 4294967295 corners".into()))?;
            *out = *self.places.entry([p.x, p.y, p.z].map(f64::to_bits)).or_insert_with(|| {
                self.vertices.push(p);
                next
            });
        }
        let [a, b, c] = triangle.map(|i| self.vertices[i as usize]);
        if (b - a).cross(&(c - a)).norm() == 0.0 {
            self.without_area += 1;
        } else {
            self.triangles.push(triangle);
        }
        Ok(())
    }
}
