//! Reads ISO 14649 in a Part 21 file: from the project to the trajectories, in the order in which they are run.

use std::collections::HashMap;
use std::io::BufRead;

use claymill_nurbs::{Curve3, KnotVector, Point3};

use super::step_nc::MM_PER_MIN;
use super::{Element, Fault, Sink, lines};
use crate::words::{first_chars, number, syntax};
use crate::{Machine, Refusal, Shape};

/// A curve of a list may begin this far from the end of the one before it, mm.
const GAP_MM: f64 = 1e-3;

/// Reads a file of STEP-NC.
pub(crate) fn read(text: &mut dyn BufRead, machine: &Machine, sink: Sink<'_>) -> Result<(), Fault> {
    let mut file = File::default();
    let (mut statement, mut begun, mut last) = (Statement::default(), 0, 0);
    lines(text, |line, text| {
        last = line;
        let mut rest = text;
        while !rest.is_empty() {
            if statement.text.is_empty() {
                begun = line;
            }
            let (whole, behind) = statement.take(rest);
            if whole {
                file.statement(begun, statement.text.trim())?;
                statement.text.clear();
            } else if statement.text.len() > LONGEST_STATEMENT {
                return Err(syntax("a statement without end"));
            }
            rest = behind;
        }
        Ok(())
    })?;
    file.run(machine, sink).map_err(|(line, refusal)| Fault::Refused { line: line.unwrap_or(last), refusal })
}

/// Characters of one statement: a section's list of moves may be long.
const LONGEST_STATEMENT: usize = 1 << 26;

/// A statement that is being gathered, without comments.
#[derive(Default)]
struct Statement {
    text: String,
    quoted: bool,
    comment: bool,
}

impl Statement {
    /// Takes from `rest` up to a `;` that stands in no string and no comment; whether there was one, and what is
    /// behind it.
    fn take<'t>(&mut self, rest: &'t str) -> (bool, &'t str) {
        let mut from = 0;
        for (i, c) in rest.char_indices() {
            if self.comment {
                if c == '/' && i > from && rest[..i].ends_with('*') {
                    self.comment = false;
                    from = i + 1;
                }
                continue;
            }
            match c {
                '\'' => self.quoted = !self.quoted,
                '/' if !self.quoted && rest[i + 1..].starts_with('*') => {
                    self.text.push_str(&rest[from..i]);
                    self.comment = true;
                    // Behind the star, which does not end what it begins.
                    from = i + 2;
                }
                ';' if !self.quoted => {
                    self.text.push_str(&rest[from..i]);
                    return (true, rest[i + 1..].trim_start());
                }
                _ => {}
            }
        }
        if !self.comment {
            self.text.push_str(&rest[from..]);
        }
        (false, "")
    }
}

/// A parameter of an instance.
#[derive(Debug, Clone, PartialEq)]
enum Arg {
    None,
    Ref(u64),
    Number(f64),
    Text(String),
    List(Vec<Arg>),
}

const DEEPEST: usize = 8;

/// Reads `( … )`; what follows it is returned too.
fn args(text: &str, depth: usize) -> Result<(Vec<Arg>, &str), Refusal> {
    if depth > DEEPEST {
        return Err(syntax("parentheses are nested too deep"));
    }
    let bad = |t: &str| syntax(format!("`{}` is no parameter", first_chars(t)));
    let mut rest = text.trim_start().strip_prefix('(').ok_or_else(|| bad(text))?.trim_start();
    let mut found = Vec::new();
    if let Some(behind) = rest.strip_prefix(')') {
        return Ok((found, behind));
    }
    loop {
        rest = rest.trim_start();
        let (arg, behind) = match rest.as_bytes().first() {
            Some(b'(') => {
                let (inner, behind) = args(rest, depth + 1)?;
                (Arg::List(inner), behind)
            }
            Some(b'\'') => {
                let end = rest[1..].find('\'').ok_or_else(|| bad(rest))?;
                (Arg::Text(rest[1..=end].to_owned()), &rest[end + 2..])
            }
            Some(_) => {
                let end = rest.find([',', ')']).ok_or_else(|| bad(rest))?;
                let word = rest[..end].trim();
                let arg = match word.as_bytes().first() {
                    Some(b'#') => Arg::Ref(word[1..].parse().map_err(|_| bad(word))?),
                    Some(b'$' | b'*') => Arg::None,
                    Some(b'.') => Arg::Text(word.to_owned()),
                    Some(b'0'..=b'9' | b'-' | b'+') => Arg::Number(number(word)?.0),
                    _ => return Err(bad(word)),
                };
                (arg, &rest[end..])
            }
            None => return Err(bad(rest)),
        };
        found.push(arg);
        rest = behind.trim_start();
        match rest.as_bytes().first() {
            Some(b',') => rest = &rest[1..],
            Some(b')') => return Ok((found, &rest[1..])),
            _ => return Err(bad(rest)),
        }
    }
}

/// The instances that matter for the moves.
#[derive(Debug)]
enum Node {
    Point(Point3),
    /// Points of straight moves.
    Polyline(Vec<u64>),
    Spline {
        degree: usize,
        points: Vec<u64>,
        knots: Vec<f64>,
        weights: Option<Vec<f64>>,
    },
    Segments(Vec<u64>),
    Segment(u64),
    Feed(f64),
    Trajectory {
        line: usize,
        rapid: bool,
        technology: u64,
        curve: u64,
    },
    /// A list, operation, workingstep, workplan or project: what it runs, in order.
    Runs(Vec<u64>),
    Other,
}

#[derive(Debug, Default)]
struct File {
    nodes: HashMap<u64, Node>,
    project: Option<u64>,
    ended: bool,
}

fn refs(arg: Option<&Arg>) -> Result<Vec<u64>, Refusal> {
    let Some(Arg::List(items)) = arg else { return Err(syntax("a list of instances is missing")) };
    let reference =
        |a: &Arg| if let Arg::Ref(n) = a { Ok(*n) } else { Err(syntax("an instance is missing")) };
    items.iter().map(reference).collect()
}

fn numbers(arg: Option<&Arg>) -> Result<Vec<f64>, Refusal> {
    let Some(Arg::List(items)) = arg else { return Err(syntax("a list of numbers is missing")) };
    let value = |a: &Arg| if let Arg::Number(n) = a { Ok(*n) } else { Err(syntax("a number is missing")) };
    items.iter().map(value).collect()
}

fn reference(arg: Option<&Arg>) -> Result<u64, Refusal> {
    if let Some(Arg::Ref(n)) = arg { Ok(*n) } else { Err(syntax("an instance is missing")) }
}

/// Knots written once each, with how often they occur.
fn repeated(counts: &[f64], values: &[f64]) -> Result<Vec<f64>, Refusal> {
    if counts.len() != values.len() || counts.iter().any(|c| c.fract() != 0.0 || !(1.0..=30.0).contains(c)) {
        return Err(Refusal::new("step-nc-knots", "multiplicities and knots do not fit"));
    }
    Ok(counts.iter().zip(values).flat_map(|(c, v)| vec![*v; *c as usize]).collect())
}

fn degree_of(arg: Option<&Arg>) -> Result<usize, Refusal> {
    match arg {
        Some(Arg::Number(d)) if (1.0..=25.0).contains(d) && d.fract() == 0.0 => Ok(*d as usize),
        _ => Err(Refusal::new("step-nc-degree", "a degree must be a whole number from 1 to 25")),
    }
}

impl File {
    fn statement(&mut self, line: usize, text: &str) -> Result<(), Refusal> {
        if text == "END-ISO-10303-21" {
            self.ended = true;
        }
        let Some(rest) = text.strip_prefix('#') else { return Ok(()) };
        let (id, body) = rest.split_once('=').ok_or_else(|| syntax("an instance without `=`"))?;
        let id: u64 = id.trim().parse().map_err(|_| syntax(format!("#{} is no number", first_chars(id))))?;
        let body = body.trim();
        let node = if body.starts_with('(') { complex(body)? } else { self.simple(line, id, body)? };
        if self.nodes.insert(id, node).is_some() {
            return Err(Refusal::new("step-nc-twice", format!("#{id} is defined twice")));
        }
        Ok(())
    }

    fn simple(&mut self, line: usize, id: u64, body: &str) -> Result<Node, Refusal> {
        let open = body.find('(').ok_or_else(|| syntax("an instance without parameters"))?;
        let (name, rest) = body.split_at(open);
        let (a, _) = args(rest, 0)?;
        Ok(match name.trim() {
            "CARTESIAN_POINT" => match numbers(a.get(1))?[..] {
                [x, y, z] => Node::Point(Point3::new(x, y, z)),
                _ => return Err(syntax("a point needs three coordinates")),
            },
            "POLYLINE" => Node::Polyline(refs(a.get(1))?),
            "B_SPLINE_CURVE_WITH_KNOTS" => Node::Spline {
                degree: degree_of(a.get(1))?,
                points: refs(a.get(2))?,
                knots: repeated(&numbers(a.get(6))?, &numbers(a.get(7))?)?,
                weights: None,
            },
            "COMPOSITE_CURVE" => Node::Segments(refs(a.get(1))?),
            "COMPOSITE_CURVE_SEGMENT" => Node::Segment(reference(a.get(2))?),
            "MILLING_TECHNOLOGY" => match a.first() {
                Some(Arg::Number(feed)) if *feed > 0.0 => Node::Feed(feed * MM_PER_MIN),
                _ => return Err(Refusal::new("feed", "a technology without a positive feed")),
            },
            "CUTTER_LOCATION_TRAJECTORY" => {
                if a.get(7).is_some_and(|a| *a != Arg::None) {
                    return Err(Refusal::new("axis", "a tool axis that varies cannot be checked"));
                }
                let rapid = matches!(a.get(1), Some(Arg::Text(kind)) if kind == ".NON_CONTACT.");
                Node::Trajectory {
                    line,
                    rapid,
                    technology: reference(a.get(3))?,
                    curve: reference(a.get(6))?,
                }
            }
            "CUTTER_CONTACT_TRAJECTORY" => {
                return Err(Refusal::new(
                    "step-nc-contact",
                    "contact trajectories leave the tool's place to the control",
                ));
            }
            "TOOLPATH_LIST" => Node::Runs(refs(a.first())?),
            "FREEFORM_OPERATION" => Node::Runs(vec![reference(a.first())?]),
            "MACHINING_WORKINGSTEP" => Node::Runs(vec![reference(a.get(3))?]),
            "WORKPLAN" => Node::Runs(refs(a.get(1))?),
            "PROJECT" => {
                self.project = Some(id);
                Node::Runs(vec![reference(a.get(1))?])
            }
            _ => Node::Other,
        })
    }

    fn point(&self, id: u64) -> Result<Point3, Refusal> {
        match self.nodes.get(&id) {
            Some(Node::Point(p)) => Ok(*p),
            _ => Err(Refusal::new("step-nc-missing", format!("#{id} should be a point"))),
        }
    }

    /// Follows project, workplans, workingsteps, operations and lists to the moves, in order.
    fn run(&self, machine: &Machine, sink: Sink<'_>) -> Result<(), (Option<usize>, Refusal)> {
        let fail = |refusal| (None, refusal);
        if !self.ended {
            return Err(fail(Refusal::new("program-end", "the file has no END-ISO-10303-21")));
        }
        let project = self.project.ok_or_else(|| fail(Refusal::new("step-nc-project", "no PROJECT")))?;
        let mut waiting = vec![project];
        let mut visits = 0;
        let mut place: Option<Point3> = None;
        while let Some(id) = waiting.pop() {
            visits += 1;
            if visits > 2 * self.nodes.len() {
                return Err(fail(Refusal::new("step-nc-cycle", format!("#{id} runs itself"))));
            }
            match self.nodes.get(&id) {
                Some(Node::Runs(next)) => {
                    // Each list of trajectories begins where it likes.
                    place = None;
                    waiting.extend(next.iter().rev());
                }
                Some(Node::Trajectory { line, rapid, technology, curve }) => {
                    let feed = match self.nodes.get(technology) {
                        Some(Node::Feed(_)) if *rapid => machine.feed.rapid_mm_per_min,
                        Some(Node::Feed(feed)) => *feed,
                        _ => {
                            let refusal =
                                Refusal::new("feed", format!("#{technology} should be a technology"));
                            return Err((Some(*line), refusal));
                        }
                    };
                    self.shapes(*curve, 0, &mut |shape| {
                        let gap_mm = place.map_or(0.0, |p| (p - shape.start()).norm());
                        if gap_mm > GAP_MM {
                            return Err(Refusal::new(
                                "step-nc-gap",
                                format!("a curve begins {gap_mm:.4} mm from the end of the one before it"),
                            ));
                        }
                        place = Some(shape.end());
                        sink(Element { line: *line, rapid: *rapid, feed, shape, tilt: None })
                    })
                    .map_err(|refusal| (Some(*line), refusal))?;
                }
                _ => {
                    return Err(fail(Refusal::new(
                        "step-nc-missing",
                        format!("#{id} should be a step of the plan"),
                    )));
                }
            }
        }
        Ok(())
    }

    fn shapes(
        &self,
        id: u64,
        depth: usize,
        each: &mut dyn FnMut(Shape) -> Result<(), Refusal>,
    ) -> Result<(), Refusal> {
        if depth > DEEPEST {
            return Err(Refusal::new("step-nc-cycle", format!("#{id} holds itself")));
        }
        match self.nodes.get(&id) {
            Some(Node::Polyline(ids)) => {
                let points: Vec<Point3> = ids.iter().map(|id| self.point(*id)).collect::<Result<_, _>>()?;
                for pair in points.windows(2).filter(|w| w[0] != w[1]) {
                    each(Shape::Line { from: pair[0], to: pair[1] })?;
                }
                Ok(())
            }
            Some(Node::Spline { degree, points, knots, weights }) => {
                let points = points.iter().map(|id| self.point(*id)).collect::<Result<_, _>>()?;
                let curve = KnotVector::new(*degree, knots.clone())
                    .and_then(|knots| Curve3::new(knots, points, weights.clone()))
                    .map_err(|e| Refusal::new("step-nc-curve", e.to_string()))?;
                each(Shape::Spline(curve))
            }
            Some(Node::Segments(ids)) => ids.iter().try_for_each(|id| match self.nodes.get(id) {
                Some(Node::Segment(curve)) => self.shapes(*curve, depth + 1, each),
                _ => Err(Refusal::new("step-nc-missing", format!("#{id} should be a segment"))),
            }),
            _ => Err(Refusal::new("step-nc-missing", format!("#{id} should be a curve"))),
        }
    }
}

/// A rational B-spline curve, written as a complex instance.
fn complex(body: &str) -> Result<Node, Refusal> {
    let (mut degree, mut points, mut knots, mut weights) = (None, None, None, None);
    let mut rest = body[1..].trim_start();
    while !rest.starts_with(')') {
        let open = rest.find('(').ok_or_else(|| syntax("a complex instance is not closed"))?;
        let name = rest[..open].trim();
        let (a, behind) = args(&rest[open..], 0)?;
        match name {
            "B_SPLINE_CURVE" => {
                degree = Some(degree_of(a.first())?);
                points = Some(refs(a.get(1))?);
            }
            "B_SPLINE_CURVE_WITH_KNOTS" => knots = Some(repeated(&numbers(a.first())?, &numbers(a.get(1))?)?),
            "RATIONAL_B_SPLINE_CURVE" => weights = Some(numbers(a.first())?),
            _ => {}
        }
        rest = behind.trim_start();
    }
    match (degree, points, knots, weights) {
        (Some(degree), Some(points), Some(knots), weights @ Some(_)) => {
            Ok(Node::Spline { degree, points, knots, weights })
        }
        _ => Ok(Node::Other),
    }
}
