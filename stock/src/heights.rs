//! How high the stock stands along a coordinate axis: for links and rapids.

use rayon::prelude::*;

use crate::grid::{self, Family, Grid};
use crate::{Stock, StockError};

/// A coordinate axis in one of its two directions.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Upwards {
    /// The axis.
    pub family: Family,
    /// Up is where its coordinate falls.
    pub is_reversed: bool,
}

impl Upwards {
    /// The height of a coordinate along the axis.
    fn height(self, mm: f64) -> f64 {
        if self.is_reversed { -mm } else { mm }
    }

    /// Height of the highest end of a list.
    fn top(self, list: &[[i32; 2]]) -> Option<f64> {
        let end = if self.is_reversed { list.first()?[0] } else { list.last()?[1] };
        Some(self.height(grid::mm(end)))
    }
}

/// The upper end of the stock over square cells.
#[derive(Debug, Clone, PartialEq)]
pub struct HeightMap {
    /// Which way is up.
    pub up: Upwards,
    /// Smallest corner of the map along the two axes across, in cyclic order, mm.
    pub origin_mm: [f64; 2],
    /// Side of a cell, mm.
    pub cell_mm: f64,
    /// Cells along the two axes.
    pub counts: [u32; 2],
    /// Heights along `up`, row by row, mm; minus infinity over nothing. Up against the axis they are negative coordinates.
    pub heights_mm: Vec<f64>,
}

impl HeightMap {
    /// The height over a place; minus infinity beside the map.
    #[must_use]
    pub fn at(&self, [u, v]: [f64; 2]) -> f64 {
        let cell = |at: f64, i: usize| ((at - self.origin_mm[i]) / self.cell_mm).floor();
        let (u, v) = (cell(u, 0), cell(v, 1));
        let is_beside = |at: f64, count: u32| at.is_nan() || at < 0.0 || at >= f64::from(count);
        if is_beside(u, self.counts[0]) || is_beside(v, self.counts[1]) {
            return f64::NEG_INFINITY;
        }
        self.heights_mm[v as usize * self.counts[0] as usize + u as usize]
    }

    /// The largest height over the cells that a rectangle touches, from its smallest to its largest corner.
    #[must_use]
    pub fn highest_in(&self, low: [f64; 2], high: [f64; 2]) -> f64 {
        self.cells_in(low, high).map(|(_, height_mm)| height_mm).fold(f64::NEG_INFINITY, f64::max)
    }

    /// The cells that a rectangle touches, from its smallest to its largest corner: their middles and heights.
    pub fn cells_in(&self, low: [f64; 2], high: [f64; 2]) -> impl Iterator<Item = ([f64; 2], f64)> {
        let range = |i: usize| {
            let cell = |at: f64| (at - self.origin_mm[i]) / self.cell_mm;
            // Conversion stops at the ends.
            let end = (cell(high[i]).floor() + 1.0).max(0.0) as u32;
            (cell(low[i]).floor().max(0.0) as u32)..end.min(self.counts[i])
        };
        let (columns, rows) = (range(0), range(1));
        let middle = |n: u32, i: usize| self.origin_mm[i] + (f64::from(n) + 0.5) * self.cell_mm;
        let cell = move |u: u32, v: u32| {
            let height_mm = self.heights_mm[v as usize * self.counts[0] as usize + u as usize];
            ([middle(u, 0), middle(v, 1)], height_mm)
        };
        rows.flat_map(move |v| columns.clone().map(move |u| cell(u, v)))
    }
}

impl Stock {
    /// The upper end of the stock over cells of `rays_per_cell` times the pitch, as high as any ray of the three families
    /// finds it. Rays across the axis count half a pitch higher than they run.
    ///
    /// Nothing thicker than the pitch stands higher; a fin between the rays of all families may.
    #[must_use]
    pub fn height_map(&self, up: Upwards, rays_per_cell: u32) -> HeightMap {
        let per_cell = rays_per_cell.max(1);
        let [a, b] = up.family.across();
        let counts = [a, b].map(|axis| self.grid.counts[axis].div_ceil(per_cell));
        let [columns, rows] = counts.map(|c| c as usize);
        // Rays along the axis, and along the first axis across: by rows.
        let by_rows = (0..counts[1]).into_par_iter().map(|row| {
            let mut heights = vec![f64::NEG_INFINITY; columns];
            for v in cells_of(row, per_cell, self.grid.counts[b]) {
                for u in 0..self.grid.counts[a] {
                    if let Some(top) = up.top(self.list(up.family, [u, v])) {
                        let height = &mut heights[(u / per_cell) as usize];
                        *height = height.max(top);
                    }
                }
                let along = |w| self.list(Family::ALL[a], [v, w]);
                self.highest(up, a, per_cell, along, &mut heights);
            }
            heights
        });
        let mut heights_mm: Vec<f64> = by_rows.collect::<Vec<_>>().concat();
        // Rays along the second: by columns.
        let by_columns = (0..counts[0]).into_par_iter().map(|column| {
            let mut heights = vec![f64::NEG_INFINITY; rows];
            for u in cells_of(column, per_cell, self.grid.counts[a]) {
                let along = |w| self.list(Family::ALL[b], [w, u]);
                self.highest(up, b, per_cell, along, &mut heights);
            }
            heights
        });
        for (column, heights) in by_columns.collect::<Vec<_>>().into_iter().enumerate() {
            for (row, height) in heights.into_iter().enumerate() {
                let known = &mut heights_mm[row * columns + column];
                *known = known.max(height);
            }
        }
        let min = self.grid.bounds().min;
        let cell_mm = self.grid.pitch_mm() * f64::from(per_cell);
        HeightMap { up, origin_mm: [min[a], min[b]], cell_mm, counts, heights_mm }
    }

    /// The upper end of the stock at a place across an axis: that of the highest of the rays along the axis around it. `None`
    /// where there is nothing.
    ///
    /// # Errors
    /// A place that is no number.
    pub fn top_mm(&self, up: Upwards, at_mm: [f64; 2]) -> Result<Option<f64>, StockError> {
        if at_mm.iter().any(|c| !c.is_finite()) {
            return Err(StockError::NotFinite("the place whose height is asked for"));
        }
        let (axes, half) = (up.family.across(), self.grid.pitch_mm());
        let [u, v] = [0, 1].map(|i| self.grid.middles_in(axes[i], at_mm[i] - half, at_mm[i] + half));
        let rays = (v[0]..v[1]).flat_map(|v| (u[0]..u[1]).map(move |u| [u, v]));
        Ok(rays.filter_map(|ray| up.top(self.list(up.family, ray))).max_by(f64::total_cmp))
    }

    /// Raises heights to the highest rays across the axis in one plane of them, from the top down, until all are known.
    fn highest<'s>(
        &self,
        up: Upwards,
        axis: usize,
        per_cell: u32,
        list: impl Fn(u32) -> &'s [[i32; 2]],
        heights: &mut [f64],
    ) {
        let mut found = vec![f64::NEG_INFINITY; heights.len()];
        let mut unknown = heights.len();
        let levels = self.grid.counts[up.family.index()];
        for i in 0..levels {
            let level = if up.is_reversed { i } else { levels - 1 - i };
            let height = up.height(self.grid.centre(up.family.index(), level)) + 0.5 * self.grid.pitch_mm();
            for interval in list(level) {
                let [from, to] = cells_between(&self.grid, axis, interval.map(grid::mm));
                for cell in from / per_cell..=to / per_cell {
                    let known = &mut found[cell as usize];
                    if *known == f64::NEG_INFINITY {
                        *known = height;
                        unknown -= 1;
                    }
                }
            }
            if unknown == 0 {
                break;
            }
        }
        heights.iter_mut().zip(found).for_each(|(height, found)| *height = height.max(found));
    }
}

/// The cells of the grid in a cell of the map.
fn cells_of(cell: u32, per_cell: u32, count: u32) -> std::ops::Range<u32> {
    cell * per_cell..((cell + 1) * per_cell).min(count)
}

/// The first and the last cell that an interval touches with more than an end.
fn cells_between(grid: &Grid, axis: usize, [low, high]: [f64; 2]) -> [u32; 2] {
    let within = 0.25 * grid::QUANTUM_MM;
    [grid.cell_of(axis, low + within), grid.cell_of(axis, high - within)]
}
