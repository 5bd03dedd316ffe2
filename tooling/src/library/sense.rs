//! Sizes that no tool has, and values of a tool that contradict each other.

use claymill_toolpath::Tool;

use super::{Advance, Cutting, Library, LibraryTool, Speed};
use crate::error::{Fault, one_line};

/// No tool or holder is longer or thicker, mm.
const LONGEST_MM: f64 = 1e4;
/// A library has no more tools than this.
pub(crate) const MOST_TOOLS: usize = 10_000;
/// A holder has no more sections than this.
pub(crate) const MOST_SECTIONS: usize = 200;
/// A tool has cutting data for no more materials than this.
const MOST_MATERIALS: usize = 200;
/// No machine has more tools than this.
const LARGEST_NUMBER: u32 = 99_999_999;
/// No tool has more edges than this.
const MOST_FLUTES: u32 = 100;
/// No spindle is faster, 1/min, no edge, m/min, and no feed, mm/min.
const LARGEST_RPM: f64 = 1e6;
const LARGEST_VC: f64 = 1e5;
const LARGEST_FEED: f64 = 1e7;
/// Longest name, characters.
const LONGEST_NAME: usize = 200;

impl Library {
    /// Refuses tools that make no sense, and ids that occur twice.
    ///
    /// # Errors
    /// The first such tool by its id, with cause and remedy.
    pub fn check(&self) -> Result<(), (String, Fault)> {
        if self.tools.len() > MOST_TOOLS {
            let what = format!("{} tools are more than {MOST_TOOLS}", self.tools.len());
            return Err(("library".into(), Fault::new(what, "Split the library.")));
        }
        let mut ids = std::collections::BTreeSet::new();
        for tool in &self.tools {
            let named = |fault| (one_line(&tool.id), fault);
            tool.check().map_err(named)?;
            if !ids.insert(&tool.id) {
                return Err(named(Fault::new(
                    "the id occurs twice",
                    "Give every tool an id of its own, for example T12.",
                )));
            }
        }
        Ok(())
    }
}

impl LibraryTool {
    /// Refuses values that make no sense.
    ///
    /// # Errors
    /// The first such value, with cause and remedy.
    pub fn check(&self) -> Result<(), Fault> {
        check_id(&self.id)?;
        if self.name.chars().count() > LONGEST_NAME || self.name.chars().any(char::is_control) {
            return Err(Fault::new(
                "the name is no single line of at most 200 characters",
                "Shorten the name.",
            ));
        }
        // The text form is the one that refuses sizes that no tool has.
        self.tool.to_string().parse::<Tool>().map_err(|e| {
            Fault::new(e.to_string(), "Correct the tool's sizes. Check the unit of the file.")
        })?;
        if self.number.is_some_and(|n| !(1..=LARGEST_NUMBER).contains(&n)) {
            return Err(Fault::new("its number is not from 1 to 99999999", "Correct `number`."));
        }
        if self.flutes.is_some_and(|n| !(1..=MOST_FLUTES).contains(&n)) {
            return Err(Fault::new("the number of flutes is not from 1 to 100", "Correct `flutes`."));
        }
        let lengths = [
            ("flute_length_mm", self.flute_length_mm),
            ("overall_length_mm", self.overall_length_mm),
            ("stick_out_mm", self.stick_out_mm),
            ("gauge_length_mm", self.gauge_length_mm),
        ];
        for (field, value) in lengths {
            size(field, value)?;
        }
        let diameter = self.diameter_mm();
        if !(0.0..=diameter).contains(&self.dead_centre_mm) {
            return Err(Fault::new(
                format!(
                    "a dead centre of {} mm is not between 0 and the diameter {diameter} mm",
                    self.dead_centre_mm
                ),
                "Correct `dead_centre_mm`.",
            ));
        }
        if self.centre_cutting == Some(true) && self.dead_centre_mm > 0.0 {
            return Err(Fault::new(
                format!("it cuts at its centre and has a dead centre of {} mm", self.dead_centre_mm),
                "Set `centre_cutting = false`, or leave `dead_centre_mm` out.",
            ));
        }
        if self.ramp_deg.is_some_and(|d| !(d > 0.0 && d <= 90.0)) {
            return Err(Fault::new("its ramp is not above 0 and at most 90°", "Correct `ramp_deg`."));
        }
        self.check_holder()?;
        if self.cutting.len() > MOST_MATERIALS {
            return Err(Fault::new("it has cutting data for more than 200 materials", "Leave some out."));
        }
        self.cutting.iter().try_for_each(|(material, cutting)| {
            check_id(material)?;
            cutting
                .check()
                .map_err(|f| Fault::new(format!("cutting data of {material}: {}", f.what), f.remedy))
        })
    }

    fn check_holder(&self) -> Result<(), Fault> {
        // As `Holder::parse` has it.
        let lowest = self.tool.radius_mm();
        if let Some(out) = self.stick_out_mm.filter(|out| *out < lowest) {
            return Err(Fault::new(
                format!(
                    "a stick-out of {out} mm leaves nothing of an end of radius {lowest} mm below the holder"
                ),
                "Correct `stick_out_mm`, or the stick-out of `holder`.",
            ));
        }
        let Some(holder) = &self.holder else { return Ok(()) };
        if self.stick_out_mm != Some(holder.stick_out_mm) {
            return Err(Fault::new(
                format!(
                    "the stick-out is {:?} mm, but that of its holder {} mm",
                    self.stick_out_mm, holder.stick_out_mm
                ),
                "State the stick-out once, in `holder`.",
            ));
        }
        let sections = &holder.sections;
        if sections.is_empty() || sections.len() > MOST_SECTIONS {
            return Err(Fault::new(
                format!("its holder has {} sections, which is not from 1 to {MOST_SECTIONS}", sections.len()),
                "Describe the holder by fewer sections.",
            ));
        }
        let sizes = sections.iter().flat_map(|s| [s.lower_diameter_mm, s.upper_diameter_mm, s.length_mm]);
        for value in sizes {
            size("a size of the holder", Some(value))?;
        }
        Ok(())
    }
}

impl Cutting {
    /// Speed and advance, nothing else.
    #[must_use]
    pub const fn new(speed: Speed, advance: Advance) -> Self {
        Cutting {
            speed,
            advance,
            ae_mm: None,
            ap_mm: None,
            engagement_deg: None,
            plunge_mm_per_min: None,
            ramp_mm_per_min: None,
            lead_mm_per_min: None,
        }
    }

    fn check(&self) -> Result<(), Fault> {
        match self.speed {
            Speed::Edge { vc_m_per_min } => within("vc_m_per_min", Some(vc_m_per_min), LARGEST_VC)?,
            Speed::Spindle { rpm } => within("rpm", Some(rpm), LARGEST_RPM)?,
        }
        match self.advance {
            Advance::PerEdge { fz_mm } => size("fz_mm", Some(fz_mm))?,
            Advance::PerMinute { feed_mm_per_min } => {
                within("feed_mm_per_min", Some(feed_mm_per_min), LARGEST_FEED)?;
            }
        }
        size("ae_mm", self.ae_mm)?;
        size("ap_mm", self.ap_mm)?;
        within("engagement_deg", self.engagement_deg, 180.0)?;
        within("plunge_mm_per_min", self.plunge_mm_per_min, LARGEST_FEED)?;
        within("ramp_mm_per_min", self.ramp_mm_per_min, LARGEST_FEED)?;
        within("lead_mm_per_min", self.lead_mm_per_min, LARGEST_FEED)
    }
}

/// Ids and names of materials are what a program's comment and a key of TOML can hold.
fn check_id(id: &str) -> Result<(), Fault> {
    let fitting = |c: char| c.is_ascii_alphanumeric() || "-_.".contains(c);
    if (1..=40).contains(&id.len()) && id.chars().all(fitting) {
        return Ok(());
    }
    Err(Fault::new(
        format!("`{}` is no name of 1 to 40 letters, digits, `-`, `_` and `.`", one_line(id)),
        "Rename it, for example T12 or aluminium.",
    ))
}

fn size(field: &str, value: Option<f64>) -> Result<(), Fault> {
    within(field, value, LONGEST_MM)
}

fn within(field: &str, value: Option<f64>, most: f64) -> Result<(), Fault> {
    match value.filter(|v| !(*v > 0.0 && *v <= most)) {
        None => Ok(()),
        Some(v) => Err(Fault::new(
            format!("{field} is {v}, which is not above 0 and at most {most}"),
            format!("Correct {field}. Check the unit of the file."),
        )),
    }
}
