//! CLDATA with NURBS: CATIA's `BEGIN NURBS_SIEMENS … END NURBS` or Creo's `MOVNRB`.

use std::fmt::Write as _;
use std::io::BufRead;

use claymill_nurbs::{Curve3, Point3};
use claymill_toolpath::MoveKind;

use super::{Fault, Grammar, Page, Sink, apt_read, title};
use crate::job::{Section, Stroke};
use crate::lower::{Abilities, Lowered, Splines, chords};
use crate::number::decimal;
use crate::{Coolant, Machine, Shape, Units};

#[derive(Debug)]
pub(crate) struct Apt {
    pub(crate) creo: bool,
}

/// Statements are wrapped with `$` before this column.
const WIDTH: usize = 72;
/// Values in one MOVNRB statement.
pub(crate) const MOVNRB_VALUES: usize = 24;
const KNOT_DIGITS: u8 = 6;
const WEIGHT_DIGITS: u8 = 9;

/// Writes a statement, wrapped at commas.
fn statement(out: &mut String, text: &str) {
    let mut column = 0;
    for (i, part) in text.split_inclusive(',').enumerate() {
        if i > 0 && column + part.len() > WIDTH {
            out.push_str("$\n");
            column = 0;
        }
        out.push_str(part);
        column += part.len();
    }
    out.push('\n');
}

fn goto(page: &Page, p: &Point3) -> String {
    let f = &page.format;
    format!("GOTO/{},{},{}", f.text(p.x), f.text(p.y), f.text(p.z))
}

impl Apt {
    fn curve(&self, out: &mut String, page: &Page, curve: &Curve3, stroke: &Stroke) {
        let (d, u) = (curve.knots().degree(), curve.knots().as_slice());
        let text = |mm: f64| page.format.text(mm);
        if !self.creo {
            let rate = decimal(stroke.feed / page.format.units.mm(), 3);
            statement(out, &format!("BEGIN NURBS_SIEMENS(D={d},F={rate},AXIS=0.,0.,1.);"));
            for (i, p) in curve.points().iter().enumerate() {
                let interval = if i == 0 { 0.0 } else { u[i + d - 1] - u[(i + d).saturating_sub(2)] };
                let weight = curve.weights().map_or(1.0, |w| w[i]);
                let _ = writeln!(
                    out,
                    "N{i},XT={},YT={},ZT={},DK={},W={};",
                    text(p.x),
                    text(p.y),
                    text(p.z),
                    decimal(interval, KNOT_DIGITS),
                    decimal(weight, WEIGHT_DIGITS)
                );
            }
            out.push_str("END NURBS;\n");
            return;
        }
        let length = Shape::Spline(curve.clone()).length_mm();
        out.push_str("MOVNRB/M3AXIS\n");
        let _ = writeln!(out, "MOVNRB/ON,{},{},0,{},{}", d + 1, u.len(), curve.points().len(), text(length));
        for knots in u.chunks(MOVNRB_VALUES) {
            let values: Vec<String> = knots.iter().map(|k| decimal(*k, KNOT_DIGITS)).collect();
            statement(out, &format!("MOVNRB/1,{}", values.join(",")));
        }
        for points in curve.points().chunks(MOVNRB_VALUES / 3) {
            let values: Vec<String> = points.iter().flat_map(|p| [text(p.x), text(p.y), text(p.z)]).collect();
            statement(out, &format!("MOVNRB/2,{}", values.join(",")));
        }
        out.push_str("MOVNRB/NEXT\n");
        for p in chords(curve, &page.format, page.machine.tolerance_mm) {
            let _ = writeln!(out, "{}", goto(page, &p));
        }
        out.push_str("MOVNRB/OFF\n");
    }
}

impl Grammar for Apt {
    fn abilities(&self, machine: &Machine) -> Abilities {
        let splines = Splines {
            pieces: false,
            degrees: if self.creo { [2, 25] } else { [2, 3] },
            weights: (!self.creo).then_some([1e-6, 1.0]),
            weight_digits: WEIGHT_DIGITS,
            knot_digits: KNOT_DIGITS,
            largest_knot: 1e6,
            planes: None,
            max_points: machine.max_points.unwrap_or(usize::MAX),
            exact_points: false,
            first_weight_one: false,
            halved: false,
            biarcs: false,
        };
        Abilities { splines: if machine.nurbs { vec![splines] } else { Vec::new() }, arcs: false }
    }

    fn digits(&self) -> u8 {
        4
    }

    fn begin(&self, out: &mut String, page: &Page) {
        let _ = writeln!(out, "PARTNO {}", page.name);
        for line in &page.header {
            let _ = writeln!(out, "$$ {line}");
        }
        let _ = writeln!(out, "UNITS/{}", if page.machine.units == Units::Mm { "MM" } else { "INCHES" });
        for line in page.machine.home.iter().flatten().chain(&page.machine.start) {
            let _ = writeln!(out, "{line}");
        }
    }

    fn section(&self, out: &mut String, page: &Page, section: &Section, start: &Point3) {
        let machine = page.machine;
        if machine.comments {
            title(page, section).iter().for_each(|line| out.push_str(&format!("$$ {line}\n")));
        }
        let _ = writeln!(out, "LOADTL/{}", section.tool_number);
        // Diameter and corner radius.
        let text = |mm: f64| page.format.text(mm);
        let _ = writeln!(out, "CUTTER/{},{}", text(2.0 * section.radius_mm), text(section.radius_mm));
        if section.speed_rpm > 0.0 {
            let turn = if machine.spindle.counterclockwise { "CCLW" } else { "CLW" };
            let _ = writeln!(out, "SPINDL/{},RPM,{turn}", decimal(section.speed_rpm, 1));
        }
        match machine.coolant {
            Coolant::Off => {}
            Coolant::Mist => out.push_str("COOLNT/MIST\n"),
            Coolant::Flood => out.push_str("COOLNT/FLOOD\n"),
        }
        let above = Point3::new(start.x, start.y, section.clearance_mm.max(start.z));
        let _ = writeln!(out, "RAPID\n{}", goto(page, &above));
        if above != *start {
            let _ = writeln!(out, "RAPID\n{}", goto(page, start));
        }
    }

    fn stroke(&self, out: &mut String, page: &Page, stroke: &Stroke, lowered: &Lowered, _: u64) {
        if page.machine.comments && stroke.kind == MoveKind::Cut {
            let _ = writeln!(out, "$$ move {} region {} pass {}", stroke.seq, stroke.region, stroke.pass);
        }
        if stroke.kind != MoveKind::Rapid && !lowered.shapes.is_empty() {
            let unit = if page.machine.units == Units::Mm { "MMPM" } else { "IPM" };
            let _ = writeln!(out, "FEDRAT/{},{unit}", decimal(stroke.feed / page.format.units.mm(), 3));
        }
        for shape in &lowered.shapes {
            match shape {
                Shape::Spline(curve) => self.curve(out, page, curve, stroke),
                other => {
                    if stroke.kind == MoveKind::Rapid {
                        out.push_str("RAPID\n");
                    }
                    let _ = writeln!(out, "{}", goto(page, &other.end()));
                }
            }
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
        let own = page.machine.home.is_some();
        let top = if own { section.clearance_mm } else { section.retreat_mm };
        if top > end.z {
            let above = Point3::new(end.x, end.y, top);
            let _ = writeln!(out, "RAPID\n{}", goto(page, &above));
        }
        page.machine.home.iter().flatten().for_each(|line| out.push_str(&format!("{line}\n")));
        if let Some(text) = stop {
            let _ = writeln!(out, "PPRINT/{}\nSTOP", text.to_uppercase());
        }
    }

    fn end(&self, out: &mut String, page: &Page, _: &[u64]) {
        for line in &page.machine.end {
            let _ = writeln!(out, "{line}");
        }
        out.push_str("SPINDL/OFF\nFINI\n");
    }

    fn numbered(&self, _: &str) -> bool {
        false
    }

    fn read(&self, text: &mut dyn BufRead, machine: &Machine, sink: Sink<'_>) -> Result<(), Fault> {
        apt_read::read(self.creo, text, machine, sink)
    }
}
