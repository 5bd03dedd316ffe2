//! Where the joints of `regions.json` run: found again along the boundaries of the meshes.

use std::collections::{BTreeSet, HashMap};

use claymill_nurbs::{FaceMesh, Point3};
use claymill_toolpath::JointRecord;
use rayon::prelude::*;

use crate::exhibit::Exhibit;
use crate::lines::Stroke;

/// What lies along a stretch of boundary.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum JointClass {
    /// Nothing, or nothing that the joints know of.
    Open,
    /// A border of regions.
    Border,
    /// An edge inside a region.
    Sharp,
    /// Tangent.
    Tangent,
    /// Of equal curvature.
    Curvature,
}

impl JointClass {
    /// All of them, as the layer tree lists them.
    pub const ALL: [JointClass; 5] =
        [JointClass::Border, JointClass::Sharp, JointClass::Tangent, JointClass::Curvature, JointClass::Open];

    /// For the layer tree.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            JointClass::Border => "Region borders",
            JointClass::Sharp => "Inner edges (C0)",
            JointClass::Tangent => "Tangent joints (G1)",
            JointClass::Curvature => "Smooth joints (G2)",
            JointClass::Open => "Open boundaries",
        }
    }
}

/// A stretch of boundary between two faces, or of one with nothing beside it.
#[derive(Debug, Clone, PartialEq)]
pub struct Seam {
    /// The face, and the one beside it.
    pub faces: (usize, Option<usize>),
    /// Index into the joints of `regions.json`.
    pub joint: Option<usize>,
    /// What it is.
    pub class: JointClass,
}

/// The seams of an exhibit and where they run.
#[derive(Debug, Default)]
pub(crate) struct Seams {
    pub(crate) seams: Vec<Seam>,
    pub(crate) strokes: Vec<Stroke>,
}

/// A piece of boundary.
#[derive(Debug, Clone, Copy)]
struct Edge {
    face: u32,
    ends: [u32; 2],
    a: Point3,
    b: Point3,
}

impl Seams {
    pub(crate) fn new(exhibit: &Exhibit, origin: &Point3) -> Self {
        let deviation = exhibit.meshes.iter().flat_map(|m| &m.deviation_mm).copied().fold(0.0, f32::max);
        // Chords of two meshes along one edge differ by up to both meshes' deviation.
        let reach_mm = exhibit.regions.tolerance_mm + 2.0 * f64::from(deviation);
        let grid = EdgeGrid::new(&exhibit.meshes, reach_mm);
        let runs: Vec<(usize, Option<usize>, Vec<Point3>)> = (0..exhibit.meshes.len())
            .into_par_iter()
            .flat_map_iter(|face| runs(&exhibit.meshes[face], face, &grid, reach_mm))
            .collect();
        let by_faces = by_faces(&exhibit.regions.joints);
        let mut seams = Seams::default();
        for (face, beside, points) in runs {
            // Both faces draw their joints: where three meet they do not see the same neighbour.
            let joint = beside.and_then(|b| by_faces.get(&[face.min(b), face.max(b)]).copied());
            let class = class(exhibit, face, beside, joint.map(|j| &exhibit.regions.joints[j]));
            let tag = seams.seams.len() as u32;
            seams.seams.push(Seam { faces: (face, beside), joint, class });
            let relative = |p: &Point3| [0, 1, 2].map(|i| (p[i] - origin[i]) as f32);
            let points = points.iter().map(relative).collect();
            seams.strokes.push(Stroke { tag, group: tag, thinned: false, points });
        }
        seams
    }
}

/// Pairs of faces with a joint of each class, and open stretches, as [`JointClass::ALL`] lists them.
pub(crate) fn joint_counts(seams: &[Seam]) -> [usize; 5] {
    JointClass::ALL.map(|class| {
        let of_class = seams.iter().filter(|s| s.class == class);
        let pair = |s: &Seam| s.faces.1.map(|other| [s.faces.0.min(other), s.faces.0.max(other)]);
        let pairs: BTreeSet<[usize; 2]> = of_class.clone().filter_map(pair).collect();
        pairs.len() + of_class.filter(|s| s.faces.1.is_none()).count()
    })
}

/// The longest joint of each pair of faces.
fn by_faces(joints: &[JointRecord]) -> HashMap<[usize; 2], usize> {
    let mut longest: HashMap<[usize; 2], usize> = HashMap::new();
    for (i, j) in joints.iter().enumerate() {
        let key = [j.faces[0].min(j.faces[1]), j.faces[0].max(j.faces[1])];
        let best = longest.entry(key).or_insert(i);
        if joints[*best].length_mm < j.length_mm {
            *best = i;
        }
    }
    longest
}

fn class(exhibit: &Exhibit, face: usize, beside: Option<usize>, joint: Option<&JointRecord>) -> JointClass {
    let region = |f: usize| exhibit.region_of_face[f];
    match (beside, joint.map(|j| j.class.as_str())) {
        (None, _) => JointClass::Open,
        (Some(other), _) if region(other) != region(face) => JointClass::Border,
        (Some(_), Some("G2")) => JointClass::Curvature,
        (Some(_), Some("G1")) => JointClass::Tangent,
        (Some(_), _) => JointClass::Sharp,
    }
}

/// The boundary of a face as runs with the same neighbour.
fn runs(
    mesh: &FaceMesh,
    face: usize,
    grid: &EdgeGrid,
    reach_mm: f64,
) -> Vec<(usize, Option<usize>, Vec<Point3>)> {
    let mut runs: Vec<(usize, Option<usize>, Vec<Point3>)> = Vec::new();
    for ring in &mesh.rings {
        let (first, mut going_on) = (runs.len(), false);
        for i in 0..ring.len() {
            let ends = [ring[i], ring[(i + 1) % ring.len()]];
            let [a, b] = ends.map(|v| mesh.points[v as usize]);
            if a == b {
                continue;
            }
            let beside = grid.beside(&Edge { face: face as u32, ends, a, b }, reach_mm);
            match runs.last_mut() {
                Some(run) if going_on && run.1 == beside => run.2.push(b),
                _ => runs.push((face, beside, vec![a, b])),
            }
            going_on = true;
        }
        // A ring may begin in the middle of a run.
        if runs.len() > first + 1
            && runs[first].1 == runs[runs.len() - 1].1
            && let Some(last) = runs.pop()
        {
            let begin = std::mem::replace(&mut runs[first].2, last.2);
            runs[first].2.extend(begin.into_iter().skip(1));
        }
    }
    runs
}

/// Edges in the cells of a grid, to be found by place.
struct EdgeGrid {
    cell_mm: f64,
    cells: HashMap<[i64; 3], Vec<u32>>,
    edges: Vec<Edge>,
}

impl EdgeGrid {
    fn new(meshes: &[FaceMesh], reach_mm: f64) -> Self {
        let mut edges = Vec::new();
        for (face, mesh) in meshes.iter().enumerate() {
            for ring in &mesh.rings {
                for i in 0..ring.len() {
                    let ends = [ring[i], ring[(i + 1) % ring.len()]];
                    let [a, b] = ends.map(|v| mesh.points[v as usize]);
                    edges.push(Edge { face: face as u32, ends, a, b });
                }
            }
        }
        let mean_mm = edges.iter().map(|e| (e.b - e.a).norm()).sum::<f64>() / edges.len().max(1) as f64;
        let cell_mm = mean_mm.max(2.0 * reach_mm).max(f64::MIN_POSITIVE);
        let mut grid = EdgeGrid { cell_mm, cells: HashMap::new(), edges };
        for index in 0..grid.edges.len() {
            let Edge { a, b, .. } = grid.edges[index];
            // Half a cell a step: with a look into the cells around nothing within a cell is missed.
            let steps = ((b - a).norm() / (0.5 * cell_mm)).ceil().max(1.0) as usize;
            for step in 0..=steps {
                let key = grid.key(&(a + (b - a) * (step as f64 / steps as f64)));
                let cell = grid.cells.entry(key).or_default();
                if cell.last() != Some(&(index as u32)) {
                    cell.push(index as u32);
                }
            }
        }
        grid
    }

    fn key(&self, p: &Point3) -> [i64; 3] {
        [0, 1, 2].map(|i| (p[i] / self.cell_mm).floor() as i64)
    }

    /// The face whose boundary runs nearest to the middle of `e`.
    fn beside(&self, e: &Edge, reach_mm: f64) -> Option<usize> {
        let middle = nalgebra::center(&e.a, &e.b);
        let [x, y, z] = self.key(&middle);
        let mut nearest: Option<(f64, u32)> = None;
        for d in 0..27 {
            let Some(cell) = self.cells.get(&[x + d % 3 - 1, y + d / 3 % 3 - 1, z + d / 9 - 1]) else {
                continue;
            };
            for &other in cell {
                let o = &self.edges[other as usize];
                if o.face == e.face && (o.ends.contains(&e.ends[0]) || o.ends.contains(&e.ends[1])) {
                    continue;
                }
                let found = (distance_to_segment(&middle, &o.a, &o.b), o.face);
                if found.0 <= reach_mm && nearest.is_none_or(|n| found < n) {
                    nearest = Some(found);
                }
            }
        }
        nearest.map(|n| n.1 as usize)
    }
}

fn distance_to_segment(p: &Point3, a: &Point3, b: &Point3) -> f64 {
    let ab = b - a;
    let length2 = ab.norm_squared();
    let t = if length2 > 0.0 { ((p - a).dot(&ab) / length2).clamp(0.0, 1.0) } else { 0.0 };
    (p - (a + ab * t)).norm()
}
