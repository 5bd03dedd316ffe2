//! Splits face boundaries into those within a region and those around it, by place alone: segments
//! of meshes are matched in a grid within the joint tolerance.

use std::collections::HashMap;

use claymill_nurbs::Point3;
use rayon::prelude::*;

use crate::model_view::{ModelView, mesh_deviation_mm};

/// What lies on the other side of a face's boundary.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum BorderKind {
    /// A face of the same region.
    Patch,
    /// A face of another region, or nothing.
    Region,
}

/// A run of one face's boundary with the same neighbourhood all along.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Border {
    pub(crate) kind: BorderKind,
    pub(crate) points: Vec<Point3>,
}

/// A boundary segment of some face's mesh.
#[derive(Debug, Clone, Copy)]
struct Segment {
    face: u32,
    /// Vertices of the face's mesh.
    ends: [u32; 2],
    a: Point3,
    b: Point3,
}

/// Boundary segments sorted into the cells of a grid, to be found by place.
struct SegmentGrid {
    cell_mm: f64,
    cells: HashMap<[i64; 3], Vec<u32>>,
    segments: Vec<Segment>,
    /// Largest deviation of each face's mesh, mm.
    deviation_mm: Vec<f64>,
}

/// Splits the boundaries of all faces into runs that border the same region and runs that border another
/// region or nothing. Chords of two meshes along one edge differ by up to both meshes' deviation, which is
/// added to the joint tolerance.
pub(crate) fn classify_borders(view: &ModelView<'_>) -> Vec<Border> {
    let grid = SegmentGrid::new(view);
    (0..view.meshes.len()).into_par_iter().flat_map_iter(|f| face_borders(view, &grid, f)).collect()
}

fn face_borders(view: &ModelView<'_>, grid: &SegmentGrid, face: usize) -> Vec<Border> {
    let mesh = &view.meshes[face];
    let mut borders: Vec<Border> = Vec::new();
    for ring in &mesh.rings {
        let mut open: Option<Border> = None;
        for i in 0..ring.len() {
            let ends = [ring[i], ring[(i + 1) % ring.len()]];
            let [a, b] = ends.map(|v| mesh.points[v as usize]);
            if a == b {
                continue;
            }
            let segment = Segment { face: face as u32, ends, a, b };
            let kind = if grid.has_partner(view, &segment) { BorderKind::Patch } else { BorderKind::Region };
            match &mut open {
                Some(border) if border.kind == kind => border.points.push(b),
                _ => borders.extend(open.replace(Border { kind, points: vec![a, b] })),
            }
        }
        borders.extend(open);
    }
    borders
}

impl SegmentGrid {
    fn new(view: &ModelView<'_>) -> Self {
        let deviation_mm: Vec<f64> =
            view.meshes.iter().map(|m| f64::from(mesh_deviation_mm(std::slice::from_ref(m)))).collect();
        let reach = view.joint_tolerance_mm + 2.0 * deviation_mm.iter().copied().fold(0.0, f64::max);
        let mut segments = Vec::new();
        for (face, mesh) in view.meshes.iter().enumerate() {
            for ring in &mesh.rings {
                for i in 0..ring.len() {
                    let ends = [ring[i], ring[(i + 1) % ring.len()]];
                    let [a, b] = ends.map(|v| mesh.points[v as usize]);
                    segments.push(Segment { face: face as u32, ends, a, b });
                }
            }
        }
        let mean = segments.iter().map(|s| (s.b - s.a).norm()).sum::<f64>() / segments.len().max(1) as f64;
        let mut grid = SegmentGrid {
            cell_mm: mean.max(2.0 * reach).max(f64::MIN_POSITIVE),
            cells: HashMap::new(),
            segments,
            deviation_mm,
        };
        for index in 0..grid.segments.len() {
            let Segment { a, b, .. } = grid.segments[index];
            // Steps of half a cell: with the look into neighbouring cells nothing within a cell is missed.
            let steps = ((b - a).norm() / (0.5 * grid.cell_mm)).ceil().max(1.0) as usize;
            let mut last = None;
            for step in 0..=steps {
                let key = grid.key(&(a + (b - a) * (step as f64 / steps as f64)));
                if last != Some(key) {
                    grid.cells.entry(key).or_default().push(index as u32);
                    last = Some(key);
                }
            }
        }
        grid
    }

    fn key(&self, p: &Point3) -> [i64; 3] {
        [0, 1, 2].map(|i| (p[i] / self.cell_mm).floor() as i64)
    }

    /// Whether a face of the same region (or the face itself, along a seam) meets the middle of `s`.
    fn has_partner(&self, view: &ModelView<'_>, s: &Segment) -> bool {
        let middle = nalgebra::center(&s.a, &s.b);
        let region = view.region_of_face[s.face as usize];
        let partner = |index: u32| {
            let t = &self.segments[index as usize];
            let connected = t.face == s.face && (t.ends.contains(&s.ends[0]) || t.ends.contains(&s.ends[1]));
            !connected
                && view.region_of_face[t.face as usize] == region
                && distance_to_segment(&middle, &t.a, &t.b)
                    <= view.joint_tolerance_mm
                        + self.deviation_mm[s.face as usize]
                        + self.deviation_mm[t.face as usize]
        };
        let [x, y, z] = self.key(&middle);
        let around = |d: i64| {
            let key = [x + d % 3 - 1, y + d / 3 % 3 - 1, z + d / 9 - 1];
            self.cells.get(&key).is_some_and(|cell| cell.iter().any(|&i| partner(i)))
        };
        (0..27).any(around)
    }
}

fn distance_to_segment(p: &Point3, a: &Point3, b: &Point3) -> f64 {
    let ab = b - a;
    let length2 = ab.norm_squared();
    let t = if length2 > 0.0 { ((p - a).dot(&ab) / length2).clamp(0.0, 1.0) } else { 0.0 };
    (p - (a + ab * t)).norm()
}

#[cfg(test)]
mod tests {
    use super::*;
    use claymill_nurbs::{Face, FaceMesh, KnotVector, Model, NurbsSurface, Source, SurfaceKind};

    /// A flat rectangle whose boundary is split into `n` pieces a side.
    fn rectangle(x: f64, y: f64, width: f64, height: f64, n: usize) -> (Face, FaceMesh) {
        let at = |s: f64, t: f64| Point3::new(x + s * width, y + t * height, 0.0);
        let line = KnotVector::clamped_uniform(1, 2);
        let corners = vec![at(0.0, 0.0), at(0.0, 1.0), at(1.0, 0.0), at(1.0, 1.0)];
        let face = Face {
            surface: NurbsSurface::new(line.clone(), line, corners, None).unwrap(),
            loops: Vec::new(),
            reversed: false,
            kind: SurfaceKind::Plane,
            source: Source::default(),
        };
        let side = |i: usize| i as f64 / n as f64;
        let mut points = Vec::new();
        points.extend((0..n).map(|i| at(side(i), 0.0)));
        points.extend((0..n).map(|i| at(1.0, side(i))));
        points.extend((0..n).map(|i| at(1.0 - side(i), 1.0)));
        points.extend((0..n).map(|i| at(0.0, 1.0 - side(i))));
        let mesh =
            FaceMesh { rings: vec![(0..points.len() as u32).collect()], points, ..FaceMesh::default() };
        (face, mesh)
    }

    #[test]
    fn borders_inside_a_region_are_told_from_its_outline() {
        // Two halves left of one tall face (a T-junction, different divisions), and a foreign face below.
        let parts = [
            rectangle(0.0, 0.0, 10.0, 10.0, 3),
            rectangle(0.0, 10.0, 10.0, 10.0, 4),
            rectangle(10.0, 0.0, 10.0, 20.0, 10),
            rectangle(0.0, -10.0, 20.0, 10.0, 5),
        ];
        let (faces, meshes): (Vec<_>, Vec<_>) = parts.into_iter().unzip();
        let model = Model { faces, ..Model::default() };
        let view = ModelView {
            model: &model,
            meshes: &meshes,
            region_of_face: &[0, 0, 0, 1],
            cut: None,
            joint_tolerance_mm: 0.01,
            free_sides: None,
        };
        let length = |kind: BorderKind| {
            let of = |b: &Border| b.points.windows(2).map(|ab| (ab[1] - ab[0]).norm()).sum::<f64>();
            classify_borders(&view).iter().filter(|b| b.kind == kind).map(of).sum::<f64>()
        };
        // Each side of a joint counts: 10 between the halves, 20 along the tall face.
        approx::assert_abs_diff_eq!(length(BorderKind::Patch), 2.0 * (10.0 + 20.0), epsilon = 1e-9);
        approx::assert_abs_diff_eq!(length(BorderKind::Region), 80.0 + 60.0, epsilon = 1e-9);
    }
}
