//! Proof that a sweep meets no stock that is still there, by dividing a box around it.
//!
//! The depth at a point is the radius of a ball about it that lies in one position of the body, in the initial stock and in
//! no earlier piece: the least of three signed distances, none of which changes faster than the point moves. So a box is done where the
//! depth of its middle and half its diagonal are not more than what is passed over, or where one earlier piece, being
//! convex, holds its eight corners. The box with the largest bound is divided next.

use std::cmp::Ordering;
use std::collections::BinaryHeap;
use std::ops::ControlFlow;

use claymill_nurbs::{Aabb, Point3, Vector3};

use super::initial::InitialStock;
use super::piece::Sweep;
use super::plunge::at_rest;
use super::retrace::uncovered;
use super::sweeps::{Sweeps, Time};
use crate::across::across;

/// What the search may pass over and how long it may take.
#[derive(Debug, Clone, Copy)]
pub(super) struct Limits {
    /// Balls of this radius are found; smaller ones need not be, mm.
    pub(super) radius_mm: f64,
    /// Boxes are not divided below this, mm.
    pub(super) smallest_mm: f64,
    /// Boxes looked at.
    pub(super) most_boxes: u64,
}

/// What is known of a sweep.
#[derive(Debug, Clone, Copy)]
pub(super) struct Depth {
    /// The largest ball found: its radius, mm; not positive where there is none.
    pub(super) found_mm: f64,
    /// Its middle.
    pub(super) at: Point3,
    /// No ball is larger than this, mm.
    pub(super) bound_mm: f64,
    /// Where one of that size is not ruled out.
    pub(super) bound_at: Point3,
    /// Boxes looked at.
    pub(super) boxes: u64,
}

/// Sizes are found to this part of them, and to the radius passed over.
const SIZE_KNOWN: f64 = 0.02;
/// Corners this little outside of a piece are on its surface, mm: floors and walls are often the same in sweep and piece.
const ON_SKIN_MM: f64 = 1e-9;

struct Open {
    bound: f64,
    number: u64,
    middle: Point3,
    half: Vector3,
}

impl PartialEq for Open {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}
impl Eq for Open {}
impl PartialOrd for Open {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}
impl Ord for Open {
    fn cmp(&self, other: &Self) -> Ordering {
        self.bound.total_cmp(&other.bound).then(other.number.cmp(&self.number))
    }
}

/// How deep a sweep enters what is left of the stock before a time.
pub(super) fn depth(
    sweep: &Sweep,
    before: Time,
    sweeps: &Sweeps,
    stock: &InitialStock<'_>,
    limits: &Limits,
) -> Depth {
    let nothing = |boxes| Depth {
        found_mm: f64::NEG_INFINITY,
        at: sweep.start,
        bound_mm: f64::NEG_INFINITY,
        bound_at: sweep.start,
        boxes,
    };
    let bounds = sweep.bounds();
    if !bounds.meets(&stock.bounds()) || stock.signed_mm(&bounds.centre()) > 0.5 * bounds.diagonal() {
        return nothing(0);
    }
    let mut all = nothing(0);
    for part in at_rest(sweep, &stock.bounds()) {
        let Some(sweep) = uncovered(&part, before, sweeps, 0.5 * limits.radius_mm) else { continue };
        let most_boxes = limits.most_boxes.saturating_sub(all.boxes).max(1);
        let limits = &Limits { most_boxes, ..*limits };
        let found = Search { sweep, before, sweeps, stock, limits, found: nothing(0), held: None }.run();
        all.boxes += found.boxes;
        if found.found_mm > all.found_mm {
            (all.found_mm, all.at) = (found.found_mm, found.at);
        }
        if found.bound_mm > all.bound_mm {
            (all.bound_mm, all.bound_at) = (found.bound_mm, found.bound_at);
        }
    }
    all
}

struct Search<'a> {
    sweep: Sweep,
    before: Time,
    sweeps: &'a Sweeps,
    stock: &'a InitialStock<'a>,
    limits: &'a Limits,
    found: Depth,
    /// The piece that held the last box.
    held: Option<Sweep>,
}

impl Search<'_> {
    fn run(mut self) -> Depth {
        let frame = frame_of(&self.sweep);
        let Some((middle, half)) = first_box(&self.sweep, &frame, &self.stock.bounds()) else {
            return self.found;
        };
        let mut open = BinaryHeap::new();
        let mut number = 0;
        open.push(Open { bound: f64::INFINITY, number, middle, half });
        while let Some(next) = open.pop() {
            let passed_over = self.passed_over();
            if next.bound <= passed_over {
                break;
            }
            if self.found.boxes >= self.limits.most_boxes {
                self.leave(next.bound, &next.middle);
                break;
            }
            self.found.boxes += 1;
            let Some(bound) = self.bound(&next, &frame) else { continue };
            if bound <= self.passed_over() {
                continue;
            }
            let longest = next.half.imax();
            if 2.0 * next.half[longest] <= self.limits.smallest_mm {
                self.leave(bound, &next.middle);
                continue;
            }
            let mut half = next.half;
            half[longest] *= 0.5;
            for side in [-1.0, 1.0] {
                number += 1;
                let middle = next.middle + frame[longest] * (side * half[longest]);
                open.push(Open { bound, number, middle, half });
            }
        }
        self.found.bound_mm = self.found.bound_mm.max(self.passed_over());
        self.found
    }

    /// Boxes without a ball larger than this need no closer look.
    fn passed_over(&self) -> f64 {
        let least = self.limits.radius_mm;
        if self.found.found_mm > least { self.found.found_mm * (1.0 + SIZE_KNOWN) + least } else { least }
    }

    /// Leaves a box undecided.
    fn leave(&mut self, bound: f64, at: &Point3) {
        if bound > self.found.bound_mm {
            (self.found.bound_mm, self.found.bound_at) = (bound, *at);
        }
    }

    /// An upper bound of the depth within a box; `None` where it holds nothing at all.
    fn bound(&mut self, b: &Open, frame: &[Vector3; 3]) -> Option<f64> {
        let (p, half) = (&b.middle, b.half.norm());
        let swept = -self.sweep.signed_mm(p);
        if swept + half <= self.passed_over() {
            return None;
        }
        let inside = swept.min(-self.stock.signed_mm(p));
        if inside + half <= self.passed_over() {
            return None;
        }
        let corners = || {
            (0..8).map(|k| {
                let side = |axis: usize| if k >> axis & 1 == 0 { b.half[axis] } else { -b.half[axis] };
                p + frame[0] * side(0) + frame[1] * side(1) + frame[2] * side(2)
            })
        };
        let holds = |piece: &Sweep| corners().all(|c| piece.holds(&c) || piece.signed_mm(&c) <= ON_SKIN_MM);
        if self.held.as_ref().is_some_and(holds) {
            return None;
        }
        let uncut = self.sweeps.signed_before(p, self.before, [-half, inside]);
        if uncut <= -half {
            return None;
        }
        if uncut < 0.0 {
            let around = corners().fold(Aabb::empty(), |mut all, c| {
                all.add(&c);
                all
            });
            let mut holder = None;
            self.sweeps.around(&around, self.before, |piece, _| {
                if holds(piece) {
                    holder = Some(*piece);
                    return ControlFlow::Break(());
                }
                ControlFlow::Continue(())
            });
            if holder.is_some() {
                self.held = holder;
                return None;
            }
        }
        let depth = inside.min(uncut);
        if depth > self.found.found_mm {
            (self.found.found_mm, self.found.at) = (depth, *p);
        }
        Some(depth + half)
    }
}

/// Along the way, across it, and along the tool's axis.
fn frame_of(sweep: &Sweep) -> [Vector3; 3] {
    let axis = sweep.axis;
    let aside = sweep.way - axis * sweep.way.dot(&axis);
    let first = if aside.norm() > 1e-9 { aside.normalize() } else { across(&axis) };
    [first, axis.cross(&first), axis]
}

/// A box around a sweep in its frame, no larger than the stock needs: middle and half sides.
fn first_box(sweep: &Sweep, frame: &[Vector3; 3], stock: &Aabb) -> Option<(Point3, Vector3)> {
    let [low, high, radius] = sweep.shape.extent();
    let (mut from, mut to) = (Vector3::zeros(), Vector3::zeros());
    for k in 0..3 {
        let (start, way) = (frame[k].dot(&sweep.start.coords), frame[k].dot(&sweep.way));
        let [below, above] = if k == 2 { [low, high] } else { [-radius, radius] };
        // The stock as seen along this direction.
        let middle = frame[k].dot(&stock.centre().coords);
        let half = 0.5 * frame[k].abs().dot(&(stock.max - stock.min));
        from[k] = (start + way.min(0.0) + below).max(middle - half);
        to[k] = (start + way.max(0.0) + above).min(middle + half);
        if from[k] > to[k] {
            return None;
        }
    }
    let middle = 0.5 * (from + to);
    let place = frame[0] * middle[0] + frame[1] * middle[1] + frame[2] * middle[2];
    Some((Point3::from(place), 0.5 * (to - from)))
}
