//! All that the tools of a program sweep while they cut, as convex pieces with times in a tree, and
//! the time at which a point was cut.

use std::ops::ControlFlow;

use claymill_nurbs::{Aabb, Point3, Vector3, outward};
use claymill_toolpath::{Move, MoveKind};
use rayon::prelude::*;

use super::body::Shape;
use super::error::{KeepGoing, StockError};
use super::flatten::{Chord, Flat};
use super::piece::Sweep;
use super::tool_bodies::{ToolBody, ToolPart};
use super::tree::Tree;

/// A program comes to no more pieces than this.
const MOST_PIECES: usize = 100_000_000;

/// Exits that differ by less are one, mm.
const BESIDE_MM: f64 = 1e-9;

/// A moment of a program: the number of a chord, counted through all moves in their order.
pub type Time = u32;

/// What a chord is of.
#[derive(Debug, Clone, Copy)]
pub(super) struct Step {
    /// Index of the move.
    pub(super) of_move: u32,
    /// The move's parameters at both ends.
    pub(super) parameters: [f64; 2],
}

/// A swept body, small: axis and shape are kept once.
#[derive(Debug, Clone, Copy)]
struct Piece {
    start: Point3,
    way: Vector3,
    axis: u32,
    shape: u32,
    time: Time,
}

/// The cutting sweeps of a program.
#[derive(Debug, Default)]
pub(super) struct Sweeps {
    pieces: Vec<Piece>,
    axes: Vec<Vector3>,
    shapes: Vec<Shape>,
    tree: Tree,
    pub(super) steps: Vec<Step>,
    /// First step of every move, and one more.
    pub(super) first_step: Vec<Time>,
}

/// A body at a chord with what the flattening may hide.
#[derive(Debug, Clone, Copy)]
pub(super) struct Moved {
    pub(super) part: ToolPart,
    pub(super) sweep: Sweep,
}

/// The bodies of a tool along a chord: shrunk by what flattening hides where `cutting`, else grown by it.
pub(super) fn moved<'a>(
    flat: &'a Flat,
    chord: &'a Chord,
    bodies: &'a [ToolBody],
    cutting: bool,
) -> impl Iterator<Item = Moved> + 'a {
    bodies.iter().filter_map(move |body| {
        let [a, b] = chord.axes;
        let axis = if a == b { a } else { (a + b).normalize() };
        let [mut start, mut end] = chord.tips;
        let mut shape = body.shape;
        let mut hidden = flat.sag_mm;
        if flat.turn > 0.0 {
            if let (Shape::End { disc: 0.0, centre, .. }, false) = (shape, flat.is_rational) {
                // The middle of a ball moves on a path of its own, and no turn of the axis changes the ball.
                // Blending the axis leaves it within 0.6 turn² of its chord at equal parameters.
                hidden += 0.6 * flat.turn * flat.turn * centre;
                start += a * centre - axis * centre;
                end += b * centre - axis * centre;
            } else {
                hidden += 0.5 * flat.turn * shape.reach();
            }
        }
        if hidden > 0.0 {
            shape = shape.grown(if cutting { -hidden } else { hidden })?;
        }
        Some(Moved { part: body.part, sweep: Sweep { start, way: end - start, axis, shape } })
    })
}

impl Sweeps {
    /// Of all moves that cut: every kind but rapids. `bodies` are those of the move's tool.
    pub(super) fn new(
        moves: &[Move],
        flats: &[Flat],
        bodies: &[&[ToolBody]],
        keep_going: KeepGoing<'_>,
    ) -> Result<Self, StockError> {
        let mut first_step = vec![0];
        let mut steps = Vec::new();
        for (k, flat) in flats.iter().enumerate() {
            steps.extend(flat.chords.iter().map(|c| Step { of_move: k as u32, parameters: c.parameters }));
            first_step.push(steps.len() as Time);
        }
        if steps.len() > MOST_PIECES {
            return Err(StockError::TooManyPieces { limit: MOST_PIECES });
        }
        let (mut pieces, mut axes, mut shapes): (Vec<Piece>, Vec<Vector3>, Vec<Shape>) = Default::default();
        for (k, flat) in flats.iter().enumerate().filter(|(k, _)| moves[*k].kind != MoveKind::Rapid) {
            if !keep_going() {
                return Err(StockError::Stopped);
            }
            let known = shapes.len().saturating_sub(8);
            for (j, chord) in flat.chords.iter().enumerate() {
                let cutters = bodies[k].iter().filter(|b| b.part == ToolPart::Flutes).count();
                for Moved { sweep, .. } in moved(flat, chord, &bodies[k][..cutters], true) {
                    if axes.last() != Some(&sweep.axis) {
                        axes.push(sweep.axis);
                    }
                    // Shapes of this move, or those that the move before has had too.
                    let shape = (known..shapes.len()).find(|&i| shapes[i] == sweep.shape);
                    let shape = shape.unwrap_or_else(|| {
                        shapes.push(sweep.shape);
                        shapes.len() - 1
                    });
                    pieces.push(Piece {
                        start: sweep.start,
                        way: sweep.way,
                        axis: (axes.len() - 1) as u32,
                        shape: shape as u32,
                        time: first_step[k] + j as Time,
                    });
                }
            }
            if pieces.len() > MOST_PIECES {
                return Err(StockError::TooManyPieces { limit: MOST_PIECES });
            }
        }
        let mut sweeps = Sweeps { pieces, axes, shapes, tree: Tree::default(), steps, first_step };
        let boxes: Vec<Aabb> =
            (0..sweeps.pieces.len()).into_par_iter().map(|i| sweeps.piece(i).bounds()).collect();
        let times: Vec<Time> = sweeps.pieces.iter().map(|p| p.time).collect();
        let (tree, order) = Tree::new(&boxes, &times);
        sweeps.pieces = order.par_iter().map(|&i| sweeps.pieces[i as usize]).collect();
        sweeps.tree = tree;
        Ok(sweeps)
    }

    /// Convex pieces.
    pub(super) fn count(&self) -> usize {
        self.pieces.len()
    }

    /// Bytes in memory.
    pub(super) fn bytes(&self) -> usize {
        self.tree.bytes()
            + self.pieces.len() * size_of::<Piece>()
            + self.steps.len() * size_of::<Step>()
            + self.axes.len() * size_of::<Vector3>()
    }

    pub(super) fn piece(&self, i: usize) -> Sweep {
        let p = &self.pieces[i];
        let (axis, shape) = (self.axes[p.axis as usize], self.shapes[p.shape as usize]);
        Sweep { start: p.start, way: p.way, axis, shape }
    }

    #[cfg(test)]
    pub(super) fn time_of_piece(&self, i: usize) -> Time {
        self.pieces[i].time
    }

    /// The earliest time before another at which a piece holds a point.
    pub(super) fn cut_before(&self, p: &Point3, before: Time) -> Option<Time> {
        self.tree.earliest(&Aabb { min: *p, max: *p }, before, |i| self.piece(i).holds(p))
    }

    /// The earliest time of a piece that holds a whole box; being convex it does if it holds the corners.
    pub(super) fn held_at(&self, b: &Aabb) -> Option<Time> {
        let corner = |n: usize| {
            let side = |k: usize| if n >> k & 1 == 0 { b.min[k] } else { b.max[k] };
            Point3::new(side(0), side(1), side(2))
        };
        self.tree.earliest(b, Time::MAX, |i| {
            let piece = self.piece(i);
            (0..8).all(|n| piece.holds(&corner(n)))
        })
    }

    /// The least signed distance of a point from a piece before a time, at most the larger limit; one below the smaller will do.
    pub(super) fn signed_before(&self, p: &Point3, before: Time, limits: [f64; 2]) -> f64 {
        self.tree.least(p, limits, before, |i| self.piece(i).signed_mm(p)).map_or(limits[1], |found| found.0)
    }

    /// A box around all pieces.
    pub(super) fn bounds(&self) -> Aabb {
        self.tree.bounds()
    }

    /// Calls `found` for pieces before a time whose box holds a whole box, with their times.
    pub(super) fn around(
        &self,
        b: &Aabb,
        before: Time,
        mut found: impl FnMut(&Sweep, Time) -> ControlFlow<()>,
    ) {
        let sides = [0, 1, 2].map(|k| [b.min[k] as f32, b.max[k] as f32]);
        let place = [sides.map(|s| s[0]), sides.map(|s| s[1])];
        self.tree.visit(before, |node| node.hold(place), |i| found(&self.piece(i), self.pieces[i].time));
    }

    /// How far down the line `p + t·n` has been cut at least, from a place of it: the least exit of pieces that hold that place;
    /// `None` where none does.
    pub(super) fn cut_down_to(&self, p: &Point3, n: &Vector3, from: f64, low: f64) -> Option<f64> {
        let q = p + n * from;
        let sides = [0, 1, 2].map(|k| outward([q[k], q[k]]));
        let place = [sides.map(|s| s[1]), sides.map(|s| s[0])];
        let mut down: Option<f64> = None;
        self.tree.visit(
            Time::MAX,
            |node| node.hold(place),
            |i| {
                let piece = self.piece(i);
                // Being convex, a piece that holds both places holds all between.
                if piece.holds(&q) && down.is_none_or(|t| piece.holds(&(p + n * (t - BESIDE_MM).max(low)))) {
                    let known = down.map_or(from, |t| (t - BESIDE_MM).max(low));
                    down = Some(piece.exit(p, n, known, low));
                }
                if down == Some(low) { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
            },
        );
        down
    }
}
