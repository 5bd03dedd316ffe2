//! Pieces of faces with the triangles that stand for them; cutting one in four quarters its
//! deviation from the surface.

use claymill_nurbs::{FaceId, FaceMesh, Model, Point2, Point3};

use crate::drop::DropMesh;

/// Triangles are cut in four at most so often.
const CUTS: u32 = 6;
/// A triangle that was cut less often is large.
const LARGE_CUTS: u32 = 2;

/// A piece of a face and the triangle that stands for it, in the frame of a setup.
#[derive(Debug, Clone, Copy)]
pub(super) struct Patch {
    pub(super) corners: [Point3; 3],
    /// How far the surface may be from the triangle, mm.
    pub(super) deviation_mm: f64,
    /// Where it comes from; `None` for obstacles, which are triangles themselves.
    origin: Option<(FaceId, [Point2; 3])>,
    cuts: u32,
}

/// What patches are made of.
pub(super) struct Patches<'a> {
    pub(super) model: &'a Model,
    pub(super) meshes: &'a [Option<FaceMesh>],
    pub(super) view: &'a DropMesh<'a>,
}

impl Patch {
    pub(super) fn face(&self) -> Option<FaceId> {
        self.origin.map(|o| o.0)
    }

    /// Whether it may well be cut before it is looked at closely.
    pub(super) fn is_large(&self) -> bool {
        self.origin.is_some() && self.cuts < LARGE_CUTS
    }
}

impl Patches<'_> {
    /// A triangle of the setup's mesh.
    pub(super) fn whole(&self, triangle: usize) -> Patch {
        let origin = self.view.face_of(triangle).and_then(|(face, local)| {
            let mesh = self.meshes[face].as_ref()?;
            Some((face, mesh.triangles[local].map(|i| mesh.uv[i as usize])))
        });
        Patch {
            corners: self.view.corners(triangle),
            deviation_mm: self.view.deviation(triangle),
            origin,
            cuts: 0,
        }
    }

    /// Four smaller patches with their corners on the surface; `None` when the surface is within `fine_mm` of the triangle. Halving
    /// the sides quarters the deviation, since it is a bound on second derivatives over the patch times their squares.
    pub(super) fn quarters(&self, patch: &Patch, fine_mm: f64) -> Option<[Patch; 4]> {
        let (face, uv) = patch.origin.filter(|_| patch.deviation_mm > fine_mm && patch.cuts < CUTS)?;
        let surface = &self.model.faces[face].surface;
        let middle = |i: usize, j: usize| nalgebra::center(&uv[i], &uv[j]);
        let middles = [middle(0, 1), middle(1, 2), middle(2, 0)];
        let points = middles.map(|m| self.view.in_frame(&surface.point(m.x, m.y)));
        let piece = |corners, uv| Patch {
            corners,
            deviation_mm: 0.25 * patch.deviation_mm,
            origin: Some((face, uv)),
            cuts: patch.cuts + 1,
        };
        let [a, b, c] = patch.corners;
        let [ab, bc, ca] = points;
        Some([
            piece([a, ab, ca], [uv[0], middles[0], middles[2]]),
            piece([ab, b, bc], [middles[0], uv[1], middles[1]]),
            piece([ca, bc, c], [middles[2], middles[1], uv[2]]),
            piece([ab, bc, ca], middles),
        ])
    }
}
