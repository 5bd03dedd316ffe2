//! Stock as a layer on a surface: clay on an armature, as everything within a distance of triangles.
//!
//! ```text
//!        ╭───────────────╮         capsules along the edges of triangles that are small beside the layer.
//!      t │  ·──·──·──·   │         A point over the inside of a triangle, t from it, is √(t² + r²) from an
//!        ╰──│──│──│──│───╯         edge, where r is the triangle's inradius: the capsules are as thick as
//!           ╰──surface───           that, so that nothing is missing
//! ```

use claymill_nurbs::{Point3, Vector3};
use claymill_toolpath::Tool;
use rustc_hash::FxHashSet;

use crate::grid::{Grid, QUANTUM_MM};
use crate::intervals::subtract;
use crate::{Stock, StockError, Sweep, ToolBody};

/// Triangles are divided until their inradius is no more than this share of the thickness: so the layer is thicker than asked
/// by half a hundredth at most.
const FINE: f64 = 0.1;
/// Triangles are divided so often at most, each time along their longest edge.
const MOST_HALVINGS: u32 = 24;

impl Stock {
    /// Everything within a distance of a surface that is given by triangles, on both sides: no less, and up to half a hundredth
    /// of the thickness more. What lies beyond the grid is not there.
    ///
    /// # Errors
    /// A thickness that is none; a triangle with a corner that is not there; as [`Sweep::new`]; no ray passes the layer.
    pub fn layer(
        grid: Grid,
        points: &[Point3],
        triangles: &[[u32; 3]],
        thickness_mm: f64,
    ) -> Result<Self, StockError> {
        if !(thickness_mm > 0.0 && thickness_mm.is_finite()) {
            return Err(StockError::Size { what: "a layer", mm: thickness_mm, least: QUANTUM_MM });
        }
        let fine_mm = FINE * thickness_mm;
        let radius_mm = thickness_mm.hypot(fine_mm) + 2.0 * QUANTUM_MM;
        let (ball, up) = (ToolBody::end(&Tool::ball(radius_mm))?, Vector3::z());
        let tip = |p: &Point3| p - up * radius_mm;
        let mut capsules = Vec::new();
        let mut seen: FxHashSet<[u32; 2]> = FxHashSet::default();
        for (triangle, vertices) in triangles.iter().enumerate() {
            if let Some(&vertex) = vertices.iter().find(|v| **v as usize >= points.len()) {
                return Err(StockError::NoVertex { triangle, vertex, vertices: points.len() });
            }
            let corners = vertices.map(|v| points[v as usize]);
            for i in 0..3 {
                let (a, b) = (i, (i + 1) % 3);
                if seen.insert([vertices[a].min(vertices[b]), vertices[a].max(vertices[b])]) {
                    capsules.push(Sweep::new(&ball, up, tip(&corners[a]), tip(&corners[b]))?);
                }
            }
            for [a, b] in across(corners, fine_mm) {
                capsules.push(Sweep::new(&ball, up, tip(&a), tip(&b))?);
            }
        }
        let block = Stock::block_in(grid, &grid.bounds())?;
        let mut around = block.clone();
        around.cut_all(&capsules);
        // What the capsules took is the layer.
        Stock::from_lists(grid, |ray| {
            let mut layer = block.list(ray.family, ray.cell).to_vec();
            for rest in around.list(ray.family, ray.cell) {
                subtract(&mut layer, rest[0], rest[1]);
            }
            Ok(layer)
        })
    }
}

/// Lines across a triangle by which it is divided into ones of a small inradius.
fn across(corners: [Point3; 3], inradius_mm: f64) -> Vec<[Point3; 2]> {
    let (mut lines, mut waiting) = (Vec::new(), vec![(corners, 0)]);
    while let Some(([a, b, c], halvings)) = waiting.pop() {
        let sides = [(b - a).norm(), (c - b).norm(), (a - c).norm()];
        let twice_mm2 = (b - a).cross(&(c - a)).norm();
        let around_mm: f64 = sides.iter().sum();
        let is_small = twice_mm2.is_nan() || twice_mm2 <= inradius_mm * around_mm;
        if halvings == MOST_HALVINGS || is_small {
            continue;
        }
        // The longest side is the one from the first to the second corner.
        let [a, b, c] = match sides {
            [x, y, z] if x >= y && x >= z => [a, b, c],
            [_, y, z] if y >= z => [b, c, a],
            _ => [c, a, b],
        };
        let middle = a + (b - a) * 0.5;
        lines.push([middle, c]);
        waiting.extend([([a, middle, c], halvings + 1), ([middle, b, c], halvings + 1)]);
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_triangle_is_divided_until_its_parts_are_small() {
        let corners = [Point3::origin(), Point3::new(100.0, 0.0, 0.0), Point3::new(0.0, 100.0, 0.0)];
        // Its inradius is 100 (1 − 1/√2) = 29.3 mm.
        assert!(across(corners, 29.4).is_empty() && across(corners, 29.2).len() == 1);
        // Every halving of a right isosceles triangle divides the inradius by √2.
        assert_eq!(across(corners, 10.0).len(), 15);
        assert!(across([Point3::origin(); 3], 1.0).is_empty());
        assert!(
            across([Point3::origin(), Point3::new(f64::NAN, 0.0, 0.0), Point3::origin()], 1.0).is_empty()
        );
    }
}
