//! The global section: delimiters, sender, units, resolution.

use super::tokens::{self, Delimiters, Tokens};

/// What the reader needs of the global section.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Global {
    pub(crate) delimiters: Delimiters,
    /// The sending program.
    pub(crate) system: Option<String>,
    /// The unit as declared.
    pub(crate) unit: String,
    /// Millimetres in one unit of the file, model scale included.
    pub(crate) mm_per_unit: f64,
    /// Declared resolution in file units; 0 when none.
    pub(crate) resolution: f64,
    /// Sentences for the report.
    pub(crate) warnings: Vec<String>,
}

/// Units flag, names and millimetres (IGES 5.3, table 2).
const UNITS: [(i64, &[&str], f64); 10] = [
    (1, &["INCH", "IN"], 25.4),
    (2, &["MM", "MILLIMETER", "MILLIMETRE"], 1.0),
    (4, &["FT", "FOOT", "FEET"], 304.8),
    (5, &["MI", "MILE"], 1_609_344.0),
    (6, &["M", "METER", "METRE"], 1000.0),
    (7, &["KM", "KILOMETER", "KILOMETRE"], 1e6),
    (8, &["MIL"], 0.0254),
    (9, &["UM", "MICRON"], 1e-3),
    (10, &["CM", "CENTIMETER", "CENTIMETRE"], 10.0),
    (11, &["UIN", "MICROINCH"], 25.4e-6),
];
/// The flag that leaves the unit to its name.
const UNIT_BY_NAME: i64 = 3;

impl Global {
    pub(crate) fn new(section: &[u8]) -> Self {
        let delimiters = delimiters(section);
        let fields = fields(section, delimiters);
        let field = |number: usize| fields.get(number - 1).copied().unwrap_or(b"");
        let real = |number: usize| tokens::real(field(number));
        let mut warnings = Vec::new();

        let (unit, unit_mm) = unit(field(14), field(15), &mut warnings);
        // The ratio of model space to the real thing: 0.125 is a model at one eighth.
        let scale = real(13).filter(|s| *s > 0.0).unwrap_or(1.0);
        if scale != 1.0 {
            warnings.push(format!("The file declares a model scale of {scale}: sizes were divided by it."));
        }
        let system = [5, 6].map(|n| tokens::text(field(n))).into_iter().find(|s| !s.is_empty());
        Global {
            delimiters,
            system,
            unit,
            mm_per_unit: unit_mm / scale,
            resolution: real(19).filter(|r| *r > 0.0).unwrap_or(0.0),
            warnings,
        }
    }
}

/// The first two fields declare the delimiters as `1H,,1H;,` — or are empty and leave `,` and `;`.
fn delimiters(section: &[u8]) -> Delimiters {
    let declared = |s: &[u8]| match s.trim_ascii_start() {
        [b'1', b'H' | b'h', c, ..] if !c.is_ascii_alphanumeric() && *c != b' ' => Some(*c),
        _ => None,
    };
    let parameter = declared(section);
    let separator = parameter.unwrap_or(b',');
    // `1H,` and its delimiter, or just the delimiter.
    let section = section.trim_ascii_start();
    let skip = if parameter.is_some() { 4 } else { 1 };
    let record = section.get(skip..).and_then(declared).filter(|r| *r != separator);
    Delimiters { parameter: separator, record: record.unwrap_or(b';') }
}

fn fields(section: &[u8], delimiters: Delimiters) -> Vec<&[u8]> {
    let mut tokens = Tokens::new(section, delimiters);
    // Nobody has more than 26 fields; damaged delimiters may pretend so.
    std::iter::from_fn(|| tokens.next()).take(64).collect()
}

fn unit(flag: &[u8], name: &[u8], warnings: &mut Vec<String>) -> (String, f64) {
    let name = tokens::text(name).to_ascii_uppercase();
    let named = UNITS.iter().find(|u| u.1.contains(&name.as_str()));
    let flag = tokens::integer(flag).unwrap_or(0);
    let flagged = UNITS.iter().find(|u| u.0 == flag);
    match (flagged, named) {
        (Some(f), Some(n)) if f.0 != n.0 => {
            warnings.push(format!(
                "The unit flag {flag} says {} but the unit name says {name}: the flag was followed; compare the size \
                 with the real part.",
                f.1[0]
            ));
            (f.1[0].into(), f.2)
        }
        (Some(f), _) => (f.1[0].into(), f.2),
        (None, Some(n)) => {
            if flag != UNIT_BY_NAME {
                warnings.push(format!("The unit flag is {flag}; the unit name {name} was followed."));
            }
            (n.1[0].into(), n.2)
        }
        // The standard's default is the inch.
        (None, None) if flag == 0 && name.is_empty() => {
            warnings.push(
                "The file declares no unit: the standard's default, inch, was taken; check the size.".into(),
            );
            ("INCH".into(), 25.4)
        }
        (None, None) => {
            warnings.push(format!(
                "The unit (flag {flag}, name `{name}`) is unknown: millimetres were taken; check the size."
            ));
            (name, 1.0)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn with(scale: &str, flag: &str, name: &str) -> Global {
        let text = format!(
            "1H,,1H;,3Hsrc,5Ha.igs,4HCAD1,3Hpre,32,38,6,308,15,,{scale},{flag},{name},1,.1,,1D-3,9.;"
        );
        Global::new(text.as_bytes())
    }

    #[test]
    fn every_unit_and_the_model_scale() {
        assert_eq!(with("1.", "1", "2HIN").mm_per_unit, 25.4);
        assert_eq!(with("1.", "6", "1HM").mm_per_unit, 1000.0);
        assert_eq!(with("1.", "3", "2HCM").mm_per_unit, 10.0);
        assert_eq!(with("0.5", "2", "2HMM").mm_per_unit, 2.0);
        let g = with("1.", "2", "2HMM");
        assert_eq!((g.resolution, g.system.as_deref()), (1e-3, Some("CAD1")));
        assert!(g.warnings.is_empty());
    }

    #[test]
    fn doubtful_units_are_reported() {
        for doubtful in [with("1.", "", ""), with("1.", "6", "2HMM"), with("1.", "77", "3HELL")] {
            assert_eq!(doubtful.warnings.len(), 1, "{doubtful:?}");
        }
        assert_eq!(with("1.", "6", "2HMM").mm_per_unit, 1000.0);
    }

    #[test]
    fn odd_delimiters() {
        let g = Global::new(b"1H/,1H#/".as_slice());
        assert_eq!(g.delimiters.parameter, b'/');
        let g = Global::new(b"1H//1H#/3Hsrc/5Ha.igs/4HCAD1/3Hpre/32/38/6/308/15//1./2/2HMM#");
        assert_eq!(g.delimiters, Delimiters { parameter: b'/', record: b'#' });
        assert_eq!(g.unit, "MM");
        let g = Global::new(b",,3Hsrc,5Ha.igs,4HCAD1,3Hpre,32,38,6,308,15,,1.,6,1HM;");
        assert_eq!((g.delimiters.record, g.mm_per_unit), (b';', 1000.0));
    }
}
