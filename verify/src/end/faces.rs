//! How far an end is from all faces: the piece of the model with the lowest bound is cut until nothing can be nearer than a
//! point that is known.

use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::ops::ControlFlow;

use claymill_nurbs::{
    Aabb, BoxTree, Curve2, Domain, FaceId, FaceMesh, Leaves, Model, Point2, Point3, Vector3,
};
use rayon::prelude::*;

use super::body::EndBody;
use super::edges::{EdgePiece, borders, halves, pieces};
use super::flats::Flat;
use crate::drop::DropMesh;

/// Distances are known to this and a tie, mm, or to this share of them.
const KNOWN_MM: f64 = 4e-5;
const KNOWN_SHARE: f64 = 0.01;
/// Pieces whose bounds differ by less are as near, mm.
const TIE_MM: f64 = 1e-5;
/// A border that is nearer than the inside of all faces by less than this does not count as what is touched, mm.
const BORDER_MM: f64 = 2e-4;
/// Pieces that are cut, at most.
const MOST_CUTS: usize = 20_000;
/// Steps towards what is nearest from what was nearest a little before.
const APPROACHES: u32 = 2;
/// Second derivatives make the distance of a surface from its triangle a quarter where that is cut in four.
const QUARTER: f64 = 0.25;

/// The faces of a model, ready to be asked how far an end is from them.
pub(crate) struct EndFaces<'a> {
    meshes: &'a [Option<FaceMesh>],
    leaves: Vec<Leaves>,
    flats: Vec<Option<Flat>>,
    domains: Vec<Option<Domain>>,
    borders: Vec<Vec<Curve2>>,
    edges: Vec<EdgePiece>,
    around_edges: BoxTree,
}

/// What an end is nearest to.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Nearest {
    /// Distance, negative where the end enters the model, mm.
    pub(crate) gap_mm: f64,
    /// On the model.
    pub(crate) point: Point3,
    pub(crate) face: Option<FaceId>,
    pub(crate) uv: Point2,
    /// On the border of a face.
    pub(crate) on_border: bool,
    /// How the distance grows when the place moves.
    pub(crate) gradient: Vector3,
}

#[derive(Clone, Copy)]
enum Piece {
    /// A triangle of a face's parameters.
    Sheet {
        face: FaceId,
        uv: [Point2; 3],
        p: [Point3; 3],
        sag_mm: f64,
    },
    Edge(EdgePiece),
    /// What is not of a face is as flat as its triangle.
    Flat([Point3; 3]),
}

/// A piece that may hold what is nearest. Of those that are as near the newest, which is the smallest, goes first: along a border
/// that is nearest all over, the least piece settles all others.
#[derive(PartialEq, Eq, PartialOrd, Ord)]
struct Waiting {
    /// What of the piece is nearest is no nearer than so many `TIE_MM`; of a border as it counts.
    bound: Reverse<i64>,
    piece: usize,
}

impl<'a> EndFaces<'a> {
    pub(crate) fn new(model: &Model, meshes: &'a [Option<FaceMesh>]) -> Self {
        let leaves: Vec<Leaves> = model.faces.par_iter().map(|f| Leaves::new(&f.surface)).collect();
        let domain = |f: &claymill_nurbs::Face| (!f.loops.is_empty()).then(|| Domain::new(f));
        let borders = borders(model);
        let of_face = |(face, curves): (usize, &Vec<Curve2>)| pieces(face, &leaves[face], curves);
        let edges: Vec<EdgePiece> = borders.iter().enumerate().flat_map(of_face).collect();
        let boxes: Vec<Aabb> = edges.iter().map(|e| Aabb::of(&e.ends).inflated(e.sag_mm)).collect();
        EndFaces {
            meshes,
            domains: model.faces.par_iter().map(domain).collect(),
            flats: model.faces.iter().map(|f| Flat::of(&f.surface)).collect(),
            borders,
            leaves,
            around_edges: BoxTree::new(&boxes),
            edges,
        }
    }

    /// What the end is nearest to with its tip at a place of the model, if that is no farther than `within_mm`. `view` looks
    /// along its axis. `last` is what it was nearest to a little before: what is farther than that is not looked at.
    pub(crate) fn nearest(
        &self,
        view: &DropMesh<'_>,
        [tip, axis]: [&Vector3; 2],
        body: &EndBody,
        within_mm: f64,
        last: Option<&Nearest>,
    ) -> Option<Nearest> {
        let tip = Point3::from(*tip);
        let mut search = Search {
            faces: self,
            tip,
            axis: *axis,
            body: *body,
            within_mm,
            best: None,
            waiting: BinaryHeap::new(),
            pieces: Vec::new(),
            flat: None,
        };
        if let Some(last) = last {
            search.begin_at(last);
        }
        let near_mm = search.limit_mm();
        let in_frame = view.in_frame(&tip);
        let is_near = |b: &Aabb| {
            let beside = |k: usize| (b.min[k] - in_frame[k]).max(in_frame[k] - b.max[k]).max(0.0);
            let place = Vector3::new(beside(0).hypot(beside(1)), 0.0, b.max.z - in_frame.z);
            body.distance(&place, &Vector3::z()).0 <= near_mm
        };
        let slack_mm = view.worst_deviation_mm();
        view.visit(
            |b| is_near(&b.inflated(slack_mm)),
            |k| {
                if !view.face_of(k).is_some_and(|(face, _)| search.is_settled(face)) {
                    search.push(self.sheet(view, k));
                }
                ControlFlow::Continue(())
            },
        );
        let around = |b: &Aabb| {
            let middle = nalgebra::center(&b.min, &b.max);
            body.distance(&(middle - tip), axis).0 - 0.5 * b.diagonal() <= near_mm
        };
        self.around_edges.visit(
            |boxes| boxes.each(around),
            |k| {
                search.push(Piece::Edge(self.edges[k]));
                ControlFlow::Continue(())
            },
        );
        search.settle();
        search.best.filter(|best| best.gap_mm <= within_mm)
    }

    fn sheet(&self, view: &DropMesh<'_>, triangle: usize) -> Piece {
        let known = view.face_of(triangle).and_then(|(face, k)| {
            let mesh = self.meshes[face].as_ref()?;
            let at = mesh.triangles[k].map(|i| i as usize);
            let (uv, p) = (at.map(|i| mesh.uv[i]), at.map(|i| mesh.points[i]));
            Some(Piece::Sheet { face, uv, p, sag_mm: f64::from(mesh.deviation_mm[k]) })
        });
        known.unwrap_or_else(|| Piece::Flat(view.corners(triangle).map(|p| view.in_model(&p))))
    }
}

/// A distance as it counts.
fn counted_mm(mm: f64, on_border: bool) -> f64 {
    if on_border { mm + BORDER_MM } else { mm }
}

struct Search<'a> {
    faces: &'a EndFaces<'a>,
    tip: Point3,
    axis: Vector3,
    body: EndBody,
    within_mm: f64,
    best: Option<Nearest>,
    waiting: BinaryHeap<Waiting>,
    /// All that have been met.
    pieces: Vec<Piece>,
    /// The last face that was asked whether it is settled, and the answer.
    flat: Option<(FaceId, bool)>,
}

impl Search<'_> {
    /// How near the nearest place so far is, as it counts.
    fn best_mm(&self) -> f64 {
        let of_best = |best: &Nearest| counted_mm(best.gap_mm, best.on_border);
        self.best.as_ref().map_or(counted_mm(self.within_mm, true), of_best)
    }

    /// Nothing farther than this is of interest, borders as they count.
    fn limit_mm(&self) -> f64 {
        let best_mm = self.best_mm();
        best_mm - KNOWN_MM.max(KNOWN_SHARE * best_mm)
    }

    /// Takes in what was nearest a little before, and what is near there now: from a place to the nearest one of the tool, from
    /// that to the nearest one of the tangent plane.
    fn begin_at(&mut self, last: &Nearest) {
        self.take(last.point, last.face, last.uv, last.on_border);
        let Some(face) = last.face.filter(|_| !last.on_border) else { return };
        let leaves = &self.faces.leaves[face];
        let (u_ends, v_ends) = leaves.domain();
        let mut uv = last.uv;
        for _ in 0..APPROACHES {
            let jet = leaves.jet(uv.x, uv.y);
            let (gap_mm, gradient) = self.body.distance(&(jet.p - self.tip), &self.axis);
            let Some(step) = jet.tangent_coordinates(&(-gradient * gap_mm)) else { return };
            uv = Point2::new(
                (uv.x + step.x).clamp(u_ends.0, u_ends.1),
                (uv.y + step.y).clamp(v_ends.0, v_ends.1),
            );
        }
        self.take(leaves.point(uv.x, uv.y), Some(face), uv, false);
    }

    /// Whether a face is flat, so that its one nearest place, or its border, says all. The distance is a convex function: from any
    /// place inside to the nearest one of the plane it does not grow, and the border is crossed on the way.
    fn is_settled(&mut self, face: FaceId) -> bool {
        if let Some((last, is_settled)) = self.flat
            && last == face
        {
            return is_settled;
        }
        let nearest =
            self.faces.flats[face].as_ref().map(|flat| flat.nearest(&self.tip, &self.axis, &self.body));
        // The borders of untrimmed faces are nowhere but in their triangles.
        let has_border = !self.faces.borders[face].is_empty();
        let is_settled = nearest.is_some_and(|(_, uv)| uv.is_some() || has_border);
        if let Some((point, Some(uv))) = nearest {
            self.take(point, Some(face), uv, false);
        }
        self.flat = Some((face, is_settled));
        is_settled
    }

    /// A tangent plane of a convex function lies below it: over a flat piece that is lowest at a corner.
    fn push(&mut self, piece: Piece) {
        let (corners, sag_mm) = match &piece {
            Piece::Sheet { p, sag_mm, .. } => (*p, *sag_mm),
            Piece::Edge(edge) => ([edge.ends[0], edge.ends[1], edge.ends[1]], edge.sag_mm),
            Piece::Flat(p) => (*p, 0.0),
        };
        let middle = match &piece {
            Piece::Edge(edge) => nalgebra::center(&edge.ends[0], &edge.ends[1]),
            _ => Point3::from((corners[0].coords + corners[1].coords + corners[2].coords) / 3.0),
        };
        let (mm, gradient) = self.body.distance(&(middle - self.tip), &self.axis);
        let lowest = corners.iter().map(|c| gradient.dot(&(c - middle))).fold(f64::INFINITY, f64::min);
        let bound_mm = counted_mm(mm + lowest - sag_mm, matches!(piece, Piece::Edge(_)));
        if bound_mm < self.limit_mm() {
            let bound = Reverse((bound_mm / TIE_MM).floor() as i64);
            self.waiting.push(Waiting { bound, piece: self.pieces.len() });
            self.pieces.push(piece);
        }
    }

    fn settle(&mut self) {
        for _ in 0..MOST_CUTS {
            let Some(Waiting { bound: Reverse(bound), piece }) = self.waiting.pop() else { return };
            if bound as f64 * TIE_MM >= self.limit_mm() {
                return;
            }
            match self.pieces[piece] {
                Piece::Sheet { face, uv, p, sag_mm } => self.quarter(face, &uv, &p, sag_mm),
                Piece::Edge(edge) => {
                    let curve = &self.faces.borders[edge.face][edge.curve];
                    let both = halves(&self.faces.leaves[edge.face], curve, &edge);
                    let uv = curve.point(both[0].t[1]);
                    self.take(both[0].ends[1], Some(edge.face), uv, true);
                    both.into_iter().for_each(|half| self.push(Piece::Edge(half)));
                }
                Piece::Flat(p) => {
                    let m = [0, 1, 2].map(|k| nalgebra::center(&p[k], &p[(k + 1) % 3]));
                    m.into_iter().for_each(|m| self.take(m, None, Point2::origin(), false));
                    for corners in quarters(&p, &m) {
                        self.push(Piece::Flat(corners));
                    }
                }
            }
        }
    }

    fn quarter(&mut self, face: FaceId, uv: &[Point2; 3], p: &[Point3; 3], sag_mm: f64) {
        let leaves = &self.faces.leaves[face];
        let m = [0, 1, 2].map(|k| nalgebra::center(&uv[k], &uv[(k + 1) % 3]));
        let q = m.map(|c| leaves.point(c.x, c.y));
        let middle = Point2::from((uv[0].coords + uv[1].coords + uv[2].coords) / 3.0);
        self.take(leaves.point(middle.x, middle.y), Some(face), middle, false);
        for k in 0..3 {
            self.take(q[k], Some(face), m[k], false);
        }
        for (uv, p) in quarters(uv, &m).into_iter().zip(quarters(p, &q)) {
            self.push(Piece::Sheet { face, uv, p, sag_mm: QUARTER * sag_mm });
        }
    }

    /// Takes in that a point of the model is there, if it is inside of the trims.
    fn take(&mut self, point: Point3, face: Option<FaceId>, uv: Point2, on_border: bool) {
        let (gap_mm, gradient) = self.body.distance(&(point - self.tip), &self.axis);
        if counted_mm(gap_mm, on_border) >= self.best_mm() {
            return;
        }
        let domain = face.filter(|_| !on_border).and_then(|face| self.faces.domains[face].as_ref());
        if domain.is_none_or(|d| d.contains(uv.x, uv.y)) {
            self.best = Some(Nearest { gap_mm, point, face, uv, on_border, gradient });
        }
    }
}

/// The four parts of a triangle, by the middles of its sides.
fn quarters<T: Copy>(p: &[T; 3], m: &[T; 3]) -> [[T; 3]; 4] {
    [[p[0], m[0], m[2]], [m[0], p[1], m[1]], [m[2], m[1], p[2]], [m[0], m[1], m[2]]]
}
