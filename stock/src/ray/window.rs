//! Which rays of a tile a sweep can meet: rows of them, between bounds that follow the way.

use claymill_nurbs::{Aabb, Point3};

use super::capsule::Capsule;
use super::frustum::Frustum;
use super::swollen::Swollen;
use super::{Turned, dot};
use crate::body::Solid;
use crate::grid::{self, Family, Grid, SIDE};
use crate::sweep::Sweep;

/// Bounds are wider by this, for rounding, mm.
const ROUNDING_MM: f64 = 1e-6;
/// Intervals of the parts of one tool that are no further apart than this are one, mm: stacked sections share a disc.
const JOINT_MM: f64 = 1e-9;
/// A cylinder without end ends this far beyond the stock, mm.
const BEYOND_MM: f64 = 1.0;

enum Shape {
    Capsule(Capsule),
    // Boxed: they are several times as large.
    Swollen(Box<Swollen>),
    Frustum(Box<Frustum>),
}

impl Shape {
    #[inline]
    fn interval(&self, u: f64, v: f64) -> Option<[f64; 2]> {
        match self {
            Shape::Capsule(shape) => shape.interval(u, v),
            Shape::Swollen(shape) => shape.interval(u, v),
            Shape::Frustum(shape) => shape.interval(u, v),
        }
    }
}

/// A solid on its way.
struct Part {
    shape: Shape,
    /// Box of the solid at the start.
    low: Turned,
    high: Turned,
    along: Turned,
}

/// A sweep as one family of rays meets it.
pub(crate) struct Seen {
    parts: Vec<Part>,
}

/// Middles of the columns and rows of a tile, and how many there are.
pub(crate) struct Places {
    family: Family,
    /// First cell of the tile along the two axes across.
    pub(crate) first: [u32; 2],
    columns: [f64; SIDE as usize],
    rows: [f64; SIDE as usize],
}

impl Places {
    pub(crate) fn new(grid: &Grid, family: Family, tile: usize) -> Self {
        let across = grid.tiles(family)[0] as usize;
        let first = [(tile % across) as u32 * SIDE, (tile / across) as u32 * SIDE];
        let [a, b] = family.across();
        let (mut columns, mut rows) = ([0.0; SIDE as usize], [0.0; SIDE as usize]);
        for i in 0..SIDE {
            columns[i as usize] = grid.centre(a, first[0] + i);
            rows[i as usize] = grid.centre(b, first[1] + i);
        }
        Places { family, first, columns, rows }
    }
}

impl Seen {
    pub(crate) fn new(grid: &Grid, family: Family, sweep: &Sweep<'_>) -> Self {
        let bounds = grid.bounds();
        let part = |solid: &Solid| Part::new(&bounds, family, sweep, solid);
        Seen { parts: sweep.body.solids.iter().filter_map(part).collect() }
    }

    /// The tiles that it may meet, as first and last along both axes; `None` beside the grid.
    pub(crate) fn tiles(&self, grid: &Grid, family: Family) -> Option<[[u32; 2]; 2]> {
        let mut cells = [[u32::MAX, 0]; 2];
        let k = family.index();
        let bounds = grid.bounds();
        for part in &self.parts {
            let ends = [0, 1, 2].map(|i| part.ends(i));
            if ends[2][0] > bounds.max[k] + FURTHER_MM || ends[2][1] < bounds.min[k] - FURTHER_MM {
                continue;
            }
            let found = [0, 1].map(|i| grid.middles_in(family.across()[i], ends[i][0], ends[i][1]));
            if found.iter().all(|f| f[0] < f[1]) {
                for (cells, found) in cells.iter_mut().zip(found) {
                    *cells = [cells[0].min(found[0]), cells[1].max(found[1])];
                }
            }
        }
        (cells[0][0] < cells[0][1]).then(|| cells.map(|[first, end]| [first / SIDE, (end - 1) / SIDE]))
    }

    /// Calls a function with rays of a tile and their intervals inside of the sweep, until it returns `true`. Only rays are
    /// looked at that `wanted` wants, given a range along them in quanta that holds all the intervals. The tile has nothing
    /// beyond `span`.
    pub(crate) fn any_ray(
        &self,
        grid: &Grid,
        places: &Places,
        span: [f64; 2],
        mut wanted: impl FnMut(usize, [i32; 2]) -> bool,
        mut each: impl FnMut(usize, [f64; 2]) -> bool,
    ) -> bool {
        let near = |part: &&Part| {
            let [low, high] = part.ends(2);
            low <= span[1] && high >= span[0]
        };
        let mut parts = self.parts.iter().filter(near);
        let (Some(one), more) = (parts.next(), parts.next()) else { return false };
        let Some(other) = more else {
            // A loop of its own for each shape: what is called for a ray is known within it.
            return match &one.shape {
                Shape::Capsule(shape) => one.any_ray(grid, places, |u, v| shape.interval(u, v), wanted, each),
                Shape::Swollen(shape) => one.any_ray(grid, places, |u, v| shape.interval(u, v), wanted, each),
                Shape::Frustum(shape) => one.any_ray(grid, places, |u, v| shape.interval(u, v), wanted, each),
            };
        };
        let parts: Vec<&Part> = [one, other].into_iter().chain(parts).collect();
        let ends = parts.iter().map(|part| part.ends(2));
        let reach =
            whole(ends.fold([f64::INFINITY, f64::NEG_INFINITY], |a, e| [a[0].min(e[0]), a[1].max(e[1])]));
        let mut intervals = Vec::with_capacity(parts.len());
        for (v, row) in places.rows.iter().copied().enumerate() {
            let ranges = parts.iter().map(|part| part.columns(grid, places, row));
            let [from, to] = ranges
                .filter(|r| r[0] < r[1])
                .fold([usize::MAX, 0], |all, range| [all[0].min(range[0]), all[1].max(range[1])]);
            for u in from..to {
                let ray = v * SIDE as usize + u;
                if !wanted(ray, reach) {
                    continue;
                }
                intervals.clear();
                intervals.extend(parts.iter().filter_map(|p| p.shape.interval(places.columns[u], row)));
                join(&mut intervals);
                if intervals.iter().any(|interval| each(ray, *interval)) {
                    return true;
                }
            }
        }
        false
    }
}

/// What reaches beyond the grid along a ray is kept (see `Stock::from_rays`): its tiles have spans of their own, and this
/// looks only whether a sweep is hopelessly far, mm.
const FURTHER_MM: f64 = 4e5;

/// A range in whole quanta, widened.
fn whole([low, high]: [f64; 2]) -> [i32; 2] {
    [grid::floor(low), grid::ceil(high)]
}

/// Sorts intervals and joins those that overlap or nearly touch.
fn join(intervals: &mut Vec<[f64; 2]>) {
    if intervals.len() < 2 {
        return;
    }
    intervals.sort_unstable_by(|a, b| a[0].total_cmp(&b[0]));
    let mut kept = 0;
    for i in 1..intervals.len() {
        let next = intervals[i];
        if next[0] <= intervals[kept][1] + JOINT_MM {
            intervals[kept][1] = intervals[kept][1].max(next[1]);
        } else {
            kept += 1;
            intervals[kept] = next;
        }
    }
    intervals.truncate(kept + 1);
}

impl Part {
    fn new(bounds: &Aabb, family: Family, sweep: &Sweep<'_>, solid: &Solid) -> Option<Self> {
        let along = family.turned((sweep.to - sweep.from).as_ref());
        let axis = family.turned(sweep.axis.as_ref());
        let on_axis = |height: f64| family.turned((sweep.from + sweep.axis * height).coords.as_ref());
        // How far a disc of radius 1 reaches along each coordinate.
        let disc = axis.map(|c| (1.0 - c * c).max(0.0).sqrt());
        let around = |middle: Turned, radius: f64, ball: f64| {
            let half = disc.map(|d| radius * d + ball + ROUNDING_MM);
            [0, 1, 2].map(|i| [middle[i] - half[i], middle[i] + half[i]])
        };
        let (shape, ends) = match *solid {
            Solid::Swollen { height, flat, corner } => {
                let middle = on_axis(height);
                let shape = if flat > 0.0 {
                    Shape::Swollen(Box::new(Swollen::new(middle, axis, along, flat, corner)))
                } else {
                    Shape::Capsule(Capsule::new(middle, along, corner))
                };
                (shape, around(middle, flat, corner))
            }
            Solid::Frustum { low, high, .. } => {
                let top = if high[0].is_finite() { high[0] } else { top_of(bounds, sweep) };
                if top <= low[0] {
                    return None;
                }
                let (base, upper) = (on_axis(low[0]), on_axis(top));
                let shape = Frustum::new(base, axis, along, top - low[0], [low[1], high[1]]);
                let (a, b) = (around(base, low[1], 0.0), around(upper, high[1], 0.0));
                let ends = [0, 1, 2].map(|i| [a[i][0].min(b[i][0]), a[i][1].max(b[i][1])]);
                (Shape::Frustum(Box::new(shape)), ends)
            }
        };
        Some(Part { shape, low: ends.map(|e| e[0]), high: ends.map(|e| e[1]), along })
    }

    /// Where it is along a coordinate on its whole way.
    fn ends(&self, i: usize) -> [f64; 2] {
        [self.low[i] + self.along[i].min(0.0), self.high[i] + self.along[i].max(0.0)]
    }

    /// See `Seen::any_ray`.
    #[inline]
    fn any_ray(
        &self,
        grid: &Grid,
        places: &Places,
        interval: impl Fn(f64, f64) -> Option<[f64; 2]>,
        mut wanted: impl FnMut(usize, [i32; 2]) -> bool,
        mut each: impl FnMut(usize, [f64; 2]) -> bool,
    ) -> bool {
        let reach = whole(self.ends(2));
        for (v, row) in self.rows(grid, places) {
            let [from, to] = self.columns(grid, places, row);
            for u in from..to {
                let ray = v * SIDE as usize + u;
                if wanted(ray, reach)
                    && let Some(interval) = interval(places.columns[u], row)
                    && each(ray, interval)
                {
                    return true;
                }
            }
        }
        false
    }

    /// The rows of a tile that it may meet.
    fn rows<'p>(&self, grid: &Grid, places: &'p Places) -> impl Iterator<Item = (usize, f64)> + use<'p> {
        let [low, high] = self.ends(1);
        let [from, to] = in_tile(grid, places, 1, low, high);
        places.rows.iter().copied().enumerate().take(to).skip(from)
    }

    /// The columns of a row that it may meet: where its box is while that covers the row.
    #[inline]
    fn columns(&self, grid: &Grid, places: &Places, row: f64) -> [usize; 2] {
        let [du, dv, _] = self.along;
        let (mut s0, mut s1) = (0.0, 1.0);
        if dv == 0.0 {
            if row < self.low[1] || row > self.high[1] {
                return [0, 0];
            }
        } else {
            let (a, b) = ((row - self.high[1]) / dv, (row - self.low[1]) / dv);
            (s0, s1) = (a.min(b).max(0.0), a.max(b).min(1.0));
            if s0 > s1 {
                return [0, 0];
            }
        }
        let (a, b) = (s0 * du, s1 * du);
        in_tile(grid, places, 0, self.low[0] + a.min(b), self.high[0] + a.max(b))
    }
}

/// The cells of a tile, counted within it, whose middles lie in an interval of one of the axes across.
#[inline]
fn in_tile(grid: &Grid, places: &Places, i: usize, low: f64, high: f64) -> [usize; 2] {
    let [from, to] = grid.middles_in(places.family.across()[i], low, high);
    let first = places.first[i];
    let from = from.saturating_sub(first).min(SIDE);
    let to = to.saturating_sub(first).min(SIDE);
    [from as usize, to as usize]
}

/// A height above the tip that is beyond the stock all along the way.
fn top_of(bounds: &Aabb, sweep: &Sweep<'_>) -> f64 {
    let along = |p: &Point3| dot(p.coords.as_ref(), sweep.axis.as_ref());
    let corner = |k: usize| if sweep.axis[k] > 0.0 { bounds.max[k] } else { bounds.min[k] };
    along(&Point3::new(corner(0), corner(1), corner(2))) - along(&sweep.from).min(along(&sweep.to))
        + BEYOND_MM
}
