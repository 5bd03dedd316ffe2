//! In what the controls that are programmed in words of G-code differ.

use crate::Units;

/// A control that is programmed in words of G-code.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Flavour {
    Fanuc,
    Mitsubishi,
    Siemens,
    LinuxCnc {
        /// Curves in G18 and G19: from 2.10 on.
        planes: bool,
    },
    Beckhoff,
    Plain,
}

impl Flavour {
    /// Axes that G0 starts together may arrive one after the other: the tool then leaves the straight line.
    pub(super) fn rapid_is_straight(self) -> bool {
        matches!(self, Flavour::LinuxCnc { .. })
    }

    pub(super) fn semicolon(self) -> bool {
        matches!(self, Flavour::Siemens | Flavour::Beckhoff)
    }

    pub(super) fn comment(self, text: &str) -> String {
        let plain: String = text
            .chars()
            .map(|c| if c.is_ascii() && !c.is_ascii_control() && !"()%;".contains(c) { c } else { '_' })
            .collect();
        if self.semicolon() { format!("; {plain}") } else { format!("({plain})") }
    }

    pub(super) fn unit_code(self, units: Units) -> &'static str {
        match (self, units) {
            (Flavour::Siemens, Units::Mm) => "G71",
            (Flavour::Siemens, Units::Inch) => "G70",
            (_, Units::Mm) => "G21",
            (_, Units::Inch) => "G20",
        }
    }
}
