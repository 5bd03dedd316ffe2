//! One closest-point query: branch and bound over pieces and rims, with the argument for the global
//! minimum on trimmed faces.

use std::ops::ControlFlow;

use super::ClosestPoints;
use super::build::Trim;
use super::net::Direction;
use super::newton::{Spot, descend};
use super::piece::{Piece, Shape};
use crate::{Boxes, FaceId, Foot, Point3};

/// A piece is given up when nothing on it can be nearer than the best foot by more than this, mm.
const CERTAIN_MM: f64 = 1e-9;
/// Cuts of one piece during a query, at most (each halves it one way).
const LARGEST_DEPTH: usize = 40;
/// Cut pieces during the visit of one piece, at most: a guard for queries with a continuum of nearest points
/// that lie outside the trims.
const LARGEST_CUT_COUNT: usize = 3000;

/// A foot on the side of a piece lies on a rim that is no farther away than this, mm.
const ON_RIM_MM: f64 = 1e-6;

/// A piece is cut through a foot on it unless that is this near to a side, as a part of the piece.
const CUT_INSET: f64 = 0.02;

/// The best foot so far.
#[derive(Debug, Clone, Copy)]
pub(super) struct Found {
    face: FaceId,
    uv: (f64, f64),
    point: Point3,
    on: On,
}

/// What of a face a foot was found on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum On {
    Inside,
    /// The side of a piece, along which a rim may run.
    Side,
    Rim,
}

/// Whether a monotone piece may hold a local minimum: the sides from which the distance rises are open.
pub(super) fn may_exit(piece: &Piece, trim: &Trim, signs: [i8; 2]) -> bool {
    [(0, piece.net.u), (1, piece.net.v)].into_iter().all(|(axis, (low, high))| match signs[axis] {
        1 => trim.is_open(axis, low),
        -1 => trim.is_open(axis, high),
        _ => true,
    })
}

/// One query under way.
pub(super) struct Search<'q> {
    index: &'q ClosestPoints<'q>,
    p: Point3,
    pub(super) best_squared: f64,
    pub(super) found: Option<Found>,
    /// The item on which the foot lies.
    pub(super) item: usize,
    cuts: usize,
}

impl<'q> Search<'q> {
    pub(super) fn new(index: &'q ClosestPoints<'q>, p: &Point3, within_mm: f64) -> Self {
        Search {
            index,
            p: *p,
            // A foot just at the limit still counts.
            best_squared: (within_mm.max(0.0).powi(2)).next_up(),
            found: None,
            item: usize::MAX,
            cuts: 0,
        }
    }

    /// The answer.
    pub(super) fn foot(&self) -> Option<Foot> {
        let found = self.found?;
        let (u, v) = found.uv;
        let ((u0, u1), (v0, v1)) = self.index.model.faces[found.face].surface.domain();
        Some(Foot {
            face: found.face,
            u,
            v,
            point: found.point,
            distance_mm: self.best_squared.sqrt(),
            on_boundary: found.on == On::Rim
                || u == u0
                || u == u1
                || v == v0
                || v == v1
                || found.on == On::Side && self.is_on_rim(&found),
        })
    }

    /// Whether a rim of its face runs through a foot. Where one runs along the side of a piece, the piece has the same nearest
    /// point as the rim, and which of them was looked at first does not matter.
    fn is_on_rim(&self, found: &Found) -> bool {
        let index = self.index;
        let place = found.point;
        let is_near = |boxes: &Boxes| boxes.each(|b| b.distance_squared(&place) <= ON_RIM_MM * ON_RIM_MM);
        let mut is_on_rim = false;
        index.tree.visit(is_near, |item| {
            let rim = item.checked_sub(index.pieces.len()).map(|rim| &index.rims[rim]);
            let surface = &index.model.faces[found.face].surface;
            is_on_rim = rim.filter(|rim| rim.face == found.face).is_some_and(|rim| {
                let pcurve = &index.trims[rim.face].edges[rim.edge];
                rim.nearest(surface, pcurve, &place, ON_RIM_MM * ON_RIM_MM).is_some()
            });
            if is_on_rim { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        });
        is_on_rim
    }

    /// Looks for a nearer foot on an item.
    pub(super) fn visit(&mut self, item: usize) {
        let before = self.best_squared;
        let pieces = &self.index.pieces;
        if let Some(piece) = pieces.get(item) {
            self.cuts = 0;
            self.visit_piece(piece, 0);
        } else {
            self.visit_rim(item - pieces.len());
        }
        if self.best_squared < before {
            self.item = item;
        }
    }

    /// Looks for a nearer foot on a piece of a surface.
    ///
    /// Why the result is the global minimum also on trimmed faces: a nearest point of a face lies either on
    /// a rim, and rims are items of their own, or inside the trims. There it is a local minimum over the
    /// untrimmed surface, thus of every piece that it belongs to. A convex piece has one local minimum, the
    /// constrained one: if that lies outside the trims, the piece holds no other candidate. On a monotone
    /// piece a local minimum lies on the sides from which the distance rises. There it is a critical point
    /// as well, which a monotone piece has not, unless the side is a crease, a kinked seam, a pole, or
    /// belongs to a boundary without rims. All other pieces are cut until they are one of these, are outside
    /// the trims, or hold nothing nearer.
    fn visit_piece(&mut self, piece: &Piece, depth: usize) {
        let local = piece.local(&self.p);
        if piece.box_distance_squared(&local) >= self.best_squared {
            return;
        }
        let trim = &self.index.trims[piece.face];
        let (convexity, barren) = match piece.shape(&local) {
            Shape::Convex(least) => (Some(least), false),
            Shape::Monotone(signs) => (None, !may_exit(piece, trim, signs)),
            Shape::Unknown => (None, false),
        };
        if barren && !piece.chords.is_empty() {
            return;
        }
        let start = piece.start(&local);
        let Some(spot) = descend(piece, &local, start, convexity, self.best_squared) else {
            return;
        };
        // A barren piece wholly inside the trims gives a bound early that keeps others from being searched.
        self.offer(piece, &spot);
        if convexity.is_some() || barren {
            return;
        }
        self.cuts += 1;
        let bound = self.best_squared.sqrt() - CERTAIN_MM;
        if depth == LARGEST_DEPTH || self.cuts > LARGEST_CUT_COUNT || bound <= 0.0 {
            return;
        }
        let Some(direction) = piece.net.blocks(&self.p.coords, bound) else {
            return;
        };
        // Bernstein coefficients bound a function sharply whose minimum is on a side: cut through the foot.
        let at = 0.5 + if direction == Direction::U { spot.s } else { spot.t };
        let at = if at > CUT_INSET && at < 1.0 - CUT_INSET { at } else { 0.5 };
        let mut halves = (piece.net.cut(direction, at)).map(|net| trim.part(net, piece));
        let near = |half: &Option<Piece>| {
            half.as_ref().map_or(f64::INFINITY, |h| h.box_distance_squared(&h.local(&self.p)))
        };
        if near(&halves[1]) < near(&halves[0]) {
            halves.swap(0, 1);
        }
        for half in halves.iter().flatten() {
            self.visit_piece(half, depth + 1);
        }
    }

    /// Takes `spot` if it is nearer and belongs to the face.
    fn offer(&mut self, piece: &Piece, spot: &Spot) {
        if spot.distance_squared >= self.best_squared {
            return;
        }
        let (u, v) = piece.parameters(spot.s, spot.t);
        let trim = &self.index.trims[piece.face];
        if !piece.chords.is_empty() && trim.domain.as_ref().is_some_and(|d| !d.contains(u, v)) {
            return;
        }
        self.best_squared = spot.distance_squared;
        let is_end = |x: f64, (low, high): (f64, f64)| x == low || x == high;
        let on = if is_end(u, piece.net.u) || is_end(v, piece.net.v) { On::Side } else { On::Inside };
        self.found = Some(Found { face: piece.face, uv: (u, v), point: piece.world(&spot.position), on });
    }

    fn visit_rim(&mut self, rim: usize) {
        let rim = &self.index.rims[rim];
        let surface = &self.index.model.faces[rim.face].surface;
        let pcurve = &self.index.trims[rim.face].edges[rim.edge];
        let Some(spot) = rim.nearest(surface, pcurve, &self.p, self.best_squared) else {
            return;
        };
        let at = pcurve.point(spot.t);
        self.best_squared = spot.distance_squared;
        self.found = Some(Found { face: rim.face, uv: (at.x, at.y), point: spot.point, on: On::Rim });
    }
}
