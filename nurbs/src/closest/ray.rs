//! Where a line crosses a model: a contraction `x ↦ x − M f(x)` proves one crossing or none on each
//! piece; other pieces are cut.

use std::ops::ControlFlow;

use super::ClosestPoints;
use super::interval::{Interval, dot};
use super::net::Net;
use super::piece::Piece;
use crate::{Aabb, FaceId, Point3, Vector3};

/// A point this near to the line is on it, mm.
const ON_LINE_MM: f64 = 1e-9;
/// Crossings of one face this near to each other are one, mm: seen from two pieces, or from both sides of a seam.
const SAME_MM: f64 = 1e-6;
/// The piece is solved where its derivatives stray from those in its middle by no more than this share.
const LARGEST_STRAY: f64 = 0.5;
/// Steps until the position is known to the last bit, since each at least halves its error.
const STEPS: usize = 60;
/// Cuts of one piece (each halves it one way) after one another, of one piece, and of all pieces, at most: reached
/// where the line touches or follows the surface, or goes through a pole.
const LARGEST_DEPTH: usize = 36;
const LARGEST_CUT_COUNT: usize = 2000;
const LARGEST_CUT_COUNT_OF_ALL: usize = 40_000;

/// A place where a line passes through a face.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Crossing {
    /// The face.
    pub face: FaceId,
    /// Its parameter `u`.
    pub u: f64,
    /// Its parameter `v`.
    pub v: f64,
    /// The point, mm.
    pub point: Point3,
    /// Its distance from the start of the line, mm.
    pub along_mm: f64,
}

/// Where a line meets a model.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Crossings {
    /// In the order of the line. A line through an edge that two faces share crosses both.
    pub all: Vec<Crossing>,
    /// Whether it is proven that there are no others: every piece of the model misses the line or crosses it once.
    /// Not so where the line touches a face or lies in it.
    pub complete: bool,
}

/// A line, as the directions across it.
struct Line<'q> {
    index: &'q ClosestPoints<'q>,
    origin: Point3,
    along: Vector3,
    across: [Vector3; 2],
    length_mm: f64,
    found: Vec<Crossing>,
    /// Of the piece that is looked at, and of those before.
    cuts: usize,
    cuts_before: usize,
    complete: bool,
}

impl ClosestPoints<'_> {
    /// Where the line from `origin` in `direction`, of `length_mm`, passes through faces; nothing for a zero
    /// direction.
    #[must_use]
    pub fn crossings(&self, origin: &Point3, direction: &Vector3, length_mm: f64) -> Crossings {
        let Some(along) = direction.try_normalize(0.0) else { return Crossings::default() };
        let aside = if along.x.abs() < 0.7 { Vector3::x() } else { Vector3::y() };
        let first = along.cross(&aside).normalize();
        let across = [first, along.cross(&first)];
        let found = Vec::new();
        let mut line = Line {
            index: self,
            origin: *origin,
            along,
            across,
            length_mm,
            found,
            cuts: 0,
            cuts_before: 0,
            complete: true,
        };
        self.tree.visit(
            |boxes| boxes.each(|b| meets(b, origin, &along, length_mm)),
            |item| {
                if let Some(piece) = self.pieces.get(item) {
                    line.cuts_before += std::mem::take(&mut line.cuts);
                    line.visit(piece, 0);
                }
                ControlFlow::Continue(())
            },
        );
        let mut all = line.found;
        all.sort_by(|a, b| a.along_mm.total_cmp(&b.along_mm).then(a.face.cmp(&b.face)));
        let mut kept: Vec<Crossing> = Vec::with_capacity(all.len());
        for c in all {
            let same = |k: &&Crossing| k.face == c.face && (k.point - c.point).norm() < SAME_MM;
            if !kept.iter().rev().take_while(|k| c.along_mm - k.along_mm < SAME_MM).any(|k| same(&k)) {
                kept.push(c);
            }
        }
        Crossings { all: kept, complete: line.complete }
    }
}

/// Whether a line along a unit vector meets a box, by its stretches between opposite sides.
fn meets(b: &Aabb, origin: &Point3, unit: &Vector3, length_mm: f64) -> bool {
    let (mut from, mut to) = (0.0f64, length_mm);
    for axis in 0..3 {
        let (low, high) = (b.min[axis] - origin[axis], b.max[axis] - origin[axis]);
        if unit[axis].abs() < f64::MIN_POSITIVE {
            if low > 0.0 || high < 0.0 {
                return false;
            }
            continue;
        }
        let (a, b) = (low / unit[axis], high / unit[axis]);
        (from, to) = (from.max(a.min(b)), to.min(a.max(b)));
    }
    // The boxes are rounded outward by more than this rounds.
    from <= to + ON_LINE_MM
}

impl Line<'_> {
    /// Whether the hull of a net shows that it misses the line.
    fn misses(&self, net: &Net) -> bool {
        let range = |axis: &Vector3| {
            Interval::of(net.points.iter().map(|h| (h.xyz() / h.w - self.origin.coords).dot(axis)))
        };
        let [a, b, c] = [&self.across[0], &self.across[1], &self.along].map(range);
        let beside = |r: Interval| r.lo > ON_LINE_MM || r.hi < -ON_LINE_MM;
        beside(a) || beside(b) || c.hi < -ON_LINE_MM || c.lo > self.length_mm + ON_LINE_MM
    }

    /// Finds the crossing of a piece. With `f` the offset of its point from the line, `M` the inverse of `f'` in the
    /// middle, and `f'` within `ρ ≤ ½` of that everywhere, `x ↦ x − M f(x)` brings every point nearer to a zero, if
    /// there is one, by the factor `ρ`; so does going back to the piece. What this ends at is a zero or there is none.
    fn visit(&mut self, piece: &Piece, depth: usize) {
        if self.misses(&piece.net) {
            return;
        }
        let across = self.across.map(|a| piece.turned(&a));
        let Some(inverse) = inverse(piece, &across) else {
            self.cut(piece, depth);
            return;
        };
        let origin = piece.local(&self.origin);
        let (mut s, mut t) = (0.0f64, 0.0f64);
        let mut off = [0.0; 2];
        for _ in 0..STEPS {
            let p = piece.point(s, t) - origin;
            off = [p.dot(&across[0]), p.dot(&across[1])];
            let step = |row: [f64; 2]| row[0] * off[0] + row[1] * off[1];
            let next = ((s - step(inverse[0])).clamp(-0.5, 0.5), (t - step(inverse[1])).clamp(-0.5, 0.5));
            if next == (s, t) {
                break;
            }
            (s, t) = next;
        }
        if off[0].hypot(off[1]) > ON_LINE_MM {
            return;
        }
        let (u, v) = piece.parameters(s, t);
        let trim = &self.index.trims[piece.face];
        if !piece.chords.is_empty() && trim.domain.as_ref().is_some_and(|d| !d.contains(u, v)) {
            return;
        }
        let point = piece.world(&piece.point(s, t));
        let along_mm = (point - self.origin).dot(&self.along);
        if (0.0..=self.length_mm).contains(&along_mm) {
            self.found.push(Crossing { face: piece.face, u, v, point, along_mm });
        }
    }

    fn cut(&mut self, piece: &Piece, depth: usize) {
        self.cuts += 1;
        let of_all = self.cuts_before + self.cuts;
        if depth == LARGEST_DEPTH || self.cuts > LARGEST_CUT_COUNT || of_all > LARGEST_CUT_COUNT_OF_ALL {
            self.complete = false;
            return;
        }
        let trim = &self.index.trims[piece.face];
        for half in piece.net.cut(piece.bent_direction(), 0.5) {
            if let Some(half) = trim.part(half, piece) {
                self.visit(&half, depth + 1);
            }
        }
    }
}

/// The inverse of the derivatives in the middle, if those anywhere on the piece are near enough to it.
fn inverse(piece: &Piece, across: &[Vector3; 2]) -> Option<[[f64; 2]; 2]> {
    let (su, sv) = piece.slopes();
    let exactly = |a: &Vector3| [0, 1, 2].map(|k| Interval { lo: a[k], hi: a[k] });
    let rows = across.each_ref().map(|a| [dot(su, &exactly(a)), dot(sv, &exactly(a))]);
    let middle = rows.map(|row| row.map(|x| 0.5 * (x.lo + x.hi)));
    let determinant = middle[0][0] * middle[1][1] - middle[0][1] * middle[1][0];
    let inverse =
        [[middle[1][1], -middle[0][1]], [-middle[1][0], middle[0][0]]].map(|r| r.map(|x| x / determinant));
    let stray = |row: [f64; 2]| -> f64 {
        let part = |k: usize| 0.5 * (row[0].abs() * rows[0][k].width() + row[1].abs() * rows[1][k].width());
        part(0) + part(1)
    };
    // Not so either where the determinant is zero.
    (inverse.map(stray).iter().all(|&x| x <= LARGEST_STRAY)).then_some(inverse)
}
