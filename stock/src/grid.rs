//! Where the rays are: three families through the centres of the cells of one box, in whole quanta.

use claymill_nurbs::{Aabb, Point3};

use crate::StockError;

/// Ends of intervals are whole multiples of this, mm (0.1 µm).
pub const QUANTUM_MM: f64 = 1e-4;
/// Quanta in a millimetre.
pub(crate) const QUANTA_PER_MM: f64 = 1e4;
/// An end that is this close to a whole quantum is put on it, quanta (0.01 nm): below the rounding of coordinates of a
/// hundred metres.
const SNAP: f64 = 1e-4;
/// Smallest and largest pitch, mm.
pub const PITCHES_MM: (f64, f64) = (1e-3, 1e3);
/// No stock reaches further from the origin, mm: twice that still fits into an `i32` of quanta.
pub const FARTHEST_MM: f64 = 1e5;
/// A stock needs this much for a ray, bytes: two intervals and its share of a tile.
const RAY_BYTES: u64 = 32;
/// A stock needs at most this where nothing else is asked for, bytes.
pub const USUAL_BYTES: u64 = 4 << 30;
/// Rays along a side of a tile.
pub(crate) const SIDE: u32 = 32;
/// Rays of a tile.
pub(crate) const TILE: usize = (SIDE * SIDE) as usize;

/// A coordinate axis of the model, along which a family of rays runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Family {
    /// Rays along x.
    X,
    /// Rays along y.
    Y,
    /// Rays along z.
    Z,
}

impl Family {
    /// All three.
    pub const ALL: [Family; 3] = [Family::X, Family::Y, Family::Z];

    /// 0 = x, 1 = y, 2 = z.
    #[must_use]
    pub const fn index(self) -> usize {
        self as usize
    }

    /// The axes across the rays, in cyclic order: for z they are x and y.
    #[must_use]
    pub const fn across(self) -> [usize; 2] {
        [(self.index() + 1) % 3, (self.index() + 2) % 3]
    }

    /// Coordinates across the rays, then along them.
    pub(crate) fn turned(self, p: &[f64; 3]) -> [f64; 3] {
        let [u, v] = self.across();
        [p[u], p[v], p[self.index()]]
    }
}

/// The cells of a stock. Rays run through their centres.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Grid {
    /// Smallest corner, quanta.
    pub(crate) origin: [i32; 3],
    /// Side of a cell, quanta.
    pub(crate) pitch: i32,
    /// Cells along x, y and z.
    pub(crate) counts: [u32; 3],
}

impl Grid {
    /// The cells that cover a box from its smallest corner on, with at most [`USUAL_BYTES`] of memory.
    ///
    /// The pitch is rounded to whole quanta. A box whose sides are multiples of it is covered exactly.
    ///
    /// # Errors
    /// An empty box, one too far out, a pitch out of range or too fine for memory, and what is no number.
    pub fn over(bounds: &Aabb, pitch_mm: f64) -> Result<Self, StockError> {
        Grid::within(bounds, pitch_mm, USUAL_BYTES)
    }

    /// The same with another limit of memory, bytes.
    ///
    /// # Errors
    /// As [`Grid::over`].
    pub fn within(bounds: &Aabb, pitch_mm: f64, limit_bytes: u64) -> Result<Self, StockError> {
        let corners = bounds.corners();
        if corners.iter().any(|c| c.is_nan()) {
            return Err(StockError::NotFinite("a corner of the stock's box"));
        }
        if (0..3).any(|k| bounds.min[k] >= bounds.max[k]) {
            return Err(StockError::EmptyBox);
        }
        let reach_mm = corners.iter().fold(0.0, |a: f64, b| a.max(b.abs()));
        if reach_mm > FARTHEST_MM {
            return Err(StockError::TooFar { reach_mm });
        }
        if !(pitch_mm >= PITCHES_MM.0 && pitch_mm <= PITCHES_MM.1) {
            return Err(StockError::Pitch { pitch_mm });
        }
        let pitch = (pitch_mm * QUANTA_PER_MM).round() as i32;
        let origin = [0, 1, 2].map(|k| floor(bounds.min[k]));
        let counts = [0, 1, 2].map(|k| {
            let side = i64::from(ceil(bounds.max[k])) - i64::from(origin[k]);
            // At most 2e5 mm by cells of 1 µm: it fits.
            side.div_euclid(i64::from(pitch)) as u32 + u32::from(side % i64::from(pitch) != 0)
        });
        let [x, y, z] = counts.map(u64::from);
        let rays = x * y + y * z + z * x;
        let bytes = rays * RAY_BYTES;
        if bytes > limit_bytes {
            let fitting_mm = pitch_mm * (bytes as f64 / limit_bytes as f64).sqrt() * 1.001;
            return Err(StockError::TooFine { pitch_mm, rays, bytes, limit_bytes, fitting_mm });
        }
        Ok(Grid { origin, pitch, counts })
    }

    /// Side of a cell and distance of neighbouring rays, mm.
    #[must_use]
    pub fn pitch_mm(&self) -> f64 {
        f64::from(self.pitch) / QUANTA_PER_MM
    }

    /// Cells along x, y and z.
    #[must_use]
    pub fn cells(&self) -> [u32; 3] {
        self.counts
    }

    /// The box of all cells, mm.
    #[must_use]
    pub fn bounds(&self) -> Aabb {
        let corner = |steps: [u32; 3]| {
            Point3::from([0, 1, 2].map(|k| {
                let quanta = i64::from(self.origin[k]) + i64::from(steps[k]) * i64::from(self.pitch);
                quanta as f64 / QUANTA_PER_MM
            }))
        };
        Aabb { min: corner([0; 3]), max: corner(self.counts) }
    }

    /// Rays of the three families together.
    #[must_use]
    pub fn rays(&self) -> u64 {
        let [x, y, z] = self.counts.map(u64::from);
        x * y + y * z + z * x
    }

    /// Middle of a cell along one axis, in halves of a quantum.
    pub(crate) fn halves(&self, axis: usize, cell: u32) -> i64 {
        2 * i64::from(self.origin[axis]) + (2 * i64::from(cell) + 1) * i64::from(self.pitch)
    }

    /// Middle of a cell along one axis, mm.
    #[inline]
    pub(crate) fn centre(&self, axis: usize, cell: u32) -> f64 {
        self.halves(axis, cell) as f64 / (2.0 * QUANTA_PER_MM)
    }

    /// The cells along an axis whose middles lie in an interval: the first, and the one after the last.
    #[inline]
    pub(crate) fn middles_in(&self, axis: usize, low: f64, high: f64) -> [u32; 2] {
        let (from, pitch) = (f64::from(self.origin[axis]) / QUANTA_PER_MM, self.pitch_mm());
        let count = i64::from(self.counts[axis]);
        let first = -whole_below((from - low) / pitch + 0.5 + 1e-9);
        let end = whole_below((high - from) / pitch - 0.5 + 1e-9) + 1;
        // Both are cut off at the grid's ends.
        [first, end].map(|cell| cell.clamp(0, count) as u32)
    }

    /// The cell along an axis that holds a coordinate; beyond the grid its first or last.
    pub(crate) fn cell_of(&self, axis: usize, at: f64) -> u32 {
        let from = f64::from(self.origin[axis]) / QUANTA_PER_MM;
        (((at - from) / self.pitch_mm()).floor().max(0.0) as u32).min(self.counts[axis] - 1)
    }

    /// Tiles across a family's rays.
    pub(crate) fn tiles(&self, family: Family) -> [u32; 2] {
        family.across().map(|axis| self.counts[axis].div_ceil(SIDE))
    }
}

/// The largest whole number not above another one, within ±2⁶². Rays need two each: truncation costs less than a call of
/// `floor`, which processors of the baseline do not have as an instruction.
#[inline]
fn whole_below(x: f64) -> i64 {
    const LARGEST: f64 = (1_i64 << 62) as f64;
    // Within the range, and of what is no number 0.
    let whole = x.clamp(-LARGEST, LARGEST) as i64;
    whole - i64::from(whole as f64 > x)
}

/// What is beyond an `i32` becomes its smallest or largest.
#[inline]
fn narrowed(quanta: i64) -> i32 {
    quanta.clamp(i64::from(i32::MIN), i64::from(i32::MAX)) as i32
}

/// The largest whole quantum not above a coordinate.
#[inline]
pub(crate) fn floor(mm: f64) -> i32 {
    narrowed(whole_below(mm * QUANTA_PER_MM + SNAP))
}

/// The smallest whole quantum not below a coordinate.
#[inline]
pub(crate) fn ceil(mm: f64) -> i32 {
    narrowed(-whole_below(SNAP - mm * QUANTA_PER_MM))
}

/// A whole quantum as a coordinate, mm.
#[inline]
pub(crate) fn mm(quanta: i32) -> f64 {
    f64::from(quanta) / QUANTA_PER_MM
}

/// The family of rays that runs along the third of three axes, if all are axes of the coordinates.
pub(crate) fn family_along(axes: &[claymill_nurbs::Vector3; 3]) -> Option<Family> {
    let is_axis = |axis: &claymill_nurbs::Vector3| axis.iter().all(|c| *c == 0.0 || c.abs() == 1.0);
    let family = Family::ALL.into_iter().find(|k| axes[2][k.index()].abs() == 1.0);
    family.filter(|_| axes.iter().all(is_axis))
}

/// Refuses what is not a unit vector.
pub(crate) fn unit(v: &claymill_nurbs::Vector3) -> Result<claymill_nurbs::Vector3, StockError> {
    let length = v.norm();
    if (length - 1.0).abs() <= 1e-6 { Ok(v / length) } else { Err(StockError::Direction(length)) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn block(min: [f64; 3], max: [f64; 3]) -> Aabb {
        Aabb { min: min.into(), max: max.into() }
    }

    #[test]
    fn a_box_of_whole_cells_is_covered_exactly() {
        let bounds = block([-0.3, 0.29, 100.1], [9.7, 5.29, 103.1]);
        let grid = Grid::over(&bounds, 0.5).unwrap();
        assert_eq!(grid.cells(), [20, 10, 6]);
        assert_eq!(grid.bounds(), bounds);
        assert_eq!(grid.centre(0, 0), -0.05);
        assert_eq!(grid.middles_in(0, -0.05, 0.45), [0, 2]);
        assert_eq!(grid.middles_in(0, f64::NEG_INFINITY, f64::INFINITY), [0, 20]);
        assert_eq!(grid.middles_in(0, -9.0, -8.0), [0, 0]);
        assert_eq!(grid.middles_in(0, 20.0, 21.0), [20, 20]);
    }

    #[test]
    fn what_cannot_be_a_grid_is_refused() {
        let bounds = block([0.0; 3], [5000.0, 2000.0, 1500.0]);
        let refused = |b: &Aabb, pitch| Grid::over(b, pitch).unwrap_err();
        for pitch_mm in [0.0, -1.0, f64::INFINITY, 1e-4] {
            assert_eq!(refused(&bounds, pitch_mm), StockError::Pitch { pitch_mm });
        }
        assert!(matches!(refused(&bounds, f64::NAN), StockError::Pitch { .. }));
        let StockError::TooFine { bytes, fitting_mm, .. } = refused(&bounds, 0.3) else {
            panic!("it is too fine")
        };
        assert!(bytes > USUAL_BYTES && Grid::over(&bounds, fitting_mm).is_ok());
        assert_eq!(refused(&block([0.0; 3], [1.0, 1.0, 0.0]), 0.1), StockError::EmptyBox);
        assert_eq!(refused(&Aabb::empty(), 0.1), StockError::EmptyBox);
        assert!(matches!(refused(&block([0.0; 3], [1.0, 1.0, 1e6]), 0.1), StockError::TooFar { .. }));
        assert!(matches!(refused(&block([0.0, f64::NAN, 0.0], [1.0; 3]), 0.1), StockError::NotFinite(_)));
    }
}
