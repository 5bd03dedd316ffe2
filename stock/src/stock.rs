//! The stock itself and what it starts from: a block, a cylinder, or intervals along each ray.

use std::sync::Arc;

use claymill_nurbs::{Aabb, Point3};
use rayon::prelude::*;

use crate::StockError;
use crate::grid::{self, Family, Grid, SIDE};
use crate::intervals::united;
use crate::tile::{Lists, Shared, ray_in_tile};

/// Material as intervals along three families of rays.
///
/// A clone shares all tiles with its original until one of them is cut there: states between operations are cheap.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Stock {
    pub(crate) grid: Grid,
    /// Tiles of the rays along x, y and z, row by row.
    pub(crate) families: [Vec<Shared>; 3],
}

/// A ray of a stock.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ray {
    /// The axis along which it runs.
    pub family: Family,
    /// Where it crosses the plane of the other two axes, in cyclic order, mm: for z they are x and y.
    pub across_mm: [f64; 2],
    /// Number of its cell along these two axes.
    pub cell: [u32; 2],
}

impl Stock {
    /// A block that fills a box.
    ///
    /// # Errors
    /// As [`Grid::over`].
    pub fn block(bounds: &Aabb, pitch_mm: f64) -> Result<Self, StockError> {
        Stock::block_in(Grid::over(bounds, pitch_mm)?, bounds)
    }

    /// A block within a grid that covers more, or that was allowed more memory.
    ///
    /// # Errors
    /// No ray of the grid passes the block.
    pub fn block_in(grid: Grid, bounds: &Aabb) -> Result<Self, StockError> {
        Stock::from_rays(grid, |ray| {
            let k = ray.family.index();
            let mut across = ray.family.across().into_iter().zip(ray.across_mm);
            let is_inside = across.all(|(a, at)| (bounds.min[a]..bounds.max[a]).contains(&at));
            is_inside.then(|| vec![[bounds.min[k], bounds.max[k]]])
        })
    }

    /// A cylinder along a coordinate axis, from the middle of its lower end.
    ///
    /// # Errors
    /// As [`Grid::over`]; a radius or length that is not positive.
    pub fn cylinder(
        along: Family,
        base: Point3,
        radius_mm: f64,
        length_mm: f64,
        pitch_mm: f64,
    ) -> Result<Self, StockError> {
        if radius_mm.is_nan() || radius_mm <= 0.0 {
            return Err(StockError::Radius(radius_mm));
        }
        let k = along.index();
        let mut bounds = Aabb { min: base, max: base };
        for axis in along.across() {
            bounds.min[axis] -= radius_mm;
            bounds.max[axis] += radius_mm;
        }
        bounds.max[k] += length_mm;
        Stock::cylinder_in(Grid::over(&bounds, pitch_mm)?, along, base, radius_mm, length_mm)
    }

    /// The same on a grid that there is.
    ///
    /// # Errors
    /// As [`Stock::cylinder`].
    pub fn cylinder_in(
        grid: Grid,
        along: Family,
        base: Point3,
        radius_mm: f64,
        length_mm: f64,
    ) -> Result<Self, StockError> {
        if radius_mm.is_nan() || radius_mm <= 0.0 {
            return Err(StockError::Radius(radius_mm));
        }
        let k = along.index();
        let ends_mm = [base[k], base[k] + length_mm];
        Stock::from_rays(grid, |ray| {
            if ray.family == along {
                let [x, y] = [0, 1].map(|i| ray.across_mm[i] - base[ray.family.across()[i]]);
                return (x * x + y * y <= radius_mm * radius_mm).then(|| vec![ends_mm]);
            }
            // Of the two axes across the ray, one runs along the cylinder and one across it.
            let [a, b] = ray.family.across();
            let [at_a, at_b] = ray.across_mm;
            let (along_mm, beside_mm) = if a == k { (at_a, at_b - base[b]) } else { (at_b, at_a - base[a]) };
            let square = radius_mm * radius_mm - beside_mm * beside_mm;
            let (half, middle) = (square.max(0.0).sqrt(), base[ray.family.index()]);
            (square > 0.0 && (ends_mm[0]..ends_mm[1]).contains(&along_mm))
                .then(|| vec![[middle - half, middle + half]])
        })
    }

    /// Any material: a function returns where it lies along each ray, as intervals in any order, mm.
    ///
    /// This is how a model with a layer of clay becomes stock: along a ray, the boundary of a model that is swollen by the
    /// layer is the centre height of a ball as large as the layer that is dropped along the ray. Ends are rounded to
    /// whole quanta outwards, so that there is never less material than returned. What reaches beyond the grid along a
    /// ray is kept.
    ///
    /// # Errors
    /// An interval whose ends do not ascend or are no numbers; no material at all.
    pub fn from_rays<F>(grid: Grid, material: F) -> Result<Self, StockError>
    where
        F: Fn(Ray) -> Option<Vec<[f64; 2]>> + Sync,
    {
        let lists = |ray| {
            let Some(intervals) = material(ray) else { return Ok(Vec::new()) };
            let whole = intervals.into_iter().map(|[low, high]| {
                let fits = low <= high
                    && low.abs() <= 2.0 * grid::FARTHEST_MM
                    && high.abs() <= 2.0 * grid::FARTHEST_MM;
                if fits {
                    Ok([grid::floor(low), grid::ceil(high)])
                } else {
                    Err(StockError::Interval { low, high })
                }
            });
            Ok(united(whole.collect::<Result<_, _>>()?))
        };
        Stock::from_lists(grid, lists)
    }

    /// The same from lists in quanta.
    pub(crate) fn from_lists<F>(grid: Grid, list_of: F) -> Result<Self, StockError>
    where
        F: Fn(Ray) -> Result<Vec<[i32; 2]>, StockError> + Sync,
    {
        Stock::from_tiles(grid, |lists, family, tile| fill(lists, &grid, family, tile, &list_of))
    }

    /// The same from whole tiles; their lists are empty at first.
    pub(crate) fn from_tiles<F>(grid: Grid, fill: F) -> Result<Self, StockError>
    where
        F: Fn(&mut Lists, Family, [u32; 2]) -> Result<(), StockError> + Sync,
    {
        let family = |family: Family| -> Result<Vec<Shared>, StockError> {
            let [across, rows] = grid.tiles(family);
            let row = |lists: &mut Lists, row: u32| -> Result<Vec<Shared>, StockError> {
                let mut tiles: Vec<Shared> = Vec::with_capacity(across as usize);
                for column in 0..across {
                    lists.load(&None);
                    fill(lists, family, [column, row])?;
                    let tile = lists.store();
                    // Within a block nearly all tiles are alike: they are one.
                    let same = tiles.last().filter(|last| **last == tile).cloned();
                    tiles.push(same.unwrap_or(tile));
                }
                Ok(tiles)
            };
            let rows: Vec<_> =
                (0..rows).into_par_iter().map_init(Lists::new, row).collect::<Result<_, _>>()?;
            Ok(rows.into_iter().flatten().collect())
        };
        let stock = Stock { grid, families: [family(Family::X)?, family(Family::Y)?, family(Family::Z)?] };
        if stock.is_empty() { Err(StockError::Empty { pitch_mm: grid.pitch_mm() }) } else { Ok(stock) }
    }

    /// The cells.
    #[must_use]
    pub fn grid(&self) -> &Grid {
        &self.grid
    }

    /// Whether nothing is left on any ray.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.families.iter().flatten().all(Option::is_none)
    }

    /// Memory of the tiles, bytes. Tiles shared within the stock count once a neighbour.
    #[must_use]
    pub fn bytes_in_memory(&self) -> usize {
        let mut total = 0;
        for tiles in &self.families {
            total += tiles.capacity() * size_of::<Shared>();
            let mut last: Option<&Arc<_>> = None;
            for tile in tiles.iter().flatten() {
                total += if last.is_some_and(|l| Arc::ptr_eq(l, tile)) { 0 } else { tile.bytes() };
                last = Some(tile);
            }
        }
        total
    }

    /// The material on the ray through a cell, ascending, mm; empty beyond the grid.
    ///
    /// The cell is counted along the two axes across the ray, in cyclic order.
    #[must_use]
    pub fn on_ray(&self, family: Family, cell: [u32; 2]) -> Vec<[f64; 2]> {
        self.list(family, cell).iter().map(|i| i.map(grid::mm)).collect()
    }

    /// The list of a ray, quanta.
    #[inline]
    pub(crate) fn list(&self, family: Family, [u, v]: [u32; 2]) -> &[[i32; 2]] {
        let [a, b] = family.across();
        if u >= self.grid.counts[a] || v >= self.grid.counts[b] {
            return &[];
        }
        let tile = (v / SIDE) as usize * self.grid.tiles(family)[0] as usize + (u / SIDE) as usize;
        self.families[family.index()][tile].as_ref().map_or(&[], |tile| tile.ray(ray_in_tile(u, v)))
    }
}

/// Fills the lists of a tile; those beyond the grid are empty.
fn fill<F>(
    lists: &mut Lists,
    grid: &Grid,
    family: Family,
    tile: [u32; 2],
    list_of: &F,
) -> Result<(), StockError>
where
    F: Fn(Ray) -> Result<Vec<[i32; 2]>, StockError>,
{
    let [a, b] = family.across();
    for v in (tile[1] * SIDE..(tile[1] + 1) * SIDE).take_while(|v| *v < grid.counts[b]) {
        for u in (tile[0] * SIDE..(tile[0] + 1) * SIDE).take_while(|u| *u < grid.counts[a]) {
            let across_mm = [grid.centre(a, u), grid.centre(b, v)];
            lists.rays[ray_in_tile(u, v)] = list_of(Ray { family, across_mm, cell: [u, v] })?;
        }
    }
    Ok(())
}
