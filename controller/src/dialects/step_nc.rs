//! ISO 14649 in a Part 21 file: every move is a `CUTTER_LOCATION_TRAJECTORY` with its curve.

use std::fmt::Write as _;
use std::io::BufRead;

use claymill_nurbs::{Curve3, Point3};
use claymill_toolpath::MoveKind;

use super::{Fault, Grammar, Page, Sink, step_nc_read, title};
use crate::job::{Section, Stroke};
use crate::lower::{Abilities, Lowered, Splines};
use crate::number::decimal;
use crate::{Machine, Shape};

#[derive(Debug)]
pub(crate) struct StepNc;

/// Instance numbers of a move: the trajectory `BASE + id · STRIDE`, its technology and geometry behind it. Readers may keep
/// them in 32 bits: half a million moves fit.
const BASE: u64 = 1 << 20;
const STRIDE: u64 = 1 << 12;
/// Geometry of a move that needs more numbers lies out here.
const FAR: u64 = 1 << 40;
const FAR_STRIDE: u64 = 1 << 20;
/// A section's workplan has the last number of its first move; what belongs to it has those before.
const WORKPLAN: u64 = STRIDE - 1;
/// mm/min in one m/s, the unit of feeds.
pub(crate) const MM_PER_MIN: f64 = 60_000.0;
const KNOT_DIGITS: u8 = 6;
const WEIGHT_DIGITS: u8 = 9;
/// Control points that fit in a move's instance numbers.
const MOST_POINTS: usize = 60_000;

fn cartesian(page: &Page, p: &Point3) -> String {
    let f = &page.format;
    format!("CARTESIAN_POINT('',({},{},{}))", f.text(p.x), f.text(p.y), f.text(p.z))
}

fn list(items: impl IntoIterator<Item = String>) -> String {
    let mut text = String::from("(");
    for (i, item) in items.into_iter().enumerate() {
        if i > 0 {
            text.push_str(if i % 16 == 0 { ",\n" } else { "," });
        }
        text.push_str(&item);
    }
    text.push(')');
    text
}

impl Grammar for StepNc {
    fn abilities(&self, machine: &Machine) -> Abilities {
        let splines = Splines {
            pieces: false,
            degrees: [1, 25],
            weights: Some([1e-6, 1.0]),
            weight_digits: WEIGHT_DIGITS,
            knot_digits: KNOT_DIGITS,
            largest_knot: 1e6,
            planes: None,
            max_points: machine.max_points.unwrap_or(MOST_POINTS).min(MOST_POINTS),
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
        let quoted: Vec<String> =
            page.header.iter().map(|l| format!("'{}'", l.replace('\'', "''"))).collect();
        let _ = writeln!(out, "ISO-10303-21;\nHEADER;");
        let _ = writeln!(out, "FILE_DESCRIPTION(({}),'2;1');", quoted.join(",\n"));
        let _ = writeln!(out, "FILE_NAME('{}','1970-01-01T00:00:00',(''),(''),'claymill','','');", page.name);
        let _ = writeln!(out, "FILE_SCHEMA(('MACHINING_SCHEMA','MILLING_SCHEMA'));\nENDSEC;\nDATA;");
        let _ = writeln!(out, "#10=WORKPIECE('{}',$,$,$,$,$,());", page.name);
        let _ = writeln!(out, "#11=DIRECTION('',(0.,0.,1.));\n#12=DIRECTION('',(1.,0.,0.));");
    }

    fn section(&self, out: &mut String, page: &Page, section: &Section, _: &Point3) {
        if page.machine.comments {
            title(page, section).iter().for_each(|line| out.push_str(&format!("/* {line} */\n")));
        }
    }

    fn stroke(&self, out: &mut String, page: &Page, stroke: &Stroke, lowered: &Lowered, id: u64) {
        let trajectory = BASE + id * STRIDE;
        let technology = trajectory + 1;
        // A section's workplan and what belongs to it have the last numbers of a move.
        let room = STRIDE as usize - 32;
        let mut next = if numbers(lowered) <= room { trajectory + 3 } else { FAR + id * FAR_STRIDE };
        let curve = geometry(out, page, stroke, lowered, &mut next);
        let feed = decimal(stroke.feed / MM_PER_MIN, 9);
        let spindle = match page.speed_rpm > 0.0 {
            true => decimal(page.speed_rpm / 60.0, 6),
            false => "$".to_owned(),
        };
        let _ = writeln!(out, "#{technology}=MILLING_TECHNOLOGY({feed},.TCP.,$,{spindle},$,.F.,.F.,.F.,$);");
        let kind = match stroke.kind {
            MoveKind::Cut => ".CONTACT.",
            MoveKind::LeadIn => ".APPROACH.",
            MoveKind::LeadOut => ".LIFT_OFF.",
            MoveKind::Link => ".CONNECT.",
            MoveKind::Rapid => ".NON_CONTACT.",
        };
        let mut speed = "$".to_owned();
        if stroke.kind == MoveKind::Rapid {
            speed = format!("#{}", trajectory + 2);
            let _ = writeln!(out, "{speed}=RAPID_SPEED();");
        }
        let _ = writeln!(
            out,
            "#{trajectory}=CUTTER_LOCATION_TRAJECTORY(.T.,{kind},{speed},#{technology},$,.T.,#{curve},$,$);"
        );
    }

    fn leave(
        &self,
        out: &mut String,
        page: &Page,
        section: &Section,
        _: &Point3,
        _: Option<&str>,
        ids: std::ops::Range<u64>,
    ) {
        let plan = BASE + ids.start * STRIDE + WORKPLAN;
        let refs = list(ids.map(|id| format!("#{}", BASE + id * STRIDE)));
        let height = Point3::new(0.0, 0.0, section.clearance_mm);
        let _ = writeln!(out, "#{}={};", plan - 1, cartesian(page, &height));
        let _ = writeln!(out, "#{}=AXIS2_PLACEMENT_3D('',#{},#11,#12);", plan - 2, plan - 1);
        let _ = writeln!(out, "#{}=PLANE('clearance',#{});", plan - 3, plan - 2);
        let origin = section.frame.to_model(&Point3::origin());
        let (z, x) = (section.frame.axis(), section.frame.to_model(&Point3::new(1.0, 0.0, 0.0)) - origin);
        let direction = |v: claymill_nurbs::Vector3| {
            format!("DIRECTION('',({},{},{}))", decimal(v.x, 12), decimal(v.y, 12), decimal(v.z, 12))
        };
        let _ = writeln!(out, "#{}={};", plan - 4, cartesian(page, &origin));
        let _ = writeln!(out, "#{}={};\n#{}={};", plan - 5, direction(z), plan - 6, direction(x));
        let _ =
            writeln!(out, "#{}=AXIS2_PLACEMENT_3D('',#{},#{},#{});", plan - 7, plan - 4, plan - 5, plan - 6);
        let _ = writeln!(out, "#{}=SETUP('{}',#{},#{},());", plan - 8, section.setup, plan - 7, plan - 3);
        let _ = writeln!(out, "#{}=TOOLPATH_LIST({refs});", plan - 9);
        let _ = writeln!(out, "#{}=MILLING_CUTTING_TOOL('{}',$,(),$,$,$);", plan - 10, section.tool);
        let _ = writeln!(
            out,
            "#{}=FREEFORM_OPERATION(#{},$,'{}',$,$,#{},$,$,$,$,$,$);",
            plan - 11,
            plan - 9,
            section.setup,
            plan - 10
        );
        let _ = writeln!(out, "#{}=TOOLPATH_FEATURE('{}',#10,(#{}));", plan - 12, section.setup, plan - 11);
        let _ = writeln!(
            out,
            "#{}=MACHINING_WORKINGSTEP('{}',#{},#{},#{},$);",
            plan - 13,
            section.setup,
            plan - 3,
            plan - 12,
            plan - 11
        );
        let _ = writeln!(out, "#{plan}=WORKPLAN('{}',(#{}),$,#{},$);", section.setup, plan - 13, plan - 8);
    }

    fn retreat(&self, _: &Machine) -> String {
        // Between workplans the control moves by itself.
        "over the clearance plane of each setup".into()
    }

    fn end(&self, out: &mut String, page: &Page, groups: &[u64]) {
        let plans = list(groups.iter().map(|id| format!("#{}", BASE + id * STRIDE + WORKPLAN)));
        let _ = writeln!(out, "#13=WORKPLAN('main',{plans},$,$,$);");
        let _ = writeln!(out, "#14=PROJECT('{}',#13,(#10),$,$,$);", page.name);
        let _ = writeln!(out, "ENDSEC;\nEND-ISO-10303-21;");
    }

    fn numbered(&self, _: &str) -> bool {
        false
    }

    fn read(&self, text: &mut dyn BufRead, machine: &Machine, sink: Sink<'_>) -> Result<(), Fault> {
        step_nc_read::read(text, machine, sink)
    }
}

/// Instances that a move's geometry needs, or more.
fn numbers(lowered: &Lowered) -> usize {
    let of = |s: &Shape| if let Shape::Spline(curve) = s { curve.points().len() + 2 } else { 2 };
    lowered.shapes.iter().map(of).sum::<usize>() + 4
}

/// Writes what a move runs along; returns its instance.
fn geometry(out: &mut String, page: &Page, stroke: &Stroke, lowered: &Lowered, next: &mut u64) -> u64 {
    let splines: Vec<&Curve3> = lowered
        .shapes
        .iter()
        .filter_map(|s| if let Shape::Spline(curve) = s { Some(curve) } else { None })
        .collect();
    if splines.is_empty() {
        let mut points = vec![lowered.shapes.first().map_or(stroke.curve.start(), Shape::start)];
        points.extend(lowered.shapes.iter().map(Shape::end));
        if points.len() == 1 {
            points.push(points[0]);
        }
        let first = *next;
        for p in &points {
            let _ = writeln!(out, "#{next}={};", cartesian(page, p));
            *next += 1;
        }
        let refs = list((first..*next).map(|n| format!("#{n}")));
        let _ = writeln!(out, "#{next}=POLYLINE('',{refs});");
        *next += 1;
        return *next - 1;
    }
    let curves: Vec<u64> = splines.iter().map(|curve| bspline(out, page, curve, next)).collect();
    if let [curve] = curves[..] {
        return curve;
    }
    let first = *next;
    for curve in curves {
        let _ = writeln!(out, "#{next}=COMPOSITE_CURVE_SEGMENT(.CONTINUOUS.,.T.,#{curve});");
        *next += 1;
    }
    let refs = list((first..*next).map(|n| format!("#{n}")));
    let _ = writeln!(out, "#{next}=COMPOSITE_CURVE('',{refs},.U.);");
    *next += 1;
    *next - 1
}

fn bspline(out: &mut String, page: &Page, curve: &Curve3, next: &mut u64) -> u64 {
    let first = *next;
    for p in curve.points() {
        let _ = writeln!(out, "#{next}={};", cartesian(page, p));
        *next += 1;
    }
    let refs = list((first..*next).map(|n| format!("#{n}")));
    let (degree, knots) = (curve.knots().degree(), curve.knots().as_slice());
    let runs: Vec<&[f64]> = knots.chunk_by(|a, b| a == b).collect();
    let multiplicities = list(runs.iter().map(|r| r.len().to_string()));
    let values = list(runs.iter().map(|r| decimal(r[0], KNOT_DIGITS)));
    let _ = match curve.weights() {
        None => writeln!(
            out,
            "#{next}=B_SPLINE_CURVE_WITH_KNOTS('',{degree},{refs},.UNSPECIFIED.,.F.,.F.,{multiplicities},{values},.UNSPECIFIED.);"
        ),
        Some(weights) => writeln!(
            out,
            "#{next}=(BOUNDED_CURVE() B_SPLINE_CURVE({degree},{refs},.UNSPECIFIED.,.F.,.F.)\n\
             B_SPLINE_CURVE_WITH_KNOTS({multiplicities},{values},.UNSPECIFIED.) CURVE() GEOMETRIC_REPRESENTATION_ITEM()\n\
             RATIONAL_B_SPLINE_CURVE({}) REPRESENTATION_ITEM(''));",
            list(weights.iter().map(|w| decimal(*w, WEIGHT_DIGITS)))
        ),
    };
    *next += 1;
    *next - 1
}
