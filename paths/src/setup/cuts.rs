//! What a setup cuts, as small triangles of ball positions.

use claymill_nurbs::{FaceId, Jet, NurbsSurface, Point2, Point3, Vector3};
use rayon::prelude::*;

use crate::setup::context::SetupContext;

/// Triangles are halved until the normals at their corners are closer than this (cosine of 12°): over a sharp
/// bend the ball's centre goes round an arc, whose sides ask for much closer rows than its top.
const STRAIGHT: f64 = 0.978;
/// Halvings of a covering triangle, at most.
const HALVINGS: u32 = 10;
/// Pieces that lean over by more than this (`n·axis`) are for another setup.
const OVERHANGING: f64 = -0.02;

/// A piece of a covering triangle that the setup cuts: ball centres over its corners, and the surface in its middle.
pub(crate) struct Cut {
    pub(crate) centres: [Point3; 3],
    pub(crate) jet: Jet,
}

#[derive(Clone, Copy)]
struct Corner {
    uv: Point2,
    normal: Vector3,
    centre: Point3,
    /// How far it is inside of the setup's border, mm.
    inside_mm: f64,
}

impl SetupContext<'_> {
    /// What the setup cuts of some faces, but only of triangles (by face and number) that are to be `kept`.
    pub(crate) fn cuts(&self, faces: &[FaceId], kept: impl Fn(FaceId, usize) -> bool + Sync) -> Vec<Cut> {
        let of_face = |&face: &FaceId| {
            let mesh = &self.covering.meshes()[face];
            let surface = self.ball.surface(face);
            let cut = mesh.triangles.iter().zip(&self.assignments[face]).enumerate();
            cut.filter(|(k, (_, assignment))| assignment.is_cut_by(self.index) && kept(face, *k))
                .flat_map(|(k, (t, assignment))| {
                    let inside_mm = self.claims.inside_mm(face, k);
                    let uv = t.map(|i| mesh.uv[i as usize]);
                    self.cut_up(surface, uv, inside_mm, assignment.side(self.index))
                })
                .collect::<Vec<_>>()
        };
        faces.par_iter().flat_map_iter(of_face).collect()
    }

    /// Nothing where the surface has no normal at a corner.
    fn cut_up(
        &self,
        surface: &NurbsSurface,
        uv: [Point2; 3],
        inside_mm: Option<[f64; 3]>,
        side: f64,
    ) -> Vec<Cut> {
        let mut cuts = Vec::new();
        let corner = |uv: Point2, inside_mm: f64| self.corner(surface, uv, side, inside_mm);
        let at = inside_mm.unwrap_or([f64::INFINITY; 3]);
        let [Some(a), Some(b), Some(c)] = [0, 1, 2].map(|k| corner(uv[k], at[k])) else {
            return cuts;
        };
        let mut left = vec![([a, b, c], HALVINGS)];
        while let Some((corners, halvings)) = left.pop() {
            let bent = self.bent_side(&corners).filter(|_| halvings > 0);
            if let Some([a, b, c]) = bent
                && let Some(middle) =
                    corner(nalgebra::center(&a.uv, &b.uv), 0.5 * (a.inside_mm + b.inside_mm))
            {
                left.extend([([a, middle, c], halvings - 1), ([middle, b, c], halvings - 1)]);
                continue;
            }
            let [a, b, c] = corners.map(|c| c.uv.coords);
            let middle = (a + b + c) / 3.0;
            let jet = surface.jet(middle.x, middle.y);
            if jet.normal().is_some_and(|n| side * n.z < OVERHANGING) {
                continue;
            }
            let inside = corners.map(|c| self.slopes.inside(&surface.jet(c.uv.x, c.uv.y)));
            let places = corners.map(|c| (c.centre, c.inside_mm));
            let pieces = clipped(places, inside).flat_map(|piece| clipped(piece, piece.map(|(_, mm)| mm)));
            cuts.extend(pieces.map(|piece| Cut { centres: piece.map(|(centre, _)| centre), jet }));
        }
        cuts
    }

    /// Where the ball touches one side of the surface.
    fn corner(&self, surface: &NurbsSurface, uv: Point2, side: f64, inside_mm: f64) -> Option<Corner> {
        let (n, _) = surface.normal(uv.x, uv.y)?;
        let centre = surface.point(uv.x, uv.y) + self.ball.end().to_middle(&(n * side));
        Some(Corner { uv, normal: n, centre, inside_mm })
    }

    /// The corners, first those of the side over which the normal turns most: if that is too much, and if the side is
    /// longer than a raster can tell.
    fn bent_side(&self, corners: &[Corner; 3]) -> Option<[Corner; 3]> {
        let turned = [0, 1, 2].map(|k| [0, 1, 2].map(|i| corners[(k + i) % 3]));
        let cosine = |c: &[Corner; 3]| c[0].normal.dot(&c[1].normal);
        let most = turned.into_iter().min_by(|a, b| cosine(a).total_cmp(&cosine(b)))?;
        let length_mm = (most[0].centre - most[1].centre).norm();
        (cosine(&most) < STRAIGHT && length_mm > self.raster_mm()).then_some(most)
    }
}

/// A place, and how far it is inside of a border.
type Inside = (Point3, f64);

/// The part of a triangle where what is given at its corners is not negative, as triangles.
fn clipped(corners: [Inside; 3], given: [f64; 3]) -> impl Iterator<Item = [Inside; 3]> {
    let mut kept: Vec<Inside> = Vec::with_capacity(4);
    for i in 0..3 {
        let j = (i + 1) % 3;
        if given[i] >= 0.0 {
            kept.push(corners[i]);
        }
        if (given[i] >= 0.0) != (given[j] >= 0.0) {
            let share = given[i] / (given[i] - given[j]);
            let ((p, a), (q, b)) = (corners[i], corners[j]);
            let inside_mm = if a == b { a } else { a + (b - a) * share };
            kept.push((p + (q - p) * share, inside_mm));
        }
    }
    (2..kept.len()).map(move |k| [kept[0], kept[k - 1], kept[k]])
}
