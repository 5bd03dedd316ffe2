//! Which places on the faces a setup cuts.

use std::sync::Arc;

use claymill_nurbs::{FaceId, FaceMesh, Point2};
use rayon::prelude::*;

use crate::contact::Covering;
use crate::reach::Fate;

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
    /// Per bin: corners of a triangle and whether it is claimed.
    bins: Vec<Vec<([Point2; 3], bool)>>,
}

impl Claims {
    pub(crate) fn new(covering: &Covering, fates: &[Vec<Fate>], mine: impl Fn(&Fate) -> bool + Sync) -> Self {
        let faces = covering
            .meshes
            .par_iter()
            .zip(fates)
            .map(|(mesh, fates)| match fates.iter().filter(|f| mine(f)).count() {
                0 => Claimed::None,
                all if all == fates.len() => Claimed::All,
                _ => Claimed::Part(Arc::new(Bins::new(mesh, fates.iter().map(&mine)))),
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
    fn new(mesh: &FaceMesh, mine: impl Iterator<Item = bool>) -> Self {
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
        for (t, mine) in mesh.triangles.iter().zip(mine) {
            let corners = t.map(|i| mesh.uv[i as usize]);
            let box_low = corners[0].inf(&corners[1]).inf(&corners[2]);
            let box_high = corners[0].sup(&corners[1]).sup(&corners[2]);
            let ([i0, j0], [i1, j1]) = (bins.bin(&box_low), bins.bin(&box_high));
            for j in j0..=j1 {
                for i in i0..=i1 {
                    bins.bins[j * along + i].push((corners, mine));
                }
            }
        }
        bins
    }

    fn bin(&self, p: &Point2) -> [usize; 2] {
        [0, 1].map(|k| (((p[k] - self.low[k]) / self.size[k]).max(0.0) as usize).min(self.count[k] - 1))
    }

    fn holds(&self, p: Point2) -> bool {
        let [i, j] = self.bin(&p);
        self.bins[j * self.count[0] + i].iter().any(|(corners, mine)| *mine && contains(corners, p))
    }
}

fn contains(corners: &[Point2; 3], p: Point2) -> bool {
    let [a, b, c] = corners.map(|q| q - p);
    let turns = [a.perp(&b), b.perp(&c), c.perp(&a)];
    turns.iter().all(|t| *t >= 0.0) || turns.iter().all(|t| *t <= 0.0)
}
