//! Volumes: lengths of intervals times the area of a cell.

use rayon::prelude::*;

use crate::grid::{Family, QUANTA_PER_MM};
use crate::intervals::length;
use crate::sweep::Sweep;
use crate::tile::Shared;
use crate::{Stock, StockError};

/// A volume as each family of rays finds it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Volume {
    /// By rays along x, y and z, mm³.
    pub families_mm3: [f64; 3],
    /// How many rays of each family met it.
    pub rays: [u64; 3],
}

impl Volume {
    /// The family that most rays of met it: the one that faces it best. Ties go to the lower one.
    #[must_use]
    pub fn best_family(&self) -> Family {
        let better = |best: Family, next: Family| {
            if self.rays[next.index()] > self.rays[best.index()] { next } else { best }
        };
        Family::ALL.into_iter().fold(Family::X, better)
    }

    /// What the best family finds, mm³. A shallow cut is measured well by the rays that see it from above, and badly by
    /// those along it: the mean would be worse.
    #[must_use]
    pub fn best_mm3(&self) -> f64 {
        self.families_mm3[self.best_family().index()]
    }
}

impl Stock {
    /// What is left.
    #[must_use]
    pub fn volume(&self) -> Volume {
        self.sum(|tile, _| {
            let Some(tile) = tile else { return [0, 0] };
            tile.rays()
                .fold([0, 0], |[sum, rays], ray| [sum + length(ray), rays + i64::from(!ray.is_empty())])
        })
    }

    /// What this stock has lost to become a later state of it.
    ///
    /// # Errors
    /// Stocks of different grids.
    pub fn removed_since(&self, later: &Stock) -> Result<Volume, StockError> {
        if self.grid != later.grid {
            return Err(StockError::Grids);
        }
        Ok(self.lost(later))
    }

    /// What moves would remove; the stock stays as it is.
    #[must_use]
    pub fn removed_by(&self, sweeps: &[Sweep<'_>]) -> Volume {
        let mut later = self.clone();
        later.cut_all(sweeps);
        self.lost(&later)
    }

    /// What a later state of the same grid has lost.
    fn lost(&self, later: &Stock) -> Volume {
        self.sum(|before, [family, number]| {
            let after = &later.families[family][number];
            let mut total = [0, 0];
            let Some(before) = before else { return total };
            if after.as_ref().is_some_and(|after| std::sync::Arc::ptr_eq(before, after)) {
                return total;
            }
            for (i, ray) in before.rays().enumerate() {
                let lost = length(ray) - after.as_ref().map_or(0, |after| length(after.ray(i)));
                total = [total[0] + lost, total[1] + i64::from(lost != 0)];
            }
            total
        })
    }

    /// Sums of quanta and rays over all tiles. Whole numbers: the order does not matter.
    fn sum(&self, of: impl Fn(&Shared, [usize; 2]) -> [i64; 2] + Sync) -> Volume {
        let totals = [0, 1, 2].map(|family| {
            let tiles = self.families[family].par_iter().enumerate();
            tiles
                .map(|(number, tile)| of(tile, [family, number]))
                .reduce(|| [0, 0], |a, b| [a[0] + b[0], a[1] + b[1]])
        });
        let area_mm2 = self.grid.pitch_mm() * self.grid.pitch_mm();
        Volume {
            families_mm3: totals.map(|[sum, _]| sum as f64 / QUANTA_PER_MM * area_mm2),
            rays: totals.map(|[_, rays]| rays.unsigned_abs()),
        }
    }
}
