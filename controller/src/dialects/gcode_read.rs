//! Reads G-code block by block as a control would, with the splines, arcs and rules of each
//! flavour. What a control would reject or execute wrongly is refused by name.

use claymill_nurbs::Point3;

use super::flavour::Flavour;
use super::gcode_modes::{Begins, Modes, Motion};
use super::own_blocks::OwnBlocks;
use super::plane_reader::PlaneReader;
use super::{Element, Sink, beckhoff, fanuc, linuxcnc, siemens};
use crate::words::{Comments, Value, Word, first_chars, words};
use crate::{Arc, Machine, Refusal, Shape};

/// A spline that later blocks go on with.
#[derive(Debug)]
enum Open {
    Fanuc(fanuc::Open),
    Siemens(siemens::Open),
    LinuxCnc(linuxcnc::Open),
    Beckhoff(Vec<Point3>),
}

/// A control that reads G-code, block by block.
pub(crate) struct Reader<'a> {
    flavour: Flavour,
    machine: &'a Machine,
    sink: Sink<'a>,
    own: OwnBlocks,
    modes: Modes,
    position: [Option<f64>; 3],
    feed: Option<f64>,
    spline_type: bool,
    /// Line of the first block of the open spline.
    begun: usize,
    open: Option<Open>,
    planes: PlaneReader<'a>,
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
            own: OwnBlocks::new(machine, |line| bare(line).to_owned()),
            modes: Modes::new(flavour, machine),
            position: [None; 3],
            feed: None,
            spline_type: false,
            begun: 0,
            open: None,
            planes: PlaneReader::new(flavour, machine),
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
        self.modes.unit_mm * if self.flavour == Flavour::Fanuc { 1e-3 } else { 1e-4 }
    }

    fn go(&mut self, line: usize, rapid: bool, shape: Shape) -> Result<(), Refusal> {
        let end = shape.end();
        self.position = [Some(end.x), Some(end.y), Some(end.z)];
        self.modes.check()?;
        self.planes.check()?;
        if !rapid {
            self.modes.check_blend(self.machine)?;
        }
        let feed = if rapid { self.machine.feed.rapid_mm_per_min } else { self.feed()? };
        (self.sink)(Element { line, rapid, feed, shape, tilt: self.planes.tilt() })
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
        self.planes.finish()?;
        Ok(())
    }

    pub(crate) fn block(&mut self, line: usize, text: &str) -> Result<(), Refusal> {
        let text = bare(text);
        if text.is_empty() || text == "%" {
            return Ok(());
        }
        match self.read(line, text) {
            Err(_) if self.open.is_none() && self.own.has(text) => {
                self.pass_over(text);
                Ok(())
            }
            read => read,
        }
    }

    /// A block of the machine definition that is not understood: its modes count, and where it goes nobody knows.
    fn pass_over(&mut self, text: &str) {
        let words = words(text, self.comments()).unwrap_or_default();
        for w in words.iter().filter(|w| w.key == "G") {
            self.modes.leave(w.code(), &words);
        }
        self.position = [None; 3];
    }

    fn comments(&self) -> Comments {
        if self.flavour.semicolon() { Comments::Semicolon } else { Comments::Parentheses }
    }

    fn read(&mut self, line: usize, text: &str) -> Result<(), Refusal> {
        if self.flavour == Flavour::Siemens {
            if self.open.is_none() && self.planes.cycle(text, self.modes.unit_mm)? {
                self.position = [None; 3];
                return Ok(());
            }
            if siemens::call(text)? {
                return Ok(());
            }
        }
        let words = words(text, self.comments())?;
        if words.is_empty() {
            return Ok(());
        }
        if words[0].key.starts_with('#') {
            return self.hash(line, &words);
        }
        if self.goes_on(&words)? {
            return Ok(());
        }
        if self.goes_home(&words) {
            self.modes.leave(Some(910), &words);
            self.position = [None; 3];
            return Ok(());
        }
        if self.planes.block(&words, self.modes.unit_mm, self.ended)? {
            // The rotary axes have moved: where the tool is in the new plane nobody knows. An indexed part does not move it.
            if self.flavour == Flavour::Fanuc {
                self.position = [None; 3];
            }
            return Ok(());
        }
        self.plain(line, &words)
    }

    /// `G91 G28 Z0.`: from where it is straight to the reference point of Z.
    fn goes_home(&self, words: &[Word]) -> bool {
        let [g91, g28, z] = words else { return false };
        matches!(self.flavour, Flavour::Fanuc | Flavour::Mitsubishi)
            && [g91, g28].iter().all(|w| w.key == "G")
            && [g91.code(), g28.code()] == [Some(910), Some(280)]
            && z.key == "Z"
            && z.number() == Some(0.0)
            && !self.ended
    }

    /// Whether an open spline took the block.
    fn goes_on(&mut self, words: &[Word]) -> Result<bool, Refusal> {
        let unit_mm = self.modes.unit_mm;
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
                words.iter().try_for_each(|w| self.pointed(w))?;
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
                    self.modes.motion = Motion::None;
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
                Ok(true)
            }
            Some(Open::Beckhoff(mut points)) => {
                if is("G", 1500) && words.len() == 1 {
                    self.end_beckhoff(points)?;
                    return Ok(true);
                }
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
            self.feed = w.number().map(|f| f * self.modes.unit_mm);
        }
    }

    /// `#SPLINE …`
    fn hash(&mut self, line: usize, words: &[Word]) -> Result<(), Refusal> {
        let keys: Vec<&str> = words.iter().map(|w| w.key).collect();
        match (self.flavour, keys.as_slice()) {
            (Flavour::Beckhoff, ["#SPLINE", "TYPE", "BSPLINE"]) => self.spline_type = true,
            (Flavour::Beckhoff, ["#SPLINE", "TYPE", ..]) => {
                return Err(Refusal::new("beckhoff-type", "#SPLINE TYPE of another kind than BSPLINE"));
            }
            (Flavour::Beckhoff, ["#SPLINE", "ON"]) => self.begin_beckhoff(line)?,
            (Flavour::Beckhoff, ["#SPLINE", "OFF"]) => match self.open.take() {
                Some(Open::Beckhoff(points)) => self.end_beckhoff(points)?,
                _ => return Err(Refusal::new("beckhoff-off", "#SPLINE OFF without #SPLINE ON")),
            },
            _ => {
                return Err(Refusal::new("unknown-word", format!("`{}` is not known", first_chars(keys[0]))));
            }
        }
        Ok(())
    }

    /// `#SPLINE ON` or G151.
    fn begin_beckhoff(&mut self, line: usize) -> Result<(), Refusal> {
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
            return Err(Refusal::new("position", "a spline starts from a position that is not known"));
        };
        self.begun = line;
        self.open = Some(Open::Beckhoff(vec![place]));
        Ok(())
    }

    /// `#SPLINE OFF` or G150.
    fn end_beckhoff(&mut self, points: Vec<Point3>) -> Result<(), Refusal> {
        self.go(self.begun, false, Shape::Spline(beckhoff::close(points)?))
    }

    /// A block outside of splines.
    fn plain(&mut self, line: usize, words: &[Word]) -> Result<(), Refusal> {
        if self.ended {
            return Err(Refusal::new("program-end", "a block behind the program's end"));
        }
        let siemens = self.flavour == Flavour::Siemens;
        let mut begins = None;
        // Modes hold for the whole block, wherever in it they stand.
        for w in words {
            match (w.key, &w.value) {
                ("G", Value::Number { .. }) => begins = self.modes.take(w.code(), words)?.or(begins),
                ("BSPLINE", Value::None) if siemens => begins = Some(Begins::Siemens),
                ("POLY", Value::None) if siemens => self.modes.motion = Motion::Poly,
                _ => {}
            }
        }
        if begins == Some(Begins::Dwell) {
            return Ok(());
        }
        let mut block = Block::default();
        for w in words {
            self.word(w, begins, &mut block)?;
        }
        if block.lost {
            // What the operator or the tool changer does in between nobody knows.
            self.position = [None; 3];
        }
        match begins {
            Some(spline) => self.begin(line, spline, words),
            None => self.travel(line, &block, words),
        }
    }

    /// A word of a block outside of splines.
    fn word(&mut self, w: &Word, begins: Option<Begins>, block: &mut Block) -> Result<(), Refusal> {
        let siemens = self.flavour == Flavour::Siemens;
        let unit_mm = self.modes.unit_mm;
        let nurbs = begins == Some(Begins::Fanuc);
        self.pointed(w)?;
        match (w.key, &w.value) {
            ("G", Value::Number { .. }) => {}
            ("M", Value::Number { .. }) => match w.code() {
                Some(0 | 10 | 60) => block.lost = true,
                Some(20 | 300) => self.ended = true,
                Some(30 | 40 | 50 | 70 | 80 | 90) => {}
                _ => return Err(unknown(w)),
            },
            ("X" | "Y" | "Z", Value::Number { value, .. }) => {
                block.axes["XYZ".find(w.key).unwrap_or(0)] = Some(value * unit_mm);
            }
            ("R" | "K", Value::Number { .. }) if nurbs => {}
            ("I" | "J" | "K", Value::Number { value, .. }) => {
                block.centre["IJK".find(w.key).unwrap_or(0)] = Some(value * unit_mm);
            }
            ("F", Value::Number { value, .. }) => self.feed = Some(value * unit_mm),
            ("A" | "B" | "C" | "U" | "V" | "W", Value::Number { .. }) => {
                return Err(Refusal::new("axis", format!("`{}`: only X, Y and Z can be checked", w.key)));
            }
            ("R", Value::Number { .. }) => {
                return Err(Refusal::new("arc-radius-word", "arcs by R are ambiguous; use I, J, K"));
            }
            ("S" | "T" | "H" | "D" | "P" | "O", Value::Number { .. }) => {}
            ("L", Value::Number { .. }) if begins == Some(Begins::LinuxCnc) => {}
            ("Q", Value::Number { .. }) if begins == Some(Begins::Cubic) => {}
            ("BSPLINE" | "POLY" | "COMPOF", Value::None) if siemens => {}
            ("SD" | "PL" | "PW", Value::Number { .. }) if siemens => {}
            ("PO", Value::List(_)) if siemens && self.modes.motion == Motion::Poly => {}
            _ if siemens => return Err(siemens::stranger(w.key).unwrap_or_else(|| unknown(w))),
            _ => return Err(unknown(w)),
        }
        Ok(())
    }

    /// Fanuc's way to read a length without a point depends on a parameter: as millimetres, or as steps.
    fn pointed(&self, w: &Word) -> Result<(), Refusal> {
        let steps = matches!(self.flavour, Flavour::Fanuc | Flavour::Mitsubishi);
        match w.value {
            Value::Number { value, pointed: false, .. }
                if steps && value != 0.0 && "XYZIJKR".contains(w.key) =>
            {
                Err(Refusal::new(
                    "decimal-point",
                    format!("{}{value} without a point may mean {value} steps", w.key),
                ))
            }
            _ => Ok(()),
        }
    }

    fn begin(&mut self, line: usize, spline: Begins, words: &[Word]) -> Result<(), Refusal> {
        self.begun = line;
        let (position, unit_mm) = (self.place(), self.modes.unit_mm);
        self.modes.check()?;
        match (self.flavour, spline) {
            (_, Begins::Siemens) => {
                self.feed()?;
                let mut open = siemens::Open::begin(position)?;
                open.block(words, unit_mm)?;
                self.open = Some(Open::Siemens(open));
            }
            (Flavour::LinuxCnc { planes }, Begins::LinuxCnc) => {
                let mut open = linuxcnc::Open::begin(planes, self.modes.plane, position)?;
                open.block(words, unit_mm)?;
                self.open = Some(Open::LinuxCnc(open));
            }
            // The motion before it stays active.
            (_, Begins::Cubic | Begins::Quadratic) => {
                let curve = linuxcnc::bezier(spline, words, self.modes.plane, position, unit_mm)?;
                self.go(line, false, Shape::Spline(curve))?;
            }
            (_, Begins::Beckhoff) => self.begin_beckhoff(line)?,
            (_, Begins::BeckhoffEnd) => return Err(Refusal::new("beckhoff-off", "G150 without G151")),
            (flavour, _) => {
                self.feed()?;
                self.modes.motion = Motion::None;
                let (step, high_speed) = (self.step_mm(), self.modes.high_speed);
                let open = fanuc::Open::begin(flavour, words, unit_mm, position, step, high_speed)?;
                self.open = Some(Open::Fanuc(open));
            }
        }
        Ok(())
    }

    /// A line, an arc or a polynomial, if the block names axes.
    fn travel(&mut self, line: usize, block: &Block, words: &[Word]) -> Result<(), Refusal> {
        let from = self.place();
        let motion = self.modes.motion;
        let polynomial = words.iter().any(|w| w.key == "PO");
        if motion == Motion::Poly && (polynomial || block.axes != [None; 3]) {
            let Some(from) = from else {
                return Err(Refusal::new("position", "POLY starts from a position that is not known"));
            };
            self.feed()?;
            let curve = siemens::poly(words, from, self.modes.unit_mm)?;
            return self.go(line, false, Shape::Spline(curve));
        }
        let arc = matches!(motion, Motion::Clockwise | Motion::Counterclockwise);
        let centred = block.centre != [None; 3];
        if centred && !arc {
            return Err(Refusal::new("no-arc", "I, J or K without G2 or G3"));
        }
        // A centre alone is a full circle.
        if block.axes == [None; 3] && !centred {
            return Ok(());
        }
        let mut target = self.position;
        for axis in 0..3 {
            target[axis] = block.axes[axis].or(target[axis]);
        }
        if motion == Motion::None {
            return Err(Refusal::new("no-motion", "axes without a motion code: no G0 to G3 is active"));
        }
        let ([Some(x), Some(y), Some(z)], Some(from)) = (target, from) else {
            if arc || motion == Motion::Feed {
                return Err(Refusal::new("position", "a cutting move from a position that is not known"));
            }
            self.modes.check()?;
            self.position = target;
            return Ok(());
        };
        let to = Point3::new(x, y, z);
        if arc {
            self.feed()?;
            let arc = self.arc(from, to, &block.centre)?;
            return self.go(line, false, Shape::Arc(arc));
        }
        if from == to {
            return Ok(());
        }
        self.go(line, motion == Motion::Rapid, Shape::Line { from, to })
    }

    fn arc(&self, from: Point3, to: Point3, centre: &[Option<f64>; 3]) -> Result<Arc, Refusal> {
        let plane = self.modes.plane;
        let mut middle = from;
        for axis in 0..3 {
            if centre[axis].is_some() && axis == plane.axes()[2] {
                return Err(Refusal::new("arc-centre", "a centre across the active plane"));
            }
            middle[axis] += centre[axis].unwrap_or(0.0);
        }
        let clockwise = self.modes.motion == Motion::Clockwise;
        let arc = Arc::through(from, to, middle, plane, clockwise).ok_or_else(|| {
            Refusal::new("arc-radius", "the arc's ends are not equally far from its centre")
        })?;
        if matches!(self.flavour, Flavour::LinuxCnc { .. }) && arc.radius_mm() < LINUXCNC_RADIUS_MM {
            return Err(Refusal::new(
                "linuxcnc-zero-radius",
                format!("a radius of {:.6} mm counts as none", arc.radius_mm()),
            ));
        }
        Ok(arc)
    }
}

/// What the words of a block say of its motion.
#[derive(Debug, Default)]
struct Block {
    /// Where to, mm.
    axes: [Option<f64>; 3],
    /// I, J and K, mm.
    centre: [Option<f64>; 3],
    /// Whether the position is not known afterwards.
    lost: bool,
}

fn unknown(w: &Word) -> Refusal {
    Refusal::new("unknown-word", format!("`{}` is not known", first_chars(w.key)))
}

/// A block without its line number.
fn bare(text: &str) -> &str {
    let text = text.trim();
    match text.strip_prefix('N').map(|rest| rest.trim_start_matches(|c: char| c.is_ascii_digit())) {
        Some(rest) if rest.len() + 1 < text.len() => rest.trim_start(),
        _ => text,
    }
}
