//! Heidenhain conversational. A spline block names its end, and for each axis the coefficients of
//! `K3·t³ + K2·t² + K1·t + end`, where `t` runs from 1 to 0.

use std::fmt::Write as _;
use std::io::BufRead;

use claymill_nurbs::{Curve3, Point3};
use claymill_toolpath::MoveKind;

use super::plane_words::{PLANE_RESET, spatial};
use super::siemens::power_basis;
use super::{Fault, Grammar, Page, Sink, heidenhain_read, title};
use crate::job::{Section, Stroke};
use crate::lower::{Abilities, Lowered, Splines};
use crate::tilt::Turn;
use crate::{Coolant, Machine, Shape, Units};

#[derive(Debug)]
pub(crate) struct Heidenhain;

/// Joints of splines with a larger corner are stopped at, degrees.
pub(crate) const CORNER_DEG: f64 = 0.1;
/// Decimals of a coefficient's mantissa.
pub(crate) const MANTISSA_DIGITS: usize = 8;

fn signed(page: &Page, mm: f64) -> String {
    let text = page.format.text(mm);
    let text = text.strip_suffix('.').unwrap_or(&text);
    if text.starts_with('-') { text.to_owned() } else { format!("+{text}") }
}

fn point(page: &Page, p: &Point3) -> String {
    format!("X{} Y{} Z{}", signed(page, p.x), signed(page, p.y), signed(page, p.z))
}

fn feed(page: &Page, rate: f64) -> String {
    match page.machine.units {
        // Heidenhain's feed in inch programs is in tenths of an inch a minute.
        Units::Inch => format!("F{}", (rate / 2.54).round()),
        Units::Mm => format!("F{}", rate.round()),
    }
}

impl Grammar for Heidenhain {
    fn abilities(&self, machine: &Machine) -> Abilities {
        let spl = Splines {
            pieces: true,
            degrees: [3, 3],
            weights: None,
            weight_digits: 0,
            knot_digits: 6,
            largest_knot: 1e6,
            planes: None,
            max_points: 4,
            exact_points: true,
            first_weight_one: false,
            halved: false,
            biarcs: false,
        };
        Abilities { splines: if machine.nurbs { vec![spl] } else { Vec::new() }, arcs: false }
    }

    fn digits(&self) -> u8 {
        4
    }

    fn begin(&self, out: &mut String, page: &Page) {
        let unit = if page.machine.units == Units::Mm { "MM" } else { "INCH" };
        let _ = writeln!(out, "BEGIN PGM {} {unit}", page.name);
        page.header.iter().for_each(|line| out.push_str(&format!("; {line}\n")));
        let machine = page.machine;
        let lines = machine.home.iter().flatten().chain(&machine.start);
        lines.for_each(|line| out.push_str(&format!("{line}\n")));
    }

    fn section(&self, out: &mut String, page: &Page, section: &Section, start: &Point3) {
        let machine = page.machine;
        if machine.comments {
            for line in title(page, section) {
                let _ = writeln!(out, "; {line}");
            }
        }
        // A preset by its number; other names of work offsets mean nothing here.
        if let Some(preset) = machine.place(&section.place).work_offset.and_then(|o| o.parse::<u16>().ok()) {
            let _ = writeln!(out, "CYCL DEF 247 DATUM SETTING Q339=+{preset}");
        }
        let tool = section.tool_number;
        match &machine.tool_change {
            Some(lines) => {
                for line in lines {
                    let _ = writeln!(out, "{}", line.replace("{tool}", &tool.to_string()));
                }
            }
            None => {
                let speed = match section.speed_rpm > 0.0 {
                    true => format!(" S{}", section.speed_rpm.round()),
                    false => String::new(),
                };
                let _ = writeln!(out, "TOOL CALL {tool} Z{speed}");
            }
        }
        if let Some(Turn::Plane { deg }) = section.placed.map(|p| p.by) {
            let _ = writeln!(out, "{}", spatial(deg));
        }
        let turn = match (section.speed_rpm > 0.0, machine.spindle.counterclockwise) {
            (false, _) => "",
            (true, false) => " M3",
            (true, true) => " M4",
        };
        let _ = writeln!(out, "L Z{} R0 FMAX{turn}", signed(page, section.clearance_mm.max(start.z)));
        let coolant = if machine.coolant == Coolant::Off { "" } else { " M8" };
        let _ = writeln!(out, "L X{} Y{} R0 FMAX{coolant}", signed(page, start.x), signed(page, start.y));
        if start.z < section.clearance_mm {
            let _ = writeln!(out, "L Z{} R0 FMAX", signed(page, start.z));
        }
    }

    fn stroke(&self, out: &mut String, page: &Page, stroke: &Stroke, lowered: &Lowered, _: u64) {
        if page.machine.comments && stroke.kind == MoveKind::Cut {
            let _ = writeln!(out, "; move {} region {} pass {}", stroke.seq, stroke.region, stroke.pass);
        }
        let rate = feed(page, stroke.feed);
        // A block that does not move: what comes before it and what comes after it need not be tangential.
        if let Some(Shape::Spline(curve)) = lowered.shapes.first() {
            let _ = writeln!(out, "L {} R0 {rate}", point(page, &curve.points()[0]));
        }
        let mut last: Option<&Shape> = None;
        for shape in &lowered.shapes {
            match shape {
                Shape::Line { to, .. } if stroke.kind == MoveKind::Rapid => {
                    let _ = writeln!(out, "L {} R0 FMAX", point(page, to));
                }
                Shape::Spline(curve) => {
                    if last.is_some_and(|l| corner_deg(l, shape) >= 0.5 * CORNER_DEG) {
                        let _ = writeln!(out, "L {} R0 {rate}", point(page, &curve.points()[0]));
                    }
                    spline(out, page, curve, &rate);
                }
                other => {
                    let _ = writeln!(out, "L {} R0 {rate}", point(page, &other.end()));
                }
            }
            last = Some(shape);
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
        if section.clearance_mm > end.z {
            let _ = writeln!(out, "L Z{} R0 FMAX", signed(page, section.clearance_mm));
        }
        match &page.machine.home {
            Some(lines) => lines.iter().for_each(|line| out.push_str(&format!("{line}\n"))),
            None if section.retreat_mm > section.clearance_mm => {
                let _ = writeln!(out, "L Z{} R0 FMAX", signed(page, section.retreat_mm));
            }
            None => {}
        }
        if section.placed.is_some() {
            let _ = writeln!(out, "{PLANE_RESET}");
        }
        if let Some(text) = stop {
            let _ = writeln!(out, "; {text}");
            let _ = writeln!(out, "STOP M5");
        }
    }

    fn end(&self, out: &mut String, page: &Page, _: &[u64]) {
        for line in &page.machine.end {
            let _ = writeln!(out, "{line}");
        }
        let unit = if page.machine.units == Units::Mm { "MM" } else { "INCH" };
        let _ = writeln!(out, "L M30");
        let _ = writeln!(out, "END PGM {} {unit}", page.name);
    }

    fn numbered(&self, line: &str) -> bool {
        !line.starts_with(' ')
    }

    fn always_numbered(&self) -> bool {
        true
    }

    fn read(&self, text: &mut dyn BufRead, machine: &Machine, sink: Sink<'_>) -> Result<(), Fault> {
        heidenhain_read::read(text, machine, sink)
    }
}

pub(crate) fn corner_deg(a: &Shape, b: &Shape) -> f64 {
    match (a.directions(), b.directions()) {
        (Some([_, out]), Some([into, _])) => out.angle(&into).to_degrees(),
        _ => 180.0,
    }
}

/// A coefficient in the form with an exponent, without zeros that say nothing.
fn coefficient(value: f64) -> String {
    let text = format!("{value:+.MANTISSA_DIGITS$E}");
    let (mantissa, exponent) = text.split_once('E').unwrap_or((&text, "0"));
    let mantissa = mantissa.trim_end_matches('0').trim_end_matches('.');
    if exponent == "0" { mantissa.to_owned() } else { format!("{mantissa}E{exponent}") }
}

fn spline(out: &mut String, page: &Page, curve: &Curve3, rate: &str) {
    let points = curve.points();
    let _ = writeln!(out, "SPL {} {rate}", point(page, &points[points.len() - 1]));
    for axis in 0..3 {
        // Backwards, because t runs from 1 to 0.
        let bezier: Vec<f64> = points.iter().rev().map(|p| p[axis] / page.format.units.mm()).collect();
        let a = power_basis(&bezier);
        let letter = ["X", "Y", "Z"][axis];
        let k = |n: usize| coefficient(a.get(n).copied().unwrap_or(0.0));
        let _ = writeln!(out, "  K3{letter}{} K2{letter}{} K1{letter}{}", k(3), k(2), k(1));
    }
}
