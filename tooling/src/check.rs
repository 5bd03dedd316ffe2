//! Does a tool fit its holder, its machine and what is asked of it? Each finding has a remedy.

use claymill_toolpath::Holder;

use crate::library::{Library, LibraryTool, Speed};
use crate::machine::MachineShape;
use crate::process::Material;

/// A holder grips at least this many shank diameters.
const LEAST_GRIP: f64 = 2.0;
/// A tool that sticks out more diameters than this bends and chatters in hard materials.
const SLENDER: f64 = 8.0;

/// What is wrong with a tool.
#[derive(Debug, Clone, PartialEq)]
pub struct Finding {
    /// Id of the tool.
    pub tool: String,
    /// Whether the tool can still be used.
    pub severity: Severity,
    /// Which check.
    pub code: FindingCode,
    /// The cause with its figures.
    pub what: String,
    /// What to do.
    pub remedy: String,
}

/// How much a finding matters.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Severity {
    /// It can be used with care.
    Warning,
    /// It cannot be used as described.
    Error,
}

/// The checks.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum FindingCode {
    /// The shank is as thick as the lower end of the holder, or thicker.
    ShankTooThick,
    /// Flutes would be inside the holder.
    FlutesInHolder,
    /// The tool is too short for its stick-out, or gripped over too short a length.
    TooShort,
    /// It sticks out many times its diameter.
    Slender,
    /// It is longer than the machine's z axis travels.
    LongerThanTravel,
    /// The part is deeper than tool or travel allow.
    TooDeep,
    /// The changer does not take its length, thickness or number.
    Changer,
    /// The spindle does not turn as its cutting data ask for.
    SpindleSpeed,
    /// The axes are slower than its feed.
    Feed,
    /// It has no cutting data for the material.
    NoCuttingData,
    /// It can neither plunge nor ramp.
    NoEntry,
    /// Another tool has the same number.
    SameNumber,
}

/// What tools are checked against. What is left out is not checked.
#[derive(Debug, Clone, Copy, Default)]
pub struct CheckAgainst<'a> {
    /// The machine.
    pub machine: Option<&'a MachineShape>,
    /// The material.
    pub material: Option<&'a Material>,
    /// How far below the top of the part the tool has to get, mm.
    pub depth_mm: Option<f64>,
}

/// Checks all tools of a library, and that no two have the same number. Sorted as the tools are.
#[must_use]
pub fn check_library(library: &Library, against: &CheckAgainst) -> Vec<Finding> {
    let mut findings = Vec::new();
    for (index, tool) in library.tools.iter().enumerate() {
        findings.extend(check_tool(tool, against));
        let same = library.tools[..index].iter().find(|t| t.number.is_some() && t.number == tool.number);
        if let (Some(first), Some(number)) = (same, tool.number) {
            findings.push(finding(
                tool,
                Severity::Error,
                FindingCode::SameNumber,
                format!("it has the number {number}, as {} has", first.id),
                "Give each tool a number of its own.",
            ));
        }
    }
    findings
}

/// Checks a tool.
#[must_use]
pub fn check_tool(tool: &LibraryTool, against: &CheckAgainst) -> Vec<Finding> {
    let mut findings = Vec::new();
    let mut add = |severity, code, what: String, remedy: &str| {
        findings.push(finding(tool, severity, code, what, remedy));
    };
    clamping(tool, &mut add);
    if let Some(material) = against.material {
        if let Err(error) = tool.cutting_for(material) {
            let remedy = format!("Add a table [tools.cutting.{}], or choose another tool.", material.name);
            add(Severity::Warning, FindingCode::NoCuttingData, error.to_string(), &remedy);
        }
        let diameter = tool.diameter_mm();
        let hard = material.stages.values().any(|v| v.engagement_deg.is_some());
        if let Some(out) = tool.stick_out_mm.filter(|out| hard && *out > SLENDER * diameter) {
            let what =
                format!("it sticks out {out} mm, more than {SLENDER} times its diameter of {diameter} mm");
            add(Severity::Warning, FindingCode::Slender, what, "Shorten the stick-out, or lower the feed.");
        }
    }
    if tool.centre_cutting == Some(false) && tool.ramp_deg.is_none() {
        let what = "it does not cut at its centre and has no ramp, so it cannot enter material".to_owned();
        let remedy = "Give `ramp_deg`, or let it enter from the side only.";
        add(Severity::Warning, FindingCode::NoEntry, what, remedy);
    }
    if let (Some(depth), Some(out)) = (against.depth_mm, tool.stick_out_mm)
        && depth > out
    {
        let what = format!("the part is {depth} mm deep, and it sticks out {out} mm");
        add(
            Severity::Warning,
            FindingCode::TooDeep,
            what,
            "Lengthen the stick-out where the holder would touch.",
        );
    }
    if let Some(machine) = against.machine {
        on_machine(tool, machine, against.depth_mm, &mut add);
    }
    findings
}

type Add<'f> = dyn FnMut(Severity, FindingCode, String, &str) + 'f;

fn clamping(tool: &LibraryTool, add: &mut Add) {
    let shank = 2.0 * tool.tool.shank_radius_mm();
    let nose = tool.holder.as_ref().and_then(|h| h.sections.first());
    if let Some(nose) = nose.filter(|n| n.lower_diameter_mm <= shank) {
        let what = format!(
            "its shank of {shank} mm fits no holder whose lower end has a diameter of {} mm",
            nose.lower_diameter_mm
        );
        let remedy = "Choose a holder for this shank, or correct the shank's diameter.";
        add(Severity::Error, FindingCode::ShankTooThick, what, remedy);
    }
    let Some(out) = tool.stick_out_mm else { return };
    let straight = tool.tool.flute_length_mm.unwrap_or(0.0);
    let flutes = tool.flute_length_mm.unwrap_or(0.0).max(straight);
    if out < flutes {
        let what = format!("it sticks out {out} mm, but its flutes are {flutes} mm long");
        add(
            Severity::Error,
            FindingCode::FlutesInHolder,
            what,
            "Lengthen the stick-out to the flutes at least.",
        );
    }
    let Some(length) = tool.overall_length_mm else { return };
    let grip = length - out;
    if grip <= 0.0 {
        let what = format!("it sticks out {out} mm and is {length} mm long, so nothing is held");
        add(Severity::Error, FindingCode::TooShort, what, "Shorten the stick-out, or take a longer tool.");
    } else if grip < LEAST_GRIP * shank {
        let what = format!(
            "only {grip:.1} mm are held, less than {LEAST_GRIP} diameters of the shank of {shank} mm"
        );
        add(Severity::Warning, FindingCode::TooShort, what, "Shorten the stick-out, or take a longer tool.");
    }
}

fn on_machine(tool: &LibraryTool, machine: &MachineShape, depth_mm: Option<f64>, add: &mut Add) {
    let length = tool.length_in_spindle_mm();
    if let (Some(length), Some(travel)) = (length, machine.travel_mm("z")) {
        let depth = depth_mm.unwrap_or(0.0);
        if length > travel {
            let what = format!("it is {length} mm long in the spindle, and z travels {travel} mm");
            let remedy = "Take a shorter tool or holder, or a machine with more travel.";
            add(Severity::Error, FindingCode::LongerThanTravel, what, remedy);
        } else if length + depth > travel {
            let what = format!(
                "it is {length} mm long in the spindle; over a part {depth} mm deep z has to travel {} mm, and travels {travel}",
                length + depth
            );
            let remedy = "Take a shorter tool, or set the part lower: the tool could not be drawn out of it.";
            add(Severity::Warning, FindingCode::TooDeep, what, remedy);
        }
    }
    let changer = machine.changer;
    let mut bounded = |what: &str, value: Option<f64>, most: Option<f64>| {
        if let (Some(value), Some(most)) = (value, most)
            && value > most
        {
            let what = format!("its {what} of {value} mm is more than the {most} mm that the changer takes");
            add(Severity::Error, FindingCode::Changer, what, "Put it in by hand, or take another holder.");
        }
    };
    bounded("length in the spindle", length, changer.longest_mm);
    bounded("thickness", Some(thickest_mm(tool)), changer.thickest_mm);
    if let (Some(number), Some(places)) = (tool.number, changer.places)
        && number > places
    {
        let what = format!("it has the number {number}, and the magazine {places} places");
        add(Severity::Error, FindingCode::Changer, what, "Give it a number that the magazine has.");
    }
    for (material, cutting) in &tool.cutting {
        let spindle = machine.spindle;
        let (slow, fast) = (spindle.min_rpm.unwrap_or(0.0), spindle.max_rpm.unwrap_or(f64::INFINITY));
        let rpm = match cutting.speed {
            Speed::Spindle { rpm } => rpm,
            Speed::Edge { vc_m_per_min } => crate::cutting::spindle_rpm(vc_m_per_min, tool.diameter_mm()),
        };
        if !(slow..=fast).contains(&rpm) {
            let what =
                format!("for {material} it turns at {rpm:.0} 1/min, and the spindle from {slow} to {fast}");
            let remedy = "Nothing has to be done: speed and feed are brought to what the spindle can do.";
            add(Severity::Warning, FindingCode::SpindleSpeed, what, remedy);
        }
        let most = machine.feed.max_mm_per_min.unwrap_or(f64::INFINITY);
        if let crate::library::Advance::PerMinute { feed_mm_per_min } = cutting.advance
            && feed_mm_per_min > most
        {
            let what =
                format!("for {material} its feed is {feed_mm_per_min} mm/min, and the machine's {most}");
            add(
                Severity::Warning,
                FindingCode::Feed,
                what,
                "Nothing has to be done: the feed is brought down.",
            );
        }
    }
}

/// The largest diameter of tool and holder, mm.
fn thickest_mm(tool: &LibraryTool) -> f64 {
    let holder = tool.holder.iter().flat_map(Holder::profile).flatten().map(|[_, radius]| radius);
    2.0 * holder.fold(tool.tool.widest_mm(), f64::max)
}

fn finding(
    tool: &LibraryTool,
    severity: Severity,
    code: FindingCode,
    what: String,
    remedy: impl Into<String>,
) -> Finding {
    Finding { tool: tool.id.clone(), severity, code, what, remedy: remedy.into() }
}
