//! Whether a move touches stock.

use crate::grid::{self, Family};
use crate::intervals::overlaps;
use crate::ray::window::{Places, Seen};
use crate::sweep::Sweep;
use crate::{Stock, StockError};

impl Stock {
    /// Whether a body, larger by a margin, passes no ray inside of stock.
    ///
    /// Material between the rays is not seen. Take a margin of at least the pitch beyond the clearance: what stays clear
    /// then is clear of everything thicker than the pitch. A fin thinner than that may stand between the rays of all
    /// three families.
    ///
    /// # Errors
    /// A margin that is negative or no number.
    pub fn is_clear(&self, sweep: &Sweep<'_>, margin_mm: f64) -> Result<bool, StockError> {
        if margin_mm.is_nan() || margin_mm < 0.0 {
            return Err(StockError::Size { what: "a margin", mm: margin_mm, least: 0.0 });
        }
        let body = sweep.body.offset(margin_mm)?;
        let larger = Sweep { body: &body, ..*sweep };
        Ok(!Family::ALL.into_iter().any(|family| self.touches(family, &larger)))
    }

    fn touches(&self, family: Family, sweep: &Sweep<'_>) -> bool {
        let grid = &self.grid;
        let seen = Seen::new(grid, family, sweep);
        let Some([columns, rows]) = seen.tiles(grid, family) else { return false };
        let (across, tiles) = (grid.tiles(family)[0], &self.families[family.index()]);
        (rows[0]..=rows[1]).any(|row| {
            (columns[0]..=columns[1]).any(|column| {
                let number = (row * across + column) as usize;
                let Some(tile) = &tiles[number] else { return false };
                let places = Places::new(grid, family, number);
                let span = tile.span.map(grid::mm);
                seen.any_ray(
                    grid,
                    &places,
                    span,
                    |ray, [low, high]| overlaps(tile.ray(ray), low, high),
                    |ray, [low, high]| overlaps(tile.ray(ray), grid::floor(low), grid::ceil(high)),
                )
            })
        })
    }
}
