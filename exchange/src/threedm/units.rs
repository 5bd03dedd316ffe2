//! Units of length.

use super::archive::Reader;
use super::fault::Fault;

/// Name and millimetres of the units that the archive numbers (`LengthUnitSystem` of the openNURBS toolkit);
/// the lengths are the definitions of SI and of the international inch.
const UNITS: [(i32, &str, f64); 22] = [
    (12, "ANGSTROM", 1e-7),
    (13, "NANOMETRE", 1e-6),
    (1, "MICRON", 1e-3),
    (2, "MM", 1.0),
    (3, "CM", 10.0),
    (14, "DECIMETRE", 100.0),
    (4, "METRE", 1e3),
    (15, "DEKAMETRE", 1e4),
    (16, "HECTOMETRE", 1e5),
    (5, "KILOMETRE", 1e6),
    (17, "MEGAMETRE", 1e9),
    (18, "GIGAMETRE", 1e12),
    (6, "MICROINCH", 25.4e-6),
    (7, "MIL", 25.4e-3),
    (8, "INCH", 25.4),
    (9, "FOOT", 304.8),
    (19, "YARD", 914.4),
    (10, "MILE", 1_609_344.0),
    (20, "POINT", 25.4 / 72.0),
    (21, "PICA", 25.4 / 6.0),
    (22, "NAUTICAL MILE", 1_852_000.0),
    (0, "NONE", 1.0),
];
const CUSTOM: i32 = 11;

/// The units of a file.
#[derive(Debug, Clone)]
pub(super) struct Units {
    pub(super) declared: String,
    pub(super) mm_per_unit: f64,
    pub(super) tolerance: f64,
    pub(super) warning: Option<String>,
}

impl Units {
    /// What holds when the file says nothing.
    pub(super) fn unknown() -> Self {
        Units {
            declared: "NONE".into(),
            mm_per_unit: 1.0,
            tolerance: 0.0,
            warning: Some("The file declares no unit of length: millimetres are assumed.".into()),
        }
    }

    /// Reads the settings record of units and tolerances.
    pub(super) fn read(r: &mut Reader) -> Result<Self, Fault> {
        let version = r.integer()?;
        let number = r.integer()?;
        let [tolerance, _angle, _relative] = r.reals()?;
        let mut custom = None;
        if version >= 101 {
            let _display = r.take(8)?;
        }
        if version >= 102 {
            custom = Some((r.real()?, r.text()?));
        }
        let known = UNITS.iter().find(|(n, ..)| *n == number).map(|(_, name, mm)| ((*name).into(), *mm));
        let custom = || {
            let (metres, name) = custom.filter(|(metres, _)| (1e-10..1e10).contains(metres))?;
            Some((name, metres * 1e3))
        };
        let found = if number == CUSTOM { custom() } else { known };
        let plausible = if tolerance.is_finite() { tolerance.max(0.0) } else { 0.0 };
        let Some((declared, mm_per_unit)) = found else {
            return Ok(Units { tolerance: plausible, ..Units::unknown() });
        };
        let warning = (number == 0).then(|| Units::unknown().warning).flatten();
        Ok(Units { declared, mm_per_unit, tolerance: plausible, warning })
    }
}
