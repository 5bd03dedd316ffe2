use claymill_nurbs::Point3;

use super::gcode::Flavour;
use super::{Element, Sink, beckhoff, fanuc, linuxcnc, siemens};
use crate::words::{Comments, Value, Word, first_chars, words};
use crate::{Arc, Machine, Plane, Refusal, Shape};

/// The motion that a block without a G word goes on with.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Motion {
    None,
    Rapid,
    Feed,
    Clockwise,
    Counterclockwise,
    Poly,
}

/// A spline that later blocks go on with.
#[derive(Debug)]
enum Open {
    Fanuc(fanuc::Open),
    Siemens(siemens::Open),
    LinuxCnc(linuxcnc::Open),
    Beckhoff(Vec<Point3>),
}

/// The modal state of a control that reads G-code.
pub(crate) struct Reader<'a> {
    flavour: Flavour,
    machine: &'a Machine,
    sink: Sink<'a>,
    position: [Option<f64>; 3],
    motion: Motion,
    plane: Plane,
    feed: Option<f64>,
    unit_mm: f64,
    high_speed: bool,
    spline_type: bool,
    /// Line of the first block of the open spline.
    begun: usize,
    open: Option<Open>,
    ended: bool,
}

/// LinuxCNC refuses arcs with a smaller radius, mm (0.00005 inch).
const LINUXCNC_RADIUS_MM: f64 = 0.00127;

impl<'a> Reader<'a> {
    pub(crate) fn new(flavour: Flavour, machine: &'a Machine, sink: Sink<'a>) -> Self {
        Reader {
            flavour,
            machine,
            sink,
            position: [None; 3],
            motion: Motion::None,
            plane: Plane::Xy,
            feed: None,
            unit_mm: machine.units.mm(),
            high_speed: false,
            spline_type: false,
            begun: 0,
            open: None,
            ended: false,
        }
    }

    fn place(&self) -> Option<Point3> {
        match self.position {
            [Some(x), Some(y), Some(z)] => Some(Point3::new(x, y, z)),
            _ => None,
        }
    }

    fn step_mm(&self) -> f64 {
        self.unit_mm * if self.flavour == Flavour::Fanuc { 1e-3 } else { 1e-4 }
    }

    fn go(&mut self, line: usize, rapid: bool, shape: Shape) -> Result<(), Refusal> {
        let end = shape.end();
        self.position = [Some(end.x), Some(end.y), Some(end.z)];
        let feed = if rapid { self.machine.feed.rapid_mm_per_min } else { self.feed()? };
        (self.sink)(Element { line, rapid, feed, shape })
    }

    fn feed(&self) -> Result<f64, Refusal> {
        match self.feed {
            Some(feed) if feed > 0.0 => Ok(feed),
            _ => Err(Refusal::new("feed", "a cutting move without a feed")),
        }
    }

    /// At the end of the text.
    pub(crate) fn finish(&mut self) -> Result<(), Refusal> {
        if self.open.is_some() {
            return Err(Refusal::new("spline-open", "the program ends within a spline"));
        }
        if !self.ended {
            return Err(Refusal::new("program-end", "the program has no end (M30 or M2)"));
        }
        Ok(())
    }

    pub(crate) fn block(&mut self, line: usize, text: &str) -> Result<(), Refusal> {
        let mut text = text.trim();
        if let Some(rest) = text.strip_prefix('N') {
            text = rest.trim_start_matches(|c: char| c.is_ascii_digit()).trim_start();
        }
        let custom = |lines: &[String]| lines.iter().any(|l| l.trim() == text);
        if text.is_empty() || text == "%" || custom(&self.machine.start) || custom(&self.machine.end) {
            return Ok(());
        }
        let is_tool_change = |l: &String| {
            l.split_once("{tool}").map_or(l.trim() == text, |(a, b)| text.starts_with(a) && text.ends_with(b))
        };
        if self.machine.tool_change.as_ref().is_some_and(|lines| lines.iter().any(is_tool_change)) {
            return Ok(());
        }
        let comments = if self.flavour.semicolon() { Comments::Semicolon } else { Comments::Parentheses };
        let words = words(text, comments)?;
        if words.is_empty() {
            return Ok(());
        }
        if words[0].key.starts_with('#') {
            return self.hash(line, &words);
        }
        if self.goes_on(line, &words)? { Ok(()) } else { self.plain(line, &words) }
    }

    /// Whether an open spline took the block.
    fn goes_on(&mut self, line: usize, words: &[Word]) -> Result<bool, Refusal> {
        let unit_mm = self.unit_mm;
        let is = |key: &str, code: u32| words.iter().any(|w| w.key == key && w.code() == Some(code));
        match self.open.take() {
            None => Ok(false),
            Some(Open::Fanuc(mut open)) => {
                if words.iter().any(|w| matches!(w.key, "G" | "M" | "S" | "T")) {
                    return Err(if words.iter().any(|w| w.key == "K") {
                        Refusal::new("nurbs-ps1005", "G, M, S or T within a NURBS")
                    } else {
                        open.early()
                    });
                }
                match open.block(words, unit_mm)? {
                    Some(curve) => self.go(self.begun, false, Shape::Spline(curve))?,
                    None => self.open = Some(Open::Fanuc(open)),
                }
                Ok(true)
            }
            Some(Open::Siemens(mut open)) => {
                if words.iter().any(|w| w.key == "BSPLINE") {
                    return Err(Refusal::new(
                        "siemens-run-on",
                        "BSPLINE within a BSPLINE: the two would be one; put G1 between them",
                    ));
                }
                if words.iter().any(|w| matches!(w.key, "G" | "M" | "S" | "T" | "POLY")) {
                    let curve = open.close()?;
                    self.go(self.begun, false, Shape::Spline(curve))?;
                    return Ok(false);
                }
                self.words_beside(words, &["X", "Y", "Z", "SD", "PL", "PW", "F"])?;
                open.block(words, unit_mm)?;
                self.open = Some(Open::Siemens(open));
                Ok(true)
            }
            Some(Open::LinuxCnc(mut open)) => {
                if is("G", 52) {
                    open.block(words, unit_mm)?;
                    self.take_feed(words);
                    self.open = Some(Open::LinuxCnc(open));
                } else if is("G", 53) && words.len() == 1 {
                    self.feed()?;
                    let curve = open.close()?;
                    self.motion = Motion::None;
                    self.go(self.begun, false, Shape::Spline(curve))?;
                } else {
                    return Err(Refusal::new(
                        "linuxcnc-between",
                        format!(
                            "{} from line {} on: only G5.2 may stand before G5.3",
                            words[0].key, self.begun
                        ),
                    ));
                }
                let _ = line;
                Ok(true)
            }
            Some(Open::Beckhoff(mut points)) => {
                if words
                    .iter()
                    .any(|w| matches!(w.key, "M" | "S" | "T") || (w.key == "G" && w.code() != Some(10)))
                {
                    return Err(Refusal::new(
                        "beckhoff-word",
                        "only linear blocks may stand within a spline",
                    ));
                }
                self.words_beside(words, &["G", "X", "Y", "Z", "F"])?;
                self.take_feed(words);
                let mut p = points[points.len() - 1];
                for w in words {
                    if let (Some(axis), Some(value)) = ("XYZ".find(w.key), w.number()) {
                        p[axis] = value * unit_mm;
                    }
                }
                points.push(p);
                self.open = Some(Open::Beckhoff(points));
                Ok(true)
            }
        }
    }

    fn words_beside(&mut self, words: &[Word], allowed: &[&str]) -> Result<(), Refusal> {
        match words.iter().find(|w| !allowed.contains(&w.key)) {
            Some(w) => {
                Err(Refusal::new("unknown-word", format!("`{}` has no place here", first_chars(w.key))))
            }
            None => Ok(()),
        }
    }

    fn take_feed(&mut self, words: &[Word]) {
        for w in words.iter().filter(|w| w.key == "F") {
            self.feed = w.number().map(|f| f * self.unit_mm);
        }
    }

    /// `#SPLINE …`
    fn hash(&mut self, line: usize, words: &[Word]) -> Result<(), Refusal> {
        let keys: Vec<&str> = words.iter().map(|w| w.key).collect();
        match (self.flavour, keys.as_slice()) {
            (Flavour::Beckhoff, ["#SPLINE", "TYPE", "BSPLINE"]) => self.spline_type = true,
            (Flavour::Beckhoff, ["#SPLINE", "ON"]) => {
                if !self.spline_type {
                    return Err(Refusal::new(
                        "beckhoff-type",
                        "#SPLINE ON without #SPLINE TYPE BSPLINE: an Akima spline",
                    ));
                }
                if self.open.is_some() {
                    return Err(Refusal::new("beckhoff-run-on", "#SPLINE ON within a spline"));
                }
                let Some(place) = self.place() else {
                    return Err(Refusal::new(
                        "position",
                        "a spline starts from a position that is not known",
                    ));
                };
                self.begun = line;
                self.open = Some(Open::Beckhoff(vec![place]));
            }
            (Flavour::Beckhoff, ["#SPLINE", "OFF"]) => match self.open.take() {
                Some(Open::Beckhoff(points)) => {
                    let curve = beckhoff::close(points)?;
                    self.go(self.begun, false, Shape::Spline(curve))?;
                }
                _ => return Err(Refusal::new("beckhoff-off", "#SPLINE OFF without #SPLINE ON")),
            },
            _ => {
                return Err(Refusal::new("unknown-word", format!("`{}` is not known", first_chars(keys[0]))));
            }
        }
        Ok(())
    }

    /// A block outside of splines.
    fn plain(&mut self, line: usize, words: &[Word]) -> Result<(), Refusal> {
        let mut axes = [None; 3];
        let mut centre = [None; 3];
        let mut begins = None;
        let mut lost = false;
        for w in words {
            let unknown =
                || Err(Refusal::new("unknown-word", format!("`{}` is not known", first_chars(w.key))));
            match (w.key, &w.value) {
                ("G", Value::Number { .. }) => {
                    if let Some(spline) = self.g(w.code(), words)? {
                        begins = Some(spline);
                    }
                }
                ("M", Value::Number { .. }) => match w.code() {
                    Some(0 | 10) => lost = true,
                    Some(20 | 300) => self.ended = true,
                    Some(30 | 40 | 50 | 60 | 70 | 80 | 90) => {}
                    _ => return unknown(),
                },
                ("X" | "Y" | "Z", Value::Number { value, .. }) => {
                    axes["XYZ".find(w.key).unwrap_or(0)] = Some(value * self.unit_mm);
                }
                ("I" | "J" | "K", Value::Number { value, .. }) if begins != Some("G06.2") => {
                    centre["IJK".find(w.key).unwrap_or(0)] = Some(value * self.unit_mm);
                }
                ("F", Value::Number { value, .. }) => self.feed = Some(value * self.unit_mm),
                ("A" | "B" | "C" | "U" | "V" | "W", Value::Number { .. }) => {
                    return Err(Refusal::new("axis", format!("`{}`: only X, Y and Z can be checked", w.key)));
                }
                ("R" | "K", Value::Number { .. }) if begins == Some("G06.2") => {}
                ("R", Value::Number { .. }) => {
                    return Err(Refusal::new("arc-radius-word", "arcs by R are ambiguous; use I, J, K"));
                }
                ("S" | "T" | "H" | "D" | "P" | "O", Value::Number { .. }) => {}
                ("L", Value::Number { .. }) if begins == Some("G5.2") => {}
                ("BSPLINE", Value::None) if self.flavour == Flavour::Siemens => begins = Some("BSPLINE"),
                ("POLY", Value::None) if self.flavour == Flavour::Siemens => self.motion = Motion::Poly,
                ("SD" | "PL" | "PW", Value::Number { .. }) if self.flavour == Flavour::Siemens => {}
                ("PO", Value::List(_)) if self.flavour == Flavour::Siemens && self.motion == Motion::Poly => {
                }
                _ => return unknown(),
            }
        }
        if lost {
            // The operator may do what he likes before the program goes on.
            self.position = [None; 3];
        }
        if let Some(spline) = begins {
            return self.begin(line, spline, words);
        }
        self.travel(line, axes, centre, words)
    }

    /// A G code; a spline's name when it begins one.
    fn g(&mut self, code: Option<u32>, words: &[Word]) -> Result<Option<&'static str>, Refusal> {
        let refuse = |rule, detail: &str| Err(Refusal::new(rule, detail));
        let siemens = self.flavour == Flavour::Siemens;
        match code.unwrap_or(u32::MAX) {
            0 => self.motion = Motion::Rapid,
            10 => self.motion = Motion::Feed,
            20 => self.motion = Motion::Clockwise,
            30 => self.motion = Motion::Counterclockwise,
            170 => self.plane = Plane::Xy,
            180 => self.plane = Plane::Zx,
            190 => self.plane = Plane::Yz,
            200 if !siemens => self.unit_mm = 25.4,
            210 if !siemens => self.unit_mm = 1.0,
            700 if siemens => self.unit_mm = 25.4,
            710 if siemens => self.unit_mm = 1.0,
            400 | 490 | 540..=599 | 640 | 800 | 900 | 940 | 430 => {}
            50 if matches!(self.flavour, Flavour::Fanuc | Flavour::Mitsubishi) => {
                let p = words.iter().find(|w| w.key == "P").and_then(Word::number);
                self.high_speed = p == Some(10_000.0);
            }
            62 if matches!(self.flavour, Flavour::Fanuc | Flavour::Mitsubishi) => return Ok(Some("G06.2")),
            52 if matches!(self.flavour, Flavour::LinuxCnc { .. }) => return Ok(Some("G5.2")),
            53 if matches!(self.flavour, Flavour::LinuxCnc { .. }) => {
                return refuse("linuxcnc-g5.3", "G5.3 without G5.2");
            }
            62 => return refuse("linuxcnc-g6.2", "G6.2 is unknown to 2.9 and corrupts the position in 2.10"),
            410 | 420 => {
                return refuse(
                    "radius-compensation",
                    "G41 and G42 move the path by what the control knows only",
                );
            }
            910 => return refuse("incremental", "G91: incremental positions are not read"),
            930 | 950 => return refuse("feed-mode", "G93 and G95: feeds other than mm/min are not read"),
            _ => return refuse("unknown-code", "a G code that is not known: its effect cannot be checked"),
        }
        Ok(None)
    }

    fn begin(&mut self, line: usize, spline: &str, words: &[Word]) -> Result<(), Refusal> {
        self.begun = line;
        self.take_feed(words);
        let (position, unit_mm) = (self.place(), self.unit_mm);
        self.open = Some(match (self.flavour, spline) {
            (Flavour::Siemens, _) => {
                self.feed()?;
                let mut open = siemens::Open::begin(position)?;
                open.block(words, unit_mm)?;
                Open::Siemens(open)
            }
            (Flavour::LinuxCnc { planes }, _) => {
                let mut open = linuxcnc::Open::begin(planes, self.plane, position)?;
                open.block(words, unit_mm)?;
                Open::LinuxCnc(open)
            }
            (flavour, _) => {
                self.feed()?;
                self.motion = Motion::None;
                let step = self.step_mm();
                Open::Fanuc(fanuc::Open::begin(flavour, words, unit_mm, position, step, self.high_speed)?)
            }
        });
        Ok(())
    }

    /// A line, an arc or a polynomial, if the block names axes.
    fn travel(
        &mut self,
        line: usize,
        axes: [Option<f64>; 3],
        centre: [Option<f64>; 3],
        words: &[Word],
    ) -> Result<(), Refusal> {
        let from = self.place();
        if self.motion == Motion::Poly && words.iter().any(|w| w.key == "PO") {
            let Some(from) = from else {
                return Err(Refusal::new("position", "POLY starts from a position that is not known"));
            };
            self.feed()?;
            let curve = siemens::poly(words, from, self.unit_mm)?;
            return self.go(line, false, Shape::Spline(curve));
        }
        if axes == [None; 3] {
            return Ok(());
        }
        let mut target = self.position;
        for axis in 0..3 {
            target[axis] = axes[axis].or(target[axis]);
        }
        let arc = matches!(self.motion, Motion::Clockwise | Motion::Counterclockwise);
        if self.motion == Motion::None || self.motion == Motion::Poly {
            return Err(Refusal::new("no-motion", "axes without a motion code: no G0 to G3 is active"));
        }
        let ([Some(x), Some(y), Some(z)], Some(from)) = (target, from) else {
            if arc || self.motion == Motion::Feed {
                return Err(Refusal::new("position", "a cutting move from a position that is not known"));
            }
            self.position = target;
            return Ok(());
        };
        let to = Point3::new(x, y, z);
        if arc {
            self.feed()?;
            let mut middle = from;
            for axis in 0..3 {
                if centre[axis].is_some() && axis == self.plane.axes()[2] {
                    return Err(Refusal::new("arc-centre", "a centre across the active plane"));
                }
                middle[axis] += centre[axis].unwrap_or(0.0);
            }
            let clockwise = self.motion == Motion::Clockwise;
            let arc = Arc::through(from, to, middle, self.plane, clockwise).ok_or_else(|| {
                Refusal::new("arc-radius", "the arc's ends are not equally far from its centre")
            })?;
            if matches!(self.flavour, Flavour::LinuxCnc { .. }) && arc.radius_mm() < LINUXCNC_RADIUS_MM {
                return Err(Refusal::new(
                    "linuxcnc-zero-radius",
                    format!("a radius of {:.6} mm counts as none", arc.radius_mm()),
                ));
            }
            return self.go(line, false, Shape::Arc(arc));
        }
        if from == to {
            return Ok(());
        }
        self.go(line, self.motion == Motion::Rapid, Shape::Line { from, to })
    }
}
