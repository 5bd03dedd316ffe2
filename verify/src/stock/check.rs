//! A program's moves on its initial stock, ready to be asked.

use std::collections::BTreeMap;

use claymill_nurbs::{Aabb, Point3, Vector3};
use claymill_toolpath::{Move, MoveKind, ToolRecord};
use rayon::prelude::*;

use super::body::Shape;
use super::cells::Cells;
use super::engagement::{Engagement, Pose, engagement};
use super::error::{KeepGoing, StockError};
use super::flatten::{Chord, Flat, flatten};
use super::initial::InitialStock;
use super::left::{Thickness, thickness};
use super::level_engagement::Told;
use super::options::StockOptions;
use super::piece::Sweep;
use super::proof::depth;
use super::report::{StockHit, StockProof, StockVolumes};
use super::sweeps::{Moved, Step, Sweeps, Time, moved};
use super::tool_bodies::{ToolBody, ToolPart, bodies_of};
use super::volume::{VolumeEstimate, volumes};
use crate::across::across;
use crate::report::Place;

/// The stock of a program at all times: the initial stock less what was swept before.
///
/// ```
/// use claymill_nurbs::{Point3, Vector3};
/// use claymill_toolpath::{Move, MoveKind, Tool, ToolRecord};
/// use claymill_verify::stock::{InitialStock, StockCheck, StockOptions, StockProof};
/// let stock = InitialStock::block(Point3::origin(), Point3::new(100.0, 60.0, 20.0))?;
/// let flat: Tool = "flat:5".parse().unwrap();
/// let tool = ToolRecord { id: "T1".into(), tool: flat, holder: None, setup_stick_out_mm: Default::default() };
/// let straight = |kind, a: [f64; 3], b: [f64; 3]| Move {
///     tool: "T1".into(),
///     ..Move::straight(kind, a.into(), b.into(), Vector3::z(), 1000.0)
/// };
/// let slot = straight(MoveKind::Cut, [-10.0, 30.0, 12.0], [110.0, 30.0, 12.0]);
/// let back = straight(MoveKind::Rapid, [110.0, 30.0, 12.0], [-10.0, 30.0, 12.0]);
/// let moves = [slot, back];
/// let check = StockCheck::new(stock, &moves, &[tool], &StockOptions::default(), &|| true)?;
/// assert_eq!(check.rapid_is_clear(1, check.time_of(1)?)?, StockProof::Clear);
/// assert!(matches!(check.rapid_is_clear(1, 0)?, StockProof::Hit(_)));
/// # Ok::<(), claymill_verify::stock::StockError>(())
/// ```
#[derive(Debug)]
pub struct StockCheck<'a> {
    pub(super) stock: InitialStock<'a>,
    pub(super) moves: &'a [Move],
    pub(super) flats: Vec<Flat>,
    pub(super) bodies: Vec<Vec<ToolBody>>,
    /// For every move the number of its tool's bodies.
    pub(super) body_of_move: Vec<usize>,
    pub(super) sweeps: Sweeps,
    cells: Cells,
    pub(super) options: StockOptions,
}

/// Of a place that was cut it is enough to know that all is within this share of a limit.
const DEEP: f64 = 0.1;

/// Ways in which a holder is moved aside to see what is near it.
const WAYS: u32 = 8;

/// When a point was cut.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cut {
    /// The moment.
    pub time: Time,
    /// Index of the move.
    pub of_move: usize,
    /// The move's parameters at the ends of the chord.
    pub parameters: [f64; 2],
}

impl<'a> StockCheck<'a> {
    /// Takes the moves of a program in their order. `tools` are those of the job; a holder sticks out as the move's setup has it.
    ///
    /// # Errors
    /// A move is not a curve, turns too far or names a tool that is not given; a size is absurd; too many pieces; stopped.
    pub fn new(
        stock: InitialStock<'a>,
        moves: &'a [Move],
        tools: &[ToolRecord],
        options: &StockOptions,
        keep_going: KeepGoing<'_>,
    ) -> Result<Self, StockError> {
        let mut keys: BTreeMap<(&str, &str), (usize, f64)> = BTreeMap::new();
        let mut records = Vec::new();
        let mut body_of_move = Vec::with_capacity(moves.len());
        let bounds = stock.bounds();
        for m in moves {
            let record = tools.iter().find(|t| t.id == m.tool);
            let unknown = || StockError::UnknownTool { seq: m.seq, tool: m.tool.clone() };
            let record = record.ok_or_else(unknown)?;
            let (number, above) = keys.entry((&m.tool, &m.setup)).or_insert_with(|| {
                records.push(record.in_setup(&m.setup));
                (records.len() - 1, 0.0)
            });
            *above = f64::max(*above, height_of(&bounds, m));
            body_of_move.push(*number);
        }
        let mut bodies = vec![Vec::new(); records.len()];
        for (number, above) in keys.values() {
            bodies[*number] = bodies_of(&records[*number], *above)?;
        }
        StockCheck::with_bodies(stock, moves, bodies, body_of_move, options, keep_going)
    }

    /// The same with bodies of any kind.
    pub(super) fn with_bodies(
        stock: InitialStock<'a>,
        moves: &'a [Move],
        bodies: Vec<Vec<ToolBody>>,
        body_of_move: Vec<usize>,
        options: &StockOptions,
        keep_going: KeepGoing<'_>,
    ) -> Result<Self, StockError> {
        let options = options.checked()?.clone();
        let reach = |k: usize| bodies[k].iter().map(|b| b.shape.reach()).fold(1.0, f64::max);
        let flats = moves
            .par_iter()
            .zip(&body_of_move)
            .map(|(m, &k)| {
                let turn = 2.0 * options.turn_mm / reach(k);
                if keep_going() { flatten(m, options.chord_mm, turn) } else { Err(StockError::Stopped) }
            })
            .collect::<Result<Vec<_>, _>>()?;
        let of_moves: Vec<&[ToolBody]> = body_of_move.iter().map(|&k| &bodies[k][..]).collect();
        let sweeps = Sweeps::new(moves, &flats, &of_moves, keep_going)?;
        let cells = Cells::over(&stock.bounds());
        Ok(StockCheck { stock, moves, flats, bodies, body_of_move, sweeps, cells, options })
    }

    /// The initial stock.
    #[must_use]
    pub fn initial(&self) -> &InitialStock<'a> {
        &self.stock
    }

    /// Convex pieces of the cutting sweeps, and the bytes that they and their tree take.
    #[must_use]
    pub fn pieces(&self) -> (usize, usize) {
        (self.sweeps.count(), self.sweeps.bytes())
    }

    /// The moment at which a move begins.
    ///
    /// # Errors
    /// No such move.
    pub fn time_of(&self, of_move: usize) -> Result<Time, StockError> {
        self.sweeps.first_step.get(of_move).copied().ok_or(StockError::NoMove(of_move))
    }

    /// The earliest time at which a piece holds the point, whether it was stock or not; `None` if it was never cut. The surface of a
    /// piece counts as cut; curved moves cut less by at most the chord error.
    #[must_use]
    pub fn cut_at(&self, p: &Point3) -> Option<Cut> {
        let time = self.sweeps.cut_before(p, Time::MAX)?;
        let Step { of_move, parameters } = self.sweeps.steps[time as usize];
        Some(Cut { time, of_move: of_move as usize, parameters })
    }

    /// Whether a point is stock at a time.
    #[must_use]
    pub fn is_stock(&self, p: &Point3, time: Time) -> bool {
        self.stock.contains(p) && self.sweeps.cut_before(p, time).is_none()
    }

    /// Whether a point is stock at a time, and how far around it all is, up to a limit.
    pub(crate) fn told_at(&self, p: &Point3, time: Time, limit_mm: f64) -> Told {
        let inside_mm = -self.stock.signed_mm(p);
        if !self.stock.contains(p) {
            return Told { is_stock: false, alike_mm: (-inside_mm).max(0.0) };
        }
        let uncut_mm = self.sweeps.signed_before(p, time, [-DEEP * limit_mm, limit_mm]);
        let alike_mm = if uncut_mm > 0.0 { uncut_mm.min(inside_mm) } else { -uncut_mm };
        Told { is_stock: uncut_mm > 0.0, alike_mm: alike_mm.max(0.0) }
    }

    /// Whether tool, shank and holder keep clear of all stock of a time on the whole of a move, as a rapid should. The move itself
    /// cuts nothing here.
    ///
    /// # Errors
    /// No such move.
    pub fn rapid_is_clear(&self, of_move: usize, time: Time) -> Result<StockProof, StockError> {
        self.clear_of_all(of_move, time, self.options.most_boxes)
    }

    /// The same within a bound on boxes.
    pub(super) fn clear_of_all(
        &self,
        of_move: usize,
        time: Time,
        boxes: u64,
    ) -> Result<StockProof, StockError> {
        self.prove(of_move, boxes, |_| true, |_| time)
    }

    /// Whether shank and holder keep clear of stock on a move that cuts: of what is there after the flutes have passed.
    ///
    /// # Errors
    /// No such move.
    pub fn body_is_clear(&self, of_move: usize) -> Result<StockProof, StockError> {
        self.body_clear(of_move, self.options.most_boxes)
    }

    /// The same within a bound on boxes.
    pub(super) fn body_clear(&self, of_move: usize, boxes: u64) -> Result<StockProof, StockError> {
        let first = self.time_of(of_move)?;
        self.prove(of_move, boxes, |part| part != ToolPart::Flutes, |chord| first + chord as Time + 1)
    }

    /// What of a move's tool, with its tip in a place and along a unit axis, is in the way of stock that is there when the move
    /// begins: the shank if it surely stands in some, or the holder if some is surely nearer to it than a distance, mm.
    #[must_use]
    pub fn struck_at(
        &self,
        of_move: usize,
        tip: &Point3,
        axis: &Vector3,
        holder_mm: f64,
    ) -> Option<ToolPart> {
        let time = self.time_of(of_move).ok()?;
        let limits = self.options.limits(self.options.share(self.moves.len()));
        let stands_in_stock = |shape: &Shape, start: Point3| {
            let sweep = Sweep { start, way: Vector3::zeros(), axis: *axis, shape: *shape };
            !self.is_known_clear(&sweep, time)
                && depth(&sweep, time, &self.sweeps, &self.stock, &limits).found_mm > limits.radius_mm
        };
        // A holder that would stand in stock were it moved so far is no farther from it.
        let x = across(axis);
        let y = axis.cross(&x);
        let turned = |k: u32| {
            let (sine, cosine) = (std::f64::consts::TAU * f64::from(k) / f64::from(WAYS)).sin_cos();
            tip + (x * cosine + y * sine) * holder_mm
        };
        let moved = || (0..WAYS).map(turned).chain([tip - axis * holder_mm]);
        let is_struck = |body: &&ToolBody| match body.part {
            ToolPart::Flutes => false,
            ToolPart::Shank => stands_in_stock(&body.shape, *tip),
            ToolPart::Holder => {
                stands_in_stock(&body.shape, *tip)
                    || (holder_mm > 0.0 && moved().any(|start| stands_in_stock(&body.shape, start)))
            }
        };
        self.bodies[self.body_of_move[of_move]].iter().find(is_struck).map(|body| body.part)
    }

    /// Whether a sweep is known to meet no stock of a time, without a proof.
    fn is_known_clear(&self, sweep: &Sweep, time: Time) -> bool {
        self.cells.are_clear_of(sweep, time, (&self.stock, &self.sweeps))
    }

    fn prove(
        &self,
        of_move: usize,
        boxes: u64,
        wanted: impl Fn(ToolPart) -> bool,
        time_of_chord: impl Fn(usize) -> Time,
    ) -> Result<StockProof, StockError> {
        let flat = self.flats.get(of_move).ok_or(StockError::NoMove(of_move))?;
        let bodies = &self.bodies[self.body_of_move[of_move]];
        if !bodies.iter().any(|b| wanted(b.part)) {
            return Ok(StockProof::Clear);
        }
        let mut left = boxes;
        let (mut hit, mut open): (Option<StockHit>, Option<StockHit>) = (None, None);
        for (k, chord) in flat.chords.iter().enumerate() {
            let time = time_of_chord(k);
            let is_near = |m: &Moved| wanted(m.part) && !self.is_known_clear(&m.sweep, time);
            let near: Vec<Moved> = moved(flat, chord, bodies, false).filter(is_near).collect();
            let swept: Vec<Sweep> = near.iter().map(|m| m.sweep).collect();
            if self.is_over_cleared_ground(of_move, &swept, time, 0.5 * self.options.narrowest_mm) {
                continue;
            }
            for Moved { part, sweep, .. } in near {
                let limits = self.options.limits(left.max(1));
                let found = depth(&sweep, time, &self.sweeps, &self.stock, &limits);
                left = left.saturating_sub(found.boxes);
                let is_hit = found.found_mm > limits.radius_mm;
                if !is_hit && found.bound_mm <= limits.radius_mm {
                    continue;
                }
                let at = if is_hit { found.at } else { found.bound_at };
                let record = StockHit {
                    size_mm: 2.0 * found.found_mm.max(0.0),
                    size_at_most_mm: 2.0 * found.bound_mm.min(self.stock.bounds().diagonal()),
                    part,
                    at: self.place(of_move, chord, &at),
                };
                let worst = if is_hit { &mut hit } else { &mut open };
                let size = |h: &StockHit| if is_hit { h.size_mm } else { h.size_at_most_mm };
                if worst.as_ref().is_none_or(|w| size(&record) > size(w)) {
                    *worst = Some(record);
                }
            }
        }
        Ok(match (hit, open) {
            (Some(hit), _) => StockProof::Hit(hit),
            (None, Some(open)) => StockProof::Undecided(open),
            (None, None) => StockProof::Clear,
        })
    }

    /// All that a move sweeps, grown by what flattening hides.
    #[cfg(test)]
    pub(super) fn sweeps_of(&self, of_move: usize) -> Vec<Sweep> {
        let (flat, bodies) = (&self.flats[of_move], &self.bodies[self.body_of_move[of_move]]);
        flat.chords.iter().flat_map(|c| moved(flat, c, bodies, false).map(|m| m.sweep)).collect()
    }

    /// A place of a move: the parameter is that of the chord where the tip is nearest across the axis.
    pub(super) fn place(&self, of_move: usize, chord: &Chord, at: &Point3) -> Place {
        let [a, b] = chord.tips;
        let way = b - a;
        let s = ((at - a).dot(&way) / way.norm_squared().max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
        let [from, to] = chord.parameters;
        Place {
            point_mm: (*at).into(),
            move_seq: Some(self.moves[of_move].seq),
            parameter: Some(from + s * (to - from)),
            face: None,
            entity: None,
        }
    }

    /// The engagement at a height above the tip in the middle of the chord that holds a parameter of a move: there the chord has the
    /// direction of the curve. `None` where the flutes are not at that height or the tool stands still. Angles are scanned every
    /// `scan_deg` degrees and their ends bisected. Exact to 0.1° for chord errors below a ten-thousandth of the radius.
    ///
    /// # Errors
    /// No such move; a number is not finite.
    pub fn engagement(
        &self,
        of_move: usize,
        parameter: f64,
        height_mm: f64,
        scan_deg: f64,
    ) -> Result<Option<Engagement>, StockError> {
        let flat = self.flats.get(of_move).ok_or(StockError::NoMove(of_move))?;
        super::error::placed("parameter or height", &[parameter, height_mm])?;
        let scan_deg = super::error::sized("scanning step, °,", scan_deg, 0.01, 90.0)?;
        let after = flat.chords.partition_point(|c| c.parameters[1] <= parameter);
        let k = after.min(flat.chords.len().saturating_sub(1));
        let Some(chord) = flat.chords.get(k) else { return Ok(None) };
        let s = 0.5;
        let bodies = &self.bodies[self.body_of_move[of_move]];
        let cutting = moved(flat, chord, bodies, true).filter(|m| m.part == ToolPart::Flutes);
        let swept: Vec<Sweep> = cutting.map(|m| Sweep { way: m.sweep.way * s, ..m.sweep }).collect();
        let Some(first) = swept.first() else { return Ok(None) };
        let way = chord.tips[1] - chord.tips[0];
        let pose = Pose {
            tip: first.start + way * s,
            way,
            axis: first.axis,
            swept: &swept,
            time: self.sweeps.first_step[of_move] + k as Time,
        };
        Ok(engagement(&pose, height_mm, scan_deg, &self.sweeps, &self.stock))
    }

    /// The tip at a parameter of a move, on its chord.
    pub(super) fn chord_at(&self, time: Time) -> Option<(usize, &Chord)> {
        let step = self.sweeps.steps.get(time as usize)?;
        let of_move = step.of_move as usize;
        let chord = &self.flats[of_move].chords[(time - self.sweeps.first_step[of_move]) as usize];
        Some((of_move, chord))
    }

    /// Heights at which engagement is measured for a report: up the corner, and at the lower end of the flank.
    pub(super) fn heights_of(&self, of_move: usize) -> Vec<f64> {
        let flutes = self.bodies[self.body_of_move[of_move]].iter().filter(|b| b.part == ToolPart::Flutes);
        let lowest = |b: &ToolBody| match b.shape {
            super::body::Shape::End { centre, .. } => [0.1, 0.3, 0.6, 1.0].map(|part| part * centre).to_vec(),
            super::body::Shape::Frustum { low, .. } => vec![low + 0.01],
        };
        flutes.flat_map(lowest).collect()
    }

    /// The highest stock over a point along its unit normal, at the end of the program, looked for as far as `reach_mm` on both sides.
    /// Exact to 1e-8 mm for straight moves; curved moves leave more by at most twice the chord error.
    #[must_use]
    pub fn thickness(&self, point: &Point3, normal: &Vector3, reach_mm: f64) -> Thickness {
        thickness(point, normal, reach_mm, &self.sweeps, &self.stock)
    }

    /// Volumes at the end of the program and by kind of move.
    ///
    /// # Errors
    /// Stopped.
    pub fn volumes(&self, keep_going: KeepGoing<'_>) -> Result<StockVolumes, StockError> {
        let points = self.options.volume_points;
        let bounds = self.stock.bounds();
        let initial = match self.stock.exact_volume_mm3() {
            Some(mm3) => VolumeEstimate { mm3, plus_minus_mm3: 0.0 },
            None => volumes(&bounds, points, 1, keep_going, |p| self.stock.contains(p).then_some(0))?[0],
        };
        let swept = self.sweeps.bounds();
        let both = Aabb { min: bounds.min.sup(&swept.min), max: bounds.max.inf(&swept.max) };
        let kinds = [MoveKind::Cut, MoveKind::LeadIn, MoveKind::LeadOut, MoveKind::Link];
        let sorted = |p: &Point3| {
            let cut = if self.stock.contains(p) { self.cut_at(p) } else { None }?;
            kinds.iter().position(|k| *k == self.moves[cut.of_move].kind)
        };
        // The last is all of them: its interval is not the sum of theirs.
        let found = volumes(&both, points, kinds.len(), keep_going, sorted)?;
        let removed = found[kinds.len()];
        let mm3 = (initial.mm3 - removed.mm3).max(0.0);
        let plus_minus_mm3 = initial.plus_minus_mm3 + removed.plus_minus_mm3;
        let by_kind = kinds.into_iter().zip(found).filter(|(_, v)| v.mm3 > 0.0).collect();
        let left = VolumeEstimate { mm3, plus_minus_mm3 };
        Ok(StockVolumes { initial, removed, left, removed_by_kind: by_kind })
    }
}

/// How far a box reaches above the tip of a move at most, along the axis, mm.
fn height_of(b: &Aabb, m: &Move) -> f64 {
    let (middle, half) = (b.centre(), 0.5 * (b.max - b.min));
    let over = |p: &[f64; 3], axis: [f64; 3]| {
        let to = middle - Point3::from(*p);
        if m.axis_start == m.axis_end {
            let axis = Vector3::from(axis);
            to.dot(&axis) + axis.abs().dot(&half)
        } else {
            to.norm() + half.norm()
        }
    };
    m.points.iter().map(|p| over(p, m.axis_start)).fold(0.0, f64::max)
}
