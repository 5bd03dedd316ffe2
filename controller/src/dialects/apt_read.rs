//! Reads CLDATA (APT) with CATIA's or Creo's NURBS statements.

use std::io::BufRead;

use claymill_nurbs::{Curve3, KnotVector, Point3};

use super::apt::MOVNRB_VALUES;
use super::own_blocks::OwnBlocks;
use super::siemens::knots_of_intervals;
use super::{Element, Fault, Sink, lines};
use crate::words::{first_chars, number, syntax};
use crate::{Machine, Refusal, Shape};

/// A curve may start this far from the current position, mm.
const START_MM: f64 = 1e-3;
const MOST_POINTS: usize = 1_000_000;

/// Reads CLDATA with CATIA's or Creo's statements.
pub(crate) fn read(
    creo: bool,
    text: &mut dyn BufRead,
    machine: &Machine,
    sink: Sink<'_>,
) -> Result<(), Fault> {
    let mut reader = Reader {
        creo,
        machine,
        own: OwnBlocks::new(machine, |line| bare(line).to_owned()),
        sink,
        position: None,
        feed: None,
        unit_mm: machine.units.mm(),
        rapid: false,
        catia: None,
        movnrb: None,
        ended: false,
    };
    let (mut joined, mut first, mut last) = (String::new(), 0, 0);
    lines(text, |line, text| {
        last = line;
        if joined.is_empty() {
            first = line;
        }
        let text = bare(text);
        if joined.len() + text.len() > 1 << 16 {
            return Err(syntax("a statement has more than 65536 characters"));
        }
        match text.strip_suffix('$') {
            Some(part) => {
                joined.push_str(part);
                Ok(())
            }
            None => {
                joined.push_str(text);
                let whole = std::mem::take(&mut joined);
                reader.statement(first, whole.trim())
            }
        }
    })?;
    if !reader.ended || !joined.is_empty() {
        let refusal = Refusal::new("program-end", "the program has no FINI");
        return Err(Fault::Refused { line: last, refusal });
    }
    Ok(())
}

/// `BEGIN NURBS_SIEMENS` that is being read.
struct Catia {
    line: usize,
    degree: usize,
    feed: f64,
    points: Vec<Point3>,
    intervals: Vec<f64>,
    weights: Vec<f64>,
}

/// `MOVNRB/ON` that is being read.
struct Movnrb {
    line: usize,
    order: usize,
    knot_count: usize,
    point_count: usize,
    knots: Vec<f64>,
    values: Vec<f64>,
    curve: Option<Curve3>,
    last: Option<Point3>,
}

struct Reader<'a> {
    creo: bool,
    machine: &'a Machine,
    own: OwnBlocks,
    sink: Sink<'a>,
    position: Option<Point3>,
    feed: Option<f64>,
    unit_mm: f64,
    rapid: bool,
    catia: Option<Catia>,
    movnrb: Option<Movnrb>,
    ended: bool,
}

/// A line without its comment.
fn bare(text: &str) -> &str {
    text.split("$$").next().unwrap_or("").trim()
}

fn values(list: &str) -> Result<Vec<f64>, Refusal> {
    list.split(',').map(|v| Ok(number(v.trim())?.0)).collect()
}

fn tilted() -> Refusal {
    Refusal::new("axis", "only a fixed axis 0,0,1 can be checked")
}

impl Reader<'_> {
    fn statement(&mut self, line: usize, text: &str) -> Result<(), Refusal> {
        if text.is_empty() {
            return Ok(());
        }
        let within = self.catia.is_some() || self.movnrb.is_some();
        match self.read(line, text) {
            Err(_) if !within && self.own.has(text) => {
                // Where a statement of the machine definition goes that is not understood nobody knows.
                self.position = None;
                Ok(())
            }
            read => read,
        }
    }

    fn read(&mut self, line: usize, text: &str) -> Result<(), Refusal> {
        if self.ended {
            return Err(Refusal::new("program-end", "a statement behind FINI"));
        }
        if self.catia.is_some() {
            return self.within_catia(text);
        }
        let (word, rest) = text.split_once('/').unwrap_or((text, ""));
        let (word, rest) = (word.trim(), rest.trim());
        if self.movnrb.is_some() && !matches!(word, "MOVNRB" | "GOTO" | "FEDRAT") {
            return Err(Refusal::new("movnrb-within", format!("`{}` within MOVNRB", first_chars(word))));
        }
        match word {
            "GOTO" => self.goto(line, rest),
            "RAPID" => {
                self.rapid = true;
                Ok(())
            }
            "FEDRAT" => {
                let (value, unit) = rest.split_once(',').unwrap_or((rest, "MMPM"));
                let mm = match unit.trim() {
                    "MMPM" => 1.0,
                    "IPM" => 25.4,
                    _ => return Err(Refusal::new("feed-mode", "feeds are in MMPM or IPM")),
                };
                self.feed = Some(number(value.trim())?.0 * mm);
                Ok(())
            }
            "UNITS" => match rest {
                "MM" => {
                    self.unit_mm = 1.0;
                    Ok(())
                }
                "INCHES" => {
                    self.unit_mm = 25.4;
                    Ok(())
                }
                _ => Err(Refusal::new("unknown-word", "UNITS are MM or INCHES")),
            },
            "STOP" => {
                self.position = None;
                Ok(())
            }
            "FINI" => {
                self.ended = true;
                Ok(())
            }
            "LOADTL" | "CUTTER" | "SPINDL" | "COOLNT" | "PPRINT" => Ok(()),
            "MOVNRB" if self.creo => self.movnrb(line, rest),
            _ if word.starts_with("PARTNO") => Ok(()),
            _ if word.starts_with("BEGIN NURBS_SIEMENS") && !self.creo => self.begin_catia(line, text),
            _ => Err(Refusal::new("unknown-word", format!("`{}` is not known", first_chars(word)))),
        }
    }

    fn goto(&mut self, line: usize, rest: &str) -> Result<(), Refusal> {
        let v = values(rest)?;
        if v.len() != 3 {
            return Err(Refusal::new("axis", "GOTO needs x, y and z; tool axes are not read"));
        }
        let to = Point3::new(v[0], v[1], v[2]) * self.unit_mm;
        if let Some(open) = &mut self.movnrb {
            if open.curve.is_none() {
                return Err(Refusal::new("movnrb-next", "GOTO before MOVNRB/NEXT"));
            }
            open.last = Some(to);
            return Ok(());
        }
        let rapid = std::mem::take(&mut self.rapid);
        let from = self.position.replace(to);
        match from {
            Some(from) if from != to => {
                let feed = if rapid { self.machine.feed.rapid_mm_per_min } else { self.feed_now()? };
                (self.sink)(Element { line, rapid, feed, shape: Shape::Line { from, to }, tilt: None })
            }
            None if !rapid => {
                Err(Refusal::new("position", "a cutting move from a position that is not known"))
            }
            _ => Ok(()),
        }
    }

    fn feed_now(&self) -> Result<f64, Refusal> {
        self.feed.filter(|f| *f > 0.0).ok_or_else(|| Refusal::new("feed", "a cutting move without a feed"))
    }

    /// A curve from the current position.
    fn follow(&mut self, line: usize, feed: f64, curve: Curve3, rule: &'static str) -> Result<(), Refusal> {
        let Some(place) = self.position else {
            return Err(Refusal::new("position", "a curve starts from a position that is not known"));
        };
        let gap = (curve.start() - place).norm();
        if gap > START_MM {
            return Err(Refusal::new(
                rule,
                format!("the curve starts {gap:.4} mm from the current position"),
            ));
        }
        self.position = Some(curve.end());
        self.rapid = false;
        (self.sink)(Element { line, rapid: false, feed, shape: Shape::Spline(curve), tilt: None })
    }

    fn begin_catia(&mut self, line: usize, text: &str) -> Result<(), Refusal> {
        let bad = |what: &str| Refusal::new("catia-begin", what);
        let inside = text
            .split_once('(')
            .and_then(|(_, r)| r.strip_suffix(");"))
            .ok_or_else(|| bad("BEGIN NURBS_SIEMENS needs (D=…,F=…,AXIS=…);"))?;
        let (mut degree, mut feed, mut axis) = (None, None, false);
        for part in inside.split(',') {
            match part.split_once('=') {
                Some(("AXIS", "VAR") | ("LENGTH", _)) => return Err(tilted()),
                Some(("D", d)) => degree = d.trim().parse::<usize>().ok().filter(|d| (2..=3).contains(d)),
                Some(("F", f)) => feed = Some(number(f.trim())?.0 * self.unit_mm),
                Some(("AXIS", a)) => axis = number(a.trim())?.0 == 0.0,
                Some(_) => return Err(bad("an unknown part")),
                None => {}
            }
        }
        let degree = degree.ok_or_else(|| bad("D must be 2 or 3"))?;
        let feed = feed.filter(|f| *f > 0.0).ok_or_else(|| bad("F must be positive"))?;
        if !axis || !inside.contains("AXIS=0.,0.,1.") && !inside.contains("AXIS=0,0,1") {
            return Err(tilted());
        }
        let (points, intervals, weights) = Default::default();
        self.catia = Some(Catia { line, degree, feed, points, intervals, weights });
        Ok(())
    }

    fn within_catia(&mut self, text: &str) -> Result<(), Refusal> {
        let bad = |what: String| Refusal::new("catia-point", what);
        if text == "END NURBS;" {
            let Some(c) = self.catia.take() else { return Ok(()) };
            let (d, n) = (c.degree, c.points.len());
            if n <= d {
                return Err(bad(format!("{n} control points are too few for D={d}")));
            }
            if c.intervals[0] != 0.0 {
                return Err(Refusal::new("catia-dk", "the first DK must be 0"));
            }
            let knots = knots_of_intervals(d, n, |i| c.intervals.get(i).copied())
                .ok_or_else(|| Refusal::new("catia-dk", "the outer DK must be 0"))?;
            let weights = c.weights.iter().any(|w| *w != 1.0).then_some(c.weights);
            let curve = KnotVector::new(d, knots)
                .and_then(|knots| Curve3::new(knots, c.points, weights))
                .map_err(|e| Refusal::new("catia-curve", e.to_string()))?;
            return self.follow(c.line, c.feed, curve, "catia-start");
        }
        let unit_mm = self.unit_mm;
        let Some(c) = &mut self.catia else { return Ok(()) };
        let body = text.strip_suffix(';').ok_or_else(|| bad("a point without `;`".into()))?;
        let mut slots = [None; 5];
        for (i, part) in body.split(',').enumerate() {
            if i == 0 {
                if part.trim() != format!("N{}", c.points.len()) {
                    return Err(bad(format!("`{}` is not N{}", first_chars(part), c.points.len())));
                }
                continue;
            }
            let value_of = || bad(format!("`{}` has no value", first_chars(part)));
            let (key, value) = part.split_once('=').ok_or_else(value_of)?;
            let slot = ["XT", "YT", "ZT", "DK", "W"].iter().position(|k| *k == key.trim());
            let slot = slot.ok_or_else(|| bad(format!("`{}` is not known", first_chars(key))))?;
            slots[slot] = Some(number(value.trim())?.0);
        }
        let [Some(x), Some(y), Some(z), Some(dk), Some(w)] = slots else {
            return Err(bad("a point needs XT, YT, ZT, DK and W".into()));
        };
        if dk < 0.0 {
            return Err(Refusal::new("catia-dk", "DK must not be negative"));
        }
        if w <= 0.0 {
            return Err(Refusal::new("catia-weight", "W must be positive"));
        }
        if c.points.len() >= MOST_POINTS {
            return Err(bad(format!("more than {MOST_POINTS} control points")));
        }
        c.points.push(Point3::new(x, y, z) * unit_mm);
        c.intervals.push(dk);
        c.weights.push(w);
        Ok(())
    }

    fn movnrb(&mut self, line: usize, rest: &str) -> Result<(), Refusal> {
        let bad = |rule, what: &str| Err(Refusal::new(rule, what));
        if rest == "M3AXIS" {
            return Ok(());
        }
        if rest == "M5AXIS" || rest.starts_with("LENGTH") {
            return Err(tilted());
        }
        if let Some(list) = rest.strip_prefix("ON,") {
            let v = values(list)?;
            if v.len() != 5 || v[..4].iter().any(|n| n.fract() != 0.0 || !(0.0..=1e6).contains(n)) {
                return bad("movnrb-on", "MOVNRB/ON needs order, knots, weights, points and length");
            }
            if v[2] != 0.0 {
                return bad("movnrb-weights", "MOVNRB has no weights: their number must be 0");
            }
            let (order, knots, points) = (v[0] as usize, v[1] as usize, v[3] as usize);
            if !(2..=26).contains(&order) || knots != points + order {
                return bad("movnrb-count", "the number of knots must be that of points plus the order");
            }
            self.movnrb = Some(Movnrb {
                line,
                order,
                knot_count: knots,
                point_count: points,
                knots: Vec::new(),
                values: Vec::new(),
                curve: None,
                last: None,
            });
            return Ok(());
        }
        let Some(open) = &mut self.movnrb else { return bad("movnrb-off", "MOVNRB without MOVNRB/ON") };
        if let Some((which @ ("1" | "2"), list)) = rest.split_once(',') {
            let v = values(list)?;
            if v.len() > MOVNRB_VALUES {
                return bad("movnrb-24", "more than 24 values in one statement");
            }
            let into = if which == "1" { &mut open.knots } else { &mut open.values };
            into.extend(v);
            if open.knots.len() > open.knot_count || open.values.len() > 3 * open.point_count {
                return bad("movnrb-count", "more values than MOVNRB/ON says");
            }
            return Ok(());
        }
        match rest {
            "NEXT" => {
                if open.knots.len() != open.knot_count || open.values.len() != 3 * open.point_count {
                    return bad("movnrb-count", "fewer values than MOVNRB/ON says");
                }
                let points = open
                    .values
                    .chunks_exact(3)
                    .map(|p| Point3::new(p[0], p[1], p[2]) * self.unit_mm)
                    .collect();
                let curve = KnotVector::new(open.order - 1, open.knots.clone())
                    .and_then(|knots| Curve3::new(knots, points, None))
                    .map_err(|e| Refusal::new("movnrb-curve", e.to_string()))?;
                open.curve = Some(curve);
                Ok(())
            }
            "OFF" => {
                let Some(open) = self.movnrb.take() else { return Ok(()) };
                let Some(curve) = open.curve else {
                    return bad("movnrb-next", "MOVNRB/OFF before MOVNRB/NEXT");
                };
                if open.last.is_none_or(|p| (p - curve.end()).norm() > START_MM) {
                    return bad("movnrb-goto", "the GOTO points do not end where the curve does");
                }
                let feed = self.feed_now()?;
                self.follow(open.line, feed, curve, "movnrb-start")
            }
            _ => bad("unknown-word", "MOVNRB of a kind that is not known"),
        }
    }
}
