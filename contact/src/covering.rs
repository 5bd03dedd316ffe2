//! The covering: triangles over all faces, each with a bound of how far the surface is from it.

use std::collections::HashSet;

use claymill_nurbs::{
    Curve2, Face, FaceId, FaceMesh, Flatness, MeshOptions, Model, NurbsError, NurbsSurface, Point2, Point3,
    Vector3, tessellate,
};
use rayon::prelude::*;

use crate::certificate::adjacency::Adjacency;
use crate::larger_than_usual;

/// Coarseness of the covering triangles: coarser means fewer boxes to search but more candidates per
/// location; it does not touch accuracy. A large ball is served as well by triangles that are larger like it.
/// The mesh's own bound counts how far parameters slide along the surface as well; what matters here is the
/// distance from the triangle's plane (see [`deviations`]), which is about ten times smaller.
const DEVIATION_MM: f64 = 0.25;
const LONGEST_EDGE_MM: f64 = 12.0;
/// Edges in ball radii, at most: what a setup reaches is probed on every triangle, and a small ball gets into
/// places that a large triangle would hide.
const LONGEST_EDGE_RADII: f64 = 2.0;
/// On faces that are not to be cut nothing is probed, mm.
const EXCLUDED_EDGE_MM: f64 = 200.0;
/// Of a huge model edges may be longer, so that there are no more than about so many triangles in all.
const TRIANGLES: f64 = 4e6;
/// Triangles are counted on a mesh of sides that are so many times as long.
const COARSER: f64 = 4.0;
/// Edges are cut into pieces that leave their chord by no more than this, mm.
const EDGE_DEVIATION_MM: f64 = 0.02;
const EDGE_PIECE_MM: f64 = 15.0;
/// Halvings of a span at most: four kilometres of pieces.
const MOST_HALVINGS: u32 = 18;
/// Of a face that has so many pieces, later spans are halved three times at most.
const MANY_PIECES: usize = 500_000;
const FEW_HALVINGS: u32 = MOST_HALVINGS - 3;
/// Sampled curvatures, and deviations of edges, are multiplied by this before they count as bounds.
const SAMPLING_MARGIN: f64 = 1.25;
/// More than rounding takes from a bound, mm.
const ROUNDING_MM: f64 = 1e-6;
/// Normals on both sides of a knot that differ by more than this (0.1°) make a crease.
const CREASE_SINE: f64 = 1.7e-3;
/// What leaves a straight line by less than this share of its length is straight.
const STRAIGHT: f64 = 1e-9;

/// The model's faces as triangles that know their surface, in model coordinates: made once, used by every
/// setup.
#[derive(Debug)]
pub struct Covering {
    pub(crate) meshes: Vec<FaceMesh>,
    /// Per face and triangle: how far the surface may be from the triangle, mm.
    pub(crate) deviation_mm: Vec<Vec<f32>>,
    /// Per face and triangle: smallest and largest normal curvature there and on the triangles around it, for
    /// the normal `Su × Sv`, 1/mm.
    pub(crate) curvature: Vec<Vec<[f32; 2]>>,
    /// Per face and triangle: whether a side is a chord of a trim curve, so that part of the triangle may lie
    /// outside the trims.
    pub(crate) rimmed: Vec<Vec<bool>>,
    pub(crate) adjacency: Adjacency,
    pub(crate) edges: Vec<EdgePiece>,
}

#[derive(Debug, Clone)]
pub(crate) struct EdgePiece {
    pub(crate) face: u32,
    pub(crate) pcurve: u32,
    pub(crate) t: (f64, f64),
    pub(crate) a: Point3,
    pub(crate) b: Point3,
    pub(crate) deviation_mm: f64,
}

impl Covering {
    /// Covers a model of `area_mm2` for a ball; what is `excluded` only stands in the way.
    ///
    /// # Errors
    /// A face that cannot be covered with triangles, with the reason. `claymill-paths` goes on without it.
    pub fn new(
        model: &Model,
        excluded: &[bool],
        area_mm2: f64,
        radius_mm: f64,
    ) -> Result<Self, (FaceId, NurbsError)> {
        Self::of_all(model, excluded, area_mm2, radius_mm).map_err(|mut uncovered| uncovered.swap_remove(0))
    }

    /// The same, with all faces that cannot be covered.
    pub fn of_all(
        model: &Model,
        excluded: &[bool],
        area_mm2: f64,
        radius_mm: f64,
    ) -> Result<Self, Vec<(FaceId, NurbsError)>> {
        Self::without(model, &[], excluded, area_mm2, radius_mm)
    }

    /// The same without any triangles of `bare` faces, in whose place something else has to stand. Their edges are there.
    pub fn without(
        model: &Model,
        bare: &[FaceId],
        excluded: &[bool],
        area_mm2: f64,
        radius_mm: f64,
    ) -> Result<Self, Vec<(FaceId, NurbsError)>> {
        let longest_edge_mm = Self::longest_edge_mm(area_mm2, radius_mm);
        let options = |id: FaceId| MeshOptions {
            deviation_mm: DEVIATION_MM * larger_than_usual(radius_mm),
            longest_edge_mm: if excluded[id] {
                longest_edge_mm.max(EXCLUDED_EDGE_MM)
            } else {
                longest_edge_mm
            },
        };
        let mesh = |(id, f): (FaceId, &Face)| {
            if bare.contains(&id) { Ok(FaceMesh::default()) } else { tessellate(f, &options(id)) }
        };
        let made: Vec<Result<FaceMesh, NurbsError>> = model.faces.par_iter().enumerate().map(mesh).collect();
        let (mut meshes, mut uncovered) = (Vec::with_capacity(made.len()), Vec::new());
        for (id, mesh) in made.into_iter().enumerate() {
            match mesh {
                Ok(mesh) => meshes.push(mesh),
                Err(reason) => uncovered.push((id, reason)),
            }
        }
        if !uncovered.is_empty() {
            return Err(uncovered);
        }
        let curvature = model.faces.par_iter().zip(&meshes).map(|(f, m)| curvature_ranges(f, m)).collect();
        let deviation_mm = model.faces.par_iter().zip(&meshes).map(|(f, m)| deviations(f, m)).collect();
        let rimmed = model.faces.par_iter().zip(&meshes).map(|(f, m)| rimmed(f, m)).collect();
        let adjacency = Adjacency::new(&meshes);
        let edges = model.faces.par_iter().enumerate().flat_map_iter(|(id, f)| edge_pieces(id, f)).collect();
        Ok(Covering { meshes, deviation_mm, curvature, rimmed, adjacency, edges })
    }

    /// About how many triangles a covering for a ball has: a coarse one, and from its triangles those of the sides that are asked for.
    /// Where parameters of a surface are uneven, they are many times as many as its area asks for.
    #[must_use]
    pub fn expected_triangles(model: &Model, excluded: &[bool], area_mm2: f64, radius_mm: f64) -> f64 {
        let longest_edge_mm = Self::longest_edge_mm(area_mm2, radius_mm);
        // What a triangle deviates goes with the square of its sides.
        let deviation_mm = COARSER * COARSER * DEVIATION_MM * larger_than_usual(radius_mm);
        let options = MeshOptions { deviation_mm, longest_edge_mm: COARSER * longest_edge_mm };
        let counted = model.faces.par_iter().zip(excluded).filter(|(_, is_excluded)| !**is_excluded);
        let count =
            |(face, _): (&Face, &bool)| tessellate(face, &options).map_or(0, |mesh| mesh.triangles.len());
        let counts: Vec<usize> = counted.map(count).collect();
        COARSER * COARSER * counts.into_iter().sum::<usize>() as f64
    }

    /// How long sides of triangles may be over a model of `area_mm2` for a ball, mm.
    #[must_use]
    pub fn longest_edge_mm(area_mm2: f64, radius_mm: f64) -> f64 {
        let edge_mm = (LONGEST_EDGE_MM * larger_than_usual(radius_mm)).min(LONGEST_EDGE_RADII * radius_mm);
        // Two triangles to a square of edges.
        edge_mm.max((2.0 * area_mm2 / TRIANGLES).sqrt())
    }

    /// The triangles of each face, in model coordinates.
    #[must_use]
    pub fn meshes(&self) -> &[FaceMesh] {
        &self.meshes
    }

    /// Pieces of the trim curves of some faces, as chords.
    pub fn edges_of(&self, is_wanted: impl Fn(FaceId) -> bool) -> impl Iterator<Item = [Point3; 2]> {
        self.edges.iter().filter(move |e| is_wanted(e.face as usize)).map(|e| [e.a, e.b])
    }

    /// Areas of a face's triangles, mm².
    pub fn areas_mm2(&self, face: FaceId) -> impl Iterator<Item = f64> {
        let mesh = &self.meshes[face];
        mesh.triangles.iter().map(|t| {
            let [a, b, c] = t.map(|i| mesh.points[i as usize]);
            0.5 * (b - a).cross(&(c - a)).norm()
        })
    }
}

/// How far the surface may be from each triangle, proven.
///
/// Over a triangle of the parameter plane it keeps near to the triangle's plane ([`Flatness`]). It may slide along that as
/// well, by no more than the mesh's own bound, and so come to lie over a triangle around it, whose plane is inclined.
fn deviations(face: &Face, mesh: &FaceMesh) -> Vec<f32> {
    let flatness = Flatness::of(&face.surface);
    let corners = |t: &[u32; 3]| t.map(|i| mesh.points[i as usize]);
    let own = |t: &[u32; 3]| flatness.off_plane_mm(&t.map(|i| mesh.uv[i as usize]));
    let own: Vec<f64> = mesh.triangles.iter().map(own).collect();
    let normal = |t: &[u32; 3]| {
        let [a, b, c] = corners(t);
        (b - a).cross(&(c - a)).try_normalize(0.0)
    };
    let normals: Vec<Option<Vector3>> = mesh.triangles.iter().map(normal).collect();
    let mut around: Vec<Vec<u32>> = vec![Vec::new(); mesh.points.len()];
    for (k, t) in mesh.triangles.iter().enumerate() {
        t.iter().for_each(|&i| around[i as usize].push(k as u32));
    }
    let slid_over = |k: usize, other: usize| {
        let slide = f64::from(mesh.deviation_mm[other]);
        let inclined = match (normals[k], normals[other]) {
            (Some(a), Some(b)) if a.dot(&b) > 0.0 => a.cross(&b).norm(),
            _ => 1.0,
        };
        own[other] + slide * inclined
    };
    let of = |(k, t): (usize, &[u32; 3])| {
        let others = t.iter().flat_map(|&i| &around[i as usize]).map(|&other| other as usize);
        let most = others.filter(|&other| other != k).map(|other| slid_over(k, other)).fold(own[k], f64::max);
        (most + ROUNDING_MM) as f32
    };
    mesh.triangles.iter().enumerate().map(of).collect()
}

/// Marks the triangles with a side on the boundary of a trimmed face, where that is not straight.
fn rimmed(face: &Face, mesh: &FaceMesh) -> Vec<bool> {
    if face.loops.is_empty() {
        return vec![false; mesh.triangles.len()];
    }
    let straight: Vec<[Point2; 2]> =
        face.loops.iter().flat_map(|l| &l.edges).filter_map(|e| straight(&e.pcurve)).collect();
    let ((u0, u1), (v0, v1)) = face.surface.domain();
    let known = STRAIGHT * (u1 - u0).max(v1 - v0);
    let runs_straight = |ends: [u32; 2]| {
        let ends = ends.map(|i| mesh.uv[i as usize]);
        straight.iter().any(|side| ends.iter().all(|p| distance_from(side, p) <= known))
    };
    let sides = |ring: &Vec<u32>| -> Vec<(u32, u32)> {
        let next = ring.iter().cycle().skip(1);
        ring.iter().zip(next).map(|(&a, &b)| (a.min(b), a.max(b))).collect()
    };
    let rim: HashSet<(u32, u32)> =
        mesh.rings.iter().flat_map(sides).filter(|&(a, b)| !runs_straight([a, b])).collect();
    let on_rim = |a: u32, b: u32| rim.contains(&(a.min(b), a.max(b)));
    mesh.triangles.iter().map(|&[a, b, c]| on_rim(a, b) || on_rim(b, c) || on_rim(c, a)).collect()
}

/// The ends of a curve that is a straight line.
fn straight(curve: &Curve2) -> Option<[Point2; 2]> {
    let points = curve.points();
    let ends = [*points.first()?, *points.last()?];
    let known = STRAIGHT * (ends[1] - ends[0]).norm();
    points.iter().all(|p| distance_from(&ends, p) <= known).then_some(ends)
}

/// How far a place is from a line from one end to the other.
#[must_use]
pub fn distance_from([a, b]: &[Point2; 2], p: &Point2) -> f64 {
    let side = b - a;
    let along = ((p - a).dot(&side) / side.norm_squared().max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
    (p - (a + side * along)).norm()
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
            let depth = if pieces.len() < MANY_PIECES { 0 } else { FEW_HALVINGS };
            cut_edge(&face.surface, &edge.pcurve, (span[0], span[1]), depth, &mut |t, a, b, deviation_mm| {
                pieces.push(EdgePiece { face: id as u32, pcurve: k as u32, t, a, b, deviation_mm });
            });
        }
    }
    pieces
}

/// Halves `[t0, t1]` until it is short and flat; deviation is sampled at quarter points.
pub(crate) fn cut_edge(
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
    if depth < MOST_HALVINGS && (deviation > EDGE_DEVIATION_MM || chord.norm() > EDGE_PIECE_MM || depth < 1) {
        let middle = 0.5 * (t0 + t1);
        cut_edge(s, c, (t0, middle), depth + 1, emit);
        cut_edge(s, c, (middle, t1), depth + 1, emit);
    } else if chord.norm() + deviation > 0.0 {
        emit((t0, t1), a, b, deviation);
    }
}
