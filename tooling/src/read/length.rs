//! Lengths with their unit, as texts hold them: `5.00 mm`, `1/4"`, `0.25 in`.

/// Unit of a length.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum LengthUnit {
    /// Millimetres.
    #[default]
    Mm,
    /// Inches.
    Inch,
}

impl LengthUnit {
    /// Millimetres in one of it.
    #[must_use]
    pub const fn mm(self) -> f64 {
        match self {
            LengthUnit::Mm => 1.0,
            LengthUnit::Inch => 25.4,
        }
    }

    /// The unit by a word of a file: `millimeters`, `metric`, `inches`, …
    pub(super) fn named(word: &str) -> Option<Self> {
        match word.trim().to_ascii_lowercase().as_str() {
            "mm" | "millimeters" | "millimetres" | "metric" => Some(LengthUnit::Mm),
            "in" | "inch" | "inches" | "imperial" => Some(LengthUnit::Inch),
            _ => None,
        }
    }
}

/// Millimetres of a text. Without a unit it is mm. A fraction and a decimal comma are understood.
pub(super) fn length_mm(text: &str) -> Option<f64> {
    let text = text.trim();
    let end = text.find(|c: char| c.is_ascii_alphabetic() && !"eE".contains(c) || "\"'µ″".contains(c));
    let (number, unit) = text.split_at(end.unwrap_or(text.len()));
    let scale = match unit.trim().to_ascii_lowercase().as_str() {
        "" | "mm" => 1.0,
        "um" | "µm" => 1e-3,
        "cm" => 10.0,
        "m" => 1000.0,
        "in" | "inch" | "inches" | "\"" | "″" => 25.4,
        "ft" | "'" => 304.8,
        "thou" | "mil" => 0.0254,
        _ => return None,
    };
    let number = number.trim().replace(',', ".");
    let value = match number.split_once('/') {
        Some((over, under)) => plain(over)? / plain(under)?,
        None => plain(&number)?,
    };
    Some(value * scale).filter(|v| v.is_finite())
}

/// A number; `inf` and `nan`, which Rust reads too, are none.
pub(super) fn plain(text: &str) -> Option<f64> {
    let text = text.trim();
    text.parse::<f64>().ok().filter(|v| v.is_finite() && text.contains(|c: char| c.is_ascii_digit()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lengths_are_read_in_every_unit_that_files_hold() {
        let cases = [
            ("5.0000 mm", 5.0),
            ("5", 5.0),
            (" 0.25 in", 6.35),
            ("1/4\"", 6.35),
            ("1/4 in", 6.35),
            ("2,5 mm", 2.5),
            ("1 cm", 10.0),
            ("1e1 mm", 10.0),
            ("500 µm", 0.5),
            ("1e-2 m", 10.0),
        ];
        for (text, mm) in cases {
            approx::assert_relative_eq!(length_mm(text).unwrap(), mm, max_relative = 1e-12);
        }
        for text in ["", "mm", "5 parsec", "1/0 mm", "nan", "inf mm", "1/2/3 mm", "e"] {
            assert_eq!(length_mm(text), None, "{text}");
        }
    }
}
