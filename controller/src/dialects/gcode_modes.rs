//! The modal state of a control that reads G-code: motion, plane, unit, path tolerance, and modes
//! under which no path is read.

use super::flavour::Flavour;
use crate::words::Word;
use crate::{Machine, Plane, Refusal};

/// The motion that a block without a G word goes on with.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Motion {
    None,
    Rapid,
    Feed,
    Clockwise,
    Counterclockwise,
    Poly,
}

/// What a G word begins.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Begins {
    /// G06.2
    Fanuc,
    /// G5.2
    LinuxCnc,
    /// G5
    Cubic,
    /// G5.1
    Quadratic,
    /// BSPLINE
    Siemens,
    /// G151
    Beckhoff,
    /// G150
    BeckhoffEnd,
    /// G4
    Dwell,
}

/// What stays from block to block on a control that reads G-code.
pub(crate) struct Modes {
    flavour: Flavour,
    pub(crate) motion: Motion,
    pub(crate) plane: Plane,
    pub(crate) unit_mm: f64,
    /// G05 P10000.
    pub(crate) high_speed: bool,
    /// How far from the programmed path LinuxCNC may run, mm; `None` while there is no limit, or none is known.
    pub(crate) path_mm: Option<f64>,
    /// Codes in force that nothing is read under: coordinates, compensation, feed.
    wrong: [Option<u32>; 3],
}

/// What a path tolerance in inches may be larger by its last digit, mm.
const BLEND_SLACK_MM: f64 = 1e-6;

impl Modes {
    pub(crate) fn new(flavour: Flavour, machine: &Machine) -> Self {
        Modes {
            flavour,
            motion: Motion::None,
            plane: Plane::Xy,
            unit_mm: machine.units.mm(),
            high_speed: false,
            path_mm: None,
            wrong: [None; 3],
        }
    }

    /// A G word of a block.
    pub(crate) fn take(&mut self, code: Option<u32>, words: &[Word]) -> Result<Option<Begins>, Refusal> {
        let code = code.unwrap_or(u32::MAX);
        if let Some((group, right)) = group(code) {
            self.wrong[group] = (!right).then_some(code);
            return if right { Ok(None) } else { Err(misread(code)) };
        }
        let fanuc = matches!(self.flavour, Flavour::Fanuc | Flavour::Mitsubishi);
        let plain = fanuc || self.flavour == Flavour::Plain;
        let siemens = self.flavour == Flavour::Siemens;
        let linuxcnc = matches!(self.flavour, Flavour::LinuxCnc { .. });
        let beckhoff = self.flavour == Flavour::Beckhoff;
        let p = || words.iter().find(|w| w.key == "P").and_then(Word::number);
        match code {
            0 => self.motion = Motion::Rapid,
            10 => self.motion = Motion::Feed,
            20 => self.motion = Motion::Clockwise,
            30 => self.motion = Motion::Counterclockwise,
            40 => return Ok(Some(Begins::Dwell)),
            170 => self.plane = Plane::Xy,
            180 => self.plane = Plane::Zx,
            190 => self.plane = Plane::Yz,
            200 if !siemens => self.unit_mm = 25.4,
            210 if !siemens => self.unit_mm = 1.0,
            700 if siemens => self.unit_mm = 25.4,
            710 if siemens => self.unit_mm = 1.0,
            610 | 611 if linuxcnc => self.path_mm = Some(0.0),
            640 if linuxcnc => self.path_mm = p().filter(|p| *p > 0.0).map(|p| p * self.unit_mm),
            430 | 490 | 540..=599 | 610 | 640 | 800 => {}
            // Further work offsets.
            5050..=5990 if siemens && code.is_multiple_of(10) => {}
            // What was scaled, mirrored, turned, polar or modal ends.
            131 | 150 | 500 | 501 | 670 | 690 | 970 | 980 if plain => {}
            50 if fanuc => self.high_speed = p() == Some(10_000.0),
            62 if fanuc => return Ok(Some(Begins::Fanuc)),
            50 if linuxcnc => return Ok(Some(Begins::Cubic)),
            51 if linuxcnc => return Ok(Some(Begins::Quadratic)),
            52 if linuxcnc => return Ok(Some(Begins::LinuxCnc)),
            1510 if beckhoff => return Ok(Some(Begins::Beckhoff)),
            1500 if beckhoff => return Ok(Some(Begins::BeckhoffEnd)),
            53 if linuxcnc => return Err(Refusal::new("linuxcnc-g5.3", "G5.3 without G5.2")),
            _ => return Err(misread(code)),
        }
        Ok(None)
    }

    /// A G word of a block that is not read: what it leaves behind counts all the same.
    pub(crate) fn leave(&mut self, code: Option<u32>, words: &[Word]) {
        // What this refuses is in `wrong`, or is nobody's mode.
        let _ = self.take(code, words);
    }

    /// Whether the path of a block can be told in these modes.
    pub(crate) fn check(&self) -> Result<(), Refusal> {
        match self.wrong.iter().flatten().next() {
            Some(code) => {
                let Refusal { rule, detail } = misread(*code);
                Err(Refusal::new(rule, format!("{detail}; a block of the machine definition has left it on")))
            }
            None => Ok(()),
        }
    }

    /// Whether LinuxCNC stays as near to the path as the machine's definition says.
    pub(crate) fn check_blend(&self, machine: &Machine) -> Result<(), Refusal> {
        if !matches!(self.flavour, Flavour::LinuxCnc { .. }) {
            return Ok(());
        }
        match self.path_mm {
            Some(mm) if mm <= machine.blend_mm + BLEND_SLACK_MM => Ok(()),
            Some(mm) => Err(Refusal::new(
                "linuxcnc-blend",
                format!(
                    "G64 lets the control leave the path by {mm} mm, more than the blend_mm of {} mm",
                    machine.blend_mm
                ),
            )),
            None => Err(Refusal::new(
                "linuxcnc-blend",
                "a cutting move without G61 or G64 P: the control rounds corners as far as it likes",
            )),
        }
    }
}

/// Which of the groups coordinates, compensation and feed a code belongs to, and whether blocks are read under it.
fn group(code: u32) -> Option<(usize, bool)> {
    Some(match code {
        900 => (0, true),
        910 => (0, false),
        400 => (1, true),
        410 | 420 => (1, false),
        940 => (2, true),
        930 | 950 => (2, false),
        _ => return None,
    })
}

/// Why a code is not read.
fn misread(code: u32) -> Refusal {
    let (rule, detail) = match code {
        62 => ("linuxcnc-g6.2", "G6.2 is unknown to 2.9 and corrupts the position in 2.10"),
        410 | 420 => ("radius-compensation", "G41 and G42 move the path by what the control knows only"),
        910 => ("incremental", "G91: incremental positions are not read"),
        930 | 950 => ("feed-mode", "G93 and G95: feeds other than mm/min are not read"),
        121 | 160 | 1120 => ("polar", "G12.1 and G16: polar coordinates are not read"),
        510 | 511 | 680 => {
            ("transformed", "G51 and G68: scaled, mirrored or turned coordinates are not read")
        }
        _ => ("unknown-code", "a G code that is not known: its effect cannot be checked"),
    };
    Refusal::new(rule, detail)
}
