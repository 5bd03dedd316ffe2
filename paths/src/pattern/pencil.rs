//! Pencil passes: along the valleys in which the ball touches on both sides.
//!
//! ```text
//!    \   ___   /
//!     \ /   \ /       Across a valley the heights of the ball have a corner: left of it one side
//!      X     X        carries the ball, right of it the other.
//!       \___/
//! ```
//!
//! Corners on two families of coarse rows are where valleys are looked for; from each a valley is followed both ways,
//! by corners on short lines across it.

use std::collections::{BTreeMap, BTreeSet};

use claymill_nurbs::{FaceId, Point2};
use nalgebra::Vector2;
use rayon::prelude::*;

use crate::RowsAlong;
use crate::curve::drive::{DriveCurve, Line};
use crate::curve::plan_curve::within;
use crate::follow::profile::{Chain, Sample, follow};
use crate::follow::proofs::Proofs;
use crate::pattern::rows::crests::PlannedPass;
use crate::pattern::rows::raster::{Patch, Row};
use crate::setup::context::SetupContext;

/// Sides that part by less than this make no valley, degrees; and half of that is enough to look closer, for a row may
/// cross a valley aslant.
const SHALLOWEST_DEG: f64 = 15.0;
/// Rows on which valleys are looked for are so many flat step-overs apart, and go so far beyond what is cut, mm.
const APART: f64 = 2.0;
const BEYOND_MM: f64 = 2.0;
/// Corners this close together are one, mm.
const ONE_CORNER_MM: f64 = 0.05;
/// Steps along a valley, mm, and how much its direction may change in one, radians.
const STEP_MM: f64 = 2.0;
const LEAST_STEP_MM: f64 = 0.1;
const BEND: f64 = 0.2;
/// Lines across reach to both sides this share of a step, and at least so far, mm.
const ACROSS: f64 = 0.5;
const LEAST_ACROSS_MM: f64 = 0.3;
/// A place this near to a valley is in it, mm.
const SAME_MM: f64 = 0.5;
/// Shorter valleys have no pass, mm; nor do longer ones go on for ever.
const SHORTEST_MM: f64 = 3.0;
const MOST_STEPS: usize = 100_000;
/// Passes run this close to the bottom, mm.
const BESIDE_MM: f64 = 1e-3;

/// Where the ball touches two sides.
#[derive(Debug, Clone, Copy)]
struct Corner {
    s: f64,
    turn_deg: f64,
    /// The face of least number of the two, where one is known.
    face: Option<FaceId>,
}

/// Valleys that were followed, by cells of [`SAME_MM`].
#[derive(Default)]
struct Known(BTreeMap<[i64; 2], Vec<Point2>>);

impl Known {
    fn cell(p: &Point2) -> [i64; 2] {
        [p.x, p.y].map(|c| (c / SAME_MM).floor() as i64)
    }

    fn add(&mut self, p: Point2) {
        self.0.entry(Known::cell(&p)).or_default().push(p);
    }

    fn holds(&self, p: &Point2) -> bool {
        let [i, j] = Known::cell(p);
        let around = (-1..=1).flat_map(|a| (-1..=1).map(move |b| [i + a, j + b]));
        around.filter_map(|c| self.0.get(&c)).flatten().any(|q| (p - q).norm() < SAME_MM)
    }
}

/// What follows the valleys of a part.
struct Pencil<'a, 'c> {
    context: &'a SetupContext<'c>,
    faces: BTreeSet<usize>,
}

impl SetupContext<'_> {
    /// The valleys of the part made of `faces`, and how many locations rest on a proven bound.
    pub(crate) fn valleys(&self, faces: &[usize]) -> (Vec<PlannedPass>, Proofs) {
        let pencil = Pencil { context: self, faces: faces.iter().copied().collect() };
        let mut known = Known::default();
        let mut valleys: Vec<Vec<Point2>> = Vec::new();
        for (seed, across) in pencil.seeds(faces) {
            if known.holds(&seed) {
                continue;
            }
            let valley = pencil.valley(seed, across, &known);
            let along: f64 = valley.windows(2).map(|w| (w[1] - w[0]).norm()).sum();
            valley.iter().for_each(|p| known.add(*p));
            if along >= SHORTEST_MM {
                valleys.push(valley);
            }
        }
        let lay = |valley: &Vec<Point2>| -> Vec<(PlannedPass, Proofs)> {
            let drawn = within(valley, BESIDE_MM).into_iter();
            let laid = drawn.map(|drawn| {
                let end = drawn.at[drawn.at.len() - 1].1;
                let found = follow(self.ball, &drawn.drive, 0.0, end);
                let (proofs, planned) = (found.proofs, vec![(0.0, end)]);
                let chains = self.kept(found.passes(self.shortest_pass_mm(), |_| true), &drawn.drive);
                (PlannedPass { q: 0.0, drive: drawn.drive, planned, chains, fresh: false }, proofs)
            });
            laid.collect()
        };
        let laid: Vec<(PlannedPass, Proofs)> = valleys.par_iter().flat_map_iter(lay).collect();
        let proofs = laid.iter().map(|l| l.1).sum();
        (laid.into_iter().map(|l| l.0).filter(|l| !l.chains.is_empty()).collect(), proofs)
    }
}

impl Pencil<'_, '_> {
    /// Places in valleys, each with the direction of the row that crosses there.
    fn seeds(&self, faces: &[usize]) -> Vec<(Point2, Vector2<f64>)> {
        let context = self.context;
        let apart_mm = APART * context.flat_step_mm();
        let cuts = context.cuts(faces, |_, _| true);
        let mut seeds = Vec::new();
        for deg in [0.0, 90.0] {
            let along = RowsAlong::at_deg(deg);
            let apart = |patch: Patch| Patch { distance_mm: apart_mm, ..patch };
            let patches: Vec<Patch> = context.patches(&cuts, along).into_iter().map(apart).collect();
            let Some(raster) = context.raster(&patches) else { continue };
            let rows = raster.rows();
            let on_row = |row: &Row| {
                let line = Line { origin: along.at([0.0, row.q]), direction: along.unit() };
                let mut found = Vec::new();
                for &(s0, s1) in &row.stretches {
                    let corners = self.corners(line, s0 - BEYOND_MM, s1 + BEYOND_MM);
                    let deep = corners.into_iter().filter(|c| c.turn_deg >= 0.5 * SHALLOWEST_DEG);
                    found.extend(deep.map(|c| (place(&line, c.s), Vector2::from(line.direction))));
                }
                found
            };
            seeds.par_extend(rows.par_iter().flat_map_iter(on_row));
        }
        seeds
    }

    /// The corners in which the ball touches two sides.
    fn corners(&self, line: Line, s0: f64, s1: f64) -> Vec<Corner> {
        let chains = follow(self.context.ball, &DriveCurve::Straight(line), s0, s1).chains;
        let mut corners: Vec<Corner> = Vec::new();
        for corner in chains.iter().flat_map(corners_of) {
            match corners.last_mut() {
                Some(last) if corner.s - last.s < ONE_CORNER_MM => {
                    last.turn_deg += corner.turn_deg;
                    last.face = [last.face, corner.face].into_iter().flatten().min();
                }
                _ => corners.push(corner),
            }
        }
        corners
    }

    /// The place in a valley of the part nearest to `centre` on a line across.
    fn bottom(&self, centre: Point2, across: Vector2<f64>, reach_mm: f64) -> Option<Point2> {
        let origin = centre - across * reach_mm;
        let line = Line { origin: [origin.x, origin.y], direction: [across.x, across.y] };
        let mut corners = self.corners(line, 0.0, 2.0 * reach_mm);
        corners.retain(|c| c.turn_deg >= SHALLOWEST_DEG && c.face.is_some_and(|f| self.is_cut(f)));
        let off = |c: &Corner| (c.s - reach_mm).abs();
        corners.iter().min_by(|a, b| off(a).total_cmp(&off(b))).map(|c| place(&line, c.s))
    }

    fn is_cut(&self, face: FaceId) -> bool {
        self.faces.contains(&face) && self.context.claims.any(face)
    }

    /// A valley from end to end, followed both ways from a place in it.
    fn valley(&self, seed: Point2, crossing: Vector2<f64>, known: &Known) -> Vec<Point2> {
        let aside = Vector2::new(-crossing.y, crossing.x);
        let way = |sign: f64| -> Vec<Point2> {
            let Some(next) = self.bottom(seed + aside * (sign * LEAST_ACROSS_MM), crossing, STEP_MM) else {
                return Vec::new();
            };
            (next - seed).try_normalize(0.0).map_or_else(Vec::new, |along| self.onward(seed, along, known))
        };
        let mut ahead = way(1.0);
        let closed = ahead.last().is_some_and(|end| *end == seed);
        let mut valley = if closed { Vec::new() } else { way(-1.0) };
        valley.reverse();
        valley.push(seed);
        valley.append(&mut ahead);
        valley
    }

    /// The places of a valley after `start`, until it ends, closes or meets another one.
    fn onward(&self, start: Point2, mut along: Vector2<f64>, known: &Known) -> Vec<Point2> {
        let (mut places, mut here, mut step_mm) = (Vec::new(), start, 0.5 * STEP_MM);
        while places.len() < MOST_STEPS {
            let across = Vector2::new(-along.y, along.x);
            let reach_mm = (ACROSS * step_mm).max(LEAST_ACROSS_MM);
            let found = self.bottom(here + along * step_mm, across, reach_mm).and_then(|next| {
                let way = (next - here).try_normalize(LEAST_STEP_MM * 0.5)?;
                (way.angle(&along) < BEND).then_some((next, way))
            });
            let Some((next, way)) = found else {
                step_mm *= 0.5;
                if step_mm < LEAST_STEP_MM {
                    break;
                }
                continue;
            };
            if places.len() > 2 && (next - start).norm() < step_mm {
                places.push(start);
                break;
            }
            places.push(next);
            if known.holds(&next) {
                break;
            }
            // The chord's direction is that of the valley halfway.
            along = (way * 2.0 - along).try_normalize(0.0).unwrap_or(way);
            (here, step_mm) = (next, (1.5 * step_mm).min(STEP_MM));
        }
        places
    }
}

fn place(line: &Line, s: f64) -> Point2 {
    Point2::from([0, 1].map(|k| line.origin[k] + s * line.direction[k]))
}

/// The corners of a chain in which the ball goes down and then up, seen from the chord between both sides.
fn corners_of(chain: &Chain) -> impl Iterator<Item = Corner> {
    let touched = |sample: &Sample| sample.face;
    chain.windows(2).map(move |two| {
        let (before, after) = (&two[0], &two[1]);
        let turn = after.start().slope.atan() - before.end().slope.atan();
        let sides = [before.samples.iter().rev().find_map(touched), after.samples.iter().find_map(touched)];
        Corner { s: after.start().s, turn_deg: turn.to_degrees(), face: sides.into_iter().flatten().min() }
    })
}
