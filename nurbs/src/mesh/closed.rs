//! One closed mesh of faces that enclose something.
//!
//! ```text
//!     face A            Neighbours are sampled each by itself: along their joint they differ by what triangles may deviate, and
//!   ●────────────●      have different corners.
//!   ●──●────●────●      Border corners closer than a tolerance become one; a border side gets the corners that lie on it. Then
//!     face B            both have the same sides there.
//! ```

use rustc_hash::{FxHashMap, FxHashSet};

use super::{MeshOptions, ModelMesh};
use crate::box_tree::BoxTree;
use crate::{Aabb, Model, NurbsError, Point3};

/// Tolerances that are tried one after the other, in deviations: both neighbours leave the joint by one at most, and files
/// join faces no better than some hundredths of a millimetre.
const TOLERANCES: [f64; 4] = [0.3, 1.0, 2.5, 6.0];

/// Triangles that enclose something, wound anticlockwise seen from outside.
#[derive(Debug, Clone, PartialEq)]
pub struct ClosedMesh {
    /// Corners, mm.
    pub points: Vec<Point3>,
    /// Three corners each. Every side has as many triangles to its left as to its right.
    pub triangles: Vec<[u32; 3]>,
    /// Largest distance of a face from its triangles, mm.
    pub deviation_mm: f64,
}

impl ClosedMesh {
    /// Triangulates all faces of a solid, or of several, and sews the triangles together.
    ///
    /// # Errors
    /// A deviation that is not positive; faces that enclose nothing: how many sides are open, and where the first one is.
    pub fn of_model(model: &Model, deviation_mm: f64) -> Result<Self, NurbsError> {
        MeshOptions { deviation_mm, longest_edge_mm: f64::INFINITY }.check()?;
        // A face without triangles leaves a hole, which is told, or is too small for one.
        let mut mesh = ModelMesh::of(model, deviation_mm);
        for (t, face) in mesh.triangles.iter_mut().zip(mesh.faces) {
            if model.faces[face].reversed {
                t.swap(1, 2);
            }
        }
        ClosedMesh::sewn(&mesh.points, &mesh.triangles, deviation_mm)
    }

    /// Sews triangles together whose borders are within a distance of each other. Those that fit already stay as they are.
    ///
    /// # Errors
    /// They enclose nothing: how many sides are open, and where the first one is.
    pub fn of_triangles(
        points: &[Point3],
        triangles: &[[u32; 3]],
        within_mm: f64,
    ) -> Result<Self, NurbsError> {
        match first_open(points, triangles) {
            None => Ok(packed(points, triangles.to_vec(), 0.0)),
            Some(_) => ClosedMesh::sewn(points, triangles, within_mm),
        }
    }

    fn sewn(points: &[Point3], triangles: &[[u32; 3]], deviation_mm: f64) -> Result<Self, NurbsError> {
        let border = border(triangles);
        let mut open = None;
        for tolerance_mm in TOLERANCES.map(|k| k * deviation_mm) {
            let mut sewn = sewn(points, triangles, &border, tolerance_mm);
            let mut found = first_open(points, &sewn);
            if found.is_some() {
                turn_alike(points, &mut sewn);
                found = first_open(points, &sewn);
            }
            match found {
                None if sewn.is_empty() => {
                    let reason = format!(
                        "all of it is smaller than the {tolerance_mm} mm that borders are joined within"
                    );
                    return Err(NurbsError::Mesh { reason });
                }
                None => return Ok(packed(points, sewn, deviation_mm + tolerance_mm)),
                Some(_) => open = found,
            }
        }
        Err(open.unwrap_or(NurbsError::OpenMesh { sides: 0, at_mm: [0.0; 3] }))
    }

    /// What it encloses, mm³.
    #[must_use]
    pub fn volume_mm3(&self) -> f64 {
        self.triangles.iter().map(|t| volume_mm3(&self.points, t)).sum()
    }
}

/// Sides without a counterpart, from their triangle's left to right.
fn border(triangles: &[[u32; 3]]) -> FxHashSet<[u32; 2]> {
    let mut found = FxHashSet::default();
    for [a, b] in triangles.iter().flat_map(sides) {
        if !found.remove(&[b, a]) {
            found.insert([a, b]);
        }
    }
    found
}

fn sides([a, b, c]: &[u32; 3]) -> [[u32; 2]; 3] {
    [[*a, *b], [*b, *c], [*c, *a]]
}

/// The triangles with what is close made one.
fn sewn(
    points: &[Point3],
    triangles: &[[u32; 3]],
    border: &FxHashSet<[u32; 2]>,
    tolerance_mm: f64,
) -> Vec<[u32; 3]> {
    let mut corners: Vec<u32> = border.iter().flatten().copied().collect();
    corners.sort_unstable();
    corners.dedup();
    let one = Clusters::new(points, &corners, tolerance_mm);
    let mut sewn = Vec::with_capacity(triangles.len());
    let mut around = Vec::new();
    for t in triangles {
        around.clear();
        let (mut corners, mut apex) = ([0; 3], 0);
        for (k, [a, b]) in sides(t).into_iter().enumerate() {
            let [p, q] = [a, b].map(|i| one.of(i));
            corners[k] = around.len();
            around.push(p);
            if border.contains(&[a, b]) && p != q {
                one.between(points, [p, q], &mut around);
                if around.len() > corners[k] + 1 {
                    apex = (k + 2) % 3;
                }
            }
        }
        // The corner opposite of a divided side sees all of it. Where none was, the fan is one triangle.
        let at = |k: usize| around[(corners[apex] + k) % around.len()];
        let fan = (2..around.len()).map(|k| [at(0), at(k - 1), at(k)]);
        sewn.extend(fan.filter(|[a, b, c]| a != b && b != c && c != a));
    }
    sewn
}

/// Corners that are one.
struct Clusters {
    /// Of each corner that is not its own.
    of: FxHashMap<u32, u32>,
    /// Those that stand for themselves and others.
    kept: Vec<u32>,
    tree: BoxTree,
    tolerance_mm: f64,
}

impl Clusters {
    fn new(points: &[Point3], corners: &[u32], tolerance_mm: f64) -> Self {
        let cell = |p: &Point3| [0, 1, 2].map(|k| (p[k] / tolerance_mm).floor() as i64);
        let mut cells: FxHashMap<[i64; 3], Vec<u32>> = FxHashMap::default();
        let (mut of, mut kept) = (FxHashMap::default(), Vec::new());
        for &corner in corners {
            let p = &points[corner as usize];
            let here = cell(p);
            let near = |at: &u32| (points[*at as usize] - p).norm();
            let around = (0..27).map(|n| [here[0] + n % 3 - 1, here[1] + n / 3 % 3 - 1, here[2] + n / 9 - 1]);
            let others = around.filter_map(|cell| cells.get(&cell)).flatten().copied();
            let closest =
                others.map(|at| (near(&at), at)).min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
            match closest.filter(|(mm, _)| *mm <= tolerance_mm) {
                Some((_, at)) => {
                    of.insert(corner, at);
                }
                None => {
                    cells.entry(here).or_default().push(corner);
                    kept.push(corner);
                }
            }
        }
        let boxes: Vec<Aabb> = kept.iter().map(|at| Aabb::of([&points[*at as usize]])).collect();
        Clusters { of, kept, tree: BoxTree::new(&boxes), tolerance_mm }
    }

    fn of(&self, corner: u32) -> u32 {
        self.of.get(&corner).copied().unwrap_or(corner)
    }

    /// Adds what lies on a side between its ends, in order.
    fn between(&self, points: &[Point3], [p, q]: [u32; 2], found: &mut Vec<u32>) {
        let (from, to) = if p < q { (p, q) } else { (q, p) };
        let (start, way) = (points[from as usize], points[to as usize] - points[from as usize]);
        let around = Aabb::of([&points[p as usize], &points[q as usize]]).inflated(self.tolerance_mm);
        let mut on: Vec<(f64, u32)> = Vec::new();
        self.tree.visit(
            |boxes| boxes.each(|b| b.meets(&around)),
            |k| {
                let corner = self.kept[k];
                let share = (points[corner as usize] - start).dot(&way) / way.norm_squared();
                let foot = start + way * share;
                let is_on = corner != p
                    && corner != q
                    && share > 0.0
                    && share < 1.0
                    && (points[corner as usize] - foot).norm() <= self.tolerance_mm;
                on.extend(is_on.then_some((share, corner)));
                std::ops::ControlFlow::Continue(())
            },
        );
        on.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        if p < q {
            found.extend(on.into_iter().map(|(_, corner)| corner));
        } else {
            found.extend(on.into_iter().rev().map(|(_, corner)| corner));
        }
    }
}

/// Turns triangles so that neighbours agree which side is outside, and each piece of them encloses something positive: not all
/// files say of surfaces what is outside.
fn turn_alike(points: &[Point3], triangles: &mut [[u32; 3]]) {
    let mut beside: FxHashMap<[u32; 2], Vec<u32>> = FxHashMap::default();
    for (k, t) in triangles.iter().enumerate() {
        for [a, b] in sides(t) {
            beside.entry([a.min(b), a.max(b)]).or_default().push(k as u32);
        }
    }
    let mut is_seen = vec![false; triangles.len()];
    for first in 0..triangles.len() {
        if std::mem::replace(&mut is_seen[first], true) {
            continue;
        }
        let mut piece = vec![first as u32];
        let mut next = 0;
        while let Some(&at) = piece.get(next) {
            next += 1;
            for [a, b] in sides(&triangles[at as usize]) {
                let [one, other] = beside[&[a.min(b), a.max(b)]][..] else { continue };
                let other = if one == at { other } else { one };
                if !std::mem::replace(&mut is_seen[other as usize], true) {
                    let t = &mut triangles[other as usize];
                    if sides(t).contains(&[a, b]) {
                        t.swap(1, 2);
                    }
                    piece.push(other);
                }
            }
        }
        if piece.iter().map(|k| volume_mm3(points, &triangles[*k as usize])).sum::<f64>() < 0.0 {
            piece.iter().for_each(|k| triangles[*k as usize].swap(1, 2));
        }
    }
}

/// What a triangle and the first point enclose, mm³: a sixth of a determinant.
fn volume_mm3(points: &[Point3], t: &[u32; 3]) -> f64 {
    let [a, b, c] = t.map(|i| points[i as usize] - points[0]);
    a.cross(&b).dot(&c) / 6.0
}

/// How many sides have no counterpart, and where the first of them is.
fn first_open(points: &[Point3], triangles: &[[u32; 3]]) -> Option<NurbsError> {
    let mut turns: FxHashMap<[u32; 2], i32> = FxHashMap::default();
    for [a, b] in triangles.iter().flat_map(sides) {
        *turns.entry([a.min(b), a.max(b)]).or_default() += if a < b { 1 } else { -1 };
    }
    let open = turns.iter().filter(|(_, turns)| **turns != 0).map(|(side, _)| *side);
    let (sides, first) = open.fold((0, None), |(n, first): (_, Option<[u32; 2]>), side| {
        (n + 1, Some(first.map_or(side, |f| f.min(side))))
    });
    first.map(|[a, _]| NurbsError::OpenMesh { sides, at_mm: points[a as usize].into() })
}

/// Without corners that no triangle has, and turned outwards as a whole.
fn packed(points: &[Point3], mut triangles: Vec<[u32; 3]>, deviation_mm: f64) -> ClosedMesh {
    let mut place = vec![u32::MAX; points.len()];
    let mut kept = Vec::new();
    for i in triangles.iter_mut().flatten() {
        let at = &mut place[*i as usize];
        if *at == u32::MAX {
            *at = kept.len() as u32;
            kept.push(points[*i as usize]);
        }
        *i = *at;
    }
    let mut mesh = ClosedMesh { points: kept, triangles, deviation_mm };
    if mesh.volume_mm3() < 0.0 {
        mesh.triangles.iter_mut().for_each(|t| t.swap(1, 2));
    }
    mesh
}
