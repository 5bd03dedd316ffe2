//! Stock as a model with a layer: all that is near a face, and all that is below one.

use std::collections::BTreeMap;
use std::ops::ControlFlow;

use claymill_nurbs::{Aabb, ClosestPoints, FaceMesh, MeshOptions, Model, Point3, Vector3};

use super::error::StockError;
use super::tree::Tree;
use crate::across::across;
use crate::mesh::face_meshes;

/// Faces farther than this are not looked for, mm.
const FAR_MM: f64 = 1e7;
/// A point this far outside of a triangle, seen from above and as part of its area, is still below it: no seam lets light
/// through.
const SEAM: f64 = 1e-9;

/// A model with a layer.
pub(super) struct LayerStock<'a> {
    closest: ClosestPoints<'a>,
    layer_mm: f64,
    below: Option<Below>,
    bounds: Aabb,
}

/// All that is below the model and above the table.
struct Below {
    /// Two directions across, and up.
    frame: [Vector3; 3],
    table_mm: f64,
    deviation_mm: f64,
    /// In the frame.
    triangles: Vec<[Point3; 3]>,
    /// Boxes from the table up to the triangles.
    columns: Tree,
    /// Seen from above: edges where the model may end or fold, at height 0.
    rims: Vec<[Point3; 2]>,
    rim_tree: Tree,
}

impl<'a> LayerStock<'a> {
    pub(super) fn new(
        model: &'a Model,
        layer_mm: f64,
        table: Option<(Vector3, f64)>,
        options: &MeshOptions,
    ) -> Result<Self, StockError> {
        let meshes: Vec<FaceMesh> = face_meshes(model, options).into_iter().flatten().collect();
        if meshes.iter().all(|m| m.triangles.is_empty()) {
            return Err(StockError::Empty("model"));
        }
        let faces = model.faces.iter().fold(Aabb::empty(), |all, f| all.union(&f.bounds()));
        let mut bounds = faces.inflated(layer_mm);
        let below = table.map(|(up, table_mm)| Below::new(&meshes, up, table_mm, options.deviation_mm));
        if let Some(below) = &below {
            let up = below.frame[2];
            for corner in 0..8 {
                let pick = |k: usize| if corner >> k & 1 == 0 { bounds.min[k] } else { bounds.max[k] };
                let p = Point3::new(pick(0), pick(1), pick(2));
                let down = p - up * (p.coords.dot(&up) - below.table_mm).max(0.0);
                bounds.add(&down);
            }
        }
        Ok(LayerStock { closest: ClosestPoints::new(model), layer_mm, below, bounds })
    }

    pub(super) fn bounds(&self) -> Aabb {
        self.bounds
    }

    pub(super) fn contains(&self, p: &Point3) -> bool {
        if self.bounds.distance_squared(p) > 0.0 {
            return false;
        }
        let is_near =
            || self.closest.closest(p, self.layer_mm + 1e-6).is_some_and(|f| f.distance_mm <= self.layer_mm);
        self.below.as_ref().is_some_and(|b| b.holds(&b.in_frame(p))) || is_near()
    }

    pub(super) fn signed_mm(&self, p: &Point3) -> f64 {
        let distance = self.closest.closest(p, FAR_MM).map_or(FAR_MM, |f| f.distance_mm);
        let layer = distance - self.layer_mm;
        self.below.as_ref().map_or(layer, |below| layer.min(below.signed_mm(&below.in_frame(p), distance)))
    }
}

impl Below {
    fn new(meshes: &[FaceMesh], up: Vector3, table_mm: f64, deviation_mm: f64) -> Self {
        let x = across(&up);
        let frame = [x, up.cross(&x), up];
        let seen = |p: &Point3| Point3::from(frame.map(|f| f.dot(&p.coords)));
        let (mut triangles, mut rims) = (Vec::new(), Vec::new());
        for mesh in meshes {
            let points: Vec<Point3> = mesh.points.iter().map(seen).collect();
            // Of every edge: how many triangles it has, and how many of these look up.
            let mut edges: BTreeMap<[u32; 2], [u32; 2]> = BTreeMap::new();
            for t in &mesh.triangles {
                let corners = t.map(|i| points[i as usize]);
                let looks_up = u32::from(area(&corners) > 0.0);
                for [a, b] in [[t[0], t[1]], [t[1], t[2]], [t[2], t[0]]] {
                    let count = edges.entry([a.min(b), a.max(b)]).or_default();
                    *count = [count[0] + 1, count[1] + looks_up];
                }
                triangles.push(corners);
            }
            let flat = |i: u32| Point3::new(points[i as usize].x, points[i as usize].y, 0.0);
            let is_rim = |&(_, &[all, up]): &(&[u32; 2], &[u32; 2])| all != 2 || up == 1;
            rims.extend(edges.iter().filter(is_rim).map(|(e, _)| e.map(flat)));
        }
        let column = |t: &[Point3; 3]| {
            let mut b = Aabb::of(t);
            b.min.z = b.min.z.min(table_mm);
            b
        };
        let (columns, order) = tree_of(&triangles.iter().map(column).collect::<Vec<_>>());
        let triangles = order.into_iter().map(|i| triangles[i as usize]).collect();
        let (rim_tree, order) = tree_of(&rims.iter().map(Aabb::of).collect::<Vec<_>>());
        let rims = order.into_iter().map(|i| rims[i as usize]).collect();
        Below { frame, table_mm, deviation_mm, triangles, columns, rims, rim_tree }
    }

    fn in_frame(&self, p: &Point3) -> Point3 {
        Point3::from(self.frame.map(|f| f.dot(&p.coords)))
    }

    /// Whether a point, in the frame, is between the table and a triangle above it.
    fn holds(&self, p: &Point3) -> bool {
        if p.z < self.table_mm {
            return false;
        }
        let mut covered = false;
        let sides = [0, 1, 2].map(|k| claymill_nurbs::outward([p[k], p[k]]));
        self.columns.visit(
            1,
            |node| node.hold([sides.map(|s| s[1]), sides.map(|s| s[0])]),
            |i| {
                covered = height_over(&self.triangles[i], p).is_some_and(|z| z >= p.z);
                if covered { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
            },
        );
        covered
    }

    /// Signed distance of a point, in the frame, whose distance from the faces is known. Its size is that to whatever may be the
    /// border: table, faces, and the walls below rims.
    fn signed_mm(&self, p: &Point3, faces_mm: f64) -> f64 {
        let flat = Point3::new(p.x, p.y, 0.0);
        let away = |i: usize| {
            let [a, b] = self.rims[i];
            let way = b - a;
            let t = (flat - a).dot(&way) / way.norm_squared().max(f64::MIN_POSITIVE);
            (flat - a - way * t.clamp(0.0, 1.0)).norm()
        };
        let rim = self.rim_tree.least(&flat, [0.0, FAR_MM], 1, away).map_or(FAR_MM, |found| found.0);
        let beside = (rim.min(faces_mm) - self.deviation_mm).max(0.0);
        let above = p.z - self.table_mm;
        if above < 0.0 {
            -above
        } else if self.holds(p) {
            -beside.min(above)
        } else {
            beside
        }
    }
}

fn tree_of(boxes: &[Aabb]) -> (Tree, Vec<u32>) {
    Tree::new(boxes, &vec![0; boxes.len()])
}

/// Twice the area seen from above, positive where the triangle looks up.
fn area([a, b, c]: &[Point3; 3]) -> f64 {
    (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x)
}

/// Height of a triangle over a place.
fn height_over(t: &[Point3; 3], p: &Point3) -> Option<f64> {
    let whole = area(t);
    if whole == 0.0 {
        return None;
    }
    let parts = [[*p, t[1], t[2]], [t[0], *p, t[2]], [t[0], t[1], *p]].map(|part| area(&part) / whole);
    parts.iter().all(|w| *w >= -SEAM).then(|| (0..3).map(|k| parts[k] * t[k].z).sum())
}
