//! Reads Heidenhain conversational programs: straight moves and spline blocks with their
//! coefficients.

use std::io::BufRead;

use claymill_nurbs::{Curve3, KnotVector, Point3};

use super::heidenhain::{CORNER_DEG, MANTISSA_DIGITS, corner_deg};
use super::own_blocks::OwnBlocks;
use super::plane_words::read_plane;
use super::siemens::bernstein;
use super::{Element, Fault, Sink, lines};
use crate::tilt::Tilt;
use crate::words::{first_chars, number, syntax};
use crate::{Machine, Refusal, Shape};

/// Each axis of a spline's start may be this far from where the block before it ended, mm.
const START_MM: f64 = 1e-3;
/// Largest coordinate of an end, mm.
const LARGEST_MM: f64 = 99_999.999_9;

/// Reads a program in conversational form.
pub(crate) fn read(text: &mut dyn BufRead, machine: &Machine, sink: Sink<'_>) -> Result<(), Fault> {
    let mut reader = Reader {
        machine,
        own: OwnBlocks::new(machine, |line| bare(line).to_owned()),
        sink,
        position: [None; 3],
        feed: None,
        unit_mm: 1.0,
        open: None,
        before: None,
        tilt: None,
        state: State::Before,
    };
    let mut last = 0;
    lines(text, |line, text| {
        last = line;
        reader.block(line, text)
    })?;
    if reader.state != State::After {
        let refusal = Refusal::new("program-end", "the program has no END PGM");
        return Err(Fault::Refused { line: last, refusal });
    }
    Ok(())
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum State {
    Before,
    Within,
    After,
}

/// A block without its number and its comment.
fn bare(text: &str) -> &str {
    let text = text.split(';').next().unwrap_or("").trim();
    text.trim_start_matches(|c: char| c.is_ascii_digit()).trim()
}

/// A spline block whose coefficients are being read.
struct Open {
    line: usize,
    end: [Option<f64>; 3],
    k: [[Option<f64>; 3]; 3],
}

struct Reader<'a> {
    machine: &'a Machine,
    own: OwnBlocks,
    sink: Sink<'a>,
    position: [Option<f64>; 3],
    feed: Option<f64>,
    unit_mm: f64,
    open: Option<Open>,
    /// The spline before this block, for the corner between them.
    before: Option<Shape>,
    /// The tilted plane.
    tilt: Option<Tilt>,
    state: State,
}

impl Reader<'_> {
    fn place(&self) -> Option<Point3> {
        match self.position {
            [Some(x), Some(y), Some(z)] => Some(Point3::new(x, y, z)),
            _ => None,
        }
    }

    fn block(&mut self, line: usize, text: &str) -> Result<(), Refusal> {
        let text = bare(text);
        if text.is_empty() {
            return Ok(());
        }
        if self.state == State::After {
            return Err(Refusal::new("program-end", "blocks behind END PGM"));
        }
        if text.starts_with(['K', 'F', 'M']) && self.open.is_some() || text.starts_with('K') {
            return self.coefficients(text);
        }
        if self.open.is_some() {
            return Err(Refusal::new("heidenhain-k", "a spline block lacks K3, K2 and K1 of each axis"));
        }
        if let Some(rest) = text.strip_prefix("BEGIN PGM") {
            self.state = State::Within;
            self.unit_mm = if rest.trim_end().ends_with("INCH") { 25.4 } else { 1.0 };
            return Ok(());
        }
        if self.state == State::Before {
            return Err(Refusal::new("program-begin", "the program does not begin with BEGIN PGM"));
        }
        if text.starts_with("END PGM") {
            if self.tilt.is_some() {
                return Err(Refusal::new("plane-open", "the program ends within a tilted plane"));
            }
            self.state = State::After;
            return Ok(());
        }
        match self.verb(line, text) {
            Err(_) if self.own.has(text) => {
                // Where a block of the machine definition goes that is not understood nobody knows.
                self.position = [None; 3];
                self.before = None;
                Ok(())
            }
            read => read,
        }
    }

    fn verb(&mut self, line: usize, text: &str) -> Result<(), Refusal> {
        let (verb, rest) = text.split_once(' ').unwrap_or((text, ""));
        match verb {
            "L" => self.line(line, rest),
            "SPL" => self.spline(line, rest),
            "PLANE" => {
                self.tilt = read_plane(rest)?;
                self.position = [None; 3];
                self.before = None;
                Ok(())
            }
            "STOP" => {
                self.position = [None; 3];
                self.before = None;
                Ok(())
            }
            "TOOL" if rest.starts_with("CALL") => {
                // The tool changer is elsewhere.
                self.position = [None; 3];
                self.before = None;
                Ok(())
            }
            // Tolerance and preset; others shift, turn and scale.
            "CYCL" if ["DEF 32.", "DEF 247"].iter().any(|known| rest.starts_with(known)) => Ok(()),
            "CYCL" => Err(Refusal::new(
                "heidenhain-cycle",
                format!("`CYCL {}`: what cycles do to coordinates is not read", first_chars(rest)),
            )),
            _ => Err(Refusal::new("unknown-word", format!("`{}` is not known", first_chars(verb)))),
        }
    }

    /// Axis words of a block; other words go to `other`.
    fn axes(
        &self,
        text: &str,
        mut other: impl FnMut(&str) -> Result<(), Refusal>,
    ) -> Result<[Option<f64>; 3], Refusal> {
        let mut axes = [None; 3];
        for word in text.split_whitespace() {
            match word.chars().next().and_then(|c| "XYZ".find(c)) {
                Some(axis) => {
                    let (value, decimals, _) = number(&word[1..])?;
                    if value.abs() > LARGEST_MM || decimals > 4 && self.unit_mm == 1.0 {
                        return Err(Refusal::new(
                            "heidenhain-digits",
                            format!(
                                "`{}`: ends have up to 5 digits before and 4 behind the point",
                                first_chars(word)
                            ),
                        ));
                    }
                    axes[axis] = Some(value * self.unit_mm);
                }
                None if word.starts_with(['A', 'B', 'C', 'U', 'V', 'W']) => {
                    let detail = format!("`{}`: only X, Y and Z can be checked", first_chars(word));
                    return Err(Refusal::new("axis", detail));
                }
                None if word.starts_with("IX") || word.starts_with("IY") || word.starts_with("IZ") => {
                    let detail = format!("`{}`: incremental positions are not read", first_chars(word));
                    return Err(Refusal::new("incremental", detail));
                }
                None => other(word)?,
            }
        }
        Ok(axes)
    }

    fn line(&mut self, line: usize, text: &str) -> Result<(), Refusal> {
        let (mut rapid, mut feed) = (false, self.feed);
        let unit = if self.unit_mm == 1.0 { 1.0 } else { 2.54 };
        let axes = self.axes(text, |word| match word {
            "FMAX" => {
                rapid = true;
                Ok(())
            }
            "R0" | "M3" | "M4" | "M5" | "M7" | "M8" | "M9" | "M30" => Ok(()),
            "RL" | "RR" => {
                Err(Refusal::new("radius-compensation", "RL and RR move the path by the tool's radius"))
            }
            _ => match word.strip_prefix('F') {
                Some(rate) => {
                    feed = Some(number(rate)?.0 * unit);
                    Ok(())
                }
                None => Err(Refusal::new("unknown-word", format!("`{}` is not known", first_chars(word)))),
            },
        })?;
        self.feed = feed;
        self.before = None;
        let from = self.place();
        for axis in 0..3 {
            self.position[axis] = axes[axis].or(self.position[axis]);
        }
        let (Some(from), Some(to)) = (from, self.place()) else {
            return if rapid || axes == [None; 3] {
                Ok(())
            } else {
                Err(Refusal::new("position", "a cutting move from a position that is not known"))
            };
        };
        if from == to {
            return Ok(());
        }
        let rate = if rapid { self.machine.feed.rapid_mm_per_min } else { self.feed_now()? };
        (self.sink)(Element { line, rapid, feed: rate, shape: Shape::Line { from, to }, tilt: self.tilt })
    }

    fn feed_now(&self) -> Result<f64, Refusal> {
        self.feed.filter(|f| *f > 0.0).ok_or_else(|| Refusal::new("feed", "a cutting move without a feed"))
    }

    fn spline(&mut self, line: usize, text: &str) -> Result<(), Refusal> {
        let mut feed = self.feed;
        let unit = if self.unit_mm == 1.0 { 1.0 } else { 2.54 };
        let end = self.axes(text.trim_end_matches('~'), |word| match word.strip_prefix('F') {
            Some(rate) => {
                feed = Some(number(rate)?.0 * unit);
                Ok(())
            }
            None if word.starts_with('M') => Ok(()),
            None => Err(Refusal::new("unknown-word", format!("`{}` is not known", first_chars(word)))),
        })?;
        self.feed = feed;
        if end.iter().flatten().count() < 2 {
            return Err(Refusal::new("heidenhain-axes", "a spline moves two axes at least"));
        }
        self.open = Some(Open { line, end, k: [[None; 3]; 3] });
        Ok(())
    }

    fn coefficients(&mut self, text: &str) -> Result<(), Refusal> {
        let unit = if self.unit_mm == 1.0 { 1.0 } else { 2.54 };
        let Some(open) = &mut self.open else {
            return Err(Refusal::new("heidenhain-k", "coefficients without a spline block"));
        };
        // The exponent may stand apart: `K3X+1.2750 E2`.
        let joined = text.replace(" E", "E").replace('~', " ");
        for word in joined.split_whitespace() {
            let bad = || syntax(format!("`{}` is no coefficient", first_chars(word)));
            let head: Vec<char> = word.chars().take(3).collect();
            let ['K', order @ '1'..='3', letter @ 'X'..='Z'] = head[..] else {
                match word.strip_prefix('F') {
                    Some(rate) => self.feed = Some(number(rate)?.0 * unit),
                    None if word.starts_with('M') => {}
                    None => return Err(bad()),
                }
                continue;
            };
            let body = &word[3..];
            let (mantissa, exponent) = body.split_once('E').unwrap_or((body, "0"));
            let (value, decimals, _) = number(mantissa)?;
            let exponent: i32 = exponent.parse().map_err(|_| bad())?;
            if value.abs() >= 10.0 || decimals > MANTISSA_DIGITS || exponent.abs() > 255 {
                return Err(Refusal::new(
                    "heidenhain-k-digits",
                    format!(
                        "`{}`: coefficients are below 10 with 8 decimals and an exponent to 255",
                        first_chars(word)
                    ),
                ));
            }
            let value = value * 10f64.powi(exponent);
            if !value.is_finite() || value.abs() > 1e9 {
                return Err(bad());
            }
            let axis = letter as usize - 'X' as usize;
            let k = &mut open.k[axis];
            let order = order as usize - '1' as usize;
            if open.end[axis].is_none() || k[order].is_some() || (order < 2 && k[order + 1].is_none()) {
                return Err(Refusal::new(
                    "heidenhain-k",
                    format!(
                        "`{}`: K3, K2, K1 stand once, in this order, for axes that SPL names",
                        first_chars(word)
                    ),
                ));
            }
            k[order] = Some(value);
        }
        let moved: Vec<usize> = (0..3).filter(|a| open.end[*a].is_some()).collect();
        if moved.iter().all(|a| open.k[*a].iter().all(Option::is_some)) {
            let open = self.open.take();
            return open.map_or(Ok(()), |open| self.close(&open));
        }
        Ok(())
    }

    fn close(&mut self, open: &Open) -> Result<(), Refusal> {
        let Some(place) = self.place() else {
            return Err(Refusal::new("position", "a spline starts from a position that is not known"));
        };
        let mut coordinates = Vec::with_capacity(3);
        for axis in 0..3 {
            let end = open.end[axis].unwrap_or(place[axis]);
            let k = |n: usize| open.k[axis][n - 1].unwrap_or(0.0) * self.unit_mm;
            let mut bezier = bernstein(&[end, k(1), k(2), k(3)]);
            bezier.reverse();
            coordinates.push(bezier);
        }
        let mut points: Vec<Point3> =
            (0..4).map(|i| Point3::new(coordinates[0][i], coordinates[1][i], coordinates[2][i])).collect();
        let gap = (points[0] - place).amax();
        if gap > START_MM {
            return Err(Refusal::new(
                "heidenhain-start",
                format!(
                    "an axis of the spline starts {gap:.4} mm from where the block before it ended, more than 1 µm"
                ),
            ));
        }
        points[0] = place;
        let knots = KnotVector::new(3, vec![0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0]);
        let curve = knots
            .and_then(|knots| Curve3::new(knots, points, None))
            .map_err(|e| Refusal::new("heidenhain-curve", e.to_string()))?;
        let shape = Shape::Spline(curve);
        if let Some(before) = &self.before {
            let corner = corner_deg(before, &shape);
            if corner >= CORNER_DEG {
                return Err(Refusal::new(
                    "heidenhain-corner",
                    format!(
                        "a corner of {corner:.2}° between splines: the control stops there; put L between them"
                    ),
                ));
            }
        }
        let end = shape.end();
        self.position = [Some(end.x), Some(end.y), Some(end.z)];
        self.before = Some(shape.clone());
        let feed = self.feed_now()?;
        (self.sink)(Element { line: open.line, rapid: false, feed, shape, tilt: self.tilt })
    }
}
