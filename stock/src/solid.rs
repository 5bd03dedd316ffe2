//! Stock from a closed triangle mesh: a ray is inside after an odd number of triangles.
//!
//! Corners of triangles and rays are whole halves of a quantum, and the side of an edge on which a ray lies is computed
//! without rounding. A ray that meets an edge or a corner is moved aside by an infinitesimal amount, always to the same
//! side. So neighbouring triangles agree, and the number of triangles along a ray through a closed mesh is even.

use claymill_nurbs::Point3;
use rustc_hash::FxHashMap;

use crate::grid::{FARTHEST_MM, Family, Grid, QUANTA_PER_MM, SIDE};
use crate::intervals::united;
use crate::tile::{Lists, ray_in_tile};
use crate::{Stock, StockError};

/// A corner in halves of a quantum.
type Corner = [i64; 3];
/// Rounding of a depth, quanta.
const SNAP: f64 = 1e-4;

impl Stock {
    /// What a closed mesh encloses: places from which every ray meets it an odd number of times. Which way triangles are
    /// wound does not matter. Corners are rounded to 0.1 µm.
    ///
    /// # Errors
    /// A mesh with an edge that bounds an odd number of triangles: it is open; a corner that is no number or not there;
    /// nothing inside on any ray of the grid.
    pub fn solid(grid: Grid, vertices: &[Point3], triangles: &[[u32; 3]]) -> Result<Self, StockError> {
        let corners = rounded(vertices)?;
        let faces = welded(&corners, triangles)?;
        let families = Family::ALL.map(|family| sorted(&grid, family, &faces));
        Stock::from_tiles(grid, |lists, family, tile| {
            let (first, order) = &families[family.index()];
            let number = (tile[1] * grid.tiles(family)[0] + tile[0]) as usize;
            let mut met: Vec<(usize, f64)> = Vec::new();
            for &face in &order[first[number]..first[number + 1]] {
                meet(&grid, family, tile, &faces[face as usize], &mut met);
            }
            fill(lists, met);
            Ok(())
        })
    }
}

fn rounded(vertices: &[Point3]) -> Result<Vec<Corner>, StockError> {
    let corner = |p: &Point3| {
        if !p.iter().all(|c| c.is_finite()) {
            return Err(StockError::NotFinite("a corner of the mesh"));
        }
        let reach_mm = p.iter().fold(0.0, |a: f64, c| a.max(c.abs()));
        if reach_mm > FARTHEST_MM {
            return Err(StockError::TooFar { reach_mm });
        }
        Ok([0, 1, 2].map(|k| 2 * (p[k] * QUANTA_PER_MM).round() as i64))
    };
    vertices.iter().map(corner).collect()
}

/// Triangles by their corners, without those that are none after rounding. Refuses an open mesh.
fn welded(corners: &[Corner], triangles: &[[u32; 3]]) -> Result<Vec<[Corner; 3]>, StockError> {
    let mut faces = Vec::with_capacity(triangles.len());
    let mut odd: FxHashMap<[Corner; 2], bool> = FxHashMap::default();
    for (triangle, vertices) in triangles.iter().enumerate() {
        let no_vertex = |&vertex: &u32| StockError::NoVertex { triangle, vertex, vertices: corners.len() };
        let missing = vertices.iter().find(|v| **v as usize >= corners.len());
        if let Some(vertex) = missing {
            return Err(no_vertex(vertex));
        }
        let face = vertices.map(|v| corners[v as usize]);
        if face[0] == face[1] || face[1] == face[2] || face[2] == face[0] {
            continue;
        }
        for i in 0..3 {
            let (a, b) = (face[i], face[(i + 1) % 3]);
            let parity = odd.entry([a.min(b), a.max(b)]).or_insert(false);
            *parity = !*parity;
        }
        faces.push(face);
    }
    let open = odd.into_iter().filter(|(_, is_odd)| *is_odd).map(|(edge, _)| edge);
    let (edges, first) = open.fold((0, None), |(count, first): (usize, Option<[Corner; 2]>), edge| {
        (count + 1, Some(first.map_or(edge, |f| f.min(edge))))
    });
    match first {
        None => Ok(faces),
        Some([at, _]) => {
            let at_mm = Point3::from(at.map(|c| c as f64 / (2.0 * QUANTA_PER_MM)));
            Err(StockError::OpenMesh { edges, at_mm })
        }
    }
}

/// First and last cell along an axis whose middles lie between two places.
fn cells(grid: &Grid, axis: usize, low: i64, high: i64) -> Option<[u32; 2]> {
    let (start, step) = (grid.halves(axis, 0), 2 * i64::from(grid.pitch));
    // Rounded up and down.
    let from = (low - start + step - 1).div_euclid(step).max(0);
    let to = (high - start).div_euclid(step).min(i64::from(grid.counts[axis]) - 1);
    // Both are cells of the grid.
    (from <= to).then_some([from as u32, to as u32])
}

/// The cells that a triangle covers, seen along a family's rays.
fn covered(grid: &Grid, family: Family, face: &[Corner; 3]) -> Option<[[u32; 2]; 2]> {
    let [u, v] = family.across().map(|axis| {
        let at = face.map(|corner| corner[axis]);
        cells(grid, axis, at[0].min(at[1]).min(at[2]), at[0].max(at[1]).max(at[2]))
    });
    Some([u?, v?])
}

/// The triangles of each tile: where its list begins, and all lists.
fn sorted(grid: &Grid, family: Family, faces: &[[Corner; 3]]) -> (Vec<usize>, Vec<u32>) {
    let [across, rows] = grid.tiles(family);
    let each = |f: &mut dyn FnMut(usize, u32)| {
        for (number, face) in faces.iter().enumerate() {
            let Some([u, v]) = covered(grid, family, face) else { continue };
            for row in v[0] / SIDE..=v[1] / SIDE {
                for column in u[0] / SIDE..=u[1] / SIDE {
                    // Triangles are counted by `u32` vertices: there are fewer than 2³².
                    f((row * across + column) as usize, number as u32);
                }
            }
        }
    };
    let count = (across * rows) as usize;
    let mut first = vec![0; count + 1];
    each(&mut |tile, _| first[tile + 1] += 1);
    for i in 0..count {
        first[i + 1] += first[i];
    }
    let (mut next, mut order) = (first.clone(), vec![0; first[count]]);
    each(&mut |tile, face| {
        order[next[tile]] = face;
        next[tile] += 1;
    });
    (first, order)
}

/// Where the rays of a tile meet a triangle: number of the ray and depth, quanta.
fn meet(grid: &Grid, family: Family, tile: [u32; 2], face: &[Corner; 3], met: &mut Vec<(usize, f64)>) {
    let Some(covered) = covered(grid, family, face) else { return };
    let ([a, b], k) = (family.across(), family.index());
    let range = |i: usize| {
        let first = covered[i][0].max(tile[i] * SIDE);
        first..(covered[i][1] + 1).min((tile[i] + 1) * SIDE)
    };
    let flat = face.map(|corner| [corner[a], corner[b]]);
    for v in range(1) {
        for u in range(0) {
            let p = [grid.halves(a, u), grid.halves(b, v)];
            // Opposite of each corner.
            let sides = [0, 1, 2].map(|i| side(&flat[(i + 1) % 3], &flat[(i + 2) % 3], &p));
            if sides[0].1 == sides[1].1 && sides[1].1 == sides[2].1 {
                let [x, y, z] = sides.map(|(area, _)| area as f64);
                let depth = x * face[0][k] as f64 + y * face[1][k] as f64 + z * face[2][k] as f64;
                met.push((ray_in_tile(u, v), depth / (x + y + z) / 2.0));
            }
        }
    }
}

/// Twice the area of the triangle from an edge to a place, and whether the place, moved by `(ε, ε²)`, is on its left.
fn side(from: &[i64; 2], to: &[i64; 2], p: &[i64; 2]) -> (i128, bool) {
    let (du, dv) = (to[0] - from[0], to[1] - from[1]);
    let area = i128::from(du) * i128::from(p[1] - from[1]) - i128::from(dv) * i128::from(p[0] - from[0]);
    let is_left = match area {
        0 if dv != 0 => dv < 0,
        0 => du > 0,
        _ => area > 0,
    };
    (area, is_left)
}

/// Pairs the depths of each ray.
fn fill(lists: &mut Lists, mut met: Vec<(usize, f64)>) {
    met.sort_unstable_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
    for of_ray in met.chunk_by(|a, b| a.0 == b.0) {
        let pairs = of_ray.chunks_exact(2);
        let whole = pairs.map(|p| [(p[0].1 + SNAP).floor() as i32, (p[1].1 - SNAP).ceil() as i32]);
        lists.rays[of_ray[0].0] = united(whole.collect());
    }
}
