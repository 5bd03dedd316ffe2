//! Does the machine reach everything a job asks of it? What lies outside is named with its move, and a remedy with it.

use std::fmt::Write as _;

use claymill_nurbs::{Point3, Vector3};

use crate::dialects::Dialect;
use crate::job::{MachineJob, Section};
use crate::rotary::comes_to;
use crate::tilt::Turn;
use crate::{AxisName, Machine, PostError};

/// The travel that a section takes along one axis, mm in the coordinates of its program.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Travel {
    /// Lowest and highest position.
    pub range_mm: [f64; 2],
    /// The moves there; `None` where it is the way to or from the cut.
    pub at: [Option<u64>; 2],
}

/// The travel that a section takes of X, Y and Z: all its moves, the way to the first and from the last, the retract before
/// a tool change and the height at which an indexed part turns. Where the machine's own blocks take the tool nobody knows.
#[must_use]
pub fn travel(section: &Section, machine: &Machine) -> [Travel; 3] {
    let mut found = [Travel { range_mm: [f64::INFINITY, f64::NEG_INFINITY], at: [None; 2] }; 3];
    let mut take = |axis: usize, mm: f64, at: Option<u64>| {
        let travel = &mut found[axis];
        if mm < travel.range_mm[0] {
            (travel.range_mm[0], travel.at[0]) = (mm, at);
        }
        if mm > travel.range_mm[1] {
            (travel.range_mm[1], travel.at[1]) = (mm, at);
        }
    };
    // In a tilted plane the axes of the machine are still those of the upright part.
    let placed = section.placed.filter(|p| matches!(p.by, Turn::Plane { .. }));
    let mut at = |p: &Point3, seq: Option<u64>| {
        let p = placed.map_or(*p, |placed| placed.tilt.to_standing(p));
        (0..3).for_each(|axis| take(axis, p[axis], seq));
    };
    for stroke in &section.strokes {
        stroke.curve.points().iter().for_each(|p| at(p, Some(stroke.seq)));
    }
    let ends = section.strokes.first().map(|s| s.curve.start()).into_iter();
    let ends: Vec<Point3> = ends.chain(section.strokes.last().map(|s| s.curve.end())).collect();
    let mut heights = vec![section.clearance_mm];
    if machine.home.is_none() {
        heights.push(section.retreat_mm);
    }
    if let Some(Turn::Index { safe_mm, .. }) = section.placed.map(|p| p.by) {
        heights.push(safe_mm);
    }
    for end in &ends {
        heights.iter().for_each(|z| at(&Point3::new(end.x, end.y, *z), None));
    }
    found
}

/// Refuses a job that the machine does not reach, with all that lies outside.
pub(crate) fn check(job: &MachineJob, dialect: Dialect, machine: &Machine) -> Result<(), PostError> {
    let mut found = Vec::new();
    let mut seen: Vec<&str> = Vec::new();
    for section in &job.sections {
        let travels = travel(section, machine);
        let out: Vec<_> = machine
            .axes
            .iter()
            .filter_map(|(axis, range)| outside(*axis, travels[*axis as usize], *range))
            .collect();
        let remedy = if out.is_empty() { String::new() } else { remedy(section, &travels, machine) };
        found.extend(out.into_iter().map(|text| format!("axis-limit: setup {}: {text}", section.setup)));
        if !remedy.is_empty() && !seen.contains(&section.setup.as_str()) {
            found.push(remedy);
        }
        let [slow, fast] = machine.spindle.range_rpm();
        let rpm = section.speed_rpm;
        if rpm > 0.0 && !(slow..=fast).contains(&rpm) {
            found.push(format!(
                "spindle-limit: setup {}: {} turns at {rpm} 1/min, and the spindle from {slow} to {fast}; give --spindle, \
                 or speed_rpm under [tools.{}]",
                section.setup, section.tool, section.tool
            ));
        }
        found.extend(head(section, dialect, machine).filter(|_| !seen.contains(&section.setup.as_str())));
        seen.push(&section.setup);
    }
    if found.is_empty() { Ok(()) } else { Err(PostError::Limits(found)) }
}

/// What an axis is asked for beyond its travel.
fn outside(axis: AxisName, travel: Travel, [low, high]: [f64; 2]) -> Option<String> {
    let [least, most] = travel.range_mm;
    let at = |seq: Option<u64>| seq.map_or_else(|| "on its way up".to_owned(), |seq| format!("move {seq}"));
    let mut text = String::new();
    if least < low {
        let _ = write!(text, "{axis:?} {least:.4} mm ({}) is below {low}", at(travel.at[0]));
    }
    if most > high {
        let comma = if text.is_empty() { "" } else { "; " };
        let _ = write!(text, "{comma}{axis:?} {most:.4} mm ({}) is above {high}", at(travel.at[1]));
    }
    (!text.is_empty()).then_some(text)
}

/// A zero from which the machine reaches the section; or how many parts it takes.
fn remedy(section: &Section, travels: &[Travel; 3], machine: &Machine) -> String {
    let mut shift = Vector3::zeros();
    let axes = section.placed.map_or(section.frame, |p| p.stands).axes();
    for (axis, [low, high]) in &machine.axes {
        let k = *axis as usize;
        let [least, most] = travels[k].range_mm;
        let parts = ((most - least) / (high - low)).ceil();
        if parts > 1.0 {
            return format!(
                "setup {} needs {:.1} mm of {axis:?}, which travels {:.1}: cut it in {parts} parts along it, each with \
                 `claymill plan --within` and a zero of its own, or turn the part by 90 degrees",
                section.setup,
                most - least,
                high - low
            );
        }
        // As little as it takes.
        shift[k] = (low - least).max(0.0) + (high - most).min(0.0);
    }
    if section.placed.is_some() {
        // The zero is shared by all planes: what helps one may harm another.
        return format!("setup {}: move the part, or its zero, by what lies outside", section.setup);
    }
    // The program goes up where the zero goes down.
    let [x, y, z] = axes;
    let zero = section.frame.to_model(&Point3::origin()) - (x * shift.x + y * shift.y + z * shift.z);
    let digits = |v: f64| (v * 1e3).round() / 1e3 + 0.0;
    format!(
        "setup {0} fits with another zero: [setups.{0}] zero_mm = [{1}, {2}, {3}]",
        section.place,
        digits(zero.x),
        digits(zero.y),
        digits(zero.z)
    )
}

/// A tilted plane beyond the travel of the rotary axes.
fn head(section: &Section, dialect: Dialect, machine: &Machine) -> Option<String> {
    let placed = section.placed.filter(|p| matches!(p.by, Turn::Plane { .. }))?;
    let axes: Vec<_> = machine.rotary.values().collect();
    let [_, _, tool] = placed.tilt.axes();
    if comes_to(&axes, &tool) {
        return None;
    }
    let travels = machine.rotary.iter().map(|(name, axis)| {
        let [low, high] = axis.travel_deg;
        format!("{} {low} to {high}", name.to_uppercase())
    });
    Some(format!(
        "head-limit: setup {} leans {:.3} degrees, and the rotary axes do not come there ({}); take another direction with \
         --setup, or write it as a program of its own ({dialect}: by = \"program\" under [tilt])",
        section.setup,
        tool.z.clamp(-1.0, 1.0).acos().to_degrees(),
        travels.collect::<Vec<_>>().join(", ")
    ))
}
