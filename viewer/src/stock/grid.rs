//! The model's height in cells, seen along a tool axis, the moving ball in the same cells, and
//! which vertices count as cut.

use std::sync::OnceLock;

use claymill_nurbs::{Point3, Vector3};
use rayon::prelude::*;

use super::heights::{Ball, Heights};
use crate::camera::{Camera, View};
use crate::course::Station;
use crate::front::Front;
use crate::scene::Scene;

/// Cells along the longer side of a map, and the smallest cell as a part of the ball's radius.
const CELLS: f64 = 1000.0;
const FINEST_RADII: f64 = 0.12;
/// What is left of the allowance where a cell counts as cut.
pub(super) const LEFT: f32 = 0.5;
/// A vertex that is on top nowhere.
const UNDER: u32 = u32::MAX;

/// A model as it is seen along one tool axis, in cells.
#[derive(Debug)]
pub(super) struct Grid {
    pub(super) camera: Camera,
    pub(super) axis: Vector3,
    /// Cells in a row, and rows.
    pub(super) size: [usize; 2],
    /// The model's height, mm along the axis; minus infinity where there is none.
    pub(super) model: Vec<f32>,
    /// The cell that each vertex of the model is on top of, surface by surface, once somebody asked.
    cells: OnceLock<Vec<Vec<u32>>>,
}

impl Grid {
    pub(super) fn new(bare: &Scene, axis: Vector3, radius_mm: f64) -> Self {
        let view = View { margin: 0.01, ..View::looking("stock", -axis, axis) };
        let wide = Camera::frame(&view, bare.points(), [CELLS as u32; 2]);
        let finer = wide.mm_per_px() / (FINEST_RADII * radius_mm).max(1e-3);
        let cells = if finer < 1.0 { (CELLS * finer).ceil().max(8.0) } else { CELLS } as u32;
        let camera = Camera::frame(&view, bare.points(), [cells; 2]);
        let front = Front::of(bare, &camera, [cells; 2], 1.0, &[]);
        Grid { camera, axis, size: front.size, model: front.nearest, cells: OnceLock::new() }
    }

    /// The place of a cell's middle at a height.
    pub(super) fn place(&self, i: usize, height_mm: f32) -> Point3 {
        let at = [(i % self.size[0]) as f64 + 0.5, (i / self.size[0]) as f64 + 0.5];
        self.camera.unprojected(at, f64::from(height_mm))
    }

    /// Samples of the ball on the way from one place to another; they are half a cell apart.
    pub(super) fn samples(&self, from: &Station, to: &Station) -> u32 {
        ((to.tip - from.tip).norm() / (0.5 * self.camera.mm_per_px())).ceil().clamp(1.0, 1e5) as u32
    }

    /// The ball at a part of the way.
    pub(super) fn ball(&self, from: &Station, to: &Station, share: f64) -> Option<Ball> {
        let tip = from.tip + (to.tip - from.tip) * share;
        let (cell_mm, bottom_mm) = (self.camera.mm_per_px(), self.camera.nearness(&tip));
        Some(Ball { at: self.camera.project(&tip)?, cell_mm, bottom_mm, radius_mm: from.radius_mm })
    }

    /// The cell that a place on the model is on top of.
    pub(super) fn cell_under(&self, p: &Point3, deviation_mm: f64) -> Option<[usize; 2]> {
        let [x, y] = self.camera.project(p)?;
        if x < 0.0 || y < 0.0 || x as usize >= self.size[0] || y as usize >= self.size[1] {
            return None;
        }
        // On a steep wall a cell holds many heights.
        let tolerance = (deviation_mm + 2.0 * self.camera.mm_per_px()) as f32;
        let (x, y) = (x as usize, y as usize);
        let height = self.camera.nearness(p) as f32;
        ((height - self.model[y * self.size[0] + x]).abs() <= tolerance).then_some([x, y])
    }

    pub(super) fn is_cut(&self, heights: &Heights, [x, y]: [usize; 2], allowance_mm: f64) -> bool {
        heights.at(x, y) - self.model[y * self.size[0] + x] < LEFT * allowance_mm as f32
    }

    /// Which vertices of the model are on top here, with little left over them.
    pub(super) fn cut_vertices(&self, bare: &Scene, heights: &Heights, allowance_mm: f64) -> Vec<Vec<bool>> {
        let cells = self.cells.get_or_init(|| {
            let cell = |v: &crate::SurfaceVertex| {
                let p = Point3::from(v.position.map(f64::from)) + bare.origin.coords;
                let cell = self.cell_under(&p, bare.deviation_mm);
                cell.map_or(UNDER, |[x, y]| (y * self.size[0] + x) as u32)
            };
            bare.surfaces.iter().map(|s| s.vertices.par_iter().map(cell).collect()).collect()
        });
        let is_cut = |&i: &u32| {
            let at = [i as usize % self.size[0], i as usize / self.size[0]];
            i != UNDER && self.is_cut(heights, at, allowance_mm)
        };
        cells.iter().map(|c| c.par_iter().map(is_cut).collect()).collect()
    }
}
