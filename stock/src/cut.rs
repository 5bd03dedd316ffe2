//! Cutting: every tile takes the moves that reach it, whatever the others do.

use rayon::prelude::*;

use crate::Stock;
use crate::grid::{self, Family, Grid};
use crate::intervals::{overlaps, subtract};
use crate::ray::window::{Places, Seen};
use crate::sweep::Sweep;
use crate::tile::{Shared, with_lists};

/// Moves that are sorted into tiles at a time: it bounds the memory for that, not the result.
const BATCH: usize = 1 << 16;
/// So many moves, or tiles with their moves, are quicker one after the other: to wake a thread takes longer.
const FEW: usize = 24;

impl Stock {
    /// Removes what a move sweeps.
    pub fn cut(&mut self, sweep: &Sweep<'_>) {
        self.cut_all(std::slice::from_ref(sweep));
    }

    /// Removes what moves sweep, on all threads.
    ///
    /// Ends are rounded inwards: on every ray no more is removed than the moves sweep, so that stock is never
    /// under-estimated. Neither the order of the moves nor the number of threads changes a bit of the result.
    pub fn cut_all(&mut self, sweeps: &[Sweep<'_>]) {
        for batch in sweeps.chunks(BATCH) {
            for family in Family::ALL {
                cut_family(&self.grid, family, &mut self.families[family.index()], batch);
            }
        }
    }
}

fn cut_family(grid: &Grid, family: Family, tiles: &mut [Shared], sweeps: &[Sweep<'_>]) {
    let each = sweeps.par_iter().with_min_len(FEW);
    let seen: Vec<Seen> = each.map(|sweep| Seen::new(grid, family, sweep)).collect();
    let (first, order) = sorted(grid, family, &seen, tiles);
    let cut = |(number, tile): &mut (usize, &mut Shared)| {
        let sweeps = &order[first[*number]..first[*number + 1]];
        let Some(span) = tile.as_ref().map(|t| t.span) else { return };
        let span = span.map(grid::mm);
        let places = Places::new(grid, family, *number);
        with_lists(|lists| {
            lists.load(tile);
            let mut is_changed = false;
            let rays = std::cell::RefCell::new(&mut lists.rays);
            for &sweep in sweeps {
                let wanted = |ray: usize, [low, high]: [i32; 2]| overlaps(&rays.borrow()[ray], low, high);
                seen[sweep as usize].any_ray(grid, &places, span, wanted, |ray, [low, high]| {
                    is_changed |= subtract(&mut rays.borrow_mut()[ray], grid::ceil(low), grid::floor(high));
                    false
                });
            }
            if is_changed {
                **tile = lists.store();
            }
        });
    };
    let met = |(number, _): &(usize, &mut Shared)| first[*number] < first[*number + 1];
    let mut met: Vec<(usize, &mut Shared)> = tiles.iter_mut().enumerate().filter(met).collect();
    let together = if order.len() > FEW { 1 } else { FEW };
    met.par_iter_mut().with_min_len(together).for_each(cut);
}

/// The moves of each tile that has material: where the list of each tile begins, and all lists.
fn sorted(grid: &Grid, family: Family, seen: &[Seen], tiles: &[Shared]) -> (Vec<usize>, Vec<u32>) {
    let across = grid.tiles(family)[0];
    let met: Vec<_> = seen.par_iter().with_min_len(FEW).map(|s| s.tiles(grid, family)).collect();
    let each = |f: &mut dyn FnMut(usize, u32)| {
        for (sweep, range) in met.iter().enumerate() {
            let Some([columns, rows]) = range else { continue };
            for row in rows[0]..=rows[1] {
                for column in columns[0]..=columns[1] {
                    let tile = (row * across + column) as usize;
                    if tiles[tile].is_some() {
                        // A batch has fewer than 2³² moves.
                        f(tile, sweep as u32);
                    }
                }
            }
        }
    };
    let mut first = vec![0; tiles.len() + 1];
    each(&mut |tile, _| first[tile + 1] += 1);
    for i in 0..tiles.len() {
        first[i + 1] += first[i];
    }
    let (mut next, mut order) = (first.clone(), vec![0; first[tiles.len()]]);
    each(&mut |tile, sweep| {
        order[next[tile]] = sweep;
        next[tile] += 1;
    });
    (first, order)
}
