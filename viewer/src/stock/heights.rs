//! Height fields in tiles that copies share, and the lowering of cells by a ball. Material under an
//! overhang cannot be shown.

use std::sync::Arc;

/// Cells along a side of a tile.
const SIDE: usize = 32;

/// A square of cells, row by row.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Tile {
    /// Nothing in it is higher.
    top: f32,
    cells: [f32; SIDE * SIDE],
}

/// Heights in the cells of a grid, mm; copies share the tiles that are the same in both.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Heights {
    /// Cells in a row, and rows.
    size: [usize; 2],
    tiles: Vec<Arc<Tile>>,
}

/// A ball in a map: where its middle is and how large it is, cells; the height of its lowest point and its radius, mm.
#[derive(Debug, Clone, Copy)]
pub(super) struct Ball {
    pub(super) at: [f64; 2],
    pub(super) cell_mm: f64,
    pub(super) bottom_mm: f64,
    pub(super) radius_mm: f64,
}

impl Heights {
    pub(super) fn new(size: [usize; 2], height: impl Fn(usize, usize) -> f32) -> Self {
        let across = size.map(|s| s.div_ceil(SIDE));
        let tile = |k: usize| {
            let (left, low) = (k % across[0] * SIDE, k / across[0] * SIDE);
            let mut cells = [f32::NEG_INFINITY; SIDE * SIDE];
            for (i, cell) in cells.iter_mut().enumerate() {
                let (x, y) = (left + i % SIDE, low + i / SIDE);
                if x < size[0] && y < size[1] {
                    *cell = height(x, y);
                }
            }
            Arc::new(Tile { top: cells.iter().copied().fold(f32::NEG_INFINITY, f32::max), cells })
        };
        Heights { size, tiles: (0..across[0] * across[1]).map(tile).collect() }
    }

    pub(super) fn at(&self, x: usize, y: usize) -> f32 {
        self.tiles[y / SIDE * self.size[0].div_ceil(SIDE) + x / SIDE].cells[y % SIDE * SIDE + x % SIDE]
    }

    /// All of them row by row.
    pub(super) fn rows(&self) -> Vec<f32> {
        let [width, height] = self.size;
        let across = width.div_ceil(SIDE);
        let mut rows = Vec::with_capacity(width * height);
        for y in 0..height {
            let row = y % SIDE * SIDE..(y % SIDE + 1) * SIDE;
            let tiles = &self.tiles[y / SIDE * across..(y / SIDE + 1) * across];
            rows.extend(tiles.iter().flat_map(|t| &t.cells[row.clone()]).take(width));
        }
        rows
    }

    /// Takes away what a ball and all above it hold.
    pub(super) fn lower(&mut self, ball: &Ball) {
        let reach = (ball.radius_mm / ball.cell_mm).ceil();
        let range = |i: usize| {
            let (low, high) = (ball.at[i] - reach, ball.at[i] + reach);
            (low.floor().max(0.0) as usize)..(high.ceil().max(0.0) as usize).min(self.size[i])
        };
        let (columns, rows) = (range(0), range(1));
        if columns.is_empty() || rows.is_empty() {
            return;
        }
        let across = self.size[0].div_ceil(SIDE);
        let (cell, square) = (ball.cell_mm as f32, (ball.radius_mm * ball.radius_mm) as f32);
        let (bottom, middle) = (ball.bottom_mm as f32, (ball.bottom_mm + ball.radius_mm) as f32);
        for ty in rows.start / SIDE..=(rows.end - 1) / SIDE {
            for tx in columns.start / SIDE..=(columns.end - 1) / SIDE {
                let tile = &mut self.tiles[ty * across + tx];
                if tile.top <= bottom {
                    continue;
                }
                let tile = Arc::make_mut(tile);
                let within = |r: &std::ops::Range<usize>, t: usize| {
                    r.start.saturating_sub(t * SIDE)..(r.end - t * SIDE).min(SIDE)
                };
                let columns = within(&columns, tx);
                let left = ((tx * SIDE + columns.start) as f64 + 0.5 - ball.at[0]) as f32;
                for y in within(&rows, ty) {
                    let down = ((ty * SIDE + y) as f64 + 0.5 - ball.at[1]) as f32 * cell;
                    let room = square - down * down;
                    let row = &mut tile.cells[y * SIDE..(y + 1) * SIDE][columns.clone()];
                    for (j, h) in row.iter_mut().enumerate() {
                        let aside = (left + j as f32) * cell;
                        // Beside the ball the root is no number, and the smaller of it and `h` is `h`.
                        *h = h.min(middle - (room - aside * aside).sqrt());
                    }
                }
            }
        }
    }

    /// Bytes that these hold and `other`, of the same grid, does not.
    pub(super) fn bytes_beside(&self, other: &Heights) -> usize {
        let own = self.tiles.iter().zip(&other.tiles).filter(|(a, b)| !Arc::ptr_eq(a, b)).count();
        own * size_of::<Tile>() + self.tiles.len() * size_of::<Arc<Tile>>()
    }
}
