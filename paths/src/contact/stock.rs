use std::collections::HashSet;

use claymill_nurbs::{
    Aabb, Curve2, Domain, Face, FaceId, FaceMesh, Leaves, MeshOptions, Model, NurbsError, NurbsSurface,
    Point2, Point3, Vector3, tessellate,
};
use rayon::prelude::*;

use super::edge::highest;
use super::face::{Polished, polish};
use super::flat::{box_height, on_segment, on_triangle, plane_height};
use super::tree::DropTree;
use super::{CONTACT_EPSILON_MM, Location, Support};
use crate::Frame;

/// Coarseness of the covering triangles: coarser means fewer boxes to search but more candidates per
/// location; it does not touch accuracy. The mesh's own bound counts how far parameters slide along the
/// surface as well; what matters here is the distance from the triangle's plane (see [`deviations`]), which is
/// about ten times smaller.
const DEVIATION_MM: f64 = 0.25;
const LONGEST_EDGE_MM: f64 = 12.0;
/// Edges in ball radii, at most: what a setup reaches is probed on every triangle, and a small ball gets into
/// places that a large triangle would hide.
const LONGEST_EDGE_RADII: f64 = 2.0;
/// On faces that are not to be cut nothing is probed, mm.
const EXCLUDED_EDGE_MM: f64 = 200.0;
/// Of a huge model edges may be longer, so that there are no more than about so many triangles in all.
const TRIANGLES: f64 = 4e6;
/// Edges are cut into pieces that leave their chord by no more than this, mm.
const EDGE_DEVIATION_MM: f64 = 0.02;
const EDGE_PIECE_MM: f64 = 15.0;
/// A triangle where `κ⁺·R` exceeds this may hold more than one contact.
const TIGHT: f64 = 0.8;
/// Sampled curvatures and deviations are multiplied by this before they count as bounds.
const SAMPLING_MARGIN: f64 = 1.25;
/// Sampled distances from a triangle's plane are multiplied by this and raised by the floor.
const DEVIATION_MARGIN: f64 = 1.5;
const DEVIATION_FLOOR_MM: f64 = 1e-4;
/// Normals on both sides of a knot that differ by more than this (0.1°) make a crease.
const CREASE_SINE: f64 = 1.7e-3;
/// A ball that touches the inside of a face this near to the rim rests on the rim as well, but for `d² / 2R`:
/// a tenth of a micrometre for a ball of 2 mm, mm.
const AT_RIM_MM: f64 = 0.02;
/// So far inside, as a share of the way to the middle, a triangle's corners are judged.
const CORNER_INSET: f64 = 0.02;
/// Triangles cut this often that are outside the trims in all places looked at are outside.
const SLIVER_LEVEL: u32 = 3;
/// A triangle whose normal leans further from its surface's (60°) stands across it.
const ALONG_COSINE: f64 = 0.5;
/// Deepest subdivision of a triangle; its deviation shrinks by 4 at each level.
const DEEPEST: u32 = 12;

/// The model's faces as triangles that know their surface, in model coordinates: made once, used by every
/// setup.
#[derive(Debug)]
pub(crate) struct FlatPart {
    pub(crate) meshes: Vec<FaceMesh>,
    /// Per face and triangle: how far the surface may be from the triangle's plane, mm.
    deviation_mm: Vec<Vec<f32>>,
    /// Per face and triangle: smallest and largest normal curvature there and on the triangles around it, for
    /// the normal `Su × Sv`, 1/mm.
    curvature: Vec<Vec<[f32; 2]>>,
    /// Per face and triangle: whether a side is a chord of a trim curve, so that part of the triangle may lie
    /// outside the trims.
    rimmed: Vec<Vec<bool>>,
    edges: Vec<EdgePiece>,
}

#[derive(Debug, Clone)]
struct EdgePiece {
    face: u32,
    pcurve: u32,
    t: (f64, f64),
    a: Point3,
    b: Point3,
    deviation_mm: f64,
}

impl FlatPart {
    /// Covers a model of `area_mm2` for a ball; what is `excluded` only stands in the way.
    pub(crate) fn new(
        model: &Model,
        excluded: &[bool],
        area_mm2: f64,
        radius_mm: f64,
    ) -> Result<Self, (FaceId, NurbsError)> {
        let edge_mm = LONGEST_EDGE_MM.min(LONGEST_EDGE_RADII * radius_mm);
        // Two triangles to a square of edges.
        let longest_edge_mm = edge_mm.max((2.0 * area_mm2 / TRIANGLES).sqrt());
        let options = |id: FaceId| MeshOptions {
            deviation_mm: DEVIATION_MM,
            longest_edge_mm: if excluded[id] {
                longest_edge_mm.max(EXCLUDED_EDGE_MM)
            } else {
                longest_edge_mm
            },
        };
        let meshes: Vec<FaceMesh> = model
            .faces
            .par_iter()
            .enumerate()
            .map(|(id, f)| tessellate(f, &options(id)).map_err(|e| (id, e)))
            .collect::<Result<_, _>>()?;
        let curvature = model.faces.par_iter().zip(&meshes).map(|(f, m)| curvature_ranges(f, m)).collect();
        let deviation_mm = model.faces.par_iter().zip(&meshes).map(|(f, m)| deviations(f, m)).collect();
        let rimmed = model.faces.par_iter().zip(&meshes).map(|(f, m)| rimmed(f, m)).collect();
        let edges = model.faces.par_iter().enumerate().flat_map_iter(|(id, f)| edge_pieces(id, f)).collect();
        Ok(FlatPart { meshes, deviation_mm, curvature, rimmed, edges })
    }
}

/// Distance of the surface from the plane of each triangle, sampled in the middle and on the sides, where a
/// quadratic has its extremes.
fn deviations(face: &Face, mesh: &FaceMesh) -> Vec<f32> {
    const PLACES: [[f64; 3]; 4] = [[1.0 / 3.0; 3], [0.5, 0.5, 0.0], [0.0, 0.5, 0.5], [0.5, 0.0, 0.5]];
    let of = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|i| mesh.points[i as usize]);
        let uv = t.map(|i| mesh.uv[i as usize].coords);
        let n = (b - a).cross(&(c - a)).try_normalize(0.0);
        let off = |w: &[f64; 3]| {
            let at = uv[0] * w[0] + uv[1] * w[1] + uv[2] * w[2];
            let d = face.surface.point(at.x, at.y) - a;
            n.map_or(d.norm(), |n| d.dot(&n).abs())
        };
        let most = PLACES.iter().map(off).fold(0.0, f64::max);
        (most * DEVIATION_MARGIN + DEVIATION_FLOOR_MM) as f32
    };
    mesh.triangles.iter().map(of).collect()
}

/// Marks the triangles with a side on the boundary of a trimmed face.
fn rimmed(face: &Face, mesh: &FaceMesh) -> Vec<bool> {
    if face.loops.is_empty() {
        return vec![false; mesh.triangles.len()];
    }
    let closed = |ring: &Vec<u32>| ring.iter().copied().zip(ring.iter().copied().cycle().skip(1)).collect();
    let pairs: Vec<Vec<(u32, u32)>> = mesh.rings.iter().map(closed).collect();
    let rim: HashSet<(u32, u32)> = pairs.into_iter().flatten().map(|(a, b)| (a.min(b), a.max(b))).collect();
    let on_rim = |a: u32, b: u32| rim.contains(&(a.min(b), a.max(b)));
    mesh.triangles.iter().map(|&[a, b, c]| on_rim(a, b) || on_rim(b, c) || on_rim(c, a)).collect()
}

/// Range of normal curvature over each triangle and those around it, from their corners and middles.
fn curvature_ranges(face: &Face, mesh: &FaceMesh) -> Vec<[f32; 2]> {
    let unknown = [f32::NEG_INFINITY, f32::INFINITY];
    let at = |uv: Point2| {
        let jet = face.surface.jet(uv.x, uv.y);
        let range = jet.normal().and_then(|n| jet.curvature(&n).principal());
        range.map_or(unknown, |(a, b)| [a as f32, b as f32])
    };
    let join = |a: [f32; 2], b: [f32; 2]| [a[0].min(b[0]), a[1].max(b[1])];
    if is_creased(&face.surface) {
        return vec![unknown; mesh.triangles.len()];
    }
    let corners: Vec<_> = mesh.uv.iter().map(|&uv| at(uv)).collect();
    let widen = |k: f32, sign: f32| {
        if k * sign > 0.0 { k * SAMPLING_MARGIN as f32 } else { k }
    };
    let own: Vec<[f32; 2]> = mesh
        .triangles
        .iter()
        .map(|t| {
            let [a, b, c] = t.map(|i| mesh.uv[i as usize]);
            let middle = at(Point2::from((a.coords + b.coords + c.coords) / 3.0));
            t.iter().map(|&i| corners[i as usize]).fold(middle, join)
        })
        .collect();
    let mut around = corners;
    for (t, &range) in mesh.triangles.iter().zip(&own) {
        for &i in t {
            around[i as usize] = join(around[i as usize], range);
        }
    }
    mesh.triangles
        .iter()
        .zip(own)
        .map(|(t, own)| {
            let r = t.iter().map(|&i| around[i as usize]).fold(own, join);
            [widen(r[0], -1.0), widen(r[1], 1.0)]
        })
        .collect()
}

/// Whether the normal jumps at a knot inside the surface (knots of full multiplicity may hide a crease; those
/// of exact arcs do not).
fn is_creased(s: &NurbsSurface) -> bool {
    let jumps = |before: (f64, f64), after: (f64, f64)| {
        let normal = |(u, v): (f64, f64)| s.jet(u, v).normal();
        matches!((normal(before), normal(after)), (Some(a), Some(b)) if a.cross(&b).norm() > CREASE_SINE)
    };
    let inner = |k: &claymill_nurbs::KnotVector| -> Vec<(f64, f64)> {
        let breaks = k.breaks();
        let beside = 1e-9 * (breaks[breaks.len() - 1] - breaks[0]);
        let full = |b: &&f64| k.multiplicity(**b) >= k.degree();
        breaks[1..breaks.len() - 1].iter().filter(full).map(|b| (b - beside, b + beside)).collect()
    };
    let ((u0, u1), (v0, v1)) = s.domain();
    let places = |a: f64, b: f64| (0..=8).map(move |i| a + (b - a) * f64::from(i) / 8.0);
    inner(s.knots_u()).iter().any(|&(a, b)| places(v0, v1).any(|v| jumps((a, v), (b, v))))
        || inner(s.knots_v()).iter().any(|&(a, b)| places(u0, u1).any(|u| jumps((u, a), (u, b))))
}

fn edge_pieces(id: FaceId, face: &Face) -> Vec<EdgePiece> {
    let mut pieces = Vec::new();
    let boundary = face.boundary();
    for (k, edge) in boundary.iter().flat_map(|l| &l.edges).enumerate() {
        for span in edge.pcurve.knots().breaks().windows(2) {
            cut_edge(&face.surface, &edge.pcurve, (span[0], span[1]), 0, &mut |t, a, b, deviation_mm| {
                pieces.push(EdgePiece { face: id as u32, pcurve: k as u32, t, a, b, deviation_mm });
            });
        }
    }
    pieces
}

/// Halves `[t0, t1]` until it is short and flat; deviation is sampled at quarter points.
fn cut_edge(
    s: &NurbsSurface,
    c: &Curve2,
    (t0, t1): (f64, f64),
    depth: u32,
    emit: &mut impl FnMut((f64, f64), Point3, Point3, f64),
) {
    let at = |f: f64| s.point_on(c, t0 + (t1 - t0) * f);
    let (a, b) = (at(0.0), at(1.0));
    let chord = b - a;
    let off = |p: Point3| {
        let along = if chord.norm_squared() > 0.0 { (p - a).dot(&chord) / chord.norm_squared() } else { 0.0 };
        (p - (a + chord * along.clamp(0.0, 1.0))).norm()
    };
    let deviation = [0.25, 0.5, 0.75].map(|f| off(at(f))).into_iter().fold(0.0, f64::max) * SAMPLING_MARGIN;
    if depth < 20 && (deviation > EDGE_DEVIATION_MM || chord.norm() > EDGE_PIECE_MM || depth < 1) {
        let middle = 0.5 * (t0 + t1);
        cut_edge(s, c, (t0, middle), depth + 1, emit);
        cut_edge(s, c, (middle, t1), depth + 1, emit);
    } else if chord.norm() + deviation > 0.0 {
        emit((t0, t1), a, b, deviation);
    }
}

/// The whole model as seen from one setup, ready for dropping a ball of one radius on it.
#[derive(Debug)]
pub(crate) struct Stock<'a> {
    radius_mm: f64,
    flat: &'a FlatPart,
    faces: Vec<SetupFace>,
    triangles: Vec<Triangle>,
    edges: Vec<EdgePiece>,
    tree: DropTree,
}

#[derive(Debug)]
struct SetupFace {
    surface: NurbsSurface,
    /// The same for evaluation.
    leaves: Leaves,
    /// The trims; `None` where the whole domain belongs to the face.
    domain: Option<Domain>,
    boundary: Vec<Curve2>,
}

#[derive(Debug, Clone, Copy)]
struct Triangle {
    p: [Point3; 3],
    face: u32,
    index: u32,
    deviation_mm: f32,
    tight: bool,
    rimmed: bool,
}

impl<'a> Stock<'a> {
    pub(crate) fn new(model: &Model, flat: &'a FlatPart, frame: &Frame, radius_mm: f64) -> Self {
        let faces: Vec<SetupFace> = model
            .faces
            .par_iter()
            .map(|f| {
                let surface = f.surface.mapped(|p| frame.to_setup(&p));
                SetupFace {
                    leaves: Leaves::new(&surface),
                    surface,
                    domain: (!f.loops.is_empty()).then(|| Domain::new(f)),
                    boundary: f.boundary().into_iter().flat_map(|l| l.edges).map(|e| e.pcurve).collect(),
                }
            })
            .collect();
        let triangles: Vec<Triangle> = flat
            .meshes
            .par_iter()
            .zip(&flat.curvature)
            .zip(&flat.deviation_mm)
            .enumerate()
            .flat_map_iter(|(face, ((mesh, curvature), deviation))| {
                mesh.triangles.iter().enumerate().map(move |(index, t)| {
                    let p = t.map(|i| frame.to_setup(&mesh.points[i as usize]));
                    // The mesh's triangles agree with Su × Sv; the upper side decides which curvature is κ⁺.
                    let up = (p[1] - p[0]).cross(&(p[2] - p[0])).z >= 0.0;
                    let kappa = if up { curvature[index][1] } else { -curvature[index][0] };
                    Triangle {
                        p,
                        face: face as u32,
                        index: index as u32,
                        deviation_mm: deviation[index],
                        tight: f64::from(kappa) * radius_mm > TIGHT,
                        rimmed: flat.rimmed[face][index],
                    }
                })
            })
            .collect();
        let edges: Vec<EdgePiece> = flat
            .edges
            .iter()
            .map(|e| EdgePiece { a: frame.to_setup(&e.a), b: frame.to_setup(&e.b), ..e.clone() })
            .collect();
        let boxes: Vec<Aabb> = triangles
            .iter()
            .map(|t| Aabb::of(&t.p).inflated(f64::from(t.deviation_mm)))
            .chain(edges.iter().map(|e| Aabb::of([&e.a, &e.b]).inflated(e.deviation_mm)))
            .collect();
        Stock { radius_mm, flat, faces, triangles, edges, tree: DropTree::new(&boxes) }
    }

    pub(crate) fn radius_mm(&self) -> f64 {
        self.radius_mm
    }

    /// The surface of a face in the setup's coordinates.
    pub(crate) fn surface(&self, face: FaceId) -> &NurbsSurface {
        &self.faces[face].surface
    }

    /// Calls `visit` with a box around every covered piece, in the setup's coordinates.
    pub(crate) fn for_each_box(&self, mut visit: impl FnMut(&Aabb)) {
        for t in &self.triangles {
            visit(&Aabb::of(&t.p).inflated(f64::from(t.deviation_mm)));
        }
        for e in &self.edges {
            visit(&Aabb::of([&e.a, &e.b]).inflated(e.deviation_mm));
        }
    }

    /// Drops the ball at `(x, y)` on everything; `near` is a location close by, which makes it faster.
    /// `None` where nothing is below.
    pub(crate) fn drop(&self, x: f64, y: f64, near: Option<&Location>) -> Option<Location> {
        let mut search = Search { stock: self, x, y, best: None, rims: Vec::new() };
        if let Some(&Location { face, support: Support::Face { u, v }, .. }) = near {
            search.try_face(face, (u, v));
        }
        let floor = search.floor();
        self.tree.descend(x, y, self.radius_mm, floor, |item| {
            match self.triangles.get(item as usize) {
                Some(t) => search.triangle(t),
                None => search.edge(&self.edges[item as usize - self.triangles.len()]),
            }
            search.floor()
        });
        for (t, uv) in std::mem::take(&mut search.rims) {
            search.subdivide(t, uv, t.p, f64::from(t.deviation_mm), 0);
        }
        search.best
    }
}

/// Whether the parameters lie in the triangle or no further from it than its own size.
fn is_beside(uv: &[Point2; 3], u: f64, v: f64) -> bool {
    let (a, b) = (uv[1] - uv[0], uv[2] - uv[0]);
    let p = Point2::new(u, v) - uv[0];
    let area = a.perp(&b);
    let (wb, wc) = (p.perp(&b) / area, a.perp(&p) / area);
    [wb, wc, 1.0 - wb - wc].iter().all(|w| (-1.0..=2.0).contains(w))
}

/// The place with these barycentric coordinates.
fn weighted<const D: usize>(corners: &[nalgebra::Point<f64, D>; 3], at: [f64; 3]) -> nalgebra::Point<f64, D> {
    (0..3).map(|i| corners[i].coords * at[i]).sum::<nalgebra::SVector<f64, D>>().into()
}

struct Search<'a> {
    stock: &'a Stock<'a>,
    x: f64,
    y: f64,
    best: Option<Location>,
    /// Triangles on rims that wait to be subdivided until the rims themselves are met: most fall below these.
    rims: Vec<(&'a Triangle, [Point2; 3])>,
}

impl<'a> Search<'a> {
    fn floor(&self) -> f64 {
        self.best.map_or(f64::NEG_INFINITY, |b| b.centre.z + CONTACT_EPSILON_MM)
    }

    fn offer(&mut self, location: Location) {
        if self.best.is_none_or(|b| location.centre.z > b.centre.z) {
            self.best = Some(location);
        }
    }

    fn try_face(&mut self, face: FaceId, start: (f64, f64)) -> Polished {
        let f = &self.stock.faces[face];
        let polished = polish(&f.leaves, start, self.x, self.y, self.stock.radius_mm);
        if let Polished::Contact { centre, normal, u, v } = polished {
            if f.domain.as_ref().is_some_and(|d| !d.contains(u, v)) {
                return Polished::Outside { u, v };
            }
            self.offer(Location { centre, normal, face, support: Support::Face { u, v } });
        }
        polished
    }

    fn triangle(&mut self, t: &'a Triangle) {
        let delta = f64::from(t.deviation_mm);
        let (r, floor) = (self.stock.radius_mm, self.floor());
        if box_height(&t.p, self.x, self.y, r + delta) <= floor {
            return;
        }
        let n = (t.p[1] - t.p[0]).cross(&(t.p[2] - t.p[0]));
        if let Some((z, _)) = plane_height(&t.p[0], &n, self.x, self.y, r + delta)
            && z <= floor
        {
            return;
        }
        let Some(rest) = on_triangle(&t.p, &n, self.x, self.y, r + delta) else {
            return;
        };
        if rest.z <= floor {
            return;
        }
        let mesh = &self.stock.flat.meshes[t.face as usize];
        let uv = mesh.triangles[t.index as usize].map(|i| mesh.uv[i as usize]);
        // A sheet that curves less tightly than the ball leaves it on all sides of a contact (geometry.md
        // §6.3), so a contact speaks for its own triangle and for those around it, as long as none of them
        // is tight. Further away on the same face a second contact is possible, across a groove.
        let here = |u: f64, v: f64| !t.tight && is_beside(&uv, u, v);
        if let Some(Location { face, support: Support::Face { u, v }, .. }) = self.best
            && face == t.face as usize
            && here(u, v)
        {
            return;
        }
        let start = weighted(&uv, rest.at);
        let proven = match self.try_face(t.face as usize, (start.x, start.y)) {
            Polished::Contact { u, v, .. } | Polished::Outside { u, v } => here(u, v),
            Polished::Failed => false,
        };
        match (proven, t.rimmed) {
            (true, _) => {}
            (false, true) => self.rims.push((t, uv)),
            (false, false) => self.subdivide(t, uv, t.p, delta, 0),
        }
    }

    /// Cuts a triangle in four in the parameter plane until its bound falls below the best contact, or is so
    /// close to the surface that the bound itself can serve as the height.
    fn subdivide(&mut self, t: &Triangle, uv: [Point2; 3], p: [Point3; 3], delta: f64, level: u32) {
        let (r, floor) = (self.stock.radius_mm, self.floor());
        let n = (p[1] - p[0]).cross(&(p[2] - p[0]));
        let Some(high) = on_triangle(&p, &n, self.x, self.y, r + delta) else {
            return;
        };
        if high.z <= floor {
            return;
        }
        let low = on_triangle(&p, &n, self.x, self.y, r);
        let mut fine = low.is_some_and(|low| high.z - low.z < CONTACT_EPSILON_MM);
        // Where a trim curve bends inwards its chord takes in a sliver that is not the face's. Edges are met
        // on their own.
        if t.rimmed && (fine || level >= SLIVER_LEVEL) {
            let inside = self.share_inside(t, &uv, high.at);
            let size = (0..3).map(|i| (p[(i + 1) % 3] - p[i]).norm()).fold(0.0, f64::max);
            if inside == 0.0 && level >= SLIVER_LEVEL || inside < 1.0 && size < AT_RIM_MM {
                return;
            }
            fine &= inside == 1.0;
        }
        fine = fine && self.lies_flat(t, &uv, &n);
        if level >= DEEPEST || fine {
            let at = weighted(&p, high.at);
            let centre = Point3::new(self.x, self.y, high.z);
            let normal = (centre - at).normalize();
            let location = Location { centre, normal, face: t.face as usize, support: Support::Bound };
            self.offer(location);
            return;
        }
        let surface = &self.stock.faces[t.face as usize].leaves;
        let middle = |i: usize, j: usize| Point2::from((uv[i].coords + uv[j].coords) * 0.5);
        let m = [middle(0, 1), middle(1, 2), middle(2, 0)];
        let q = m.map(|c| surface.point(c.x, c.y));
        let quarters = [
            ([uv[0], m[0], m[2]], [p[0], q[0], q[2]]),
            ([m[0], uv[1], m[1]], [q[0], p[1], q[1]]),
            ([m[2], m[1], uv[2]], [q[2], q[1], p[2]]),
            ([m[0], m[1], m[2]], [q[0], q[1], q[2]]),
        ];
        for (uv, p) in quarters {
            self.subdivide(t, uv, p, 0.25 * delta, level + 1);
        }
    }

    /// Whether a triangle lies along its surface. One whose corners are all on a bent side of the face stands
    /// across it, however small its distance: its surface is the side and not what its chords enclose.
    fn lies_flat(&self, t: &Triangle, uv: &[Point2; 3], n: &Vector3) -> bool {
        let middle = (uv[0].coords + uv[1].coords + uv[2].coords) / 3.0;
        let surface = &self.stock.faces[t.face as usize].surface;
        match (surface.normal(middle.x, middle.y), n.try_normalize(0.0)) {
            (Some((normal, _)), Some(n)) => normal.dot(&n).abs() >= ALONG_COSINE,
            _ => true,
        }
    }

    /// How many places in a triangle, its middle, close to its corners and where the ball would touch, belong
    /// to the face, as a share. The corners themselves may be on a trim curve.
    fn share_inside(&self, t: &Triangle, uv: &[Point2; 3], touch: [f64; 3]) -> f64 {
        let Some(domain) = &self.stock.faces[t.face as usize].domain else {
            return 1.0;
        };
        let middle = Point2::from((uv[0].coords + uv[1].coords + uv[2].coords) / 3.0);
        let corners = [0, 1, 2].map(|i| uv[i] + (middle - uv[i]) * CORNER_INSET);
        let places = corners.into_iter().chain([middle, weighted(uv, touch)]);
        places.filter(|p| domain.contains(p.x, p.y)).count() as f64 / 5.0
    }

    fn edge(&mut self, e: &EdgePiece) {
        let r = self.stock.radius_mm;
        if box_height(&[e.a, e.b], self.x, self.y, r + e.deviation_mm) <= self.floor() {
            return;
        }
        let bound = on_segment(&e.a, &e.b, self.x, self.y, r + e.deviation_mm);
        if bound.is_none_or(|(z, _)| z <= self.floor()) {
            return;
        }
        let face = &self.stock.faces[e.face as usize];
        let pcurve = &face.boundary[e.pcurve as usize];
        if let Some((z, point)) = highest(&face.leaves, pcurve, e.t, self.x, self.y, r) {
            let centre = Point3::new(self.x, self.y, z);
            let normal = (centre - point) / r;
            let location = Location { centre, normal, face: e.face as usize, support: Support::Edge };
            self.offer(location);
        }
    }
}
