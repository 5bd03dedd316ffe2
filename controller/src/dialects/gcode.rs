//! Writes programs for the controls that read G-code; how these differ is in `Flavour`. Reading
//! starts here and is done by `gcode_read`.

use std::fmt::Write as _;
use std::io::BufRead;

use claymill_nurbs::Point3;
use claymill_toolpath::MoveKind;

use super::flavour::Flavour;
use super::gcode_read::Reader;
use super::{Fault, Grammar, Page, Sink, beckhoff, fanuc, linuxcnc, plane_words, siemens, title};
use crate::job::{Section, Stroke};
use crate::lower::{Abilities, Lowered, Splines};
use crate::number::decimal;
use crate::tilt::Turn;
use crate::{Coolant, Machine, Plane, Shape};

/// Writes and reads G-code.
#[derive(Debug)]
pub(crate) struct GCode(pub(crate) Flavour);

impl GCode {
    /// Out of the way: the machine's own blocks, or to the reference point of Z on controls where that is above
    /// everything on any machine. Elsewhere up, from a section whose tool and zero are known; where the machine's own zero lies
    /// nobody knows.
    fn home(&self, out: &mut String, page: &Page, from: Option<&Section>) {
        match (&page.machine.home, from) {
            (Some(lines), _) => lines.iter().for_each(|line| out.push_str(&format!("{line}\n"))),
            (None, _) if self.has_reference_point() => out.push_str("G91 G28 Z0.\nG90\n"),
            (None, Some(section)) if page.retreats && section.retreat_mm > section.clearance_mm => {
                let _ = writeln!(out, "G0 Z{}", page.format.text(section.retreat_mm));
            }
            (None, _) => {}
        }
    }

    /// Ends the section's plane, and takes the tool out of the way.
    fn turn_back(&self, out: &mut String, page: &Page, section: &Section) {
        let Some(placed) = section.placed else { return self.home(out, page, Some(section)) };
        let in_plane = page.machine.home.is_none() && !self.has_reference_point();
        if in_plane {
            // Up along the tool, while its axis is still the plane's.
            self.home(out, page, Some(section));
        }
        for line in plane_words::end(self.0, &placed, page.machine) {
            let _ = writeln!(out, "{line}");
        }
        if !in_plane {
            self.home(out, page, Some(section));
        }
        for line in plane_words::back(self.0, &placed) {
            let _ = writeln!(out, "{line}");
        }
    }

    /// Whether G05 P10000 is on: for curves, which are not written in tilted planes.
    fn high_speed(&self, page: &Page, section: &Section) -> bool {
        let upright = section.placed.is_none();
        upright && matches!(self.0, Flavour::Fanuc | Flavour::Mitsubishi) && page.machine.nurbs
    }

    fn has_reference_point(&self) -> bool {
        matches!(self.0, Flavour::Fanuc | Flavour::Mitsubishi)
    }
}

/// `F6000.`
fn feed(page: &Page, mm_per_min: f64) -> String {
    format!("F{}", decimal(mm_per_min / page.format.units.mm(), 3))
}

impl Grammar for GCode {
    fn abilities(&self, machine: &Machine) -> Abilities {
        let splines: Vec<Splines> = match self.0 {
            _ if !machine.nurbs => Vec::new(),
            Flavour::Fanuc => vec![fanuc::splines(machine, 3)],
            Flavour::Mitsubishi => vec![fanuc::splines(machine, 4)],
            Flavour::Siemens => siemens::splines(machine),
            Flavour::LinuxCnc { planes } => vec![linuxcnc::splines(planes)],
            Flavour::Beckhoff => vec![beckhoff::splines()],
            Flavour::Plain => Vec::new(),
        };
        Abilities { splines, arcs: machine.arcs }
    }

    fn digits(&self) -> u8 {
        if self.0 == Flavour::Fanuc { 3 } else { 4 }
    }

    fn begin(&self, out: &mut String, page: &Page) {
        let code = |out: &mut String, line: &str| {
            let _ = writeln!(out, "{line}");
        };
        match self.0 {
            Flavour::Fanuc | Flavour::Mitsubishi | Flavour::Plain => {
                code(out, "%");
                code(out, &format!("O{:04} ({})", page.number, page.name));
            }
            Flavour::LinuxCnc { .. } => code(out, "%"),
            Flavour::Siemens | Flavour::Beckhoff => {}
        }
        for line in &page.header {
            code(out, &self.0.comment(line));
        }
        let unit = self.0.unit_code(page.machine.units);
        code(
            out,
            &match self.0 {
                Flavour::Siemens => format!("G90 G94 {unit} G17 G40 G64"),
                Flavour::Beckhoff => format!("G90 G94 {unit} G17 G40"),
                Flavour::LinuxCnc { .. } => {
                    let blend = decimal(page.machine.blend_mm / page.format.units.mm(), 8);
                    // G64 P0 is G64 without P: corners are then rounded as far as the control likes.
                    let path = if blend == "0." { "G61".to_owned() } else { format!("G64 P{blend}") };
                    format!("G90 G94 {unit} G17 G40 G49 G80 {path}")
                }
                _ => format!("G90 G94 {unit} G17 G40 G49 G80"),
            },
        );
        self.home(out, page, None);
        for line in &page.machine.start {
            code(out, line);
        }
        if self.0 == Flavour::Beckhoff {
            code(out, "#SPLINE TYPE BSPLINE");
        }
    }

    fn section(&self, out: &mut String, page: &Page, section: &Section, start: &Point3) {
        let machine = page.machine;
        let mut code = |line: String| {
            let _ = writeln!(out, "{line}");
        };
        if machine.comments {
            title(page, section).iter().for_each(|line| code(self.0.comment(line)));
        }
        let tool = section.tool_number;
        match &machine.tool_change {
            Some(lines) => lines.iter().for_each(|l| code(l.replace("{tool}", &tool.to_string()))),
            // The offsets of a tool are those of its cutting edge.
            None if self.0 == Flavour::Siemens => code(format!("T{tool} M6\nD1")),
            None => code(format!("T{tool} M6")),
        }
        if let Some(offset) = machine.place(&section.place).work_offset.filter(|o| !o.is_empty()) {
            code(offset);
        }
        if section.speed_rpm > 0.0 {
            let turn = if machine.spindle.counterclockwise { 4 } else { 3 };
            code(format!("S{} M{turn}", section.speed_rpm.round()));
        }
        let height = page.format.text(section.clearance_mm.max(start.z));
        let turn = section.placed.map(|placed| plane_words::begin(self.0, &placed, machine));
        match section.placed.map(|placed| placed.by) {
            // Above everything that turns with the part, as the tool is long.
            Some(Turn::Index { safe_mm, .. }) => {
                code(format!("G43\nG0 Z{}", page.format.text(safe_mm)));
                turn.into_iter().flatten().for_each(&mut code);
                code(format!("G0 Z{height}"));
            }
            Some(Turn::Plane { .. }) => turn.into_iter().flatten().for_each(&mut code),
            None => {}
        }
        match self.0 {
            _ if matches!(section.placed.map(|p| p.by), Some(Turn::Index { .. })) => {}
            Flavour::Fanuc | Flavour::Mitsubishi => code(format!("G0 G43 Z{height} H{tool}")),
            Flavour::LinuxCnc { .. } => {
                code("G43".into());
                code(format!("G0 Z{height}"));
            }
            _ => code(format!("G0 Z{height}")),
        }
        code(format!("G0 X{} Y{}", page.format.text(start.x), page.format.text(start.y)));
        if start.z < section.clearance_mm {
            code(format!("G0 Z{}", page.format.text(start.z)));
        }
        match machine.coolant {
            Coolant::Off => {}
            Coolant::Mist => code("M7".into()),
            Coolant::Flood => code("M8".into()),
        }
        if self.high_speed(page, section) {
            code("G05 P10000".into());
        }
    }

    fn stroke(&self, out: &mut String, page: &Page, stroke: &Stroke, lowered: &Lowered, _: u64) {
        if page.machine.comments && stroke.kind == MoveKind::Cut {
            let _ = writeln!(
                out,
                "{}",
                self.0.comment(&format!("move {} region {} pass {}", stroke.seq, stroke.region, stroke.pass))
            );
        }
        let rate = feed(page, stroke.feed);
        let mut first = true;
        let mut plane = Plane::Xy;
        for shape in &lowered.shapes {
            match shape {
                Shape::Line { from, to } => {
                    let axes = (to - from).iter().filter(|c| **c != 0.0).count();
                    let rapid = stroke.kind == MoveKind::Rapid && (axes < 2 || self.0.rapid_is_straight());
                    let p = page.xyz(to);
                    let _ = match (rapid, first) {
                        (true, _) => writeln!(out, "G0 {p}"),
                        (false, true) => writeln!(out, "G1 {p} {rate}"),
                        (false, false) => writeln!(out, "G1 {p}"),
                    };
                }
                Shape::Arc(arc) => {
                    let [i, j, _] = arc.plane.axes();
                    let offset = |axis: usize| {
                        let letter = ["I", "J", "K"][axis];
                        format!("{letter}{}", page.format.text(arc.centre[axis] - arc.from[axis]))
                    };
                    let (a, b) = if i < j { (i, j) } else { (j, i) };
                    let g = if arc.clockwise { 2 } else { 3 };
                    if arc.plane != plane {
                        let _ = write!(out, "G{} ", arc.plane.g());
                        plane = arc.plane;
                    }
                    let _ = write!(out, "G{g} {} {} {}", page.xyz(&arc.to), offset(a), offset(b));
                    let _ = if first { writeln!(out, " {rate}") } else { writeln!(out) };
                }
                Shape::Spline(curve) => {
                    let rate = first.then_some(rate.as_str());
                    match self.0 {
                        Flavour::Fanuc | Flavour::Mitsubishi => fanuc::write(out, page, curve, rate),
                        Flavour::Siemens => siemens::write(out, page, curve, rate),
                        Flavour::LinuxCnc { .. } => {
                            plane = linuxcnc::write(out, page, curve, rate, plane);
                        }
                        Flavour::Beckhoff => beckhoff::write(out, page, curve, rate),
                        Flavour::Plain => {}
                    }
                }
            }
            first = false;
        }
        if plane != Plane::Xy {
            let _ = writeln!(out, "G17");
        }
    }

    fn leave(
        &self,
        out: &mut String,
        page: &Page,
        section: &Section,
        end: &Point3,
        stop: Option<&str>,
        _: std::ops::Range<u64>,
    ) {
        if self.high_speed(page, section) {
            let _ = writeln!(out, "G05 P0");
        }
        if section.clearance_mm > end.z {
            let _ = writeln!(out, "G0 Z{}", page.format.text(section.clearance_mm));
        }
        if page.machine.coolant != Coolant::Off {
            let _ = writeln!(out, "M9");
        }
        if section.speed_rpm > 0.0 {
            let _ = writeln!(out, "M5");
        }
        self.turn_back(out, page, section);
        if let Some(text) = stop {
            if let Some(Turn::Index { safe_mm, .. }) = section.placed.map(|p| p.by) {
                let _ = writeln!(out, "G0 Z{}\nG0 A0.", page.format.text(safe_mm));
            }
            let _ = writeln!(out, "{}", self.0.comment(text));
            let _ = writeln!(out, "M0");
        }
    }

    fn retreat(&self, machine: &Machine) -> String {
        match self.has_reference_point() {
            true => "to the reference point of Z, G28".into(),
            false => format!("up to {} mm above the clearance height", machine.retreat_mm),
        }
    }

    fn end(&self, out: &mut String, page: &Page, _: &[u64]) {
        for line in &page.machine.end {
            let _ = writeln!(out, "{line}");
        }
        let _ = writeln!(out, "{}", if matches!(self.0, Flavour::LinuxCnc { .. }) { "M2" } else { "M30" });
        if !self.0.semicolon() {
            let _ = writeln!(out, "%");
        }
    }

    fn numbered(&self, line: &str) -> bool {
        !line.starts_with(['%', '(', ';', 'O', '#'])
    }

    fn read(&self, text: &mut dyn BufRead, machine: &Machine, sink: Sink<'_>) -> Result<(), Fault> {
        let mut reader = Reader::new(self.0, machine, sink);
        let mut last = 0;
        super::lines(text, |line, text| {
            last = line;
            reader.block(line, text)
        })?;
        reader.finish().map_err(|refusal| Fault::Refused { line: last, refusal })
    }
}
