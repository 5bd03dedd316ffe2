//! A region laid out in the plane, with angles kept as well as can be.

use super::connectivity::NONE;
use super::intrinsic::Intrinsic;
use super::sparse::System;
use super::{FieldError, RegionMesh};

/// Cells across the layout in which triangles that lie on each other are looked for.
const CELLS: f64 = 512.0;
/// Parts of the area that may be turned over, and of the cells that may be covered twice: around single bad triangles.
const TURNED: f64 = 1e-5;
const OVERLAPPING: f64 = 1e-3;

impl RegionMesh<'_> {
    /// A place in the plane for each vertex: least-squares conformal maps (Lévy, Petitjean, Ray and Maillot 2002),
    /// that is the least of Dirichlet's energy less the area, with two vertices far apart held at their distance.
    /// NaN in parts that do not hang together with these two.
    pub(super) fn flattened(&self) -> Result<Vec<[f64; 2]>, FieldError> {
        let count = self.vertices.len();
        let lengths = self.triangles.iter();
        let lengths = lengths.map(|t| std::array::from_fn(|k| self.distance_mm(t[k], t[(k + 1) % 3])));
        let intrinsic = Intrinsic::new(&self.triangles, &self.twins, lengths.collect());
        let weights = intrinsic.weights();
        let mut diagonal = vec![0.0; 2 * count];
        let mut couplings = Vec::with_capacity(2 * weights.len());
        let y = |i: u32| i + count as u32;
        for &(i, j, w) in &weights {
            for (i, j) in [(i, j), (y(i), y(j))] {
                diagonal[i as usize] += w;
                diagonal[j as usize] += w;
                couplings.push((i, j, w));
            }
        }
        // The area is a sum over the border.
        for side in (0..self.twins.len()).filter(|&s| self.twins[s] == NONE) {
            let (a, b) = (self.triangles[side / 3][side % 3], self.triangles[side / 3][(side + 1) % 3]);
            couplings.extend([(a, y(b), 0.5), (b, y(a), -0.5)]);
        }
        let (a, b) = self.far_apart();
        let mut fixed = vec![None; 2 * count];
        for (vertex, x) in [(a, 0.0), (b, self.distance_mm(a, b))] {
            fixed[vertex as usize] = Some(x);
            fixed[y(vertex) as usize] = Some(0.0);
        }
        let places = System::new(&diagonal, &couplings, &fixed)?.solve(|_| 0.0);
        Ok((0..count).map(|i| [places[i], places[count + i]]).collect())
    }

    /// Two vertices of the border far from each other.
    fn far_apart(&self) -> (u32, u32) {
        let border = self.loops.iter().flat_map(|l| l.vertices.iter().copied());
        let farthest = |from: u32| {
            border.clone().fold(from, |far, v| {
                if self.distance_mm(v, from) > self.distance_mm(far, from) { v } else { far }
            })
        };
        let a = farthest(self.loops.first().map_or(0, |l| l.vertices[0]));
        (a, farthest(a))
    }

    /// Whether a layout turns triangles over, or lays them on each other, on more than a trace of its area.
    pub(super) fn is_folded(&self, places: &[[f64; 2]]) -> bool {
        let corners = |t: &[u32; 3]| t.map(|v| places[v as usize]);
        let areas = || self.triangles.iter().map(|t| twice_area(corners(t)));
        let turned: f64 = areas().map(|a| (-a).max(0.0)).sum();
        if turned > TURNED * areas().map(f64::abs).sum::<f64>() {
            return true;
        }
        let (low, high) = extent(places);
        let cell = (high[0] - low[0]).max(high[1] - low[1]) / CELLS;
        let columns = CELLS as usize + 1;
        let mut taken = vec![0u32; columns * columns];
        for t in &self.triangles {
            let c = corners(t).map(|p| [(p[0] - low[0]) / cell, (p[1] - low[1]) / cell]);
            let area = twice_area(c);
            let span = |k: usize| {
                let low = c.iter().fold(f64::INFINITY, |m, p| m.min(p[k]));
                let high = c.iter().fold(f64::NEG_INFINITY, |m, p| m.max(p[k]));
                (low - 0.5).ceil().max(0.0) as usize..((high + 0.5).floor().max(0.0) as usize).min(columns)
            };
            for i in span(0) {
                for j in span(1) {
                    let at = [i as f64 + 0.5, j as f64 + 0.5];
                    // Places on a common side count for neither.
                    let inside = (0..3).all(|k| twice_area([at, c[k], c[(k + 1) % 3]]) > 1e-6 * area);
                    taken[i * columns + j] += u32::from(inside && area > 0.0);
                }
            }
        }
        let cells = |least: u32| taken.iter().filter(|n| **n >= least).count() as f64;
        cells(2) > OVERLAPPING * cells(1)
    }
}

/// Twice the signed area of a triangle.
pub(super) fn twice_area([a, b, c]: [[f64; 2]; 3]) -> f64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

/// Lowest and highest coordinates.
pub(super) fn extent(places: &[[f64; 2]]) -> ([f64; 2], [f64; 2]) {
    places.iter().fold(([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]), |(low, high), p| {
        (std::array::from_fn(|k| low[k].min(p[k])), std::array::from_fn(|k| high[k].max(p[k])))
    })
}
