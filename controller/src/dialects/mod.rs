//! One file a grammar: how a control writes moves, and how it reads them.

mod apt;
mod apt_read;
mod beckhoff;
mod fanuc;
mod flavour;
mod gcode;
mod gcode_modes;
mod gcode_read;
mod heidenhain;
mod heidenhain_read;
mod linuxcnc;
mod own_blocks;
mod plane_reader;
mod plane_words;
mod siemens;
mod step_nc;
mod step_nc_read;

use std::fmt;
use std::io::BufRead;
use std::str::FromStr;

use claymill_nurbs::Point3;

use crate::job::{Section, Stroke};
use crate::lower::{Abilities, Lowered};
use crate::number::LengthFormat;
use crate::tilt::Tilt;
use crate::{Machine, Refusal, Shape, Units};

use flavour::Flavour;
use gcode::GCode;

/// A control's language.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Dialect {
    /// Fanuc 15i/30i with G06.2.
    Fanuc,
    /// Mitsubishi M700V with G06.2.
    Mitsubishi,
    /// Siemens 840D with BSPLINE and POLY.
    Siemens,
    /// Heidenhain conversational with SPL.
    Heidenhain,
    /// LinuxCNC 2.9.
    LinuxCnc29,
    /// LinuxCNC 2.10.
    LinuxCnc210,
    /// Beckhoff and ISG with B-splines.
    Beckhoff,
    /// Plain G-code: lines and arcs.
    G1,
    /// CLDATA with CATIA's NURBS statements.
    AptCatia,
    /// CLDATA with Creo's NURBS statements.
    AptCreo,
    /// ISO 14649 in a Part 21 file.
    StepNc,
}

impl Dialect {
    /// All of them.
    pub const ALL: [Dialect; 11] = [
        Dialect::Fanuc,
        Dialect::Mitsubishi,
        Dialect::Siemens,
        Dialect::Heidenhain,
        Dialect::LinuxCnc29,
        Dialect::LinuxCnc210,
        Dialect::Beckhoff,
        Dialect::G1,
        Dialect::AptCatia,
        Dialect::AptCreo,
        Dialect::StepNc,
    ];

    /// Its name on the command line and in headers.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Dialect::Fanuc => "fanuc",
            Dialect::Mitsubishi => "mitsubishi",
            Dialect::Siemens => "siemens",
            Dialect::Heidenhain => "heidenhain",
            Dialect::LinuxCnc29 => "linuxcnc-2.9",
            Dialect::LinuxCnc210 => "linuxcnc-2.10",
            Dialect::Beckhoff => "beckhoff",
            Dialect::G1 => "g1",
            Dialect::AptCatia => "apt-catia",
            Dialect::AptCreo => "apt-creo",
            Dialect::StepNc => "step-nc",
        }
    }

    pub(crate) fn grammar(self) -> &'static dyn Grammar {
        match self {
            Dialect::Fanuc => &GCode(Flavour::Fanuc),
            Dialect::Mitsubishi => &GCode(Flavour::Mitsubishi),
            Dialect::Siemens => &GCode(Flavour::Siemens),
            Dialect::LinuxCnc29 => &GCode(Flavour::LinuxCnc { planes: false }),
            Dialect::LinuxCnc210 => &GCode(Flavour::LinuxCnc { planes: true }),
            Dialect::Beckhoff => &GCode(Flavour::Beckhoff),
            Dialect::G1 => &GCode(Flavour::Plain),
            Dialect::Heidenhain => &heidenhain::Heidenhain,
            Dialect::AptCatia => &apt::Apt { creo: false },
            Dialect::AptCreo => &apt::Apt { creo: true },
            Dialect::StepNc => &step_nc::StepNc,
        }
    }

    /// The dialect that the first lines of a program name.
    pub(crate) fn recognise(head: &str) -> Option<Dialect> {
        let tag = head.split_once(TAG)?.1.trim_start();
        let name: String =
            tag.chars().take_while(|c| c.is_ascii_alphanumeric() || "-.".contains(*c)).collect();
        Dialect::ALL.into_iter().find(|d| d.name() == name)
    }

    /// Decimals of coordinates when the machine says nothing.
    #[must_use]
    pub fn format(self, machine: &Machine) -> LengthFormat {
        let mm = self.grammar().digits();
        if self == Dialect::StepNc {
            // Lengths of a Part 21 file are those of its units, which here are always millimetres.
            return LengthFormat { units: Units::Mm, digits: machine.digits.unwrap_or(mm) };
        }
        let usual = if machine.units == Units::Inch { mm + 1 } else { mm };
        LengthFormat { units: machine.units, digits: machine.digits.unwrap_or(usual) }
    }
}

/// Stands in a header before the dialect's name.
pub(crate) const TAG: &str = "claymill post:";

/// `text` names no dialect.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error(
    "`{0}` is no dialect; write one of fanuc, mitsubishi, siemens, heidenhain, linuxcnc, beckhoff, g1, apt, apt-creo, step-nc"
)]
pub struct UnknownDialect(pub String);

impl FromStr for Dialect {
    type Err = UnknownDialect;

    fn from_str(text: &str) -> Result<Self, UnknownDialect> {
        match text {
            "linuxcnc" => Ok(Dialect::LinuxCnc29),
            "apt" => Ok(Dialect::AptCatia),
            _ => {
                let found = Dialect::ALL.into_iter().find(|d| d.name() == text);
                found.ok_or_else(|| UnknownDialect(text.to_owned()))
            }
        }
    }
}

impl fmt::Display for Dialect {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// What a writer knows beside the moves.
#[derive(Debug)]
pub(crate) struct Page<'a> {
    pub(crate) machine: &'a Machine,
    pub(crate) format: LengthFormat,
    /// Name of the program: letters and digits.
    pub(crate) name: String,
    /// Of the file, from 1.
    pub(crate) number: usize,
    /// Lines for the header, the dialect's tag among them.
    pub(crate) header: Vec<String>,
    /// Whether the tool goes up out of the way: a stream has no stops, and its machine may not reach that far.
    pub(crate) retreats: bool,
    /// Speed of the section that is written, 1/min; 0 where none is known.
    pub(crate) speed_rpm: f64,
}

impl Page<'_> {
    /// `X1. Y2. Z3.`
    pub(crate) fn xyz(&self, p: &Point3) -> String {
        let f = &self.format;
        format!("X{} Y{} Z{}", f.text(p.x), f.text(p.y), f.text(p.z))
    }
}

/// What whoever sets the machine up must know of a section: the tool and what is programmed of it, where the zero is,
/// how deep it goes.
pub(crate) fn title(page: &Page, section: &Section) -> [String; 2] {
    let text = |mm: f64| page.format.text(mm);
    let zero = section.frame.to_model(&Point3::origin());
    let axis = section.frame.axis();
    let named = "xyz".char_indices().find(|(i, _)| axis[*i].abs() == 1.0);
    let axis = named.map_or_else(
        || format!("{:.6} {:.6} {:.6}", axis.x, axis.y, axis.z),
        |(i, letter)| format!("{}{letter}", if axis[i] > 0.0 { '+' } else { '-' }),
    );
    let points = section.strokes.iter().flat_map(|s| s.curve.points());
    let lowest = points.map(|p| p.z).fold(f64::INFINITY, f64::min);
    let held = section.stick_out_mm.map_or_else(String::new, |mm| format!(", sticks out {}", text(mm)));
    [
        format!(
            "setup {} tool T{} ball R{}{held}, its tip is programmed",
            section.setup,
            section.tool_number,
            text(section.radius_mm)
        ),
        format!(
            "zero at X{} Y{} Z{} of the model, tool axis {axis}, lowest Z{}",
            text(zero.x),
            text(zero.y),
            text(zero.z),
            text(lowest)
        ),
    ]
}

/// A part of the program that one block moves along.
#[derive(Debug, Clone, PartialEq)]
pub struct Element {
    /// Line of the block, from 1.
    pub line: usize,
    /// G0.
    pub rapid: bool,
    /// Feed, mm/min; the machine's rapid rate where it is rapid.
    pub feed: f64,
    /// What it moves along.
    pub shape: Shape,
    /// The tilted plane, or the turned part, whose coordinates it has.
    pub tilt: Option<Tilt>,
}

/// Takes elements as they are read.
pub(crate) type Sink<'a> = &'a mut dyn FnMut(Element) -> Result<(), Refusal>;

/// A block that was refused, and its line.
#[derive(Debug)]
pub(crate) enum Fault {
    Io(std::io::Error),
    Refused { line: usize, refusal: Refusal },
}

/// A control's language: writing and reading.
pub(crate) trait Grammar: Sync {
    fn abilities(&self, machine: &Machine) -> Abilities;
    /// Usual decimals of a coordinate in mm.
    fn digits(&self) -> u8;
    /// The file up to the first section.
    fn begin(&self, out: &mut String, page: &Page);
    /// Tool, spindle, work offset and a safe way to above the start of the first move, from anywhere.
    fn section(&self, out: &mut String, page: &Page, section: &Section, start: &Point3);
    /// One move.
    fn stroke(&self, out: &mut String, page: &Page, stroke: &Stroke, lowered: &Lowered, id: u64);
    /// Up to the clearance height and on, out of the way, and a stop where the next section has another setup.
    /// `ids` are those of the moves since [`Grammar::section`].
    fn leave(
        &self,
        out: &mut String,
        page: &Page,
        section: &Section,
        end: &Point3,
        stop: Option<&str>,
        ids: std::ops::Range<u64>,
    );
    /// How the tool gets out of the way where the machine says nothing: in words, for the header.
    fn retreat(&self, machine: &Machine) -> String {
        format!("up to {} mm above the clearance height", machine.retreat_mm)
    }
    /// The file's end; `groups` are the first ids of its sections.
    fn end(&self, out: &mut String, page: &Page, groups: &[u64]);
    /// Whether a line takes a line number, and is there one in any case.
    fn numbered(&self, _line: &str) -> bool {
        true
    }
    /// Whether every line must have a number.
    fn always_numbered(&self) -> bool {
        false
    }
    /// Reads a program; the position is unknown at its beginning.
    fn read(&self, text: &mut dyn BufRead, machine: &Machine, sink: Sink<'_>) -> Result<(), Fault>;
}

/// A line of a program is never longer than this, bytes.
const LONGEST_LINE: u64 = 1 << 16;

/// Calls `each` with the lines of a program, numbered from 1.
pub(crate) fn lines(
    text: &mut dyn BufRead,
    mut each: impl FnMut(usize, &str) -> Result<(), Refusal>,
) -> Result<(), Fault> {
    let mut buffer = Vec::new();
    let mut line = 0;
    loop {
        buffer.clear();
        line += 1;
        let mut limited = std::io::Read::take(&mut *text, LONGEST_LINE);
        let count = limited.read_until(b'\n', &mut buffer).map_err(Fault::Io)?;
        if count == 0 {
            return Ok(());
        }
        let refuse = |refusal| Fault::Refused { line, refusal };
        if count as u64 == LONGEST_LINE {
            return Err(refuse(Refusal::new(
                "syntax",
                format!("the line has more than {LONGEST_LINE} bytes"),
            )));
        }
        let text = String::from_utf8_lossy(&buffer);
        each(line, text.trim_end()).map_err(refuse)?;
    }
}

/// Number of a tool id: 1 for `T1`.
#[must_use]
pub fn tool_number(id: &str) -> u32 {
    let digits: String = id.chars().filter(char::is_ascii_digit).take(6).collect();
    digits.parse().unwrap_or(1)
}
