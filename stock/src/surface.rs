//! A triangle mesh of the stock's surface for pictures.
//!
//! Rays of the three families meet in the middles of cells. These are the nodes of a lattice, inside or outside by the rays
//! along x. Eight neighbours of which some are inside have one vertex between them: the mean of where their twelve sides,
//! pieces of rays, leave the stock. Every side that leaves it is the middle of a quadrilateral of four vertices. So the
//! mesh is closed; it may touch itself along edges.

use claymill_nurbs::{Point3, Vector3};
use rayon::prelude::*;
use rustc_hash::FxHashMap;

use crate::grid::{self, Family};
use crate::{Stock, StockError};

/// Triangles of a surface, wound anticlockwise seen from outside.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct SurfaceMesh {
    /// Corners, mm.
    pub points_mm: Vec<Point3>,
    /// Three corners each.
    pub triangles: Vec<[u32; 3]>,
}

/// Nodes of the lattice at most: one bit each.
const MOST_NODES: u64 = 1 << 30;
/// A cell of the lattice from a corner: the twelve sides by axis and first node.
const SIDES: [(usize, [usize; 3]); 12] = [
    (0, [0, 0, 0]),
    (0, [0, 1, 0]),
    (0, [0, 0, 1]),
    (0, [0, 1, 1]),
    (1, [0, 0, 0]),
    (1, [1, 0, 0]),
    (1, [0, 0, 1]),
    (1, [1, 0, 1]),
    (2, [0, 0, 0]),
    (2, [1, 0, 0]),
    (2, [0, 1, 0]),
    (2, [1, 1, 0]),
];

/// Nodes are counted from one before the first ray, so that all at the border are outside.
struct Lattice<'s> {
    stock: &'s Stock,
    /// Every so many rays are used.
    step: u32,
    nodes: [usize; 3],
    /// A row of bits along x for each y and z.
    rows: Vec<Vec<u64>>,
}

impl Stock {
    /// The surface by every `step`-th ray.
    ///
    /// # Errors
    /// More than 2³⁰ nodes, or more than 2³² vertices.
    pub fn surface(&self, step: u32) -> Result<SurfaceMesh, StockError> {
        let step = step.max(1);
        let nodes = self.grid.counts.map(|n| n.div_ceil(step) as usize + 2);
        let cells: u64 = nodes.iter().map(|n| *n as u64).product();
        if cells > MOST_NODES {
            return Err(StockError::TooManyCells { what: "a surface", cells, limit: MOST_NODES });
        }
        let row = |i: usize| self.row([i % nodes[1], i / nodes[1]], step, &nodes);
        let rows = (0..nodes[1] * nodes[2]).into_par_iter().map(row).collect();
        let lattice = Lattice { stock: self, step, nodes, rows };
        let layers: Vec<_> = (0..nodes[2] - 1).into_par_iter().map(|z| lattice.vertices(z)).collect();
        let mut mesh = SurfaceMesh::default();
        let mut numbers: FxHashMap<[usize; 3], u32> = FxHashMap::default();
        for (cell, vertex) in layers.into_iter().flatten() {
            // Vertices are fewer than nodes.
            numbers.insert(cell, mesh.points_mm.len() as u32);
            mesh.points_mm.push(vertex);
        }
        let quads = (0..nodes[2] - 1).into_par_iter().map(|z| lattice.triangles(z, &numbers));
        mesh.triangles = quads.collect::<Vec<_>>().concat();
        Ok(mesh)
    }

    /// Which nodes of a row along x are inside.
    fn row(&self, [y, z]: [usize; 2], step: u32, nodes: &[usize; 3]) -> Vec<u64> {
        let mut bits = vec![0; nodes[0].div_ceil(64)];
        if y == 0 || z == 0 || y > nodes[1] - 2 || z > nodes[2] - 2 {
            return bits;
        }
        let cell = [y, z].map(|i| (i as u32 - 1) * step);
        for interval in self.list(Family::X, cell) {
            let [from, to] = self.grid.middles_in(0, grid::mm(interval[0]), grid::mm(interval[1]));
            for x in from.div_ceil(step)..to.div_ceil(step) {
                let node = x as usize + 1;
                bits[node / 64] |= 1 << (node % 64);
            }
        }
        bits
    }
}

impl Lattice<'_> {
    fn is_inside(&self, [x, y, z]: [usize; 3]) -> bool {
        self.rows[z * self.nodes[1] + y][x / 64] >> (x % 64) & 1 == 1
    }

    /// Coordinate of a node along an axis, mm.
    fn coordinate(&self, axis: usize, node: usize) -> f64 {
        let grid = &self.stock.grid;
        grid.centre(axis, 0) + (node as f64 - 1.0) * f64::from(self.step) * grid.pitch_mm()
    }

    /// Where a side leaves the stock: at the end of an interval of its ray, else in the middle.
    fn crossing(&self, axis: usize, node: [usize; 3]) -> Point3 {
        let family = Family::ALL[axis];
        let mut p = Point3::from([0, 1, 2].map(|k| self.coordinate(k, node[k])));
        let (low, high) = (p[axis], self.coordinate(axis, node[axis] + 1));
        // One of both nodes is inside, and so a ray of the grid: neither cell is at the border.
        let cell = family.across().map(|a| (node[a] as u32).wrapping_sub(1).wrapping_mul(self.step));
        let end = usize::from(self.is_inside(node));
        let ends = self.stock.list(family, cell).iter().map(|i| grid::mm(i[end]));
        p[axis] = ends.into_iter().find(|e| (low..=high).contains(e)).unwrap_or(0.5 * (low + high));
        p
    }

    /// The cells of a layer that the surface passes, each with its vertex, in order.
    fn vertices(&self, z: usize) -> Vec<([usize; 3], Point3)> {
        let mut found = Vec::new();
        for y in 0..self.nodes[1] - 1 {
            for x in 0..self.nodes[0] - 1 {
                let corner = |i: usize| self.is_inside([x + (i & 1), y + (i >> 1 & 1), z + (i >> 2)]);
                let first = corner(0);
                if (1..8).all(|i| corner(i) == first) {
                    continue;
                }
                let (mut sum, mut count) = (Vector3::zeros(), 0.0);
                for (axis, [i, j, k]) in SIDES {
                    let node = [x + i, y + j, z + k];
                    let mut other = node;
                    other[axis] += 1;
                    if self.is_inside(node) != self.is_inside(other) {
                        sum += self.crossing(axis, node).coords;
                        count += 1.0;
                    }
                }
                found.push(([x, y, z], Point3::from(sum / count)));
            }
        }
        found
    }

    /// Two triangles about every side of a layer that leaves the stock.
    fn triangles(&self, z: usize, numbers: &FxHashMap<[usize; 3], u32>) -> Vec<[u32; 3]> {
        let mut found = Vec::new();
        for y in 0..self.nodes[1] - 1 {
            for x in 0..self.nodes[0] - 1 {
                let node = [x, y, z];
                for axis in 0..3 {
                    let mut other = node;
                    other[axis] += 1;
                    let is_inside = self.is_inside(node);
                    if is_inside == self.is_inside(other) {
                        continue;
                    }
                    let [a, b] = Family::ALL[axis].across();
                    let cell = |da: usize, db: usize| {
                        let mut cell = node;
                        // A side that leaves the stock has a node inside, beside which there is a cell on either side.
                        cell[a] -= da;
                        cell[b] -= db;
                        numbers[&cell]
                    };
                    let mut quad = [cell(1, 1), cell(0, 1), cell(0, 0), cell(1, 0)];
                    if !is_inside {
                        quad.reverse();
                    }
                    found.extend([[quad[0], quad[1], quad[2]], [quad[0], quad[2], quad[3]]]);
                }
            }
        }
        found
    }
}
