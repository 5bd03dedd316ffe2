//! Triangle adjacency in the parameter planes of the faces, with the sides at which a face ends,
//! and the walk from a triangle to the one that holds a place.

use claymill_nurbs::{FaceMesh, Point2};
use rayon::prelude::*;

/// Which triangles lie beside which in the parameter planes of their faces. Triangles of all faces are numbered in one.
#[derive(Debug, Default)]
pub(crate) struct Adjacency {
    /// Per triangle, beyond the sides that begin in its first, second and third corner.
    sides: Vec<[u32; 3]>,
    /// Per face, its first triangle.
    first: Vec<u32>,
    rims: u32,
}

/// What lies beyond a side.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Beyond {
    Triangle(u32),
    /// The face ends; the sides where it does are numbered.
    Rim(u32),
}

/// Numbers from here on are those of rims.
const RIM: u32 = 1 << 31;
/// More triangles than this between two places are not crossed.
const STEPS: usize = 32;

impl Adjacency {
    pub(crate) fn new(meshes: &[FaceMesh]) -> Self {
        let mut all = Adjacency::default();
        for (sides, rims) in meshes.par_iter().map(sides).collect::<Vec<_>>() {
            let first = all.sides.len() as u32;
            let numbered = |side: u32| if side >= RIM { side + all.rims } else { side + first };
            all.sides.extend(sides.iter().map(|s| s.map(numbered)));
            all.first.push(first);
            all.rims += rims;
        }
        all
    }

    /// The number of a face's triangle.
    pub(crate) fn number(&self, face: u32, index: u32) -> u32 {
        self.first[face as usize] + index
    }

    /// How many triangles there are.
    pub(crate) fn triangles(&self) -> usize {
        self.sides.len()
    }

    /// On how many sides of triangles faces end.
    pub(crate) fn rims(&self) -> usize {
        self.rims as usize
    }

    pub(crate) fn beyond(&self, triangle: u32) -> [Beyond; 3] {
        self.sides[triangle as usize].map(|other| match other {
            rim if rim >= RIM => Beyond::Rim(rim - RIM),
            other => Beyond::Triangle(other),
        })
    }

    /// Walks from a triangle of a face to the one that `p` lies in, or to the side on which the face ends: its triangle and
    /// which one it is. `None` if neither is near.
    pub(crate) fn walk(
        &self,
        face: u32,
        mesh: &FaceMesh,
        from: u32,
        p: Point2,
    ) -> Option<Result<u32, (u32, usize)>> {
        let first = self.first[face as usize];
        let mut at = from;
        for _ in 0..STEPS {
            let uv = mesh.triangles[(at - first) as usize].map(|i| mesh.uv[i as usize]);
            // Triangles run anticlockwise: negative beyond a side.
            let within = |k: usize| (uv[(k + 1) % 3] - uv[k]).perp(&(p - uv[k]));
            let inside = [within(0), within(1), within(2)];
            if inside[0] >= 0.0 && inside[1] >= 0.0 && inside[2] >= 0.0 {
                return Some(Ok(at));
            }
            let k = (0..3).min_by(|&a, &b| inside[a].total_cmp(&inside[b]))?;
            match self.beyond(at)[k] {
                Beyond::Triangle(next) => at = next,
                Beyond::Rim(_) => return Some(Err((at, k))),
            }
        }
        None
    }
}

/// What lies beyond the sides of a mesh's triangles, and how many of them are rims.
fn sides(mesh: &FaceMesh) -> (Vec<[u32; 3]>, u32) {
    let side = |t: &[u32; 3], k: usize| (t[k], t[(k + 1) % 3]);
    // Where the sides that begin in each vertex are listed.
    let mut first = vec![0u32; mesh.points.len() + 1];
    mesh.triangles.iter().flatten().for_each(|&i| first[i as usize + 1] += 1);
    for i in 1..first.len() {
        first[i] += first[i - 1];
    }
    let (mut free, mut listed) = (first.clone(), vec![(0u32, 0u32); 3 * mesh.triangles.len()]);
    for (triangle, t) in mesh.triangles.iter().enumerate() {
        for k in 0..3 {
            let (from, to) = side(t, k);
            listed[free[from as usize] as usize] = (to, triangle as u32);
            free[from as usize] += 1;
        }
    }
    let mut rims = 0;
    let mut beyond = |t: &[u32; 3], k: usize| {
        let (from, to) = side(t, k);
        let of_end = &listed[first[to as usize] as usize..first[to as usize + 1] as usize];
        of_end.iter().find(|(back, _)| *back == from).map_or_else(
            || {
                rims += 1;
                RIM + rims - 1
            },
            |(_, triangle)| *triangle,
        )
    };
    let sides = mesh.triangles.iter().map(|t| [0, 1, 2].map(|k| beyond(t, k))).collect();
    (sides, rims)
}
