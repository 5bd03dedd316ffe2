//! The outline of what is within a band of heights along an axis, between the rays by the rays across.
//!
//! ```text
//!     ○     ○     ○        Rays along the heights are nodes: ● with material in the band, ○ without. From a node with
//!        ╱─────╲           material to one without, rays across say how far material comes. Between these places the
//!     ○ ╱ ●     ● ╲  ○     outline is straight: it is exact on lines of the grid, and cuts corners off by less than
//!       │         │        the diagonal of half a cell.
//! ```
//!
//! Rows of rays across lie in the band. A slope is widest at an end of it, so it goes on from the last two rows to there.

use claymill_nurbs::{Point3, Vector3};
use rayon::prelude::*;

use crate::Stock;
use crate::grid::{self, Family};
use crate::intervals::overlaps;

/// Polygons across an axis, each a list of corners along two axes, mm.
pub type Polygons = Vec<Vec<[f64; 2]>>;

/// Slopes go on from a row whose material ends up to so many nodes behind the last one with any.
const BEHIND: f64 = 2.0;

/// The two axes across the heights: how many nodes there are along each.
struct Nodes<'s> {
    stock: &'s Stock,
    family: Family,
    counts: [i64; 2],
    pitch_mm: f64,
    /// A bit a node, row by row.
    is_material: Vec<bool>,
    /// Rows of rays across that say how far material comes: those in the band, or else the next ones.
    rows: [u32; 2],
    /// The ends of the band.
    heights: [f64; 2],
}

impl Stock {
    /// Where material is between two heights along the third of three unit vectors at right angles, which are axes of the
    /// coordinates: polygons that may overlap, along the first two. `None` of other vectors, or of an empty band.
    #[must_use]
    pub fn outline(&self, axes: [Vector3; 3], low_mm: f64, high_mm: f64) -> Option<Polygons> {
        if low_mm.is_nan() || high_mm.is_nan() || low_mm >= high_mm {
            return None;
        }
        let family = grid::family_along(&axes)?;
        let sign = axes[2][family.index()];
        let ends = [low_mm * sign, high_mm * sign];
        let nodes = Nodes::new(self, family, [ends[0].min(ends[1]), ends[0].max(ends[1])]);
        let [a, b] = family.across();
        let seen = |[x, y]: [f64; 2]| {
            let mut p = Point3::origin();
            (p[a], p[b]) = (x, y);
            [0, 1].map(|i| p.coords.dot(&axes[i]))
        };
        let rows: Vec<Polygons> = (-1..nodes.counts[1]).into_par_iter().map(|j| nodes.between(j)).collect();
        Some(rows.into_iter().flatten().map(|polygon| polygon.into_iter().map(seen).collect()).collect())
    }
}

impl<'s> Nodes<'s> {
    fn new(stock: &'s Stock, family: Family, [low, high]: [f64; 2]) -> Self {
        let ([a, b], k) = (family.across(), family.index());
        let grid = &stock.grid;
        let cells = grid.cells();
        let (from, to) = (grid::floor(low), grid::ceil(high));
        let is_material = (0..cells[b])
            .into_par_iter()
            .flat_map_iter(|j| (0..cells[a]).map(move |i| [i, j]))
            .map(|cell| overlaps(stock.list(family, cell), from, to))
            .collect();
        let height = |m: u32| grid.centre(k, m);
        let first = (0..cells[k]).find(|m| height(*m) >= low).unwrap_or(cells[k] - 1);
        let last = (0..cells[k]).rfind(|m| height(*m) <= high).unwrap_or(0);
        // Between two rows there is none: both tell.
        let rows = [first.min(last), first.max(last)];
        let counts = [a, b].map(|axis| i64::from(cells[axis]));
        Nodes { stock, family, counts, pitch_mm: grid.pitch_mm(), is_material, rows, heights: [low, high] }
    }

    fn has(&self, [i, j]: [i64; 2]) -> bool {
        let is_node = (0..self.counts[0]).contains(&i) && (0..self.counts[1]).contains(&j);
        is_node && self.is_material[(j * self.counts[0] + i) as usize]
    }

    fn place(&self, [i, j]: [i64; 2]) -> [f64; 2] {
        let [a, b] = self.family.across();
        // Beside the grid there are nodes without material.
        let at = |axis: usize, n: i64| self.stock.grid.centre(axis, 0) + n as f64 * self.pitch_mm;
        [at(a, i), at(b, j)]
    }

    /// The material of a ray of a row along one of the axes across, which passes a node.
    fn of_row(&self, axis: usize, [i, j]: [i64; 2], row: u32) -> impl Iterator<Item = [f64; 2]> {
        let [a, b] = self.family.across();
        let (family, cell) =
            if axis == 0 { (Family::ALL[a], [j as u32, row]) } else { (Family::ALL[b], [row, i as u32]) };
        self.stock.list(family, cell).iter().map(|ends| ends.map(grid::mm))
    }

    /// The material of all rows of such rays within two places.
    fn along(&self, axis: usize, node: [i64; 2], within: [f64; 2]) -> impl Iterator<Item = [f64; 2]> {
        let within = [within[0].min(within[1]), within[0].max(within[1])];
        (self.rows[0]..=self.rows[1])
            .flat_map(move |row| self.of_row(axis, node, row))
            .map(move |[from, to]| [from.max(within[0]), to.min(within[1])])
            .filter(|[from, to]| from < to)
    }

    /// How far material comes from a node with some to its neighbour without any: as far as a row says, or as a slope goes on from
    /// two rows to the end of the band.
    fn reach(&self, axis: usize, from: [i64; 2], to: [i64; 2]) -> [f64; 2] {
        let (mut at, other) = (self.place(from), self.place(to));
        let ends = [at[axis], other[axis]];
        let sign = (ends[1] - ends[0]).signum();
        let far = self.along(axis, from, ends).map(|[a, b]| if sign > 0.0 { b } else { -a }).reduce(f64::max);
        // Where no ray says it, all of the way.
        at[axis] = far.map_or(ends[1], |far| {
            let slopes = [0, 1].into_iter().filter_map(|end| self.slope(axis, from, [ends[0], sign], end));
            sign * slopes.fold(far, f64::max).min(sign * ends[1])
        });
        at
    }

    /// How far material about a node comes in a direction at an end of the band, as the last two rows before it go on.
    fn slope(&self, axis: usize, node: [i64; 2], way @ [start, sign]: [f64; 2], end: usize) -> Option<f64> {
        let [low, high] = self.rows;
        if low == high {
            return None;
        }
        let rows = if end == 0 { [low, low + 1] } else { [high, high - 1] };
        let [height, inner] = rows.map(|row| self.stock.grid.centre(self.family.index(), row));
        let beyond = (height - self.heights[end]) / (inner - height);
        let own = self.far(axis, node, rows[0], way)?;
        let of_inner = self.far(axis, node, rows[1], way).unwrap_or(sign * start);
        (beyond > 0.0).then_some(own + beyond * (own - of_inner))
    }

    /// How far material of a row about a node comes in a direction, and no farther than the next node; to the last node or two
    /// behind it if it is not there.
    fn far(&self, axis: usize, node: [i64; 2], row: u32, [start, sign]: [f64; 2]) -> Option<f64> {
        let at = sign * start;
        let pieces = self.of_row(axis, node, row).map(|[a, b]| if sign > 0.0 { [a, b] } else { [-b, -a] });
        let near = pieces.filter(|[a, b]| *a < at + self.pitch_mm && *b > at - BEHIND * self.pitch_mm);
        near.map(|[_, b]| b.min(at + self.pitch_mm)).reduce(f64::max)
    }

    /// The polygons between a row of nodes and the next one, and what is thinner than a pitch beside the first.
    fn between(&self, j: i64) -> Polygons {
        let mut found = Polygons::new();
        let mut full: Option<i64> = None;
        for i in -1..self.counts[0] {
            let corners = [[i, j], [i + 1, j], [i + 1, j + 1], [i, j + 1]];
            let count = corners.iter().filter(|c| self.has(**c)).count();
            match (count, full) {
                (4, None) => full = Some(i),
                (0..4, Some(first)) => {
                    found.push(self.rectangle([first, j], [i, j + 1]));
                    full = None;
                }
                _ => {}
            }
            if (1..4).contains(&count) {
                found.push(self.piece(&corners));
            }
            self.thin([i, j], &mut found);
        }
        // The last nodes of a row are beside the grid.
        found
    }

    fn rectangle(&self, low: [i64; 2], high: [i64; 2]) -> Vec<[f64; 2]> {
        let ([x0, y0], [x1, y1]) = (self.place(low), self.place(high));
        vec![[x0, y0], [x1, y0], [x1, y1], [x0, y1]]
    }

    /// What is between four nodes of which some have material, anticlockwise.
    fn piece(&self, corners: &[[i64; 2]; 4]) -> Vec<[f64; 2]> {
        let mut polygon = Vec::with_capacity(6);
        for k in 0..4 {
            let (here, next) = (corners[k], corners[(k + 1) % 4]);
            let axis = k % 2;
            match (self.has(here), self.has(next)) {
                (true, true) => polygon.push(self.place(here)),
                (true, false) => polygon.extend([self.place(here), self.reach(axis, here, next)]),
                (false, true) => polygon.push(self.reach(axis, next, here)),
                (false, false) => {}
            }
        }
        polygon
    }

    /// What is between a node without material and the next ones without: thinner than a pitch, and as wide as a cell.
    fn thin(&self, at: [i64; 2], found: &mut Polygons) {
        for axis in 0..2 {
            let mut next = at;
            next[axis] += 1;
            let is_ray = (0..self.counts[1 - axis]).contains(&at[1 - axis]);
            if !is_ray || self.has(at) || self.has(next) {
                continue;
            }
            let (place, half) = (self.place(at), 0.5 * self.pitch_mm);
            let mut pieces: Vec<_> = self.along(axis, at, [place[axis], self.place(next)[axis]]).collect();
            pieces.sort_unstable_by(|p, q| p[0].total_cmp(&q[0]));
            // Of all rows what any of them has.
            pieces.dedup_by(|next, so_far| {
                let is_met = next[0] <= so_far[1];
                so_far[1] = if is_met { so_far[1].max(next[1]) } else { so_far[1] };
                is_met
            });
            for [from, to] in pieces {
                let (mut low, mut high) = (place, place);
                (low[axis], high[axis]) = (from, to);
                (low[1 - axis], high[1 - axis]) = (place[1 - axis] - half, place[1 - axis] + half);
                found.push(vec![low, [high[0], low[1]], high, [low[0], high[1]]]);
            }
        }
    }
}
