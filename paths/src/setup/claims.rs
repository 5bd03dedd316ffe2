//! Which places on the faces a setup cuts.

use std::sync::Arc;

use claymill_contact::Covering;
use claymill_nurbs::{FaceId, FaceMesh, Point2};
use rayon::prelude::*;
use rustc_hash::FxHashMap;

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
    bins: Vec<Vec<Piece>>,
    /// By triangle, how far the corners of those are inside that the setup's border crosses, mm.
    borders: FxHashMap<u32, [f32; 3]>,
}

/// A piece of a face.
#[derive(Clone, Copy)]
struct Piece {
    corners: [Point2; 3],
    what: What,
}

#[derive(Clone, Copy)]
enum What {
    Claimed,
    /// As far as it is inside; that is known at the corners, mm.
    Crossed([f32; 3]),
    /// No setup gets to it, though one does to others of its triangle.
    Missed,
}

impl Claims {
    /// What a setup cuts from above.
    pub(crate) fn of_setup(covering: &Covering, assignments: &Assignments, setup: usize) -> Self {
        let borders = |face: FaceId| {
            let own = assignments.borders[face].iter().filter(|border| usize::from(border.setup) == setup);
            own.map(|border| (border.triangle, border.inside_mm)).collect()
        };
        Self::new(covering, assignments, |assignment| assignment.is_cut_by(setup), borders)
    }

    /// What a setup cuts as walls, on one side of `Su × Sv`.
    pub(crate) fn of_walls(
        covering: &Covering,
        assignments: &Assignments,
        setup: usize,
        other_side: bool,
    ) -> Self {
        let mine = |assignment: &Assignment| assignment.is_wall_of(setup, other_side);
        Self::new(covering, assignments, mine, |_| FxHashMap::default())
    }

    /// Of the triangles whose fates are `mine`, without what is missed of them, within `borders`.
    fn new(
        covering: &Covering,
        assignments: &Assignments,
        mine: impl Fn(&Assignment) -> bool + Sync,
        borders: impl Fn(FaceId) -> FxHashMap<u32, [f32; 3]> + Sync,
    ) -> Self {
        let claimed = |(face, mesh): (FaceId, &FaceMesh)| {
            let (all, missed) = (&assignments.of[face], &assignments.missed[face]);
            let borders = borders(face);
            match all.iter().filter(|f| mine(f)).count() {
                0 => Claimed::None,
                count if count == all.len() && missed.is_empty() && borders.is_empty() => Claimed::All,
                _ => Claimed::Part(Arc::new(Bins::new(mesh, all.iter().map(&mine), missed, borders))),
            }
        };
        Claims { faces: covering.meshes().par_iter().enumerate().map(claimed).collect() }
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

    /// How far the corners of a triangle are inside of what the setup cuts, mm, if its border crosses the triangle.
    pub(crate) fn inside_mm(&self, face: FaceId, triangle: usize) -> Option<[f64; 3]> {
        let Claimed::Part(bins) = &self.faces[face] else { return None };
        bins.borders.get(&(triangle as u32)).map(|inside_mm| inside_mm.map(f64::from))
    }

    /// Whether a border of the setup crosses the triangle with these parameters.
    pub(crate) fn is_crossed(&self, face: FaceId, at: Point2) -> bool {
        let Claimed::Part(bins) = &self.faces[face] else { return false };
        bins.pieces_with(at).any(|piece| matches!(piece.what, What::Crossed(_)))
    }

    /// Whether the setup cuts any of the face.
    pub(crate) fn any(&self, face: FaceId) -> bool {
        !matches!(self.faces[face], Claimed::None)
    }
}

impl Bins {
    fn new(
        mesh: &FaceMesh,
        mine: impl Iterator<Item = bool>,
        missed: &[[Point2; 3]],
        borders: FxHashMap<u32, [f32; 3]>,
    ) -> Self {
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
            borders,
        };
        let claimed = mesh.triangles.iter().zip(mine).enumerate().filter(|(_, (_, mine))| *mine);
        let claimed: Vec<Piece> = claimed
            .map(|(k, (t, _))| Piece {
                corners: t.map(|i| mesh.uv[i as usize]),
                what: bins.borders.get(&(k as u32)).map_or(What::Claimed, |inside| What::Crossed(*inside)),
            })
            .collect();
        let missed = missed.iter().map(|&corners| Piece { corners, what: What::Missed });
        for piece in claimed.into_iter().chain(missed) {
            bins.met(&piece.corners).for_each(|bin| bins.bins[bin].push(piece));
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

    /// The pieces that a place is in.
    fn pieces_with(&self, p: Point2) -> impl Iterator<Item = &Piece> {
        let [i, j] = self.bin(&p);
        self.bins[j * self.count[0] + i].iter().filter(move |piece| contains(&piece.corners, p))
    }

    fn holds(&self, p: Point2) -> bool {
        let mut claimed = false;
        for piece in self.pieces_with(p) {
            match piece.what {
                What::Claimed => claimed = true,
                What::Crossed(inside_mm) => claimed |= within(&piece.corners, inside_mm, p) >= 0.0,
                What::Missed => return false,
            }
        }
        claimed
    }
}

/// What is given at the corners of a triangle, at a place in it; in one without an area, the least of that.
fn within(corners: &[Point2; 3], given: [f32; 3], p: Point2) -> f64 {
    let [a, b, c] = corners.map(|q| q - p);
    let parts = [b.perp(&c), c.perp(&a), a.perp(&b)];
    let all: f64 = parts.iter().sum();
    match all == 0.0 {
        true => given.into_iter().fold(f64::INFINITY, |least, mm| least.min(f64::from(mm))),
        false => parts.iter().zip(given).map(|(part, mm)| part / all * f64::from(mm)).sum(),
    }
}
