//! Which places on the faces a setup cuts.

use std::sync::Arc;

use claymill_contact::Covering;
use claymill_nurbs::{FaceId, FaceMesh, Point2};
use rayon::prelude::*;

use crate::setup::assignment::{Assignment, Assignments};
use crate::setup::in_triangle::contains;

/// What one setup cuts, by face.
pub(crate) struct Claims {
    faces: Vec<Claimed>,
}

#[derive(Clone)]
enum Claimed {
    All,
    None,
    Part(Arc<Bins>),
}

/// Triangles of a face, binned by their boxes in the parameter plane.
struct Bins {
    low: Point2,
    size: [f64; 2],
    count: [usize; 2],
    /// Per bin: claimed triangles, and (false) parts of these that no setup gets to.
    bins: Vec<Vec<([Point2; 3], bool)>>,
}

impl Claims {
    /// Of the triangles whose fates are `mine`, without what is missed of them.
    pub(crate) fn new(
        covering: &Covering,
        assignments: &Assignments,
        mine: impl Fn(&Assignment) -> bool + Sync,
    ) -> Self {
        let faces = covering
            .meshes()
            .par_iter()
            .zip(&assignments.of)
            .zip(&assignments.missed)
            .map(|((mesh, assignments), missed)| match assignments.iter().filter(|f| mine(f)).count() {
                0 => Claimed::None,
                all if all == assignments.len() && missed.is_empty() => Claimed::All,
                _ => Claimed::Part(Arc::new(Bins::new(mesh, assignments.iter().map(&mine), missed))),
            })
            .collect();
        Claims { faces }
    }

    /// For some faces, what one of two claims on each, and nothing else.
    pub(crate) fn of_two(two: &[Claims; 2], faces: &[FaceId], is_second: impl Fn(FaceId) -> bool) -> Self {
        let mut chosen = vec![Claimed::None; two[0].faces.len()];
        for &face in faces {
            chosen[face] = two[usize::from(is_second(face))].faces[face].clone();
        }
        Claims { faces: chosen }
    }

    /// Whether the setup cuts the face at these parameters.
    pub(crate) fn holds(&self, face: FaceId, at: Point2) -> bool {
        match &self.faces[face] {
            Claimed::All => true,
            Claimed::None => false,
            Claimed::Part(bins) => bins.holds(at),
        }
    }

    /// Whether the setup cuts any of the face.
    pub(crate) fn any(&self, face: FaceId) -> bool {
        !matches!(self.faces[face], Claimed::None)
    }
}

impl Bins {
    fn new(mesh: &FaceMesh, mine: impl Iterator<Item = bool>, missed: &[[Point2; 3]]) -> Self {
        let mut low = Point2::new(f64::INFINITY, f64::INFINITY);
        let mut high = -low;
        for p in &mesh.uv {
            low = low.inf(p);
            high = high.sup(p);
        }
        let along = (mesh.triangles.len() as f64).sqrt().ceil().max(1.0) as usize;
        let mut bins = Bins {
            low,
            size: [0, 1].map(|k| ((high[k] - low[k]) / along as f64).max(f64::MIN_POSITIVE)),
            count: [along; 2],
            bins: vec![Vec::new(); along * along],
        };
        let claimed = mesh.triangles.iter().zip(mine).filter(|(_, mine)| *mine);
        let claimed = claimed.map(|(t, _)| (t.map(|i| mesh.uv[i as usize]), true));
        for part in claimed.chain(missed.iter().map(|part| (*part, false))) {
            bins.met(&part.0).for_each(|bin| bins.bins[bin].push(part));
        }
        bins
    }

    /// The bins that the box around a triangle meets.
    fn met(&self, corners: &[Point2; 3]) -> impl Iterator<Item = usize> + use<> {
        let [a, b, c] = corners;
        let ([i0, j0], [i1, j1]) = (self.bin(&a.inf(b).inf(c)), self.bin(&a.sup(b).sup(c)));
        let along = self.count[0];
        (j0..=j1).flat_map(move |j| (i0..=i1).map(move |i| j * along + i))
    }

    fn bin(&self, p: &Point2) -> [usize; 2] {
        [0, 1].map(|k| (((p[k] - self.low[k]) / self.size[k]).max(0.0) as usize).min(self.count[k] - 1))
    }

    fn holds(&self, p: Point2) -> bool {
        let [i, j] = self.bin(&p);
        let bin = &self.bins[j * self.count[0] + i];
        let is_in = |claimed: bool| bin.iter().any(|part| part.1 == claimed && contains(&part.0, p));
        is_in(true) && !is_in(false)
    }
}
