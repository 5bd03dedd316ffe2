//! Area and bounding box of trimmed faces. The box comes from refining only those triangles that
//! may stick out of it.

use crate::arc::Arc;
use crate::area::{FaceArea, enclosed};
use crate::curvedness::Curvedness;
use crate::mesh::rectangle;
use crate::mesh::sampling::{Limits, MOST_SAMPLES, sample};
use crate::rings::{Ring, rings};
use crate::{Aabb, Face, MeshOptions, NurbsSurface, Point2, tessellate};

/// Accuracy of the box, mm.
const BOX_MM: f64 = 1e-4;
/// Deviation of the first triangles of a trimmed face, as a share of its size.
const COARSE: f64 = 0.02;
/// Each level cuts the facet error of a triangle by four: 24 levels resolve the box of any model.
const DEEPEST: u32 = 24;
/// Triangles of a face that are cut, at most; a sphere takes about a thousand.
const MOST_CUTS: u32 = 100_000;
/// So far beside its trim loops, as a share of its width, a surface counts as the face where nothing better is known.
const BESIDE: f64 = 1e-6;

impl Face {
    /// Area of the trimmed face, mm², to a relative accuracy of 1e-7 or better.
    ///
    /// Integrated between the exact trim curves by Green's theorem. Where damaged loops cross each other the overlap counts with its winding
    /// number.
    #[must_use]
    pub fn area_mm2(&self) -> f64 {
        self.area().mm2
    }

    /// The same, and whether it is that accurate.
    #[must_use]
    pub fn area(&self) -> FaceArea {
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
        enclosed(surface, &arcs)
    }

    /// Box around the trimmed face, within 1e-4 mm of the smallest one.
    ///
    /// Starts from few triangles and refines only those that may stick out. Where that ends before it is as near (a surface
    /// whose derivatives cannot be bounded well), or the face cannot be triangulated, the box is larger, never smaller.
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
        let mut search = Extent { surface, curved: &curved, hull, bounds: Aabb::empty(), cuts: 0 };
        if let Some((low, high)) = window {
            let corners = [low, Point2::new(high.x, low.y), high, Point2::new(low.x, high.y)];
            for [a, b, c] in [[0, 1, 2], [0, 2, 3]] {
                search.stick_out([corners[a], corners[b], corners[c]], DEEPEST);
            }
            return search.bounds;
        }
        let limits = Limits { sagitta_mm: 0.5 * BOX_MM, facet_mm: f64::INFINITY, edge_mm: f64::INFINITY };
        for arc in rings.iter().flat_map(|r: &Ring| &r.arcs) {
            let samples = sample(surface, &curved, arc, &limits, MOST_SAMPLES);
            samples.iter().for_each(|s| search.bounds.add(&s.point));
        }
        let options = MeshOptions {
            deviation_mm: (COARSE * search.bounds.diagonal()).max(BOX_MM),
            longest_edge_mm: f64::INFINITY,
        };
        let Ok(mesh) = tessellate(self, &options) else {
            return search.bounds.union(&hull_of(self, &rings));
        };
        mesh.points.iter().for_each(|p| search.bounds.add(p));
        for t in &mesh.triangles {
            search.stick_out(t.map(|i| mesh.uv[i as usize]), DEEPEST);
        }
        search.bounds
    }
}

/// The box of the control points of the part of a surface that its trim loops run around: all of the face lies in it.
fn hull_of(face: &Face, rings: &[Ring]) -> Aabb {
    let loops = face.loops.iter().flat_map(|l| &l.edges).flat_map(|e| e.pcurve.points()).copied();
    let around: Vec<Point2> = loops.chain(rings.iter().flat_map(|r| <[Point2; 2]>::from(r.hull()))).collect();
    let ((u0, u1), (v0, v1)) = face.surface.domain();
    let mut part = face.surface.clone();
    for (axis, width) in [(0, u1 - u0), (1, v1 - v0)] {
        let split = |s: &NurbsSurface, t: f64| if axis == 0 { s.split_u(t) } else { s.split_v(t) };
        let low = around.iter().fold(f64::INFINITY, |low, p| low.min(p[axis])) - BESIDE * width;
        let high = around.iter().fold(f64::NEG_INFINITY, |high, p| high.max(p[axis])) + BESIDE * width;
        if let Some((_, above)) = split(&part, low) {
            part = above;
        }
        if let Some((below, _)) = split(&part, high) {
            part = below;
        }
    }
    Aabb::of(&part.net().iter().map(|h| (h.xyz() / h.w).into()).collect::<Vec<_>>())
}

/// A box that grows.
struct Extent<'a> {
    surface: &'a NurbsSurface,
    curved: &'a Curvedness,
    hull: Aabb,
    bounds: Aabb,
    cuts: u32,
}

impl Extent<'_> {
    /// Grows the box by what a parameter triangle adds to it: where its corners and the bounds on its facet error
    /// reach beyond (but never beyond the hull), it is cut in four. Where that has to end, by these bounds.
    fn stick_out(&mut self, uv: [Point2; 3], depth: u32) {
        let corners = uv.map(|p| self.surface.point(p.x, p.y));
        corners.iter().for_each(|p| self.bounds.add(p));
        let (low, high) = (uv[0].inf(&uv[1]).inf(&uv[2]), uv[0].sup(&uv[1]).sup(&uv[2]));
        let facet = self.curved.over(low, high).deviations_mm(high.x - low.x, high.y - low.y);
        let flat = Aabb::of(&corners);
        let reach =
            Aabb { min: (flat.min - facet).sup(&self.hull.min), max: (flat.max + facet).inf(&self.hull.max) };
        let out = |k: usize| {
            reach.max[k] > self.bounds.max[k] + BOX_MM || reach.min[k] < self.bounds.min[k] - BOX_MM
        };
        if !(0..3).any(out) {
            return;
        }
        if depth == 0 || self.cuts == MOST_CUTS {
            self.bounds = self.bounds.union(&reach);
            return;
        }
        self.cuts += 1;
        let middle = |i: usize, j: usize| nalgebra::center(&uv[i], &uv[j]);
        let (a, b, c) = (middle(0, 1), middle(1, 2), middle(2, 0));
        for part in [[a, b, c], [uv[0], a, c], [uv[1], b, a], [uv[2], c, b]] {
            self.stick_out(part, depth - 1);
        }
    }
}
