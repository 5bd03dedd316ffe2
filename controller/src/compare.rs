//! Reads programs back: matches their blocks with the moves of the job in order, and reports
//! missing and added moves, distance and feed. Also gives the verifier the moves of a program.

use std::fs::File;
use std::io::{BufRead, BufReader, Read};
use std::path::{Path, PathBuf};

use claymill_nurbs::{Curve3, KnotVector, Point3};
use claymill_toolpath::{LONGEST_MADE, Move, MoveKind, Program, open_plain};
use rayon::prelude::*;
use serde::Serialize;

use crate::dialects::{Dialect, Element, Fault, Sink};
use crate::follow::deviation;
use crate::job::{MachineJob, Section, Stroke, turned};
use crate::placed::placed_as_written;
use crate::tilt::Tilt;
use crate::{Machine, ReadError, Refusal, Shape};

/// A program held against the job that it was written from.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Comparison {
    /// Moves of the job that were found in the program.
    pub moves: u64,
    /// Moves of the job that were not.
    pub missing: u64,
    /// The first of them.
    pub first_missing: Option<u64>,
    /// Blocks that move, splines counted once.
    pub elements: u64,
    /// Of these, blocks that belong to no move of the job: approach, retract, or something strange.
    pub added: u64,
    /// Largest distance between a move and what stands for it, mm.
    pub largest_mm: f64,
    /// The move with the largest distance.
    pub largest_seq: u64,
    /// The line with the largest distance.
    pub largest_line: usize,
    /// Moves whose feed differs by more than half a percent, or that run rapidly though they cut.
    pub feed_differs: u64,
    /// The first of them.
    pub first_feed_differs: Option<u64>,
}

/// Feeds may differ by this share: some controls take whole numbers only.
const FEED_SHARE: f64 = 5e-3;
/// Moves held against the job at a time.
const BATCH: usize = 4096;
/// How many moves of the job may be missing before the program counts as astray.
const LOOK_AHEAD: usize = 64;

/// What the program has for a stretch of the job: a move, or blocks between two moves.
pub(crate) struct Found<'a> {
    pub(crate) section: &'a Section,
    pub(crate) stroke: &'a Stroke,
    pub(crate) elements: Vec<Element>,
    /// Whether the elements stand for the stroke, not beside it.
    pub(crate) matched: bool,
}

/// Takes what the program has, in order.
type Take<'a, 't> = &'t mut dyn FnMut(&Found<'a>);

struct Matcher<'a, 't> {
    order: Vec<(&'a Section, &'a Stroke)>,
    next: usize,
    pending: Vec<Element>,
    pending_mm: f64,
    stroke_mm: f64,
    near_mm: f64,
    found: Vec<Found<'a>>,
    comparison: Comparison,
    take: Take<'a, 't>,
}

impl<'a, 't> Matcher<'a, 't> {
    fn new(job: &'a MachineJob, near_mm: f64, take: Take<'a, 't>) -> Self {
        let order = job.sections.iter().flat_map(|s| s.strokes.iter().map(move |t| (s, t))).collect();
        let mut matcher = Matcher {
            order,
            next: 0,
            pending: Vec::new(),
            pending_mm: 0.0,
            stroke_mm: 0.0,
            near_mm,
            found: Vec::new(),
            comparison: Comparison::default(),
            take,
        };
        matcher.measure();
        matcher
    }

    fn measure(&mut self) {
        self.stroke_mm =
            self.order.get(self.next).map_or(0.0, |(_, t)| Shape::Spline(t.curve.clone()).length_mm());
    }

    fn near(&self, a: &Point3, b: &Point3) -> bool {
        (a - b).norm() <= self.near_mm
    }

    fn push(&mut self, element: Element) {
        self.comparison.elements += 1;
        if self.pending_mm > 1.1 * self.stroke_mm + 1.0 + 3.0 * self.near_mm {
            // Longer than the move, without having come to its end.
            self.close();
        }
        if self.pending.is_empty() {
            if self.is_tail(&element)
                && let Some(last) = self.found.last_mut()
            {
                last.elements.push(element);
                return;
            }
            self.seek(&element);
        }
        let Some(&(_, stroke)) = self.order.get(self.next) else {
            return self.beside(element);
        };
        if self.pending.is_empty() && !self.near(&element.shape.start(), &stroke.curve.start()) {
            return self.beside(element);
        }
        self.pending_mm += element.shape.length_mm();
        let end = element.shape.end();
        self.pending.push(element);
        let slack = 3.0 * self.near_mm;
        let arrived = self.near(&end, &stroke.curve.end()) && self.pending_mm >= 0.9 * self.stroke_mm - slack;
        if arrived {
            self.close();
        }
    }

    /// Whether a block is the last bit of the move before, which had come near enough to its end already: no longer than what
    /// is near, and with the feed of that move, not of the next.
    fn is_tail(&self, element: &Element) -> bool {
        let (Some(last), Some((_, next))) = (self.found.last(), self.order.get(self.next)) else {
            return false;
        };
        let end = last.stroke.curve.end();
        let is_short = self.near(&element.shape.start(), &end)
            && self.near(&element.shape.end(), &end)
            && element.shape.length_mm() <= 2.0 * self.near_mm;
        last.matched && is_short && !has_feed(element, next) && has_feed(element, last.stroke)
    }

    /// Passes over moves of the job that are too short to be written, or that the program does not have.
    fn seek(&mut self, element: &Element) {
        let start = element.shape.start();
        let begins = |m: &Self, i: usize| m.near(&start, &m.order[i].1.curve.start());
        while let Some((_, stroke)) = self.order.get(self.next) {
            let still = self.stroke_mm <= 2.0 * self.near_mm
                && element.shape.length_mm() > 2.0 * self.stroke_mm + 2.0 * self.near_mm;
            if !(still && self.near(&stroke.curve.start(), &stroke.curve.end())) {
                break;
            }
            self.comparison.moves += 1;
            self.next += 1;
            self.measure();
        }
        if self.next < self.order.len() && !begins(self, self.next) {
            let last = (self.next + LOOK_AHEAD).min(self.order.len());
            if let Some(found) = (self.next + 1..last).find(|i| begins(self, *i)) {
                self.comparison.missing += (found - self.next) as u64;
                self.comparison.first_missing.get_or_insert(self.order[self.next].1.seq);
                self.next = found;
                self.measure();
            }
        }
    }

    fn beside(&mut self, element: Element) {
        self.comparison.added += 1;
        let at = self.next.min(self.order.len() - 1);
        let (section, stroke) = self.order[at];
        self.found.push(Found { section, stroke, elements: vec![element], matched: false });
    }

    /// At the end of a file: what has begun and is no move of the job is the way up.
    fn file_ends(&mut self) {
        self.pending_mm = 0.0;
        for element in std::mem::take(&mut self.pending) {
            self.beside(element);
        }
    }

    fn close(&mut self) {
        let (section, stroke) = self.order[self.next];
        let elements = std::mem::take(&mut self.pending);
        self.found.push(Found { section, stroke, elements, matched: true });
        self.pending_mm = 0.0;
        self.next += 1;
        self.measure();
        if self.found.len() >= BATCH {
            self.judge();
        }
    }

    fn judge(&mut self) {
        let found = std::mem::take(&mut self.found);
        let far: Vec<f64> = found
            .par_iter()
            .map(|f| {
                if !f.matched {
                    return 0.0;
                }
                let askew = f.elements.iter().map(|e| askew_mm(e, f.section)).fold(0.0, f64::max);
                askew + deviation(&f.stroke.curve, f.elements.iter().map(|e| &e.shape))
            })
            .collect();
        let c = &mut self.comparison;
        for (f, far) in found.iter().zip(far) {
            (self.take)(f);
            if !f.matched {
                continue;
            }
            c.moves += 1;
            if far > c.largest_mm {
                c.largest_mm = far;
                c.largest_seq = f.stroke.seq;
                c.largest_line = f.elements.first().map_or(0, |e| e.line);
            }
            if !f.elements.iter().all(|e| has_feed(e, f.stroke)) {
                c.feed_differs += 1;
                c.first_feed_differs.get_or_insert(f.stroke.seq);
            }
        }
    }

    fn finish(mut self) -> Comparison {
        while let Some((_, stroke)) = self.order.get(self.next) {
            if self.stroke_mm > 2.0 * self.near_mm {
                self.comparison.missing += 1;
                self.comparison.first_missing.get_or_insert(stroke.seq);
            } else {
                self.comparison.moves += 1;
            }
            self.next += 1;
            self.measure();
        }
        self.judge();
        self.comparison
    }
}

/// Whether a block runs as a move does.
fn has_feed(element: &Element, stroke: &Stroke) -> bool {
    match element.rapid {
        true => stroke.kind == MoveKind::Rapid,
        false => (element.feed - stroke.feed).abs() <= FEED_SHARE * stroke.feed + 0.5,
    }
}

/// How far the plane that was read takes a block from where the section's plane has it, mm. The two planes differ by a rigid
/// motion, so that no point of a block goes farther than the farthest of its control points.
fn askew_mm(element: &Element, section: &Section) -> f64 {
    let planned = section.placed.map(|p| p.tilt).filter(|t| !t.is_none());
    if element.tilt == planned {
        return 0.0;
    }
    let through = |tilt: Option<Tilt>, p: &Point3| tilt.map_or(*p, |t| t.to_standing(p));
    let points = element
        .shape
        .curve()
        .map_or_else(|| vec![element.shape.start(), element.shape.end()], |curve| curve.points().to_vec());
    let far = points.iter().map(|p| (through(element.tilt, p) - through(planned, p)).norm());
    far.fold(0.0, f64::max)
}

fn open(path: &Path) -> Result<BufReader<File>, ReadError> {
    let io = |source| ReadError::Io { path: path.to_owned(), source };
    Ok(BufReader::with_capacity(1 << 18, open_plain(path, LONGEST_MADE).map_err(io)?))
}

/// The dialect that a program's header names.
///
/// # Errors
/// The file cannot be read, or names none.
pub fn dialect_of(path: &Path) -> Result<Dialect, ReadError> {
    Dialect::recognise(&head(path)?).ok_or_else(|| ReadError::Unrecognised(path.to_owned()))
}

/// The first lines of a program.
pub(crate) fn head(path: &Path) -> Result<String, ReadError> {
    let mut head = Vec::new();
    let io = |source| ReadError::Io { path: path.to_owned(), source };
    open(path)?.take(4096).read_to_end(&mut head).map_err(io)?;
    Ok(String::from_utf8_lossy(&head).into_owned())
}

/// Reads one program.
pub(crate) fn read_elements(
    path: &Path,
    dialect: Dialect,
    machine: &Machine,
    sink: Sink<'_>,
) -> Result<(), ReadError> {
    let mut text: Box<dyn BufRead> = Box::new(open(path)?);
    dialect.grammar().read(&mut text, machine, sink).map_err(|fault| match fault {
        Fault::Io(source) => ReadError::Io { path: path.to_owned(), source },
        Fault::Refused { line, refusal } => ReadError::Refused { path: path.to_owned(), line, refusal },
    })
}

/// Checks that a text is a right program of its dialect, and returns how many blocks move.
///
/// # Errors
/// The line and rule of the first block that the control would refuse, or execute wrongly.
pub fn check(text: &str, dialect: Dialect, machine: &Machine) -> Result<u64, (usize, Refusal)> {
    elements(text, dialect, machine).map(|found| found.len() as u64)
}

/// What a text moves along, block by block.
///
/// # Errors
/// As [`check`].
pub fn elements(text: &str, dialect: Dialect, machine: &Machine) -> Result<Vec<Element>, (usize, Refusal)> {
    let mut found = Vec::new();
    let mut sink = |element: Element| {
        found.push(element);
        Ok(())
    };
    match dialect.grammar().read(&mut text.as_bytes(), machine, &mut sink) {
        Ok(()) => Ok(found),
        Err(Fault::Refused { line, refusal }) => Err((line, refusal)),
        Err(Fault::Io(e)) => Err((0, Refusal::new("io", e.to_string()))),
    }
}

/// Follows a program along its job: `take` gets what the program has, in order.
pub(crate) fn follow_program<'a>(
    job: &'a MachineJob,
    files: &[PathBuf],
    dialect: Dialect,
    machine: &Machine,
    take: Take<'a, '_>,
) -> Result<Comparison, ReadError> {
    let near_mm = 2.0 * dialect.format(machine).step_mm() + 1e-6;
    let mut matcher = Matcher::new(job, near_mm, take);
    for path in files {
        read_elements(path, dialect, machine, &mut |element| {
            matcher.push(element);
            Ok(())
        })?;
        matcher.file_ends();
    }
    Ok(matcher.finish())
}

/// Reads a program back and holds it against its job.
///
/// # Errors
/// A file cannot be read, or breaks a rule of its dialect.
pub fn compare(
    job: &MachineJob,
    files: &[PathBuf],
    dialect: Dialect,
    machine: &Machine,
) -> Result<Comparison, ReadError> {
    let job = placed_as_written(job, files, dialect, machine)?;
    follow_program(&job, files, dialect, machine, &mut |_| ())
}

/// The moves that a program makes, in model coordinates and under the names of the job that it was written
/// from, for the verifier.
///
/// # Errors
/// As [`compare`]; and the program is not that job's.
pub fn moves_of(
    job: &MachineJob,
    files: &[PathBuf],
    dialect: Dialect,
    machine: &Machine,
) -> Result<(Program, Comparison), ReadError> {
    let mut moves = Vec::new();
    let placed = placed_as_written(job, files, dialect, machine)?;
    let comparison =
        follow_program(&placed, files, dialect, machine, &mut |found| add_moves(&mut moves, found))?;
    if 2 * comparison.missing > job.strokes() as u64 {
        return Err(ReadError::Astray {
            path: files.first().cloned().unwrap_or_default(),
            what: format!(
                "{} of {} moves of the job are not in it: it belongs to another job or machine definition",
                comparison.missing,
                job.strokes()
            ),
        });
    }
    Ok((Program { moves }, comparison))
}

fn add_moves(moves: &mut Vec<Move>, found: &Found<'_>) {
    let (section, stroke) = (found.section, found.stroke);
    let axis = section.tool_axis;
    // Through the plane as it was read, not as it was meant.
    let to_model = |p: &Point3, tilt: Option<Tilt>| match (section.placed, tilt) {
        (Some(placed), Some(tilt)) => placed.stands.to_model(&tilt.to_standing(p)),
        (Some(placed), None) => placed.stands.to_model(p),
        (None, Some(tilt)) => section.frame.to_model(&tilt.to_standing(p)),
        (None, None) => section.frame.to_model(p),
    };
    let mut add = |kind: MoveKind, feed: f64, curve: &Curve3, tilt: Option<Tilt>| {
        let curve = turned(curve, |p| to_model(p, tilt));
        moves.push(Move {
            seq: stroke.seq,
            setup: section.setup.clone(),
            region: stroke.region,
            pass: stroke.pass,
            tool: section.tool.clone(),
            points: curve.points().iter().map(|&p| p.into()).collect(),
            ..Move::along(kind, &curve, axis, feed)
        });
    };
    let kind_of = |e: &Element| match (e.rapid, found.matched) {
        (true, _) => MoveKind::Rapid,
        (false, true) => stroke.kind,
        (false, false) => MoveKind::Link,
    };
    let lines = found.elements.chunk_by(|a, b| {
        matches!((&a.shape, &b.shape), (Shape::Line { .. }, Shape::Line { .. }))
            && a.rapid == b.rapid
            && a.tilt == b.tilt
    });
    for group in lines {
        let first = &group[0];
        match &first.shape {
            Shape::Line { from, .. } => {
                let mut points = vec![*from];
                let mut knots = vec![0.0, 0.0];
                for e in group {
                    let length = e.shape.length_mm();
                    knots.push(knots[knots.len() - 1] + length);
                    points.push(e.shape.end());
                }
                knots.push(knots[knots.len() - 1]);
                let curve = KnotVector::new(1, knots).and_then(|k| Curve3::new(k, points, None));
                if let Ok(curve) = curve {
                    add(kind_of(first), first.feed, &curve, first.tilt);
                }
            }
            other => {
                if let Some(curve) = other.curve() {
                    add(kind_of(first), first.feed, &curve, first.tilt);
                }
            }
        }
    }
}
