//! What faces cover, seen along an axis of the model, and how far a disc reaches beyond it.
//! Containment by centre or edge is checked by this.

use std::f64::consts::TAU;

use claymill_nurbs::{Aabb, BoxTree, Point3};

use crate::mesh::Mesh;
use crate::obstacles::closest_on_triangle;

/// Points on the rim of a disc are so close that it bows from the chords between them by no more than this, mm.
const RIM_SAG_MM: f64 = 0.02;
/// What is farther away is not measured, mm.
const FAR_MM: f64 = 1000.0;

/// What some faces cover, seen along an axis of the model.
///
/// ```text
///        ╭──●──╮     distance of a point from the nearest place that is covered: 0 over the faces;
///      ┌─│─────│──── of a disc, the largest of its points
///      │ ╰─────╯     only edges where something may end can be within it
///      │   faces
/// ```
#[derive(Debug)]
pub(crate) struct Shadow<'a> {
    mesh: &'a Mesh,
    /// The dimension along the axis.
    along: usize,
    triangles: Vec<u32>,
    cover: BoxTree,
    /// Edges of one triangle alone, and those where a face turns over: what is covered ends nowhere else.
    ends: Vec<[u32; 2]>,
    rims: BoxTree,
}

impl<'a> Shadow<'a> {
    /// Of the faces that are `wanted`, by index; along the model's `x`, `y` or `z` (0, 1 or 2).
    pub(crate) fn new(mesh: &'a Mesh, wanted: &[bool], along: usize) -> Self {
        let of_face = |face: usize| mesh.first_of_face[face]..mesh.first_of_face[face + 1];
        let faces = wanted.iter().enumerate().filter(|(_, wanted)| **wanted);
        let triangles: Vec<u32> = faces.flat_map(|(face, _)| of_face(face)).map(|i| i as u32).collect();
        let mut shadow = Shadow {
            mesh,
            along,
            ends: Vec::new(),
            cover: BoxTree::new(&[]),
            rims: BoxTree::new(&[]),
            triangles,
        };
        shadow.ends = shadow.where_it_may_end();
        let boxes: Vec<Aabb> = (0..shadow.triangles.len()).map(|i| Aabb::of(&shadow.corners(i))).collect();
        shadow.cover = BoxTree::new(&boxes);
        let boxes: Vec<Aabb> = (0..shadow.ends.len()).map(|i| Aabb::of(&shadow.end(i)[..2])).collect();
        shadow.rims = BoxTree::new(&boxes);
        shadow
    }

    /// How far a disc reaches beyond what is covered, mm: the distance of its farthest point from the nearest covered place
    /// if that is more than `spare_mm`, else 0. Of a disc that moves, the rim alone passes over all of it but where it
    /// begins: only the `whole` one is looked at inside.
    pub(crate) fn beyond_mm(&self, centre: &Point3, radius_mm: f64, spare_mm: f64, whole: bool) -> f64 {
        let centre = self.flat(centre);
        let mut most = self.gap_mm(&centre, spare_mm);
        if radius_mm <= 0.0 || (most == 0.0 && !self.ends_within(&centre, radius_mm.max(spare_mm))) {
            return most;
        }
        let (across, aside) = ((self.along + 1) % 3, (self.along + 2) % 3);
        let step_mm = 2.0 * (2.0 * RIM_SAG_MM * radius_mm).sqrt();
        let rings = if whole { (radius_mm / step_mm).ceil() as u32 } else { 1 };
        for ring in (0..rings).map(|k| radius_mm * f64::from(rings - k) / f64::from(rings)) {
            let count = (TAU * ring / step_mm).ceil() as u32;
            for angle in (0..count).map(|k| TAU * f64::from(k) / f64::from(count)) {
                let mut at = centre;
                at[across] += ring * angle.cos();
                at[aside] += ring * angle.sin();
                most = most.max(self.gap_mm(&at, most.max(spare_mm)));
            }
        }
        most
    }

    /// Distance of a point from the nearest covered place, 0 if that is no more than `enough_mm`.
    fn gap_mm(&self, at: &Point3, enough_mm: f64) -> f64 {
        let mut least = FAR_MM;
        let bound = |least: &f64| if *least <= enough_mm { 0.0 } else { least.powi(2) };
        self.cover.nearest_first(at, &mut least, bound, |least, i| {
            *least = least.min((closest_on_triangle(&self.corners(i), at) - at).norm());
        });
        if least <= enough_mm { 0.0 } else { least }
    }

    /// Whether what is covered may end within a distance of a point.
    fn ends_within(&self, at: &Point3, within_mm: f64) -> bool {
        let mut is_near = false;
        let bound = |near: &bool| if *near { 0.0 } else { within_mm.powi(2) };
        self.rims.nearest_first(at, &mut is_near, bound, |near, i| {
            *near |= (closest_on_triangle(&self.end(i), at) - at).norm() <= within_mm;
        });
        is_near
    }

    /// A point, put down on the plane across the axis.
    fn flat(&self, p: &Point3) -> Point3 {
        let mut p = *p;
        p[self.along] = 0.0;
        p
    }

    fn vertex(&self, i: u32) -> Point3 {
        self.flat(&self.mesh.points[i as usize])
    }

    fn corners(&self, i: usize) -> [Point3; 3] {
        self.mesh.triangles[self.triangles[i] as usize].map(|v| self.vertex(v))
    }

    /// An edge, as a triangle without width.
    fn end(&self, i: usize) -> [Point3; 3] {
        let [a, b] = self.ends[i].map(|v| self.vertex(v));
        [a, b, b]
    }

    fn where_it_may_end(&self) -> Vec<[u32; 2]> {
        // Each triangle's edges, and whether it is seen from above as it is from its front.
        let mut edges: Vec<([u32; 2], Option<bool>)> = Vec::with_capacity(3 * self.triangles.len());
        for (i, &triangle) in self.triangles.iter().enumerate() {
            let [a, b, c] = self.corners(i);
            let area = (b - a).cross(&(c - a))[self.along];
            let side = (area != 0.0).then_some(area > 0.0);
            let [u, v, w] = self.mesh.triangles[triangle as usize];
            edges.extend([[u, v], [v, w], [w, u]].map(|[p, q]| ([p.min(q), p.max(q)], side)));
        }
        edges.sort_unstable();
        let goes_on = |shared: &[([u32; 2], Option<bool>)]| matches!(shared, [(_, Some(one)), (_, Some(other))] if one == other);
        edges
            .chunk_by(|a, b| a.0 == b.0)
            .filter(|shared| !goes_on(shared))
            .map(|shared| shared[0].0)
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A plate of 40 × 20 in squares of 2, seen along `along`; one square in its middle is missing if `holed`.
    fn plate(along: usize, holed: bool) -> Mesh {
        let mut mesh = Mesh::default();
        let (across, aside) = ((along + 1) % 3, (along + 2) % 3);
        for i in 0..=20 {
            for j in 0..=10 {
                let mut p = Point3::new(7.0, 7.0, 7.0);
                (p[across], p[aside]) = (2.0 * f64::from(i), 2.0 * f64::from(j));
                mesh.points.push(p);
            }
        }
        for (i, j) in (0..20).flat_map(|i| (0..10).map(move |j| (i, j))) {
            let a = 11 * i + j;
            if !(holed && (i, j) == (10, 5)) {
                mesh.triangles.extend([[a, a + 11, a + 12], [a, a + 12, a + 1]]);
            }
        }
        mesh.deviation_mm = vec![0.0; mesh.triangles.len()];
        mesh.first_of_face = vec![0, mesh.triangles.len()];
        mesh
    }

    fn at(along: usize, x: f64, y: f64) -> Point3 {
        let mut p = Point3::new(-3.0, -3.0, -3.0);
        (p[(along + 1) % 3], p[(along + 2) % 3]) = (x, y);
        p
    }

    #[test]
    fn a_disc_reaches_beyond_a_plate_by_what_hangs_over() {
        for along in 0..3 {
            let mesh = plate(along, false);
            let shadow = Shadow::new(&mesh, &[true], along);
            assert_eq!(shadow.ends.len(), 60);
            for whole in [true, false] {
                let beyond = |x: f64, y: f64| shadow.beyond_mm(&at(along, x, y), 5.0, 0.1, whole);
                assert_eq!([beyond(5.0, 5.0), beyond(20.3, 14.9), beyond(35.0, 10.0)], [0.0; 3]);
                approx::assert_abs_diff_eq!(beyond(2.0, 10.0), 3.0, epsilon = RIM_SAG_MM);
                approx::assert_abs_diff_eq!(beyond(50.0, 10.0), 15.0, epsilon = RIM_SAG_MM);
                approx::assert_abs_diff_eq!(beyond(43.0, 24.0), 10.0, epsilon = RIM_SAG_MM);
            }
            let point = |x: f64| shadow.beyond_mm(&at(along, x, 10.0), 0.0, 0.1, false);
            assert_eq!([point(40.0), point(40.09)], [0.0; 2]);
            approx::assert_abs_diff_eq!(point(42.5), 2.5, epsilon = 1e-9);
            assert!(point(1e7) >= FAR_MM);
        }
    }

    #[test]
    fn holes_count_and_gaps_do_not() {
        let mesh = plate(2, true);
        let shadow = Shadow::new(&mesh, &[true], 2);
        // The hole is within the rim, beside the centre.
        let (beside, middle) = (at(2, 24.0, 11.0), at(2, 21.0, 11.0));
        assert_eq!(shadow.beyond_mm(&beside, 5.0, 0.4, false), 0.0);
        let inside = shadow.beyond_mm(&beside, 5.0, 0.4, true);
        assert!((0.4..=1.0).contains(&inside), "{inside}");
        approx::assert_abs_diff_eq!(shadow.beyond_mm(&middle, 0.0, 0.4, true), 1.0, epsilon = 1e-9);
        assert_eq!(shadow.beyond_mm(&middle, 5.0, 1.0, true), 0.0);
    }

    #[test]
    fn nothing_covers_nothing() {
        let mesh = plate(2, false);
        let shadow = Shadow::new(&mesh, &[false], 2);
        assert!(shadow.beyond_mm(&at(2, 20.0, 10.0), 5.0, 0.4, true) >= FAR_MM);
    }
}
