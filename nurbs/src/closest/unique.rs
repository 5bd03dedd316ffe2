//! Whether a nearest point is the only one: the search goes on for other minima as near as the
//! first.

use super::ClosestPoints;
use super::net::Direction;
use super::newton::descend;
use super::piece::{Piece, Shape};
use super::search::may_exit;
use crate::{Foot, Point3};

/// Minima whose distances differ by less than this are equally near, mm.
const EQUAL_MM: f64 = 1e-9;
/// Minima this near to each other are one, mm: the same place seen from two pieces or faces.
const SAME_MM: f64 = 1e-3;
/// Cuts of one piece during one question (each halves it one way), and of all pieces, at most; only a continuum of
/// nearest points comes near.
const LARGEST_DEPTH: usize = 40;
const LARGEST_CUT_COUNT: usize = 2000;

/// The nearest point of a model, and whether there is another.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Nearest {
    /// Nothing is within the distance asked for.
    Nothing,
    /// This one: every other minimum of the distance, more than a micrometre away, is further by 1e-9 mm or more.
    Unique(Foot),
    /// Not this one alone.
    Shared {
        /// One of the nearest points.
        foot: Foot,
        /// Another one as near; `None` where they are too many or too close to be told apart, as around the centre
        /// of a sphere or the axis of a cylinder.
        other: Option<Point3>,
    },
}

impl ClosestPoints<'_> {
    /// The nearest point of the model within `within_mm`, with the proof that it is the only one or the news that it
    /// is not.
    ///
    /// The proof is that of [`Self::closest`], carried on beyond the first minimum: every piece of the model either
    /// has nothing as near, or a squared distance that is convex and thus a single minimum, which is the foot found.
    /// Trim curves take part with bounds that are sampled.
    #[must_use]
    pub fn nearest(&self, p: &Point3, within_mm: f64) -> Nearest {
        let Some(foot) = self.closest(p, within_mm) else { return Nearest::Nothing };
        let horizon = (foot.distance_mm + EQUAL_MM).powi(2).next_up();
        let mut rivals =
            Rivals { index: self, p: *p, foot, horizon, cuts: 0, other: None, unresolved: false };
        // Nothing more to learn once there is another.
        let bound = |r: &Rivals| if r.other.is_some() { 0.0 } else { horizon };
        self.tree.nearest_first(p, &mut rivals, bound, Rivals::visit);
        if rivals.other.is_none() && !rivals.unresolved {
            Nearest::Unique(foot)
        } else {
            Nearest::Shared { foot, other: rivals.other }
        }
    }
}

/// The search for minima as near as the foot.
struct Rivals<'q> {
    index: &'q ClosestPoints<'q>,
    p: Point3,
    foot: Foot,
    /// Squared distance up to which a minimum is as near.
    horizon: f64,
    cuts: usize,
    other: Option<Point3>,
    unresolved: bool,
}

impl Rivals<'_> {
    fn visit(&mut self, item: usize) {
        match self.index.pieces.get(item) {
            Some(piece) => self.visit_piece(piece, 0),
            None => self.visit_rim(item - self.index.pieces.len()),
        }
    }

    fn offer(&mut self, point: Point3) {
        if (point - self.foot.point).norm() > SAME_MM {
            self.other = Some(point);
        }
    }

    fn visit_piece(&mut self, piece: &Piece, depth: usize) {
        let local = piece.local(&self.p);
        if self.other.is_some() || self.unresolved || piece.box_distance_squared(&local) >= self.horizon {
            return;
        }
        let trim = &self.index.trims[piece.face];
        match piece.shape(&local) {
            Shape::Convex(least) => {
                let start = piece.start(&local);
                let Some(spot) = descend(piece, &local, start, Some(least), self.horizon) else { return };
                let (u, v) = piece.parameters(spot.s, spot.t);
                let outside =
                    !piece.chords.is_empty() && trim.domain.as_ref().is_some_and(|d| !d.contains(u, v));
                if spot.distance_squared < self.horizon && !outside {
                    self.offer(piece.world(&spot.position));
                }
                return;
            }
            Shape::Monotone(signs) if !may_exit(piece, trim, signs) => return,
            _ => {}
        }
        if self.is_at_the_foot(piece) {
            return;
        }
        let Some(direction) = piece.net.blocks(&self.p.coords, self.horizon.sqrt()) else { return };
        self.cuts += 1;
        if self.cuts > LARGEST_CUT_COUNT || depth == LARGEST_DEPTH {
            self.unresolved = true;
            return;
        }
        // A cut through the foot leaves it on the sides of pieces, where coefficients bound sharply.
        let at = piece.fraction(&self.foot, direction);
        for half in piece.net.cut(direction, at) {
            if let Some(half) = trim.part(half, piece) {
                self.visit_piece(&half, depth + 1);
            }
        }
    }

    /// Whether all of a piece is so near to the foot that what it holds is the same minimum.
    fn is_at_the_foot(&self, piece: &Piece) -> bool {
        let near = |corner: &Point3| (corner - self.foot.point).norm() <= SAME_MM;
        piece.corners().iter().all(near)
    }

    fn visit_rim(&mut self, rim: usize) {
        let rim = &self.index.rims[rim];
        let surface = &self.index.model.faces[rim.face].surface;
        let pcurve = &self.index.trims[rim.face].edges[rim.edge];
        if let Some(spot) = rim.nearest(surface, pcurve, &self.p, self.horizon) {
            self.offer(spot.point);
        }
    }
}

impl Piece {
    /// Where a foot cuts the piece across `direction`, as a fraction: in the middle unless it is well inside.
    fn fraction(&self, foot: &Foot, direction: Direction) -> f64 {
        let ((low, high), at) = match direction {
            Direction::U => (self.net.u, foot.u),
            Direction::V => (self.net.v, foot.v),
        };
        let x = (at - low) / (high - low);
        let inside = 0.02..=0.98;
        if foot.face == self.face && inside.contains(&x) { x } else { 0.5 }
    }
}
