//! Figures as people read them: with a unit that suits, and no more digits than tell anything.

/// A narrow space that does not break a line.
const THIN: char = '\u{202f}';

/// A whole number with groups of three digits: 1 234 567.
pub(super) fn count(n: u64) -> String {
    let digits = n.to_string();
    let mut text = String::new();
    for (i, digit) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            text.push(THIN);
        }
        text.push(digit);
    }
    text
}

/// A number with about three significant digits and its unit.
fn three_digits(value: f64, unit: &str) -> String {
    let decimals = match value.abs() {
        v if v >= 99.95 || v == 0.0 => 0,
        v if v >= 9.995 => 1,
        v if v >= 0.9995 => 2,
        _ => 3,
    };
    format!("{value:.decimals$}{THIN}{unit}")
}

/// A path length: mm, m or km.
#[must_use]
pub fn length(mm: f64) -> String {
    match mm.abs() {
        v if v >= 1e6 => three_digits(mm / 1e6, "km"),
        v if v >= 1e3 => three_digits(mm / 1e3, "m"),
        _ => three_digits(mm, "mm"),
    }
}

/// The unit that suits an area, and how many mm² it has.
fn unit_of_area(mm2: f64) -> (f64, &'static str) {
    match mm2.abs() {
        v if v >= 1e5 => (1e6, "m²"),
        v if v >= 1e2 => (1e2, "cm²"),
        _ => (1.0, "mm²"),
    }
}

/// An area: mm², cm² or m².
#[must_use]
pub fn area(mm2: f64) -> String {
    area_of(mm2, mm2)
}

/// A part of an area, in the unit of the whole unless it is too small for that: the parts of one line compare at a glance.
#[must_use]
pub fn area_of(part_mm2: f64, whole_mm2: f64) -> String {
    /// In the unit of the whole; less has one digit or none.
    const LEAST: f64 = 0.01;
    let (of_whole, own) = (unit_of_area(whole_mm2), unit_of_area(part_mm2));
    let (size_mm2, unit) =
        if part_mm2.abs() < LEAST * of_whole.0 && part_mm2 != 0.0 { own } else { of_whole };
    three_digits(part_mm2 / size_mm2, unit)
}

/// An area in the unit of another one, with as many digits whatever it is: areas of a table stand below each other.
pub(super) fn area_beside(part_mm2: f64, largest_mm2: f64) -> String {
    let (size_mm2, unit) = unit_of_area(largest_mm2);
    let decimals: usize = if unit == "m²" { 4 } else { 2 };
    let least = 0.1_f64.powi(decimals as i32);
    let value = part_mm2 / size_mm2;
    if value > 0.0 && value < 0.5 * least {
        return format!("<{THIN}{least:.decimals$}{THIN}{unit}");
    }
    format!("{value:.decimals$}{THIN}{unit}")
}

/// A deviation: µm below a tenth of a millimetre.
pub(super) fn deviation(mm: f64) -> String {
    if mm.abs() < 0.1 { three_digits(mm * 1e3, "µm") } else { three_digits(mm, "mm") }
}

/// Height of a scallop, in one unit and with as many digits whatever it is: such heights stand below each other.
pub(super) fn crest(mm: f64) -> String {
    format!("{mm:.4}{THIN}mm")
}

/// A share of a whole in percent; small shares do not vanish.
pub(super) fn share(part: f64, whole: f64) -> String {
    if whole <= 0.0 {
        return "–".into();
    }
    let percent = 100.0 * part / whole;
    match percent {
        p if p > 0.0 && p < 0.01 => format!("<{THIN}0.01{THIN}%"),
        p if p > 99.99 && p < 100.0 => format!(">{THIN}99.99{THIN}%"),
        p if p.abs() < 1.0 || p > 99.0 => format!("{p:.2}{THIN}%"),
        p => format!("{p:.1}{THIN}%"),
    }
}

/// A duration as people say it: 2 h 05 min, 3 min 20 s, 4.2 s.
#[must_use]
pub fn duration(seconds: f64) -> String {
    let whole = seconds.round().max(0.0) as u64;
    if seconds < 59.95 {
        return three_digits(seconds, "s");
    }
    let (hours, minutes, rest) = (whole / 3600, whole / 60 % 60, whole % 60);
    if hours > 0 {
        format!("{}{THIN}h {minutes:02}{THIN}min", count(hours))
    } else {
        format!("{minutes}{THIN}min {rest:02}{THIN}s")
    }
}

/// A place in model coordinates.
pub(super) fn point(p: &[f64; 3]) -> String {
    format!("({:.2}, {:.2}, {:.2})", p[0], p[1], p[2])
}

/// `one face`, `two faces`: a count with its noun.
pub(super) fn plural(n: u64, noun: &str) -> String {
    let ending = if n == 1 { "" } else { "s" };
    format!("{} {noun}{ending}", count(n))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn spaces(text: &str) -> String {
        text.replace(THIN, " ")
    }

    #[test]
    fn figures_have_sensible_digits_and_units() {
        assert_eq!(spaces(&count(1_234_567)), "1 234 567");
        assert_eq!(spaces(&count(999)), "999");
        assert_eq!(spaces(&length(5_123_456.0)), "5.12 km");
        assert_eq!(spaces(&length(999.96)), "1000 mm");
        assert_eq!(spaces(&length(12_345.0)), "12.3 m");
        assert_eq!(spaces(&area(11_870_000.0)), "11.9 m²");
        assert_eq!(spaces(&area(950.0)), "9.50 cm²");
        assert_eq!(spaces(&area_of(40_200.0, 2.8e6)), "0.040 m²");
        assert_eq!(spaces(&area_of(950.0, 2.8e6)), "9.50 cm²");
        assert_eq!(spaces(&area_of(0.0, 2.8e6)), "0 m²");
        assert_eq!(spaces(&area_beside(40_200.0, 2.8e6)), "0.0402 m²");
        assert_eq!(spaces(&area_beside(12.0, 2.8e6)), "< 0.0001 m²");
        assert_eq!(spaces(&area_beside(0.0, 2.8e6)), "0.0000 m²");
        assert_eq!(spaces(&area_beside(950.0, 9_500.0)), "9.50 cm²");
        assert_eq!(spaces(&deviation(0.000_42)), "0.420 µm");
        assert_eq!(spaces(&deviation(0.25)), "0.250 mm");
        assert_eq!(spaces(&deviation(0.0)), "0 µm");
        assert_eq!(spaces(&crest(0.09953)), "0.0995 mm");
        assert_eq!(spaces(&share(1.0, 3.0)), "33.3 %");
        assert_eq!(spaces(&share(1e-9, 3.0)), "< 0.01 %");
        assert_eq!(spaces(&share(3.0 - 1e-9, 3.0)), "> 99.99 %");
        assert_eq!(spaces(&share(1.0, 0.0)), "–");
        assert_eq!(spaces(&duration(7505.0)), "2 h 05 min");
        assert_eq!(spaces(&duration(200.0)), "3 min 20 s");
        assert_eq!(spaces(&duration(4.2)), "4.20 s");
        assert_eq!(spaces(&plural(1, "pass")), "1 pass");
    }
}
