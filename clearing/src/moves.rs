//! Strokes as moves: arcs become exact quadratic NURBS, and every stroke is approached, entered and left.
//!
//! ```text
//!   rapid ───────╮            ╭─────── rapid     above the stock
//!                │ lead-in    │ lead-out
//!                ╰── cut ─────┴── link ── cut    on the level
//! ```

use claymill_contact::Frame;
use claymill_nurbs::{Curve3, KnotVector, NurbsError, Point3};
use claymill_toolpath::{Move, MoveKind, round_to_written};

use crate::above::Above;
use crate::arcs::{ArcAbout, PathPiece};
use crate::area::{Approach, Stroke};

/// Links are lifted by this off the floor, mm.
const LIFT_MM: f64 = 0.3;
/// Rapids end this far above what was cut before, mm.
const GAP_MM: f64 = 1.0;
/// An arc of one rational piece is no longer than this, radians.
const LONGEST_ARC: f64 = 1.6;
/// A full turn of a helix has this many pieces.
const TURN_PIECES: usize = 4;
/// Turns of a helix at most.
const MOST_TURNS: f64 = 500.0;

/// Feeds, mm/min, and how steeply the tool may go down.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LevelFeeds {
    /// Along passes and links.
    pub cut_mm_per_min: f64,
    /// Down, and along leads.
    pub lead_mm_per_min: f64,
    /// Rapid rate.
    pub rapid_mm_per_min: f64,
    /// Slope of a helix, degrees.
    pub ramp_deg: f64,
}

/// The moves of one level, of which all above `above_mm` was cut before; rapids are at `clearance_mm` (setup coordinates).
///
/// # Errors
/// A piece is no curve.
pub fn level_moves(
    strokes: &[Stroke],
    [z_mm, above_mm, clearance_mm]: [f64; 3],
    frame: &Frame,
    feeds: LevelFeeds,
) -> Result<Vec<Move>, NurbsError> {
    let mut pen = Pen::new(frame, feeds, clearance_mm);
    pen.strokes(strokes, z_mm, &Above::flat(above_mm))?;
    Ok(pen.moves)
}

/// What moves are written with.
pub(crate) struct Pen<'a> {
    pub(crate) frame: &'a Frame,
    pub(crate) feeds: LevelFeeds,
    /// Height of rapids, mm.
    pub(crate) clearance_mm: f64,
    pub(crate) moves: Vec<Move>,
    /// Where the tool is, setup coordinates.
    at: Option<Point3>,
    pass: u32,
}

/// Whether a pass ends where it begins: exactly, since one that goes around a sliver and back comes as near as its width.
fn is_ring(pass: &[PathPiece]) -> bool {
    let ends = pass.first().zip(pass.last());
    ends.is_some_and(|(first, last)| first.from == last.to && pass.len() > 1)
}

impl<'a> Pen<'a> {
    pub(crate) fn new(frame: &'a Frame, feeds: LevelFeeds, clearance_mm: f64) -> Self {
        Pen { frame, feeds, clearance_mm, moves: Vec::new(), at: None, pass: 0 }
    }

    fn feed(&self, kind: MoveKind) -> f64 {
        match kind {
            MoveKind::Cut | MoveKind::Link => self.feeds.cut_mm_per_min,
            MoveKind::Rapid => self.feeds.rapid_mm_per_min,
            MoveKind::LeadIn | MoveKind::LeadOut => self.feeds.lead_mm_per_min,
        }
    }

    fn push(&mut self, moved: Move, to: Point3) {
        let seq = self.moves.len() as u64;
        self.moves.push(Move { seq, setup: self.frame.name.to_string(), pass: self.pass, ..moved });
        self.at = Some(to);
    }

    /// Straight to a place, if the tool is not there.
    fn straight(&mut self, kind: MoveKind, to: Point3) {
        self.straight_at(kind, to, self.feed(kind));
    }

    fn straight_at(&mut self, kind: MoveKind, to: Point3, feed: f64) {
        let Some(from) = self.at else {
            self.at = Some(to);
            return;
        };
        let [a, b] = [from, to].map(|p| self.frame.to_model(&p));
        if a.map(round_to_written) != b.map(round_to_written) {
            let moved = Move::straight(kind, a, b, self.frame.axis(), feed);
            self.push(moved, to);
        }
    }

    /// Along pieces, each with its height at both ends; arcs become one curve.
    fn along(
        &mut self,
        kind: MoveKind,
        pieces: &[(PathPiece, [f64; 2])],
        feed: f64,
    ) -> Result<(), NurbsError> {
        let (mut points, mut weights, mut knots) = (Vec::new(), Vec::new(), vec![0.0; 3]);
        let mut length = 0.0;
        let Some((first, [z, _])) = pieces.first() else { return Ok(()) };
        points.push(self.control([first.from[0], first.from[1], *z]));
        weights.push(1.0);
        let mut end = Point3::new(first.from[0], first.from[1], *z);
        for (piece, [from, to]) in pieces {
            let sweep = piece.arc.map_or(0.0, |arc: ArcAbout| arc.sweep);
            let count = (sweep.abs() / LONGEST_ARC).ceil().max(1.0) as usize;
            for k in 0..count {
                let share = |i: usize| i as f64 / count as f64;
                let height = |s: f64| from + s * (to - from);
                let ([a, b], step) = ([piece.at(share(k)), piece.at(share(k + 1))], sweep / count as f64);
                let (middle, weight) = match piece.arc {
                    None => ([0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1])], 1.0),
                    Some(arc) => {
                        let weight = (0.5 * step).cos();
                        let chord = [0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1])];
                        let out = |i: usize| arc.centre[i] + (chord[i] - arc.centre[i]) / (weight * weight);
                        ([out(0), out(1)], weight)
                    }
                };
                let b = if k + 1 == count { piece.to } else { b };
                let heights = [height(0.5 * (share(k) + share(k + 1))), height(share(k + 1))];
                points.push(self.control([middle[0], middle[1], heights[0]]));
                points.push(self.control([b[0], b[1], heights[1]]));
                weights.extend([weight, 1.0]);
                length = round_to_written(length + (piece.length_mm() / count as f64).max(2e-4));
                knots.extend([length; 2]);
                end = Point3::new(b[0], b[1], heights[1]);
            }
        }
        knots.push(length);
        let is_plain = weights.iter().all(|w: &f64| *w == 1.0);
        let curve = Curve3::new(KnotVector::new(2, knots)?, points, (!is_plain).then_some(weights))?;
        let moved = Move::along(kind, &curve, self.frame.axis(), feed);
        self.push(moved, end);
        Ok(())
    }

    fn control(&self, [x, y, z]: [f64; 3]) -> Point3 {
        self.frame.to_model(&Point3::new(x, y, z)).map(round_to_written)
    }

    /// On a level. Leads go on as fast as the pass: they keep to its engagement.
    fn level(&mut self, kind: MoveKind, pieces: &[PathPiece], z: f64) -> Result<(), NurbsError> {
        let feed = self.feeds.cut_mm_per_min;
        for piece in pieces {
            match piece.arc {
                None => self.straight_at(kind, Point3::new(piece.to[0], piece.to[1], z), feed),
                Some(_) => self.along(kind, &[(*piece, [z, z])], feed)?,
            }
        }
        Ok(())
    }

    /// The height above which nothing is met where the tool is.
    fn here(&self, above: &Above) -> f64 {
        self.at.map_or(above.cut_mm, |at| above.over(&[[at.x, at.y]]))
    }

    /// Up to the height of rapids.
    fn lift(&mut self, above_mm: f64) {
        if let Some(at) = self.at.filter(|at| at.z < self.clearance_mm) {
            self.straight(MoveKind::LeadOut, Point3::new(at.x, at.y, (above_mm + GAP_MM).max(at.z)));
            self.straight(MoveKind::Rapid, Point3::new(at.x, at.y, self.clearance_mm));
        }
    }

    /// Up to just below the height of rapids, at the feed of leads.
    fn rise(&mut self) {
        if let Some(at) = self.at {
            let top_mm = self.clearance_mm - GAP_MM;
            self.straight(MoveKind::LeadOut, Point3::new(at.x, at.y, top_mm.max(at.z)));
        }
    }

    /// Over a place, and down to just above what was cut before.
    fn come_over(&mut self, [x, y]: [f64; 2], above_mm: f64) {
        self.lift(above_mm);
        self.straight(MoveKind::Rapid, Point3::new(x, y, self.clearance_mm));
        self.straight(MoveKind::Rapid, Point3::new(x, y, (above_mm + GAP_MM).min(self.clearance_mm)));
    }

    /// The strokes of a level.
    pub(crate) fn strokes(&mut self, strokes: &[Stroke], z: f64, above: &Above) -> Result<(), NurbsError> {
        for stroke in strokes {
            self.pass += 1;
            let above_mm = above.of_stroke(stroke).max(self.here(above));
            let first = stroke.lead_in.first().or(stroke.cut.first());
            let is_passed = matches!(stroke.approach, Approach::Along | Approach::Over);
            if is_passed && stroke.lead_in.is_empty() && is_ring(&stroke.cut) && z < above_mm {
                self.ramp(&stroke.cut, [z, above_mm], 0)?;
                self.level(MoveKind::Cut, &stroke.cut, z)?;
                self.rise();
                continue;
            }
            match stroke.approach {
                Approach::Helix { centre, radius_mm } => {
                    self.enter(centre, radius_mm, z, above_mm)?;
                    continue;
                }
                Approach::Ramp => {
                    self.ramp(&stroke.cut, [z, above_mm], 1)?;
                    continue;
                }
                Approach::Along => {
                    if let (Some(at), Some(first)) = (self.at, first) {
                        self.straight(MoveKind::Link, Point3::new(at.x, at.y, z + LIFT_MM));
                        for [x, y] in stroke.via.iter().chain([&first.from]) {
                            self.straight(MoveKind::Link, Point3::new(*x, *y, z + LIFT_MM));
                        }
                        self.straight(MoveKind::Link, Point3::new(first.from[0], first.from[1], z));
                    }
                }
                Approach::Over => {
                    if let Some(first) = first {
                        self.come_over(first.from, above_mm);
                        self.straight(MoveKind::LeadIn, Point3::new(first.from[0], first.from[1], z));
                    }
                }
            }
            self.level(MoveKind::LeadIn, &stroke.lead_in, z)?;
            self.level(MoveKind::Cut, &stroke.cut, z)?;
            self.level(MoveKind::LeadOut, &stroke.lead_out, z)?;
        }
        self.lift(self.here(above));
        Ok(())
    }

    /// Down along a ring into which no circle leads: straight down, the tool would plunge into what the ring is to cut. It ends with
    /// turns on the level.
    fn ramp(
        &mut self,
        ring: &[PathPiece],
        [z, above_mm]: [f64; 2],
        turns_on_level: usize,
    ) -> Result<(), NurbsError> {
        let Some(first) = ring.first() else { return Ok(()) };
        // A ring may run along a wall, beside which no rapid does.
        self.lift(above_mm);
        // A program begins with a rapid, if only for a little.
        self.come_over(first.from, self.clearance_mm - 2.0 * GAP_MM);
        self.straight(MoveKind::LeadIn, Point3::new(first.from[0], first.from[1], above_mm.max(z)));
        let length_mm: f64 = ring.iter().map(PathPiece::length_mm).sum();
        let (deep_mm, slope) = ((above_mm - z).max(0.0), self.feeds.ramp_deg.to_radians().tan());
        let rounds = (deep_mm / (slope * length_mm).max(f64::MIN_POSITIVE)).ceil().clamp(1.0, MOST_TURNS);
        let mut run_mm = 0.0;
        let mut pieces = Vec::new();
        for piece in (0..rounds as usize).flat_map(|_| ring) {
            let height = |run_mm: f64| (z + deep_mm * (1.0 - run_mm / (rounds * length_mm))).max(z);
            let from = height(run_mm);
            run_mm += piece.length_mm();
            pieces.push((*piece, [from, height(run_mm)]));
        }
        if let Some((_, [_, last])) = pieces.last_mut() {
            *last = z;
        }
        pieces.extend((0..turns_on_level).flat_map(|_| ring).map(|piece| (*piece, [z; 2])));
        self.along(MoveKind::LeadIn, &pieces, self.feeds.lead_mm_per_min)
    }

    /// Down on a helix that ends with a turn on the level, or straight down.
    fn enter(&mut self, centre: [f64; 2], radius_mm: f64, z: f64, above_mm: f64) -> Result<(), NurbsError> {
        let start = [centre[0] + radius_mm, centre[1]];
        self.come_over(start, above_mm);
        if radius_mm <= 0.0 {
            self.straight(MoveKind::LeadIn, Point3::new(start[0], start[1], z));
            return Ok(());
        }
        self.straight(MoveKind::LeadIn, Point3::new(start[0], start[1], above_mm.max(z)));
        let pitch_mm = std::f64::consts::TAU * radius_mm * self.feeds.ramp_deg.to_radians().tan();
        let turns = ((above_mm - z).max(0.0) / pitch_mm).ceil().clamp(1.0, MOST_TURNS) as usize;
        let corner = |k: usize| {
            let (sine, cosine) =
                (std::f64::consts::TAU * (k % TURN_PIECES) as f64 / TURN_PIECES as f64).sin_cos();
            [centre[0] + radius_mm * cosine, centre[1] + radius_mm * sine]
        };
        let down = turns * TURN_PIECES;
        let height = |k: usize| z + (above_mm - z).max(0.0) * (1.0 - k.min(down) as f64 / down as f64);
        let sweep = std::f64::consts::TAU / TURN_PIECES as f64;
        let pieces: Vec<(PathPiece, [f64; 2])> = (0..down + TURN_PIECES)
            .map(|k| {
                let arc = Some(ArcAbout { centre, sweep });
                (PathPiece { from: corner(k), to: corner(k + 1), arc }, [height(k), height(k + 1)])
            })
            .collect();
        self.along(MoveKind::LeadIn, &pieces, self.feeds.lead_mm_per_min)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A tool would be ramped down along a sliver of a few micrometres, thousands of times to and fro.
    #[test]
    fn a_pass_around_a_sliver_is_no_ring() {
        let way =
            |end: [f64; 2]| [PathPiece::line([0.0, 0.0], [0.06, 0.08]), PathPiece::line([0.06, 0.08], end)];
        assert!(is_ring(&way([0.0, 0.0])));
        assert!(!is_ring(&way([2e-5, 0.0])));
    }
}
