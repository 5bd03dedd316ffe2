//! The cards of a file being written.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::Path;

/// Parameter data of one entity as separate values.
#[derive(Debug, Clone)]
pub(crate) struct Parameters {
    kind: usize,
    values: Vec<String>,
}

impl Parameters {
    pub(crate) fn of(kind: usize) -> Self {
        Parameters { kind, values: vec![kind.to_string()] }
    }

    pub(crate) fn integers(&mut self, values: &[usize]) {
        self.values.extend(values.iter().map(usize::to_string));
    }

    /// A count and that many pointers.
    pub(crate) fn pointers(&mut self, values: &[usize]) {
        self.integers(&[values.len()]);
        self.integers(values);
    }

    pub(crate) fn reals(&mut self, values: &[f64]) {
        self.values.extend(values.iter().map(|x| real(*x)));
    }

    pub(crate) fn text(&mut self, text: &str) {
        self.values.push(counted(text));
    }
}

/// The shortest number that reads back as the same bits, with the point that the format demands.
fn real(x: f64) -> String {
    let text = format!("{x:?}");
    let text = match text.split_once('e') {
        Some((mantissa, exponent)) if mantissa.contains('.') => format!("{mantissa}E{exponent}"),
        Some((mantissa, exponent)) => format!("{mantissa}.E{exponent}"),
        None => text,
    };
    text.strip_suffix(".0").map_or(text.clone(), |whole| format!("{whole}."))
}

/// A counted string; characters outside printable ASCII have no place in the format.
fn counted(text: &str) -> String {
    let text: String = text.chars().map(|c| if matches!(c, ' '..='~') { c } else { '_' }).collect();
    format!("{}H{text}", text.len())
}

/// An entity to be written.
#[derive(Debug, Clone)]
pub(crate) struct Draft {
    pub(crate) parameters: Parameters,
    pub(crate) form: usize,
    pub(crate) level: u32,
    /// DE number of a colour definition; 0 for none.
    pub(crate) colour: usize,
    /// Belongs to another entity.
    pub(crate) dependent: bool,
    /// Lies in a parameter plane.
    pub(crate) flat: bool,
    /// Shown in the directory entry.
    pub(crate) label: String,
    /// Not geometry but a definition.
    pub(crate) definition: bool,
}

impl Draft {
    pub(crate) fn new(parameters: Parameters) -> Self {
        Draft {
            parameters,
            form: 0,
            level: 0,
            colour: 0,
            dependent: false,
            flat: false,
            label: String::new(),
            definition: false,
        }
    }

    fn status(&self) -> String {
        let role = match (self.definition, self.flat) {
            (true, _) => 2,
            (_, true) => 5,
            _ => 0,
        };
        format!("00{:02}{role:02}00", u8::from(self.dependent))
    }
}

/// All entities of a file, with their cards.
#[derive(Debug, Default)]
pub(crate) struct Deck {
    directory: String,
    parameters: String,
    entities: usize,
    cards: usize,
    colours: BTreeMap<[u8; 3], usize>,
}

impl Deck {
    pub(crate) fn new() -> Self {
        Deck::default()
    }

    /// Adds an entity; gives its DE number.
    pub(crate) fn add(&mut self, draft: Draft) -> usize {
        let de = 2 * self.entities + 1;
        let first = self.cards + 1;
        self.push_parameters(&draft.parameters.values, de);
        let count = self.cards + 1 - first;
        let Draft { form, level, colour, .. } = draft;
        let (kind, status) = (draft.parameters.kind, draft.status());
        let colour = if colour == 0 { "0".into() } else { format!("-{colour}") };
        let label = &draft.label;
        let _ = writeln!(
            self.directory,
            "{kind:>8}{first:>8}{0:>8}{0:>8}{level:>8}{0:>8}{0:>8}{0:>8}{status}D{de:>7}",
            0
        );
        let _ = writeln!(
            self.directory,
            "{kind:>8}{0:>8}{colour:>8}{count:>8}{form:>8}{0:>8}{0:>8}{label:>8}{0:>8}D{1:>7}",
            0,
            de + 1
        );
        self.entities += 1;
        de
    }

    /// Adds an entity with a name property (406, form 15) where there is a name.
    pub(crate) fn add_named(&mut self, mut draft: Draft, name: Option<&str>) -> usize {
        if let Some(name) = name.filter(|n| !n.is_empty()) {
            let mut parameters = Parameters::of(406);
            parameters.integers(&[1]);
            parameters.text(name);
            let property =
                self.add(Draft { form: 15, dependent: true, definition: true, ..Draft::new(parameters) });
            // No associativities, one property.
            draft.parameters.integers(&[0, 1, property]);
            draft.label = name.chars().filter(char::is_ascii_alphanumeric).take(8).collect();
        }
        self.add(draft)
    }

    /// DE number of the colour's definition (314), which is written once; 0 for no colour.
    pub(crate) fn colour(&mut self, colour: Option<[u8; 3]>) -> usize {
        let Some(rgb) = colour else { return 0 };
        if let Some(de) = self.colours.get(&rgb) {
            return *de;
        }
        let mut parameters = Parameters::of(314);
        parameters.reals(&rgb.map(|c| f64::from(c) / 2.55));
        let de = self.add(Draft { definition: true, ..Draft::new(parameters) });
        self.colours.insert(rgb, de);
        de
    }

    /// The whole file.
    pub(crate) fn text(&self, path: &Path, tolerance_mm: f64) -> String {
        let name = path.file_name().map_or("model.igs".into(), |n| n.to_string_lossy());
        let mut text = String::with_capacity(self.directory.len() + self.parameters.len() + 1000);
        let mut start = 0;
        section(&mut text, &["Trimmed surfaces in millimetres".into()], "", 'S', &mut start);
        // No date: the same model gives the same bytes.
        let date = counted("20000101.000000");
        let version = concat!("claymill ", env!("CARGO_PKG_VERSION"));
        let values = [
            counted(","),
            counted(";"),
            counted(&name),
            counted(&name),
            counted(version),
            counted(version),
            "32".into(),
            "308".into(),
            "15".into(),
            "308".into(),
            "15".into(),
            counted(&name),
            "1.".into(),
            "2".into(),
            counted("MM"),
            "1".into(),
            "0.".into(),
            date.clone(),
            real(if tolerance_mm > 0.0 { tolerance_mm } else { 1e-6 }),
            "0.".into(),
            String::new(),
            String::new(),
            "11".into(),
            "0".into(),
            date,
        ];
        let mut global = 0;
        section(&mut text, &delimited(&values, 72), "", 'G', &mut global);
        text += &self.directory;
        text += &self.parameters;
        let counts = format!("S{start:>7}G{global:>7}D{:>7}P{:>7}", 2 * self.entities, self.cards);
        let _ = writeln!(text, "{counts:<72}T{:>7}", 1);
        text
    }

    fn push_parameters(&mut self, values: &[String], de: usize) {
        let back = format!("{de:>8}");
        section(&mut self.parameters, &delimited(values, 64), &back, 'P', &mut self.cards);
    }
}

/// Packs values and their delimiters into lines of `width` columns. Only strings may run across lines.
fn delimited(values: &[String], width: usize) -> Vec<String> {
    let mut lines = Vec::new();
    let mut line = String::new();
    for (i, value) in values.iter().enumerate() {
        let mut value = value.clone();
        value.push(if i + 1 < values.len() { ',' } else { ';' });
        if !line.is_empty() && line.len() + value.len() > width {
            lines.push(std::mem::take(&mut line));
        }
        while value.len() > width {
            let rest = value.split_off(width);
            lines.push(std::mem::replace(&mut value, rest));
        }
        line += &value;
    }
    lines.push(line);
    lines
}

/// Appends cards: text, back pointer, section letter and running number.
fn section(text: &mut String, lines: &[String], back: &str, letter: char, number: &mut usize) {
    let columns = 72 - back.len();
    for line in lines {
        *number += 1;
        let _ = writeln!(text, "{line:<columns$}{back}{letter}{number:>7}");
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reals_read_back_with_the_same_bits() {
        let numbers = [0.0, 1.0, -2.5, 0.1 + 0.2, 1e-7, 1e22, 123_456_789.123_456_78, f64::MIN_POSITIVE];
        for x in numbers {
            let text = real(x);
            assert!(text.contains('.'), "{text}");
            assert_eq!(crate::iges::tokens::real(text.as_bytes()), Some(x), "{text}");
        }
    }

    #[test]
    fn long_strings_run_across_lines_and_numbers_do_not() {
        let values = [counted(&"x".repeat(100)), "12345.".into(), "7".into()];
        let lines = delimited(&values, 64);
        assert_eq!(lines.concat(), format!("{},12345.,7;", values[0]));
        assert!(lines.iter().all(|l| l.len() <= 64));
    }
}
