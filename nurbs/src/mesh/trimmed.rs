//! Triangulation of a trimmed face: constrained Delaunay over boundary and grid points in the scaled
//! parameter plane.

use std::collections::HashMap;
use std::panic::{AssertUnwindSafe, catch_unwind};

use spade::handles::FixedVertexHandle;
use spade::{ConstrainedDelaunayTriangulation, HasPosition, Triangulation};

use super::constraints::{keep_edges, refused};
use super::lines::Lines;
use super::sampling::{Limits, MOST_SAMPLES, Sample, sample};
use crate::arc::Arc;
use crate::curvedness::Curvedness;
use crate::rings::Ring;
use crate::winding::Winding;
use crate::{FaceMesh, KnotVector, MeshOptions, NurbsError, NurbsSurface, Point2};

pub(super) type Cdt = ConstrainedDelaunayTriangulation<Vertex>;

/// A vertex of the triangulation: its place in the scaled plane and its index in the mesh.
#[derive(Debug, Clone, Copy)]
pub(super) struct Vertex {
    place: spade::Point2<f64>,
    index: u32,
}

impl HasPosition for Vertex {
    type Scalar = f64;
    fn position(&self) -> spade::Point2<f64> {
        self.place
    }
}

/// Grid points nearer to the boundary than this, in grid steps, are left out: they would make slivers.
const CLEARANCE: f64 = 0.35;
/// The part of the tolerance that boundary edges may use up; the triangles behind them need the rest.
const BOUNDARY_SHARE: f64 = 0.3;
/// Grid cells use this part of the tolerance, since triangles beside the boundary span more than a cell.
const CELL_SHARE: f64 = 0.7;
/// Index of a vertex that the triangulation made itself, until it gets its own.
const NEW: u32 = u32::MAX;
/// Triangles flatter than this are rounding errors of straight lines.
const FLAT: f64 = 1e-11;
/// Rounds of adding points where triangles are still too coarse.
const ROUNDS: usize = 16;
/// Points that these add, at most. Triangles that stay too coarse then know by how much.
const MOST_EXTRA: usize = 1_000_000;
/// Places nearer to a grid line than this share of a step lie on it: the triangulation refuses such small numbers.
const ON_LINE: f64 = 1e-30;

/// What becomes of the boundary.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Border {
    /// Its curves are sampled as finely as the options ask, and creases of the surface cut it.
    Sampled,
    /// It consists of straight edges that stay as they are unless they are too long.
    Kept,
}

/// Triangulates the inside of `rings`.
pub(crate) fn mesh(
    surface: &NurbsSurface,
    rings: &[Ring],
    options: &MeshOptions,
    border: Border,
) -> Result<FaceMesh, NurbsError> {
    let curved = Curvedness::of(surface);
    let Some(window) = window(surface, rings) else {
        let reason = "the trim loops enclose nothing".into();
        return Err(NurbsError::Mesh { reason });
    };
    let cells = MeshOptions {
        deviation_mm: CELL_SHARE * options.deviation_mm,
        longest_edge_mm: CELL_SHARE * options.longest_edge_mm,
    };
    let lines = Lines::new(&curved, window, &cells)?;
    let share = BOUNDARY_SHARE * options.deviation_mm;
    let (creases, curve_mm) = match border {
        Border::Sampled => ([creases(surface.knots_u()), creases(surface.knots_v())], share),
        Border::Kept => ([Vec::new(), Vec::new()], f64::INFINITY),
    };
    let limits = Limits { sagitta_mm: curve_mm, facet_mm: curve_mm, edge_mm: options.longest_edge_mm };
    let scale = |lines: &[f64]| (lines.len() - 1) as f64 / (lines[lines.len() - 1] - lines[0]);
    let mut builder = Builder {
        surface,
        curved: &curved,
        options,
        origin: window.0,
        scale: [scale(&lines.u), scale(&lines.v)],
        mesh: FaceMesh::default(),
        known: HashMap::new(),
        sagitta_mm: HashMap::new(),
        inside: Winding::default(),
    };
    let mut edges = Vec::new();
    for ring in rings {
        builder.add_ring(ring, &creases, &limits, &mut edges);
    }
    builder.prepare_inside();
    builder.add_grid(&lines);
    builder.add_creases(&creases, &mut edges);
    // Spade asserts what rounding may yet find a way around: that costs this face, and no more.
    let triangulated = catch_unwind(AssertUnwindSafe(|| {
        let mut cdt = builder.triangulate(edges)?;
        builder.refine(&mut cdt)?;
        builder.finish(&cdt)
    }));
    triangulated.unwrap_or_else(|_| {
        let reason = "rounding contradicts itself where its trim loops as good as meet".into();
        Err(NurbsError::Mesh { reason })
    })
}

/// The box of the rings inside the domain; `None` when it is empty.
fn window(surface: &NurbsSurface, rings: &[Ring]) -> Option<(Point2, Point2)> {
    let ((u0, u1), (v0, v1)) = surface.domain();
    let inf = f64::INFINITY;
    let hulls = rings.iter().map(Ring::hull);
    let (low, high) =
        hulls.fold((Point2::new(inf, inf), Point2::new(-inf, -inf)), |(a, b), (c, d)| (a.inf(&c), b.sup(&d)));
    let (low, high) = (low.sup(&Point2::new(u0, v0)), high.inf(&Point2::new(u1, v1)));
    (low.x < high.x && low.y < high.y).then_some((low, high))
}

/// The inner knots at which the surface may have a crease: no triangle may cross them.
fn creases(knots: &KnotVector) -> Vec<f64> {
    let breaks = knots.breaks();
    let inner = &breaks[1..breaks.len() - 1];
    inner.iter().copied().filter(|&k| knots.multiplicity(k) >= knots.degree()).collect()
}

struct Builder<'a> {
    surface: &'a NurbsSurface,
    curved: &'a Curvedness,
    options: &'a MeshOptions,
    origin: Point2,
    /// Grid steps per parameter: makes the grid's cells about square for the Delaunay criterion.
    scale: [f64; 2],
    mesh: FaceMesh,
    /// Vertex by scaled place, to the last bit.
    known: HashMap<[u64; 2], u32>,
    /// Bow of the trim curve over a boundary edge.
    sagitta_mm: HashMap<[u32; 2], f64>,
    /// Winding of the boundary polygons.
    inside: Winding,
}

impl Builder<'_> {
    fn place(&self, uv: Point2) -> spade::Point2<f64> {
        let clean = |x: f64| if x.abs() < ON_LINE { 0.0 } else { x };
        let at = |axis: usize| clean((uv[axis] - self.origin[axis]) * self.scale[axis]);
        spade::Point2::new(at(0), at(1))
    }

    fn vertex(&mut self, uv: Point2) -> u32 {
        let (u, v) = self.surface.clamp(uv.x, uv.y);
        let point = self.surface.point(u, v);
        self.add(Sample { uv: Point2::new(u, v), point, sagitta_mm: 0.0 })
    }

    fn add(&mut self, sample: Sample) -> u32 {
        let place = self.place(sample.uv);
        let next = self.mesh.uv.len() as u32;
        let index = *self.known.entry([place.x.to_bits(), place.y.to_bits()]).or_insert(next);
        if index == next {
            self.mesh.uv.push(sample.uv);
            self.mesh.points.push(sample.point);
        }
        index
    }

    fn add_ring(&mut self, ring: &Ring, creases: &[Vec<f64>; 2], limits: &Limits, edges: &mut Vec<[u32; 2]>) {
        let mut samples: Vec<Sample> = Vec::new();
        for arc in ring.arcs.iter().flat_map(|a| cut_at_creases(a, creases)) {
            let room = MOST_SAMPLES.saturating_sub(self.mesh.uv.len() + samples.len());
            samples.extend(sample(self.surface, self.curved, &arc, limits, room));
        }
        let ids: Vec<u32> = samples.iter().map(|s| self.add(*s)).collect();
        for i in 0..ids.len() {
            let (a, b) = (ids[i], ids[(i + 1) % ids.len()]);
            if a != b {
                edges.push([a, b]);
                self.sagitta_mm.insert([a.min(b), a.max(b)], samples[i].sagitta_mm);
            }
        }
        let mut ids = ids;
        ids.dedup();
        if ids.len() > 1 && ids.first() == ids.last() {
            ids.pop();
        }
        self.mesh.rings.push(ids);
    }

    fn prepare_inside(&mut self) {
        let at = |i: u32| self.mesh.uv[i as usize];
        let polygon = |ring: &Vec<u32>| -> Vec<Arc> {
            let next = ring.iter().cycle().skip(1);
            ring.iter().zip(next).map(|(&a, &b)| Arc::line(at(a), at(b))).collect()
        };
        let arcs: Vec<Arc> = self.mesh.rings.iter().flat_map(polygon).collect();
        self.inside = Winding::new(&arcs);
    }

    /// Adds the crossings of the lines that are inside and not too close to the boundary.
    fn add_grid(&mut self, lines: &Lines) {
        let columns = lines.v.len();
        let mut blocked = vec![false; lines.u.len() * columns];
        for ring in &self.mesh.rings {
            for (i, &a) in ring.iter().enumerate() {
                let (a, b) = (self.mesh.uv[a as usize], self.mesh.uv[ring[(i + 1) % ring.len()] as usize]);
                self.block(lines, a, b, &mut blocked);
            }
        }
        for (i, &u) in lines.u.iter().enumerate() {
            for (j, &v) in lines.v.iter().enumerate() {
                let at = Point2::new(u, v);
                if !blocked[i * columns + j] && self.inside.number(at) > 0 {
                    self.vertex(at);
                }
            }
        }
    }

    fn block(&self, lines: &Lines, a: Point2, b: Point2, blocked: &mut [bool]) {
        let near = |lines: &[f64], axis: usize| {
            let reach = CLEARANCE / self.scale[axis];
            let first = lines.partition_point(|&k| k < a[axis].min(b[axis]) - reach);
            first..lines.partition_point(|&k| k <= a[axis].max(b[axis]) + reach)
        };
        let scaled = |p: Point2| {
            let place = self.place(p);
            Point2::new(place.x, place.y)
        };
        let (pa, pb) = (scaled(a), scaled(b));
        let along = pb - pa;
        for i in near(&lines.u, 0) {
            for j in near(&lines.v, 1) {
                let from = scaled(Point2::new(lines.u[i], lines.v[j])) - pa;
                let share = (from.dot(&along) / along.norm_squared()).clamp(0.0, 1.0);
                let share = if share.is_nan() { 0.0 } else { share };
                if (from - along * share).norm() < CLEARANCE {
                    blocked[i * lines.v.len() + j] = true;
                }
            }
        }
    }

    /// Makes the parts of the creases that are inside edges of the triangulation.
    fn add_creases(&self, creases: &[Vec<f64>; 2], edges: &mut Vec<[u32; 2]>) {
        for axis in 0..2 {
            for &knot in &creases[axis] {
                let uv = &self.mesh.uv;
                let mut on: Vec<u32> =
                    (0..uv.len() as u32).filter(|&i| uv[i as usize][axis] == knot).collect();
                let along = |i: u32| uv[i as usize][1 - axis];
                on.sort_by(|&i, &j| along(i).total_cmp(&along(j)));
                edges.extend(on.windows(2).filter_map(|w| {
                    let middle = nalgebra::center(&uv[w[0] as usize], &uv[w[1] as usize]);
                    (self.inside.number(middle) > 0).then_some([w[0], w[1]])
                }));
            }
        }
    }

    fn triangulate(&mut self, edges: Vec<[u32; 2]>) -> Result<Cdt, NurbsError> {
        let vertex = |i: usize| Vertex { place: self.place(self.mesh.uv[i]), index: i as u32 };
        // Vertices and edges in one go would be quicker, but spade then adds what it puts off in the order of a hash set,
        // which is another one in every run.
        let mut cdt = Cdt::bulk_load((0..self.mesh.uv.len()).map(vertex).collect()).map_err(refused)?;
        let mut handles = vec![FixedVertexHandle::from_index(0); self.mesh.uv.len()];
        cdt.vertices().for_each(|v| handles[v.data().index as usize] = v.fix());
        let edges = edges.into_iter().map(|e| e.map(|i| handles[i as usize]));
        keep_edges(&mut cdt, edges, |place| Vertex { place, index: NEW })?;
        for handle in cdt.fixed_vertices() {
            let Vertex { place, index } = *cdt.vertex(handle).data();
            if index == NEW {
                let axis = |x: f64, axis: usize| self.origin[axis] + x / self.scale[axis];
                let index = self.vertex(Point2::new(axis(place.x, 0), axis(place.y, 1)));
                cdt.vertex_data_mut(handle).index = index;
            }
        }
        Ok(cdt)
    }

    /// Splits triangles that are too coarse until none is, or there are too many.
    fn refine(&mut self, cdt: &mut Cdt) -> Result<(), NurbsError> {
        let mut added = 0;
        for _ in 0..ROUNDS {
            let mut extra = Vec::new();
            for face in cdt.inner_faces() {
                let (ids, handles) =
                    (face.vertices().map(|v| v.data().index), face.vertices().map(|v| v.fix()));
                if !self.is_inside(ids) || !self.is_coarse(ids, self.deviation_mm(ids)) {
                    continue;
                }
                // Boundary edges are fine as they are; creases are straight and may be split.
                let edges = [[0, 1], [1, 2], [2, 0]].map(|e| (e.map(|i| ids[i]), e.map(|i| handles[i])));
                let splittable = edges.into_iter().filter(|e| !self.sagitta_mm.contains_key(&sorted(e.0)));
                let worst = splittable.max_by(|a, b| self.coarseness(a.0).total_cmp(&self.coarseness(b.0)));
                let uv = |i: u32| self.mesh.uv[i as usize];
                extra.push(match worst {
                    Some(([a, b], ends)) => (nalgebra::center(&uv(a), &uv(b)), Some(ends)),
                    None => (centroid(ids.map(uv)), None),
                });
            }
            added += extra.len();
            if extra.is_empty() || added > MOST_EXTRA {
                break;
            }
            for (uv, ends) in extra {
                let before = self.mesh.uv.len();
                let index = self.vertex(uv);
                if self.mesh.uv.len() > before {
                    let place = self.place(self.mesh.uv[index as usize]);
                    insert_between(cdt, Vertex { place, index }, ends)?;
                }
            }
        }
        Ok(())
    }

    /// How much an edge exceeds what is allowed: facet error or length, whichever is worse.
    fn coarseness(&self, [a, b]: [u32; 2]) -> f64 {
        let (a, b) = (a as usize, b as usize);
        let (low, high) = (self.mesh.uv[a].inf(&self.mesh.uv[b]), self.mesh.uv[a].sup(&self.mesh.uv[b]));
        let facet = self.curved.over(low, high).deviation_mm(high.x - low.x, high.y - low.y);
        let length = (self.mesh.points[a] - self.mesh.points[b]).norm();
        (facet / self.options.deviation_mm).max((length / self.options.longest_edge_mm).powi(2))
    }

    /// Slivers of no area are outside: samples of a straight edge that rounding has made concave span them.
    /// Inside none can be, as the Delaunay criterion would have flipped them.
    fn is_inside(&self, ids: [u32; 3]) -> bool {
        let uv = ids.map(|i| self.mesh.uv[i as usize]);
        let [a, b, c] = uv.map(|p| {
            let place = self.place(p);
            Point2::new(place.x, place.y)
        });
        let longest = (b - a).norm_squared().max((c - a).norm_squared());
        (b - a).perp(&(c - a)) > FLAT * longest && self.inside.number(centroid(uv)) > 0
    }

    fn is_coarse(&self, ids: [u32; 3], deviation_mm: f64) -> bool {
        let length = |i: usize| {
            let (a, b) = (ids[i] as usize, ids[(i + 1) % 3] as usize);
            (self.mesh.points[a] - self.mesh.points[b]).norm()
        };
        deviation_mm > self.options.deviation_mm
            || (0..3).any(|i| length(i) > self.options.longest_edge_mm * (1.0 + 1e-9))
    }

    /// Facet error, and the bow of the trim curve beyond a boundary edge.
    fn deviation_mm(&self, ids: [u32; 3]) -> f64 {
        let [a, b, c] = ids.map(|i| self.mesh.uv[i as usize]);
        let (low, high) = (a.inf(&b).inf(&c), a.sup(&b).sup(&c));
        let facet = self.curved.over(low, high).deviation_mm(high.x - low.x, high.y - low.y);
        let bow = |i: usize| self.sagitta_mm.get(&sorted([ids[i], ids[(i + 1) % 3]])).copied().unwrap_or(0.0);
        facet + bow(0).max(bow(1)).max(bow(2))
    }

    fn finish(mut self, cdt: &Cdt) -> Result<FaceMesh, NurbsError> {
        for face in cdt.inner_faces() {
            let ids = face.vertices().map(|v| v.data().index);
            if self.is_inside(ids) {
                let deviation = self.deviation_mm(ids);
                self.mesh.add_triangle(ids, deviation);
            }
        }
        if self.mesh.triangles.is_empty() {
            let reason = "the trim loops enclose nothing".into();
            return Err(NurbsError::Mesh { reason });
        }
        Ok(self.mesh)
    }
}

/// Inserts a vertex in the middle of an edge. Rounding may put it beside the edge, which would then stay if it is part of a
/// crease: that goes by way of the vertex from now on.
fn insert_between(
    cdt: &mut Cdt,
    vertex: Vertex,
    ends: Option<[FixedVertexHandle; 2]>,
) -> Result<(), NurbsError> {
    let edge = ends.and_then(|[a, b]| cdt.get_edge_from_neighbors(a, b));
    let crease = edge.filter(|e| e.is_constraint_edge()).map(|e| e.fix().as_undirected());
    if let Some(edge) = crease {
        cdt.remove_constraint_edge(edge);
    }
    let middle = cdt.insert(vertex).map_err(refused)?;
    for end in ends.filter(|_| crease.is_some()).into_iter().flatten() {
        if cdt.can_add_constraint(end, middle) {
            cdt.add_constraint(end, middle);
        }
    }
    Ok(())
}

fn sorted([a, b]: [u32; 2]) -> [u32; 2] {
    [a.min(b), a.max(b)]
}

fn centroid([a, b, c]: [Point2; 3]) -> Point2 {
    Point2::from((a.coords + b.coords + c.coords) / 3.0)
}

/// The parts of an arc between creases, with ends exactly on them.
fn cut_at_creases(arc: &Arc, creases: &[Vec<f64>; 2]) -> Vec<Arc> {
    let mut parts = vec![arc.clone()];
    for axis in 0..2 {
        for &knot in &creases[axis] {
            let cut = |a: Arc| {
                let pieces = a.monotone();
                if pieces.iter().all(|a| a.crossing(axis, knot).is_none()) {
                    return vec![a];
                }
                let halves = |a: Arc| match a.crossing(axis, knot) {
                    Some(t) => {
                        let (mut x, y) = a.split(t);
                        let mut on = y.start();
                        on[axis] = knot;
                        x.set_end(on);
                        let mut y = y.reversed();
                        y.set_end(on);
                        vec![x, y.reversed()]
                    }
                    None => vec![a],
                };
                pieces.into_iter().flat_map(halves).collect()
            };
            parts = parts.into_iter().flat_map(cut).collect();
        }
    }
    parts
}
