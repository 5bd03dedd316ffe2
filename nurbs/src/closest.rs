//! Exact closest points.
//!
//! ```text
//!   face ─► Bézier pieces ─► cut until thin and tame ─┐
//!        └► trim curves   ─► cut until nearly straight ┴► boxes ─► tree
//!
//!   query ─► tree, nearest box first ─► piece: one minimum?  ── yes ─► Newton
//!                                                            └─ no ──► cut it and try its halves
//! ```
//!
//! Nothing here knows a tessellation: boxes and the proof of uniqueness come from control nets, feet from
//! Newton on the exact surfaces and curves.

mod ball;
mod build;
mod interval;
mod net;
mod newton;
mod piece;
mod ray;
mod rim;
mod search;
mod unique;

use rayon::prelude::*;

use crate::{Aabb, BoxTree, FaceId, Model, Point3};
use build::Trim;
use piece::Piece;
pub use ray::{Crossing, Crossings};
use rim::RimPiece;
use search::Search;
pub use unique::Nearest;

/// Closest points over all faces of a model: a hierarchy of boxes around small surface pieces, then Newton
/// on the exact surfaces and on the exact boundary curves.
#[derive(Debug)]
pub struct ClosestPoints<'a> {
    model: &'a Model,
    /// Per face.
    trims: Vec<Trim>,
    pieces: Vec<Piece>,
    rims: Vec<RimPiece>,
    /// Over `pieces`, then `rims`.
    tree: BoxTree,
}

/// The nearest point of the model.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Foot {
    /// The face it lies on.
    pub face: FaceId,
    /// Its parameter `u`.
    pub u: f64,
    /// Its parameter `v`.
    pub v: f64,
    /// The point, mm.
    pub point: Point3,
    /// Its distance from the query, mm.
    pub distance_mm: f64,
    /// Whether it lies on the boundary of its face (on a trim curve or a side of the parameter rectangle,
    /// seams of closed surfaces included).
    pub on_boundary: bool,
}

/// What one query leaves for the next one nearby: the items that alone can hold its foot. A fresh hint
/// (`Hint::default()`) starts a path; results do not depend on it.
#[derive(Debug, Clone, Default)]
pub struct Hint {
    centre: Point3,
    /// Queries this near to `centre` find their foot among `items`, mm.
    reach: f64,
    /// Provided that they ask for no more than this, mm.
    within: f64,
    items: Vec<u32>,
}

/// Reach of a hint, as a part of the size of the item on which the foot lies, and its limits in mm. A wide
/// reach is renewed seldom but holds many items.
const REACH: (f64, f64, f64) = (0.1, 0.2, 20.0);

impl<'a> ClosestPoints<'a> {
    /// Builds the index over all faces (in parallel).
    #[must_use]
    pub fn new(model: &'a Model) -> Self {
        let parts: Vec<_> =
            (model.faces.par_iter().enumerate()).map(|(id, face)| build::parts(id, face)).collect();
        let (mut trims, mut pieces, mut rims) = (Vec::new(), Vec::new(), Vec::new());
        for part in parts {
            trims.push(part.trim);
            pieces.extend(part.pieces);
            rims.extend(part.rims);
        }
        let mut boxes: Vec<Aabb> = (pieces.par_iter()).map(|p| Aabb::of(&p.corners())).collect();
        boxes.extend(rims.iter().map(RimPiece::bounds));
        ClosestPoints { model, trims, pieces, rims, tree: BoxTree::new(&boxes) }
    }

    /// The model.
    #[must_use]
    pub fn model(&self) -> &'a Model {
        self.model
    }

    /// The point of the model nearest to `p`, if any lies within `within_mm`. Exact to 1e-9 mm: the
    /// distance returned is never larger than the true one by more than that.
    #[must_use]
    pub fn closest(&self, p: &Point3, within_mm: f64) -> Option<Foot> {
        self.search(p, within_mm).foot()
    }

    /// The same as [`Self::closest`] for queries along a path: `hint` carries over which items can matter
    /// around the last query. Where several points are equally near, either may be returned.
    #[must_use]
    pub fn closest_from(&self, p: &Point3, within_mm: f64, hint: &mut Hint) -> Option<Foot> {
        if (p - hint.centre).norm() > hint.reach || within_mm > hint.within || hint.items.is_empty() {
            return self.renew(p, within_mm, hint);
        }
        let mut search = Search::new(self, p, within_mm);
        for k in 0..hint.items.len() {
            let item = hint.items[k] as usize;
            search.visit(item);
            if search.item == item {
                // The winner starts next time, so that the others are dismissed by their boxes.
                hint.items.swap(0, k);
            }
        }
        search.foot()
    }

    /// Whether some point of the model lies nearer to `p` than `radius_mm`; faster than looking for the nearest.
    #[must_use]
    pub fn any_within(&self, p: &Point3, radius_mm: f64) -> bool {
        let mut search = Search::new(self, p, radius_mm);
        let bound = |s: &Search| if s.found.is_some() { 0.0 } else { s.best_squared };
        self.tree.nearest_first(p, &mut search, bound, Search::visit);
        search.foot().is_some_and(|f| f.distance_mm < radius_mm)
    }

    fn search(&self, p: &Point3, within_mm: f64) -> Search<'_> {
        let mut search = Search::new(self, p, within_mm);
        self.tree.nearest_first(p, &mut search, |s| s.best_squared, Search::visit);
        search
    }

    /// Answers the query from the tree and prepares `hint` for queries around it.
    ///
    /// Let `d(p)` be the distance and `b(p)` the lower bound of an item; both change by at most `|p − c|` from
    /// the centre `c`. An item can hold the foot of `p` only if `b(p) ≤ d(p)`, thus only if
    /// `b(c) ≤ d(c) + 2 |p − c|`: the items up to `d(c) + 2 · reach` are enough.
    fn renew(&self, p: &Point3, within_mm: f64, hint: &mut Hint) -> Option<Foot> {
        let search = self.search(p, within_mm);
        let distance = search.foot().map_or(within_mm, |f| f.distance_mm);
        let (part, least, largest) = REACH;
        let size = self.pieces.get(search.item).map_or(0.0, |piece| {
            let [x, y, _] = piece.extent();
            x.min(y)
        });
        hint.centre = *p;
        hint.reach = (part * size).clamp(least, largest);
        hint.within = if search.found.is_some() { f64::INFINITY } else { within_mm };
        hint.items.clear();
        let horizon = (distance + 2.0 * hint.reach).powi(2).next_up();
        let gather = |items: &mut Vec<u32>, item: usize| {
            if self.lower_bound_squared(item, p) <= horizon {
                items.push(item as u32);
            }
        };
        self.tree.nearest_first(p, &mut hint.items, |_| horizon, gather);
        if let Some(k) = hint.items.iter().position(|&i| i as usize == search.item) {
            hint.items.swap(0, k);
        }
        search.foot()
    }

    fn lower_bound_squared(&self, item: usize, p: &Point3) -> f64 {
        match self.pieces.get(item) {
            Some(piece) => piece.box_distance_squared(&piece.local(p)),
            None => self.rims[item - self.pieces.len()].lower_bound(p).powi(2),
        }
    }
}
