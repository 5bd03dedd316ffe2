//! Proof in the plane that a tool runs over ground that was cleared down to it: a wall of any height is its line.
//!
//! ```text
//!     │  before  │            A tool that grows no thinner upwards takes away all above its end. So nothing is in the way of
//!     │  ┌╌╌╌╌╌╌╌│╌╌┐         another at the same height or above, if discs of the ends that went before cover the disc of
//!     ╰──┼───────╯  ┊         its own end along its way: flat discs within the corners.
//!        ╰╌╌╌╌╌╌╌╌╌╌╯ now
//! ```
//!
//! A ball of radius `ρ` may stay. An end of radius `R` and corner `c`, less by `ρ`, has at the height `h` above its tip the disc
//! `R − c` swollen by `x(ρ) = √((c − ρ)² − (c − h)²)`. A tool that went before, less by its chord error and by how much it was higher
//! (`a`, together), has `x(a) ≥ x(ρ) + ρ − a`. So it is enough that discs of radii `R' − c + ρ − a` cover the disc `R − c` along
//! its way. Without a corner discs of `R' − a` are to cover that of `R − ρ`: the same with `ρ` for `c`.

use std::ops::ControlFlow;

use claymill_nurbs::{Aabb, Point3, Vector3};

use super::body::Shape;
use super::check::StockCheck;
use super::initial::BoxInStock;
use super::piece::Sweep;
use super::sweeps::{Step, Time};
use super::tool_bodies::{ToolBody, ToolPart};
use crate::across::across;

/// Squares looked at for one chord.
const MOST_SQUARES: u32 = 20_000;
/// Squares are not divided below this part of what may stay.
const SMALLEST: f64 = 0.15;
/// A flank may begin so little below the upper end of its corner, mm: both are grown by chord errors.
const FLANK_MM: f64 = 1e-3;
/// Flutes that went a little lower end this much lower, mm: links are lifted.
const LIFTED_MM: f64 = 1.0;
/// Axes that differ by less are one.
const SAME_AXIS: f64 = 1e-9;

/// The cylinder that the flutes of a tool hold, from its corner up to where they end, mm from the tip.
struct Flutes {
    radius_mm: f64,
    corner_mm: f64,
    top_mm: f64,
}

impl Flutes {
    /// `None` where they grow thinner upwards or have no flank.
    fn of(bodies: &[ToolBody]) -> Option<Self> {
        let mut corner_mm = 0.0;
        for body in bodies.iter().filter(|b| b.part == ToolPart::Flutes) {
            match body.shape {
                Shape::End { corner, .. } => corner_mm = corner,
                Shape::Frustum { high, radius, slope, .. } => {
                    return (slope >= 0.0).then_some(Flutes { radius_mm: radius, corner_mm, top_mm: high });
                }
            }
        }
        None
    }
}

/// What moves along a chord, as one column that ends in the lowest place of its way.
#[derive(Clone, Copy)]
struct Column {
    /// Ends of the way in the plane.
    way: [[f64; 2]; 2],
    /// Directions of the plane, and the axis.
    frame: [Vector3; 3],
    radius_mm: f64,
    corner_mm: f64,
    /// Heights along the axis, mm.
    low_mm: f64,
    high_mm: f64,
}

impl Column {
    /// Of bodies on one chord, as far up as there is stock; `None` where there is none.
    fn of(bodies: &[Sweep], stock: &Aabb) -> Option<Self> {
        let first = bodies.first()?;
        let axis = first.axis;
        let x = across(&axis);
        let frame = [x, axis.cross(&x), axis];
        let (start, end) = (first.start.coords, first.start.coords + first.way);
        let way = [start, end].map(|tip| [tip.dot(&frame[0]), tip.dot(&frame[1])]);
        let tip_mm = axis.dot(&start).min(axis.dot(&end));
        let highest_tip_mm = axis.dot(&start).max(axis.dot(&end));
        let top_mm = axis.dot(&stock.centre().coords) + 0.5 * axis.abs().dot(&(stock.max - stock.min));
        let mut column = Column {
            way,
            frame,
            radius_mm: 0.0,
            corner_mm: 0.0,
            low_mm: f64::INFINITY,
            high_mm: f64::NEG_INFINITY,
        };
        for body in bodies {
            let [low, high, radius] = body.shape.extent();
            if tip_mm + low >= top_mm {
                continue;
            }
            if tip_mm + low < column.low_mm {
                column.low_mm = tip_mm + low;
                column.corner_mm = if let Shape::End { corner, .. } = body.shape { corner } else { 0.0 };
            }
            column.high_mm = column.high_mm.max((highest_tip_mm + high).min(top_mm));
            column.radius_mm = column.radius_mm.max(radius);
        }
        // What begins beside the corner is not rounded by it.
        let beside = |body: &Sweep| {
            let foot_mm = tip_mm + body.shape.extent()[0];
            foot_mm > column.low_mm && foot_mm < column.low_mm + column.corner_mm - FLANK_MM
        };
        if bodies.iter().any(beside) {
            column.corner_mm = 0.0;
        }
        (column.radius_mm > 0.0).then_some(column)
    }

    fn flat(&self, p: &Point3) -> [f64; 2] {
        [p.coords.dot(&self.frame[0]), p.coords.dot(&self.frame[1])]
    }

    /// A box around a square of the plane between two heights.
    fn over(&self, square: &Square, heights_mm: [f64; 2]) -> Aabb {
        let [x, y, axis] = &self.frame;
        let corners = square.corners().into_iter();
        let all = corners.flat_map(|[u, v]| heights_mm.map(|h| Point3::from(x * u + y * v + axis * h)));
        all.fold(Aabb::empty(), |mut around, p| {
            around.add(&p);
            around
        })
    }
}

/// A square of the plane.
#[derive(Clone, Copy)]
struct Square {
    middle: [f64; 2],
    half: f64,
}

impl Square {
    fn corners(&self) -> [[f64; 2]; 4] {
        let ([u, v], h) = (self.middle, self.half);
        [[u - h, v - h], [u + h, v - h], [u - h, v + h], [u + h, v + h]]
    }

    fn quarters(&self) -> [Square; 4] {
        let half = 0.5 * self.half;
        Square { half, ..*self }.corners().map(|middle| Square { middle, half })
    }
}

/// All within a radius of a straight way.
#[derive(Clone, Copy)]
struct Capsule {
    way: [[f64; 2]; 2],
    radius: f64,
}

impl Capsule {
    /// Distance from its way.
    fn off(&self, [u, v]: [f64; 2]) -> f64 {
        let [[au, av], [bu, bv]] = self.way;
        let (du, dv, wu, wv) = (bu - au, bv - av, u - au, v - av);
        let square = (du * du + dv * dv).max(f64::MIN_POSITIVE);
        let s = ((wu * du + wv * dv) / square).clamp(0.0, 1.0);
        let (off_u, off_v) = (wu - s * du, wv - s * dv);
        (off_u * off_u + off_v * off_v).sqrt()
    }

    fn holds(&self, p: [f64; 2]) -> bool {
        self.off(p) <= self.radius
    }
}

impl StockCheck<'_> {
    /// Whether bodies of a move's tool on one of its chords are known to hold no ball of stock of a radius that is there before a
    /// time, because the ground below them was cleared.
    pub(super) fn is_over_cleared_ground(
        &self,
        of_move: usize,
        bodies: &[Sweep],
        before: Time,
        ball_mm: f64,
    ) -> bool {
        // Where the axis turns, each body has a way of its own.
        if self.flats[of_move].turn > 0.0 {
            return false;
        }
        let Some(column) = Column::of(bodies, &self.stock.bounds()) else { return true };
        let Some(flutes) = Flutes::of(&self.bodies[self.body_of_move[of_move]]) else { return false };
        // What went here before with the same tool took away no more than its flutes are long; what is above went earlier.
        let middle_mm = column.low_mm + flutes.top_mm - LIFTED_MM;
        if middle_mm <= column.low_mm || middle_mm >= column.high_mm {
            return self.is_swept(&column, before, ball_mm);
        }
        let below = Column { high_mm: middle_mm, ..column };
        let above = Column { low_mm: middle_mm, corner_mm: 0.0, ..column };
        self.is_swept(&below, before, ball_mm) && self.is_swept(&above, before, ball_mm)
    }

    /// Whether a column holds no ball of stock that is there before a time.
    fn is_swept(&self, column: &Column, before: Time, ball_mm: f64) -> bool {
        if column.corner_mm > 0.0 && column.corner_mm < ball_mm {
            return false;
        }
        let inset_mm = column.corner_mm.max(ball_mm);
        let own = Capsule { way: column.way, radius: column.radius_mm - inset_mm };
        if own.radius < 0.0 {
            return false;
        }
        let [[au, av], [bu, bv]] = own.way;
        let half = 0.5 * (bu - au).abs().max((bv - av).abs()) + own.radius;
        let mut open = vec![Square { middle: [0.5 * (au + bu), 0.5 * (av + bv)], half }];
        let mut held: Option<Capsule> = None;
        let height_mm = column.low_mm + inset_mm;
        for _ in 0..MOST_SQUARES {
            let Some(square) = open.pop() else { return true };
            let off = own.off(square.middle);
            if off - square.half * std::f64::consts::SQRT_2 > own.radius {
                continue;
            }
            let is_held = |by: &Capsule| square.corners().into_iter().all(|c| by.holds(c));
            if held.as_ref().is_some_and(is_held) {
                continue;
            }
            let mut is_middle_held = false;
            let mut holder = None;
            let middle = Square { half: 0.0, ..square };
            self.sweeps.around(&column.over(&middle, [height_mm; 2]), before, |piece, time| {
                let Some(by) = self.cleared(column, piece, time, [inset_mm, ball_mm]) else {
                    return ControlFlow::Continue(());
                };
                is_middle_held |= by.holds(square.middle);
                if is_held(&by) {
                    holder = Some(by);
                    return ControlFlow::Break(());
                }
                ControlFlow::Continue(())
            });
            if holder.is_some() {
                held = holder;
                continue;
            }
            let above = column.over(&square, [column.low_mm, column.high_mm]);
            if self.stock.over_box(&above) == BoxInStock::Outside {
                continue;
            }
            let is_bare = off <= own.radius && !is_middle_held && {
                let above = column.over(&middle, [column.low_mm, column.high_mm]);
                self.stock.over_box(&above) != BoxInStock::Outside
            };
            if is_bare || square.half < SMALLEST * ball_mm {
                return false;
            }
            open.extend(square.quarters());
        }
        false
    }

    /// What the tool of an earlier piece covers of the plane for a column.
    fn cleared(
        &self,
        column: &Column,
        piece: &Sweep,
        time: Time,
        [inset_mm, ball_mm]: [f64; 2],
    ) -> Option<Capsule> {
        let [_, _, axis] = &column.frame;
        if (piece.axis - axis).norm() > SAME_AXIS {
            return None;
        }
        let Step { of_move, .. } = self.sweeps.steps[time as usize];
        let (of_move, first) = (of_move as usize, self.sweeps.first_step[of_move as usize]);
        let flat = &self.flats[of_move];
        let tips = flat.chords[(time - first) as usize].tips;
        let flutes = Flutes::of(&self.bodies[self.body_of_move[of_move]])?;
        let heights_mm = tips.map(|tip| tip.coords.dot(axis));
        let highest_mm = heights_mm[0].max(heights_mm[1]);
        // A larger corner holds a smaller one only from above itself on.
        let is_round = flutes.corner_mm > column.corner_mm;
        let foot_mm = if is_round { highest_mm + flutes.corner_mm } else { highest_mm };
        let less_mm = flat.sag_mm + (foot_mm - column.low_mm).max(0.0);
        let top_mm = heights_mm[0].min(heights_mm[1]) + flutes.top_mm - flat.sag_mm;
        let disc_mm = flutes.radius_mm - inset_mm;
        if flat.turn > 0.0 || less_mm > ball_mm || top_mm < column.high_mm || disc_mm < 0.0 {
            return None;
        }
        Some(Capsule { way: tips.map(|tip| column.flat(&tip)), radius: disc_mm + ball_mm - less_mm })
    }
}
