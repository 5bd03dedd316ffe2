//! Where material is within a band of heights, seen along any direction.

use std::sync::atomic::{AtomicU64, Ordering};

use claymill_nurbs::{Point3, Vector3};
use rayon::prelude::*;

use crate::grid::{self, Family, SIDE, TILE, unit};
use crate::intervals::overlaps;
use crate::{Stock, StockError};

/// Cells of a slice at most.
const MOST_CELLS: u64 = 1 << 31;

/// Square cells of a plane, each with material in it or none.
#[derive(Debug, Clone, PartialEq)]
pub struct Slice {
    /// Across, across and along: unit vectors. A place of the slice has the coordinates of the model's points along them.
    pub axes: [Vector3; 3],
    /// Smallest corner along the first two axes, mm.
    pub origin_mm: [f64; 2],
    /// Side of a cell, mm: the pitch of the stock.
    pub cell_mm: f64,
    /// Cells along the first two axes.
    pub counts: [u32; 2],
    /// One bit a cell, row by row.
    bits: Vec<u64>,
}

impl Slice {
    /// Whether a cell has material; nothing has beside the slice.
    #[must_use]
    pub fn has_material(&self, [u, v]: [u32; 2]) -> bool {
        let cell = v as usize * self.counts[0] as usize + u as usize;
        u < self.counts[0] && v < self.counts[1] && self.bits[cell / 64] >> (cell % 64) & 1 == 1
    }

    /// Area of the cells with material, mm².
    #[must_use]
    pub fn area_mm2(&self) -> f64 {
        let cells: u64 = self.bits.iter().map(|word| u64::from(word.count_ones())).sum();
        cells as f64 * self.cell_mm * self.cell_mm
    }
}

impl Stock {
    /// Where material is between two heights along the third of three unit vectors, which are at right angles.
    ///
    /// Along coordinate axes a cell is a cell of the stock and has material if the ray through its middle has. Along other
    /// directions every ray of the three families that runs through the band counts, widened to the edges of its cell: a
    /// slice has more material than there is by up to 1.5 pitches, and not less.
    ///
    /// # Errors
    /// Axes that are no unit vectors, not at right angles or left-handed; an empty band; more than 2³¹ cells.
    pub fn slice(&self, axes: [Vector3; 3], low_mm: f64, high_mm: f64) -> Result<Slice, StockError> {
        let axes = [unit(&axes[0])?, unit(&axes[1])?, unit(&axes[2])?];
        if (axes[0].cross(&axes[1]) - axes[2]).norm() > 1e-6 {
            return Err(StockError::Axes);
        }
        if low_mm.is_nan() || high_mm.is_nan() || low_mm >= high_mm {
            return Err(StockError::Band { low_mm, high_mm });
        }
        let corners = self.grid.bounds().corners();
        let range = |axis: &Vector3| {
            let ends = [0, 1, 2].map(|k| [corners[k] * axis[k], corners[k + 3] * axis[k]]);
            ends.iter().fold([0.0, 0.0], |[a, b], e| [a + e[0].min(e[1]), b + e[0].max(e[1])])
        };
        let cell_mm = self.grid.pitch_mm();
        let (u, v) = (range(&axes[0]), range(&axes[1]));
        // Rounding must not add a cell to a box of whole cells.
        let count = |r: [f64; 2]| ((r[1] - r[0]) / cell_mm - 1e-6).ceil().max(1.0);
        let cells = count(u) * count(v);
        if cells > MOST_CELLS as f64 {
            return Err(StockError::TooManyCells { what: "a slice", cells: cells as u64, limit: MOST_CELLS });
        }
        // Bounded by the number of cells.
        let counts = [count(u) as u32, count(v) as u32];
        let words = (cells as usize).div_ceil(64);
        let bits: Vec<AtomicU64> = (0..words).map(|_| AtomicU64::new(0)).collect();
        let canvas = Canvas { origin: [u[0], v[0]], cell_mm, counts, bits: &bits };
        if let Some(family) = grid::family_along(&axes) {
            self.along_rays(family, &axes, [low_mm, high_mm], &canvas);
        } else {
            for family in Family::ALL {
                self.across_rays(family, &axes, [low_mm, high_mm], &canvas);
            }
        }
        let bits = bits.into_iter().map(AtomicU64::into_inner).collect();
        Ok(Slice { axes, origin_mm: [u[0], v[0]], cell_mm, counts, bits })
    }

    fn along_rays(&self, family: Family, axes: &[Vector3; 3], band: [f64; 2], canvas: &Canvas<'_>) {
        let sign = axes[2][family.index()];
        let ends = band.map(|b| b * sign);
        let (low, high) = (grid::floor(ends[0].min(ends[1])), grid::ceil(ends[0].max(ends[1])));
        let [a, b] = family.across();
        (0..self.grid.counts[b]).into_par_iter().for_each(|v| {
            for u in 0..self.grid.counts[a] {
                if overlaps(self.list(family, [u, v]), low, high) {
                    let mut p = Point3::origin();
                    (p[a], p[b]) = (self.grid.centre(a, u), self.grid.centre(b, v));
                    let at = [0, 1].map(|i| p.coords.dot(&axes[i]));
                    let [u, v] = [0, 1].map(|i| canvas.cell(i, at[i]));
                    canvas.mark_row(v, u, u);
                }
            }
        });
    }

    fn across_rays(&self, family: Family, axes: &[Vector3; 3], band: [f64; 2], canvas: &Canvas<'_>) {
        let ([a, b], k) = (family.across(), family.index());
        let across = self.grid.tiles(family)[0] as usize;
        let steep = axes[2][k];
        // Half the diagonal of a cell: everything in a cell is that near to its ray.
        let wide = std::f64::consts::FRAC_1_SQRT_2 * canvas.cell_mm;
        let band = [band[0] - wide, band[1] + wide];
        self.families[k].par_iter().enumerate().for_each(|(number, tile)| {
            let Some(tile) = tile else { return };
            let first = [number % across, number / across].map(|i| i as u32 * SIDE);
            for ray in (0..TILE).filter(|ray| !tile.ray(*ray).is_empty()) {
                let mut p = Point3::origin();
                p[a] = self.grid.centre(a, first[0] + ray as u32 % SIDE);
                p[b] = self.grid.centre(b, first[1] + ray as u32 / SIDE);
                let level = p.coords.dot(&axes[2]);
                let mut within = [f64::NEG_INFINITY, f64::INFINITY];
                if steep.abs() > 1e-12 {
                    let ends = band.map(|height| (height - level) / steep);
                    within = [ends[0].min(ends[1]), ends[0].max(ends[1])];
                } else if level < band[0] || level > band[1] {
                    continue;
                }
                for interval in tile.ray(ray) {
                    let (from, to) =
                        (grid::mm(interval[0]).max(within[0]), grid::mm(interval[1]).min(within[1]));
                    if from <= to {
                        let start = [0, 1].map(|i| p.coords.dot(&axes[i]));
                        canvas.mark_line(start, [axes[0][k], axes[1][k]], [from, to], wide);
                    }
                }
            }
        });
    }
}

/// Where cells are marked, from several threads: setting a bit twice is setting it once.
struct Canvas<'a> {
    origin: [f64; 2],
    cell_mm: f64,
    counts: [u32; 2],
    bits: &'a [AtomicU64],
}

impl Canvas<'_> {
    /// The cell along one of both axes that holds a place; beside the slice its first or last.
    fn cell(&self, i: usize, mm: f64) -> u32 {
        // Conversion stops at 0.
        (((mm - self.origin[i]) / self.cell_mm).max(0.0) as u32).min(self.counts[i] - 1)
    }

    /// Marks the cells that are within `half` of a stretch of a ray, places `start + t·slope`, along either axis.
    fn mark_line(&self, start: [f64; 2], slope: [f64; 2], [from, to]: [f64; 2], half: f64) {
        let at = |i: usize, t: f64| start[i] + t * slope[i];
        let (first, last) = (at(1, from).min(at(1, to)) - half, at(1, from).max(at(1, to)) + half);
        for row in self.cell(1, first)..=self.cell(1, last) {
            // The part of the stretch that is near to the row.
            let (mut a, mut b) = (from, to);
            if slope[1].abs() > 1e-12 {
                let low = self.origin[1] + f64::from(row) * self.cell_mm - half;
                let ends = [low, low + self.cell_mm + 2.0 * half].map(|v| (v - start[1]) / slope[1]);
                (a, b) = (a.max(ends[0].min(ends[1])), b.min(ends[0].max(ends[1])));
            }
            if a <= b {
                let (low, high) = (at(0, a).min(at(0, b)) - half, at(0, a).max(at(0, b)) + half);
                self.mark_row(row, self.cell(0, low), self.cell(0, high));
            }
        }
    }

    /// Marks neighbouring cells of a row.
    fn mark_row(&self, row: u32, first: u32, last: u32) {
        let start = row as usize * self.counts[0] as usize;
        let (first, last) = (start + first as usize, start + last as usize);
        for word in first / 64..=last / 64 {
            let below = if word == first / 64 { u64::MAX << (first % 64) } else { u64::MAX };
            let above = if word == last / 64 { u64::MAX >> (63 - last % 64) } else { u64::MAX };
            let mask = below & above;
            // Most are marked by then, and reading is cheaper.
            if self.bits[word].load(Ordering::Relaxed) & mask != mask {
                self.bits[word].fetch_or(mask, Ordering::Relaxed);
            }
        }
    }
}
