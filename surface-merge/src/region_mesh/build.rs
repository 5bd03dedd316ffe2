//! From the triangulations of single faces to one mesh.

use std::collections::BTreeMap;

use claymill_nurbs::{FaceId, FaceMesh, MeshOptions, Model, Point2, Point3, tessellate_polygons};
use rayon::prelude::*;

use super::SurfacePoint;
use super::outline::{Corner, Polygons, SAME_MM};

/// The surface keeps this close to its triangles, as a part of their edge length: fillets get smaller ones.
const DEVIATION: f64 = 0.06;
/// Longest edge, as a part of the edge length asked for.
const LONGEST: f64 = 2.0;

/// Vertices and triangles of a mesh over several faces.
#[derive(Debug, Default)]
pub(super) struct Raw {
    pub(super) vertices: Vec<SurfacePoint>,
    pub(super) triangles: Vec<[u32; 3]>,
    pub(super) corners: Vec<[Point2; 3]>,
    pub(super) face_of: Vec<FaceId>,
    pub(super) skipped: Vec<FaceId>,
}

/// Triangulates every face inside its polygons and joins what shares a node.
pub(super) fn build(model: &Model, faces: &[FaceId], polygons: &[Polygons], edge_mm: f64) -> Raw {
    let options = MeshOptions { deviation_mm: DEVIATION * edge_mm, longest_edge_mm: LONGEST * edge_mm };
    let meshes: Vec<Option<FaceMesh>> = faces
        .par_iter()
        .zip(polygons)
        .map(|(&face, polygons)| {
            let uv: Vec<Vec<Point2>> =
                polygons.iter().map(|p| p.iter().map(|c| c.uv).collect::<Vec<_>>()).collect();
            tessellate_polygons(&model.faces[face].surface, &uv, &options).ok()
        })
        .collect();
    let mut raw = Raw::default();
    let mut vertex_of_node: BTreeMap<usize, u32> = BTreeMap::new();
    for ((&face, mesh), polygons) in faces.iter().zip(meshes).zip(polygons) {
        let Some(mesh) = mesh else {
            raw.skipped.push(face);
            continue;
        };
        let ids = raw.number(face, &mesh, polygons, &mut vertex_of_node);
        for triangle in &mesh.triangles {
            let [a, b, c] = triangle.map(|i| ids[i as usize]);
            // Corners closer to each other than the gaps of the model are one vertex.
            if a != b && b != c && c != a {
                raw.triangles.push([a, b, c]);
                raw.corners.push(triangle.map(|i| mesh.uv[i as usize]));
                raw.face_of.push(face);
            }
        }
    }
    raw.drop_unused();
    raw
}

impl Raw {
    /// The vertex of each vertex of a face's mesh.
    fn number(
        &mut self,
        face: FaceId,
        mesh: &FaceMesh,
        polygons: &Polygons,
        vertex_of_node: &mut BTreeMap<usize, u32>,
    ) -> Vec<u32> {
        let mut on_border: Vec<usize> = mesh.rings.iter().flatten().map(|&i| i as usize).collect();
        on_border.sort_unstable();
        on_border.dedup();
        let corners = Places::new(polygons.iter().flatten().map(|c: &Corner| (c.point, c.uv, c.node)));
        let mut ids: Vec<Option<u32>> = vec![None; mesh.points.len()];
        // Where a seam is cut, the mesh has vertices of its own: equal ones are one.
        let mut own: Vec<(Point3, Point2, usize)> = Vec::new();
        for i in on_border {
            let known = corners.nearest(&mesh.points[i], &mesh.uv[i]);
            ids[i] = Some(match known {
                Some(node) => *vertex_of_node.entry(node).or_insert_with(|| self.vertex(face, mesh, i)),
                None => {
                    let twin = own.iter().find(|o| (o.0 - mesh.points[i]).norm() <= SAME_MM);
                    let id = twin.map_or_else(|| self.vertex(face, mesh, i), |t| t.2 as u32);
                    own.push((mesh.points[i], mesh.uv[i], id as usize));
                    id
                }
            });
        }
        (0..ids.len()).map(|i| ids[i].unwrap_or_else(|| self.vertex(face, mesh, i))).collect()
    }

    fn vertex(&mut self, face: FaceId, mesh: &FaceMesh, i: usize) -> u32 {
        self.vertices.push(SurfacePoint { face, uv: mesh.uv[i], point: mesh.points[i] });
        (self.vertices.len() - 1) as u32
    }

    fn drop_unused(&mut self) {
        let mut used = vec![false; self.vertices.len()];
        self.triangles.iter().flatten().for_each(|&v| used[v as usize] = true);
        let mut next = 0;
        let renamed: Vec<u32> = used
            .iter()
            .map(|&u| {
                next += u32::from(u);
                next.wrapping_sub(1)
            })
            .collect();
        let mut keep = used.iter();
        self.vertices.retain(|_| *keep.next().unwrap_or(&false));
        self.triangles.iter_mut().flatten().for_each(|v| *v = renamed[*v as usize]);
    }
}

/// Points to look up by place.
struct Places(Vec<(Point3, Point2, usize)>);

impl Places {
    fn new(items: impl Iterator<Item = (Point3, Point2, usize)>) -> Self {
        let mut items: Vec<_> = items.collect();
        items.sort_by(|a, b| a.0.x.total_cmp(&b.0.x).then(a.2.cmp(&b.2)));
        Places(items)
    }

    /// The number of the point that `p` is; of several the one with the nearest parameters.
    fn nearest(&self, p: &Point3, uv: &Point2) -> Option<usize> {
        let from = self.0.partition_point(|i| i.0.x < p.x - SAME_MM);
        let near = self.0[from..].iter().take_while(|i| i.0.x <= p.x + SAME_MM);
        near.filter(|i| (i.0 - p).norm() <= SAME_MM)
            .min_by(|a, b| (a.1 - uv).norm_squared().total_cmp(&(b.1 - uv).norm_squared()))
            .map(|i| i.2)
    }
}
