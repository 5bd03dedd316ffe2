use crate::arc::Arc;
use crate::area::enclosed_mm2;
use crate::curvedness::Curvedness;
use crate::mesh::rectangle;
use crate::mesh::sampling::{Limits, sample};
use crate::rings::{Ring, rings};
use crate::{Aabb, Face, MeshOptions, NurbsSurface, Point2, tessellate};

/// Accuracy of the box, mm.
const BOX_MM: f64 = 1e-4;
/// Deviation of the first triangles of a trimmed face, as a share of its size.
const COARSE: f64 = 0.02;
/// Each level cuts the facet error of a triangle by four: 24 levels resolve the box of any model.
const DEEPEST: u32 = 24;

impl Face {
    /// Area of the trimmed face, mm², to a relative accuracy of 1e-7 or better.
    ///
    /// Integrated between the exact trim curves by Green's theorem. Where damaged loops cross each other the overlap counts with its winding
    /// number.
    #[must_use]
    pub fn area_mm2(&self) -> f64 {
        let surface = &self.surface;
        let ((u0, u1), (v0, v1)) = surface.domain();
        let whole = (Point2::new(u0, v0), Point2::new(u1, v1));
        let rings = rings(self);
        let window = if self.loops.is_empty() { Some(whole) } else { rectangle(self, &rings, whole) };
        let sides = window.map(|(a, b)| {
            let side = |from: f64, to: f64, u: f64| Arc::line(Point2::new(u, from), Point2::new(u, to));
            vec![side(b.y, a.y, a.x), side(a.y, b.y, b.x)]
        });
        let arcs = sides.unwrap_or_else(|| rings.into_iter().flat_map(|r| r.arcs).collect());
        enclosed_mm2(surface, &arcs)
    }

    /// Box around the trimmed face, within 1e-4 mm of the smallest one.
    ///
    /// Starts from few triangles and refines only those that may stick out.
    #[must_use]
    pub fn bounds(&self) -> Aabb {
        let surface = &self.surface;
        let curved = Curvedness::of(surface);
        let ((u0, u1), (v0, v1)) = surface.domain();
        let whole = (Point2::new(u0, v0), Point2::new(u1, v1));
        let rings = rings(self);
        let window = if self.loops.is_empty() { Some(whole) } else { rectangle(self, &rings, whole) };
        // No point lies outside of the control points' box: faces along a side of it end the search early.
        let hull = Aabb::of(&surface.net().iter().map(|h| (h.xyz() / h.w).into()).collect::<Vec<_>>());
        let mut bounds = Aabb::empty();
        if let Some((low, high)) = window {
            let corners = [low, Point2::new(high.x, low.y), high, Point2::new(low.x, high.y)];
            for [a, b, c] in [[0, 1, 2], [0, 2, 3]] {
                stick_out(
                    surface,
                    &curved,
                    [corners[a], corners[b], corners[c]],
                    &hull,
                    &mut bounds,
                    DEEPEST,
                );
            }
            return bounds;
        }
        let limits = Limits { sagitta_mm: 0.5 * BOX_MM, facet_mm: f64::INFINITY, edge_mm: f64::INFINITY };
        for arc in rings.iter().flat_map(|r: &Ring| &r.arcs) {
            sample(surface, &curved, arc, &limits).iter().for_each(|s| bounds.add(&s.point));
        }
        let options = MeshOptions {
            deviation_mm: (COARSE * bounds.diagonal()).max(BOX_MM),
            longest_edge_mm: f64::INFINITY,
        };
        let Ok(mesh) = tessellate(self, &options) else {
            return bounds;
        };
        mesh.points.iter().for_each(|p| bounds.add(p));
        for t in &mesh.triangles {
            stick_out(surface, &curved, t.map(|i| mesh.uv[i as usize]), &hull, &mut bounds, DEEPEST);
        }
        bounds
    }
}

/// Grows `bounds` by what a parameter triangle adds to it: where its corners and the bounds on its facet error
/// reach beyond (but never beyond `hull`), it is cut in four.
fn stick_out(
    surface: &NurbsSurface,
    curved: &Curvedness,
    uv: [Point2; 3],
    hull: &Aabb,
    bounds: &mut Aabb,
    depth: u32,
) {
    let corners = uv.map(|p| surface.point(p.x, p.y));
    corners.iter().for_each(|p| bounds.add(p));
    let (low, high) = (uv[0].inf(&uv[1]).inf(&uv[2]), uv[0].sup(&uv[1]).sup(&uv[2]));
    let facet = curved.over(low, high).deviations_mm(high.x - low.x, high.y - low.y);
    let flat = Aabb::of(&corners);
    let reach = Aabb { min: flat.min - facet, max: flat.max + facet };
    let out = |k: usize| {
        reach.max[k].min(hull.max[k]) > bounds.max[k] + BOX_MM
            || reach.min[k].max(hull.min[k]) < bounds.min[k] - BOX_MM
    };
    if depth > 0 && (0..3).any(out) {
        let middle = |i: usize, j: usize| nalgebra::center(&uv[i], &uv[j]);
        let (a, b, c) = (middle(0, 1), middle(1, 2), middle(2, 0));
        for part in [[a, b, c], [uv[0], a, c], [uv[1], b, a], [uv[2], c, b]] {
            stick_out(surface, curved, part, hull, bounds, depth - 1);
        }
    }
}
