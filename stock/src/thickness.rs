//! How thick the stock is over a point of the surface.

use claymill_nurbs::{Point3, Vector3};

use crate::grid::{self, Family, unit};
use crate::{Stock, StockError};

impl Stock {
    /// From a point along a unit vector to where it first leaves the stock, mm; 0 where there is none at the point.
    ///
    /// The line is followed through the cells of the family whose rays run nearest to it, each cell having the intervals of
    /// its ray. Where the surface of the stock is across the line, the error is at most the pitch and has no bias.
    ///
    /// # Errors
    /// A point that is no number, a direction that is no unit vector.
    pub fn thickness_along(&self, point: &Point3, direction: &Vector3) -> Result<f64, StockError> {
        if !point.iter().all(|c| c.is_finite()) {
            return Err(StockError::NotFinite("a point of the surface"));
        }
        let direction = unit(direction)?;
        let nearest = |best: Family, next: Family| {
            if direction[next.index()].abs() > direction[best.index()].abs() { next } else { best }
        };
        let family = Family::ALL.into_iter().fold(Family::X, nearest);
        let (k, across) = (family.index(), family.across());
        let (bounds, pitch_mm) = (self.grid.bounds(), self.grid.pitch_mm());
        let mut cell = across.map(|axis| ((point[axis] - bounds.min[axis]) / pitch_mm).floor());
        let mut way = 0.0;
        // A line enters no more cells than there are along both axes.
        let most = self.grid.counts[across[0]] + self.grid.counts[across[1]] + 2;
        for _ in 0..most {
            if (0..2).any(|i| cell[i] < 0.0 || cell[i] >= f64::from(self.grid.counts[across[i]])) {
                return Ok(way);
            }
            // Where the line leaves the cell, and through which side.
            let (mut end, mut side) = (f64::INFINITY, None);
            for i in 0..2 {
                let slope = direction[across[i]];
                let wall = cell[i] + if slope > 0.0 { 1.0 } else { 0.0 };
                let at = (bounds.min[across[i]] + wall * pitch_mm - point[across[i]]) / slope;
                if slope != 0.0 && at < end {
                    (end, side) = (at.max(way), Some((i, slope.signum())));
                }
            }
            // Both are cells of the grid.
            let list = self.list(family, cell.map(|c| c as u32));
            let at = point[k] + way * direction[k];
            let Some(interval) = list.iter().find(|i| grid::mm(i[0]) <= at && at < grid::mm(i[1])) else {
                return Ok(way);
            };
            let exit = grid::mm(interval[usize::from(direction[k] > 0.0)]);
            let leaves = (exit - point[k]) / direction[k];
            if leaves <= end {
                return Ok(leaves.max(0.0));
            }
            let Some((i, step)) = side else { return Ok(leaves.max(0.0)) };
            (way, cell[i]) = (end, cell[i] + step);
        }
        Ok(way)
    }
}
