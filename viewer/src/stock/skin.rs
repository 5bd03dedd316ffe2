//! The surface of what is still to go: large squares where they lie on it well enough, cells elsewhere.

use claymill_nurbs::Vector3;
use rayon::prelude::*;

use super::TO_GO;
use super::grid::{Grid, LEFT};
use super::heights::Heights;
use crate::scene::Scene;
use crate::shapes::SurfaceVertex;

/// Side of the largest square, cells.
const SQUARE: usize = 16;
/// How far a square may be from the material, as a part of the allowance.
const BOW: f32 = 0.05;

struct Material<'a> {
    grid: &'a Grid,
    heights: Vec<f32>,
    allowance: f32,
    /// Higher steps than these are the model's own, mm.
    step_mm: f32,
}

/// Adds a surface over the cells that are not cut yet, down to their neighbours.
pub(super) fn add_skin(scene: &mut Scene, grid: &Grid, heights: &Heights, allowance_mm: f64) {
    let allowance = allowance_mm as f32;
    let step_mm = 4.0 * grid.camera.mm_per_px() as f32 + 2.0 * allowance;
    let material = Material { grid, heights: heights.rows(), allowance, step_mm };
    let [width, height] = grid.size;
    let bands: Vec<Vec<[usize; 3]>> = (0..height.saturating_sub(1).div_ceil(SQUARE))
        .into_par_iter()
        .map(|band| {
            let mut triangles = Vec::new();
            for x in (0..width.saturating_sub(1)).step_by(SQUARE) {
                material.cover([x, band * SQUARE], SQUARE, &mut triangles);
            }
            triangles
        })
        .collect();
    let mut number = vec![u32::MAX; width * height];
    let mut corners = Vec::new();
    let mut triangles = Vec::with_capacity(bands.iter().map(Vec::len).sum());
    for t in bands.iter().flatten() {
        triangles.push(t.map(|i| {
            if number[i] == u32::MAX {
                number[i] = corners.len() as u32;
                corners.push(i);
            }
            number[i]
        }));
    }
    let origin = scene.origin.coords;
    let vertex = |&i: &usize| {
        let p = grid.place(i, material.heights[i]) - origin;
        let n = material.normal(i);
        SurfaceVertex {
            position: [p.x as f32, p.y as f32, p.z as f32],
            normal: [n.x as f32, n.y as f32, n.z as f32],
            colour: [TO_GO[0], TO_GO[1], TO_GO[2], 255],
        }
    };
    let vertices: Vec<SurfaceVertex> = corners.par_iter().map(vertex).collect();
    scene.add_triangles(&vertices, &triangles);
}

impl Material<'_> {
    fn is_to_go(&self, i: usize) -> bool {
        self.heights[i].is_finite() && self.heights[i] - self.grid.model[i] >= LEFT * self.allowance
    }

    /// Triangles over the square of `side` cells whose first corner is the middle of cell `x`, `y`.
    fn cover(&self, [x, y]: [usize; 2], side: usize, triangles: &mut Vec<[usize; 3]>) {
        let [width, height] = self.grid.size;
        if x + 1 >= width || y + 1 >= height {
            return;
        }
        let at = y * width + x;
        if side == 1 || x + side < width && y + side < height && self.lies_on(at, side) {
            let (right, below) = (at + side, at + side * width);
            for t in [[at, below, right], [right, below, below + side]] {
                let heights = t.map(|i| self.heights[i]);
                let low = heights.iter().copied().fold(f32::INFINITY, f32::min);
                let high = heights.iter().copied().fold(f32::NEG_INFINITY, f32::max);
                let whole = low.is_finite() && (side > 1 || high - low <= self.step_mm);
                if whole && t.iter().any(|&i| self.is_to_go(i)) {
                    triangles.push(t);
                }
            }
            return;
        }
        let half = side / 2;
        for [dx, dy] in [[0, 0], [half, 0], [0, half], [half, half]] {
            self.cover([x + dx, y + dy], half, triangles);
        }
    }

    /// Whether a square is nowhere far from the material, all of which is still to go.
    fn lies_on(&self, at: usize, side: usize) -> bool {
        let width = self.grid.size[0];
        let corner = |dx: usize, dy: usize| self.heights[at + dy * width + dx];
        let [a, b, c, d] = [corner(0, 0), corner(side, 0), corner(0, side), corner(side, side)];
        let bow = BOW * self.allowance;
        (0..=side).all(|dy| {
            (0..=side).all(|dx| {
                let (u, v) = (dx as f32 / side as f32, dy as f32 / side as f32);
                let flat = if u + v <= 1.0 {
                    a + (b - a) * u + (c - a) * v
                } else {
                    d + (c - d) * (1.0 - u) + (b - d) * (1.0 - v)
                };
                let i = at + dy * width + dx;
                (self.heights[i] - flat).abs() <= bow && self.is_to_go(i)
            })
        })
    }

    fn normal(&self, i: usize) -> Vector3 {
        let [width, height] = self.grid.size;
        let (x, y) = (i % width, i / width);
        let slope = |low: usize, high: usize, cells: usize| {
            let rise = f64::from(self.heights[high] - self.heights[low])
                / (cells.max(1) as f64 * self.grid.camera.mm_per_px());
            if rise.is_finite() { rise.clamp(-4.0, 4.0) } else { 0.0 }
        };
        let (x0, x1) = (x.saturating_sub(1), (x + 1).min(width - 1));
        let (y0, y1) = (y.saturating_sub(1), (y + 1).min(height - 1));
        let along_x = slope(y * width + x0, y * width + x1, x1 - x0);
        let along_y = slope(y0 * width + x, y1 * width + x, y1 - y0);
        let [right, up, _] = self.grid.camera.basis();
        (self.grid.axis - right * along_x + up * along_y).normalize()
    }
}
