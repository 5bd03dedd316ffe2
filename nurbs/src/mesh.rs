//! Triangles of a trimmed face whose deviation from the surface is bounded.

mod closed;
mod constraints;
mod grid;
mod inside;
mod lines;
pub(crate) mod sampling;
mod trimmed;

pub use closed::ClosedMesh;
pub use inside::{Inside, nearest_on_triangle};

use rayon::prelude::*;

use crate::curvedness::Curvedness;
use crate::rings::{Ring, polygon_rings, rings};
use crate::{Face, FaceId, Model, NurbsError, NurbsSurface, Point2, Point3};

/// How fine a face is triangulated.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MeshOptions {
    /// Largest distance of the face from its triangles, mm.
    pub deviation_mm: f64,
    /// Longest triangle edge, mm.
    pub longest_edge_mm: f64,
}

/// A triangulated face. Every vertex lies exactly on the surface and knows its parameters, every triangle
/// lies inside one face, so that linear interpolation in `(u, v)` gives exact surface points.
#[derive(Debug, Clone, Default)]
pub struct FaceMesh {
    /// Parameters of the vertices.
    pub uv: Vec<Point2>,
    /// The vertices, mm.
    pub points: Vec<Point3>,
    /// Triangles, anticlockwise in the parameter plane (so that their normal agrees with `Su × Sv`).
    pub triangles: Vec<[u32; 3]>,
    /// Per triangle: bound on the distance of the surface piece from it, mm.
    pub deviation_mm: Vec<f32>,
    /// Boundary loops as vertex indices, in order, first not repeated.
    pub rings: Vec<Vec<u32>>,
}

/// The triangles of all faces of a model, face after face.
#[derive(Debug, Clone, Default)]
pub struct ModelMesh {
    /// Corners, mm. Neighbouring faces have corners of their own.
    pub points: Vec<Point3>,
    /// Three corners each, anticlockwise in the parameter plane of their face.
    pub triangles: Vec<[u32; 3]>,
    /// The face of each triangle.
    pub faces: Vec<FaceId>,
}

impl ModelMesh {
    /// Triangulates all faces. One that cannot be has no triangles.
    #[must_use]
    pub fn of(model: &Model, deviation_mm: f64) -> Self {
        let options = MeshOptions { deviation_mm, longest_edge_mm: f64::INFINITY };
        let meshes: Vec<FaceMesh> =
            model.faces.par_iter().map(|face| tessellate(face, &options).unwrap_or_default()).collect();
        let mut all = ModelMesh::default();
        for (face, mesh) in meshes.into_iter().enumerate() {
            let first = all.points.len() as u32;
            all.faces.resize(all.faces.len() + mesh.triangles.len(), face);
            all.triangles.extend(mesh.triangles.iter().map(|t| t.map(|i| i + first)));
            all.points.extend(mesh.points);
        }
        all
    }
}

/// A loop that keeps this close to a parameter rectangle is the rectangle, mm.
const RECTANGLE_MM: f64 = 1e-5;

/// Triangulates the face.
///
/// Whole surfaces, and faces trimmed along parameter lines, become grids; all others a constrained Delaunay
/// triangulation of the exact trim curves' samples and a grid inside.
///
/// # Errors
/// Options that are not positive, a tolerance that asks for more than ten million points, or trim loops
/// that enclose nothing.
pub fn tessellate(face: &Face, options: &MeshOptions) -> Result<FaceMesh, NurbsError> {
    options.check()?;
    let surface = &face.surface;
    let ((u0, u1), (v0, v1)) = surface.domain();
    let whole = (Point2::new(u0, v0), Point2::new(u1, v1));
    if face.loops.is_empty() {
        return grid::rectangle_mesh(surface, whole, options);
    }
    let rings = rings(face);
    match rectangle(face, &rings, whole) {
        Some(window) => grid::rectangle_mesh(surface, window, options),
        None => trimmed::mesh(surface, &rings, options, trimmed::Border::Sampled),
    }
}

/// Triangulates the inside of polygons in the parameter plane of a surface: the loops of a face, sampled by
/// the caller. Their vertices are kept and edges up to the longest allowed get no further ones, so that the
/// meshes of neighbours fit each other where their polygons do. Inside, the triangles may cross creases of the
/// surface.
///
/// As with trim loops, jumps across the seam of a closed surface are joined along it (with vertices of their
/// own), and how polygons are nested decides which are holes.
///
/// # Errors
/// The same as [`tessellate`].
pub fn tessellate_polygons(
    surface: &NurbsSurface,
    polygons: &[Vec<Point2>],
    options: &MeshOptions,
) -> Result<FaceMesh, NurbsError> {
    options.check()?;
    trimmed::mesh(surface, &polygon_rings(surface, polygons), options, trimmed::Border::Kept)
}

impl MeshOptions {
    fn check(&self) -> Result<(), NurbsError> {
        let positive = |x: f64| x > 0.0 && !x.is_nan();
        if positive(self.deviation_mm) && positive(self.longest_edge_mm) {
            return Ok(());
        }
        let reason = "the deviation and the longest edge must be positive".into();
        Err(NurbsError::Mesh { reason })
    }
}

/// The parameter rectangle that the single loop of a face runs around, if it does.
pub(crate) fn rectangle(face: &Face, rings: &[Ring], whole: (Point2, Point2)) -> Option<(Point2, Point2)> {
    let [ring] = rings else { return None };
    let (low, high) = ring.hull();
    let runs_around = |slack: Point2| {
        let along_a_side = |points: &mut dyn Iterator<Item = Point2>| {
            let mut sides = [true; 4];
            for p in points {
                let near = [p.x - low.x, high.x - p.x, p.y - low.y, high.y - p.y];
                let slacks = [slack.x, slack.x, slack.y, slack.y];
                (0..4).for_each(|k| sides[k] &= near[k] <= slacks[k]);
            }
            sides.contains(&true)
        };
        let around = ring.arcs.iter().all(|a| along_a_side(&mut a.control_points()));
        // Along the sides and back again would enclose nothing: the corners must be met.
        let corners = [low, high, Point2::new(low.x, high.y), Point2::new(high.x, low.y)];
        let is_met = |c: &Point2| {
            let near = |p: Point2| (p.x - c.x).abs() <= slack.x && (p.y - c.y).abs() <= slack.y;
            ring.arcs.iter().any(|a| near(a.start()))
        };
        around && corners.iter().all(is_met)
    };
    // The size of the surface takes time, and most loops leave no doubt without it.
    let most = Point2::from((high - low) * 1e-3);
    if !(low.x < high.x && low.y < high.y && runs_around(most)) {
        return None;
    }
    if (low, high) == whole && runs_around(Point2::origin()) {
        return Some(whole);
    }
    let size = Curvedness::of(&face.surface).over(low, high);
    // Where the surface stands still (a plane has no such place) any parameter distance is the same point.
    let slack = Point2::new((RECTANGLE_MM / size.u).min(most.x), (RECTANGLE_MM / size.v).min(most.y));
    let snap = |x: f64, side: f64, slack: f64| if (x - side).abs() <= slack { side } else { x };
    let snapped = (
        Point2::new(snap(low.x, whole.0.x, slack.x), snap(low.y, whole.0.y, slack.y)),
        Point2::new(snap(high.x, whole.1.x, slack.x), snap(high.y, whole.1.y, slack.y)),
    );
    let inside = snapped.0 >= whole.0 && snapped.1 <= whole.1;
    (inside && runs_around(slack)).then_some(snapped)
}
