//! The quality of a region: topology (Euler characteristic, genus), tightest valley, total
//! curvature, extent and visibility, sampled in the middle of mesh triangles.

use std::collections::BTreeMap;

use claymill_nurbs::{Model, Point3, Vector3};
use nalgebra::{Matrix3, SymmetricEigen};
use serde::{Deserialize, Serialize};

use crate::{FieldError, Merge, RegionMesh};

/// What kind of surface a region is, and what it asks of a tool. Sampled in the middle of triangles.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct RegionQuality {
    /// Euler characteristic: vertices − edges + triangles.
    pub euler: i64,
    /// Loops around it.
    pub loops: usize,
    /// Number of handles, `(2 − loops − euler) / 2`; `None` for surfaces in parts or without two sides.
    pub genus: Option<usize>,
    /// Radius of the tightest valley, mm; `None` where there is none.
    pub tightest_concave_radius_mm: Option<f64>,
    /// The largest ball that keeps clear of gouging by curvature, 0.9 of that radius, mm.
    pub largest_ball_radius_mm: Option<f64>,
    /// Area in valleys tighter than the ball, mm².
    pub rest_area_mm2: f64,
    /// Integral of the absolute Gaussian curvature, steradians: 0 for what can be unrolled.
    pub total_curvature_sr: f64,
    /// Extent along the direction of largest spread, mm: the longest stroke.
    pub length_mm: f64,
    /// Extent along the direction of second largest spread, mm.
    pub width_mm: f64,
    /// Seen along its axis of normals, no part lies over another: one direction sees all of it.
    pub single_valued: bool,
}

/// Triangle edges across a region.
const EDGES_ACROSS: f64 = 40.0;
/// Longest and shortest edge, mm.
const EDGE_MM: (f64, f64) = (0.5, 60.0);
/// Curvatures below this are flat, 1/mm.
const FLAT_PER_MM: f64 = 1e-5;
/// The part of the tightest valley's radius that a ball may have.
const CLEAR: f64 = 0.9;
/// Normals within this angle of the axis make a projection along it locally one-to-one, degrees.
const STEEPEST_DEG: f64 = 85.0;
/// Cells of the projection along its longer side.
const CELLS: f64 = 256.0;

/// Measures a region that was found by merging, for a ball of a radius.
///
/// # Errors
/// The region cannot be triangulated.
pub fn quality(
    model: &Model,
    merged: &Merge,
    region: usize,
    ball_radius_mm: f64,
) -> Result<RegionQuality, FieldError> {
    let area = merged.regions.get(region).map_or(0.0, |r| r.area_mm2);
    let edge_mm = (area.sqrt() / EDGES_ACROSS).clamp(EDGE_MM.0, EDGE_MM.1);
    let mesh = RegionMesh::of_region(model, merged, region, edge_mm)?;
    let mut found = RegionQuality {
        euler: mesh.euler(),
        loops: mesh.loops().len(),
        genus: None,
        tightest_concave_radius_mm: None,
        largest_ball_radius_mm: None,
        rest_area_mm2: 0.0,
        total_curvature_sr: 0.0,
        length_mm: 0.0,
        width_mm: 0.0,
        single_valued: false,
    };
    let handles = 2 - found.loops as i64 - found.euler;
    found.genus = (handles >= 0 && handles % 2 == 0).then_some((handles / 2) as usize);
    let mut tightest = FLAT_PER_MM;
    for (triangle, uv) in mesh.triangles().iter().zip(mesh.corners()).enumerate().map(|(t, c)| (t, c.1)) {
        let corners = mesh.triangles()[triangle].map(|v| mesh.vertices()[v as usize].point);
        let facet = (corners[1] - corners[0]).cross(&(corners[2] - corners[0]));
        let area = 0.5 * facet.norm();
        let middle = (uv[0].coords + uv[1].coords + uv[2].coords) / 3.0;
        let jet = model.faces[mesh.face_of_triangle()[triangle]].surface.jet(middle.x, middle.y);
        let Some(normal) = jet.normal() else { continue };
        let outward = if normal.dot(&facet) < 0.0 { -normal } else { normal };
        let Some((least, most)) = jet.curvature(&outward).principal() else { continue };
        tightest = tightest.max(most);
        found.total_curvature_sr += (least * most).abs() * area;
        if most * ball_radius_mm >= 1.0 {
            found.rest_area_mm2 += area;
        }
    }
    if tightest > FLAT_PER_MM {
        found.tightest_concave_radius_mm = Some(1.0 / tightest);
        found.largest_ball_radius_mm = Some(CLEAR / tightest);
    }
    [found.length_mm, found.width_mm] = extents(&mesh);
    if let Some(r) = merged.regions.get(region) {
        found.single_valued = r.normal_half_angle_deg < STEEPEST_DEG && !overlaps(&mesh, &r.normal_axis);
    }
    Ok(found)
}

/// Extents along the two directions of largest spread.
fn extents(mesh: &RegionMesh<'_>) -> [f64; 2] {
    let points: Vec<Point3> = mesh.vertices().iter().map(|v| v.point).collect();
    let count = points.len() as f64;
    let centre = points.iter().fold(Vector3::zeros(), |c, p| c + p.coords) / count;
    let spread = points.iter().fold(Matrix3::zeros(), |m, p| {
        let d = p.coords - centre;
        m + d * d.transpose()
    });
    let eigen = SymmetricEigen::new(spread);
    let mut order = [0, 1, 2];
    order.sort_by(|&a, &b| eigen.eigenvalues[b].total_cmp(&eigen.eigenvalues[a]));
    [order[0], order[1]].map(|k| {
        let axis = eigen.eigenvectors.column(k).into_owned();
        let (low, high) = points.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), p| {
            let x = p.coords.dot(&axis);
            (a.min(x), b.max(x))
        });
        high - low
    })
}

/// Whether two places of the mesh, apart from each other, are seen at one place along `axis`.
fn overlaps(mesh: &RegionMesh<'_>, axis: &Vector3) -> bool {
    let side = if axis.x.abs() < 0.9 { Vector3::x() } else { Vector3::y() };
    let x = axis.cross(&side).normalize();
    let y = axis.cross(&x);
    let flat: Vec<[f64; 2]> =
        mesh.vertices().iter().map(|v| [v.point.coords.dot(&x), v.point.coords.dot(&y)]).collect();
    let size = |k: usize| {
        let (low, high) =
            flat.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), p| (a.min(p[k]), b.max(p[k])));
        (low, high - low)
    };
    let ((x0, wide), (y0, high)) = (size(0), size(1));
    let cell = wide.max(high) / CELLS;
    if cell.is_nan() || cell <= 0.0 {
        return false;
    }
    let mut depths: BTreeMap<(i32, i32), f64> = BTreeMap::new();
    for triangle in mesh.triangles() {
        let c = triangle.map(|v| {
            let [x, y] = flat[v as usize];
            [(x - x0) / cell, (y - y0) / cell]
        });
        let depth = triangle.map(|v| mesh.vertices()[v as usize].point.coords.dot(axis));
        let twice = |a: [f64; 2], b: [f64; 2], p: [f64; 2]| {
            (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0])
        };
        let area = twice(c[0], c[1], c[2]);
        if area == 0.0 {
            continue;
        }
        let span = |k: usize| {
            let low = c.iter().fold(f64::INFINITY, |m, p| m.min(p[k]));
            let high = c.iter().fold(f64::NEG_INFINITY, |m, p| m.max(p[k]));
            (low - 0.5).ceil() as i32..=(high - 0.5).floor() as i32
        };
        for i in span(0) {
            for j in span(1) {
                let at = [f64::from(i) + 0.5, f64::from(j) + 0.5];
                let share: [f64; 3] =
                    std::array::from_fn(|k| twice(c[(k + 1) % 3], c[(k + 2) % 3], at) / area);
                if share.iter().all(|s| *s > 0.0) {
                    let here: f64 = (0..3).map(|k| share[k] * depth[k]).sum();
                    // Centres on a common side may count for both triangles; they are at one depth.
                    match depths.get(&(i, j)) {
                        Some(other) if (other - here).abs() > 1e-6 * cell.max(1.0) => return true,
                        Some(_) => {}
                        None => {
                            depths.insert((i, j), here);
                        }
                    }
                }
            }
        }
    }
    false
}
