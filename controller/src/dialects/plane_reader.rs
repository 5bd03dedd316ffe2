//! Follows the tilted plane, or the indexed part, through a program in G-code.

use claymill_nurbs::Vector3;

use super::flavour::Flavour;
use super::plane_words::{read_cycle800, read_g68_2};
use crate::tilt::Tilt;
use crate::words::Word;
use crate::{Machine, Refusal};

/// What is in force of planes and indices.
pub(super) struct PlaneReader<'a> {
    flavour: Flavour,
    machine: &'a Machine,
    tilt: Option<Tilt>,
    /// Whether the tool is along the plane's axis: G68.2 alone does not turn it.
    is_aligned: bool,
    /// Whether a plane of the control is on, upright ones included.
    is_open: bool,
}

impl<'a> PlaneReader<'a> {
    pub(super) fn new(flavour: Flavour, machine: &'a Machine) -> Self {
        PlaneReader { flavour, machine, tilt: None, is_aligned: true, is_open: false }
    }

    /// The plane in force; none where it is upright.
    pub(super) fn tilt(&self) -> Option<Tilt> {
        self.tilt.filter(|t| !t.is_none())
    }

    /// Whether anything may move now.
    pub(super) fn check(&self) -> Result<(), Refusal> {
        if self.is_aligned {
            return Ok(());
        }
        Err(Refusal::new(
            "fanuc-g53.1",
            "a move in a plane of G68.2 without G53.1: the tool would stand askew in it",
        ))
    }

    /// At the program's end.
    pub(super) fn finish(&self) -> Result<(), Refusal> {
        match self.is_open {
            true => Err(Refusal::new("plane-open", "the program ends within a tilted plane")),
            false => Ok(()),
        }
    }

    /// Whether a text is CYCLE800.
    pub(super) fn cycle(&mut self, text: &str, unit_mm: f64) -> Result<bool, Refusal> {
        let text = text.split(';').next().unwrap_or_default().trim();
        let Some(plane) = read_cycle800(text, unit_mm)? else { return Ok(false) };
        (self.tilt, self.is_open) = (plane, plane.is_some());
        Ok(true)
    }

    /// Whether a block is about planes or the index, and nothing else.
    pub(super) fn block(&mut self, words: &[Word], unit_mm: f64, ended: bool) -> Result<bool, Refusal> {
        let has = |code: u32| words.iter().any(|w| w.key == "G" && w.code() == Some(code));
        match self.flavour {
            Flavour::Fanuc if has(682) && !ended => {
                if self.is_open {
                    return Err(Refusal::new(
                        "tilted-plane",
                        "G68.2 within a plane of G68.2: put G69 before it",
                    ));
                }
                self.tilt = Some(read_g68_2(words, unit_mm)?);
                (self.is_open, self.is_aligned) = (true, false);
                Ok(true)
            }
            Flavour::Fanuc if has(531) && !ended => {
                if !self.is_open || words.len() > 1 {
                    return Err(Refusal::new("fanuc-g53.1", "G53.1 stands alone, behind G68.2"));
                }
                self.is_aligned = true;
                Ok(true)
            }
            Flavour::Fanuc if has(690) && words.len() == 1 => {
                (self.tilt, self.is_open, self.is_aligned) = (None, false, true);
                Ok(true)
            }
            Flavour::LinuxCnc { .. } => self.index(words, ended),
            _ => Ok(false),
        }
    }

    /// `G0 A90.`
    fn index(&mut self, words: &[Word], ended: bool) -> Result<bool, Refusal> {
        let Some(deg) = words.iter().find(|w| w.key == "A").and_then(Word::number) else { return Ok(false) };
        let axis = self.machine.rotary.get("a").filter(|axis| axis.turns_table && !ended);
        let Some(axis) = axis else { return Ok(false) };
        let [g0, _] = words else {
            return Err(Refusal::new(
                "index",
                "A moves alone, by G0: a block that turns the part and moves is not read",
            ));
        };
        if g0.key != "G" || g0.code() != Some(0) {
            return Err(Refusal::new("index", "A moves by G0 only"));
        }
        let [low, high] = axis.travel_deg;
        if !(low..=high).contains(&deg) {
            return Err(Refusal::new("head-limit", format!("A{deg} is outside {low} to {high} degrees")));
        }
        self.tilt = Tilt::of_turned_part(&Vector3::from(axis.direction), deg);
        Ok(true)
    }
}
