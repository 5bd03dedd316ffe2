//! How lengths are written in programs: unit and decimals, and the value that the written text
//! stands for.

use claymill_nurbs::Point3;

use crate::Units;

/// How lengths are written: unit and decimals.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LengthFormat {
    /// Unit.
    pub units: Units,
    /// Decimals.
    pub digits: u8,
}

impl LengthFormat {
    /// A length of `mm` as text, `12.5`; always with a point, since whole numbers may mean steps.
    #[must_use]
    pub fn text(&self, mm: f64) -> String {
        decimal(mm / self.units.mm(), self.digits)
    }

    /// The length that the text of `mm` says.
    #[must_use]
    pub fn snap(&self, mm: f64) -> f64 {
        round(mm / self.units.mm(), self.digits) * self.units.mm()
    }

    /// The point that its text says.
    #[must_use]
    pub fn snap_point(&self, p: &Point3) -> Point3 {
        p.map(|c| self.snap(c))
    }

    /// One step of the last digit, mm.
    #[must_use]
    pub fn step_mm(&self) -> f64 {
        self.units.mm() * 10f64.powi(-i32::from(self.digits))
    }
}

/// Steps of the last digit are told apart to one part in this.
const HALF_NOISE: f64 = 1e6;

/// `value` rounded to `digits` decimals.
#[must_use]
pub(crate) fn round(value: f64, digits: u8) -> f64 {
    let scale = 10f64.powi(i32::from(digits));
    // Halves that arithmetic has moved by a last bit must all go the same way: ends that were equal stay so.
    let steps = (value * scale * HALF_NOISE).round() / HALF_NOISE;
    let rounded = steps.round() / scale;
    if rounded == 0.0 { 0.0 } else { rounded }
}

/// `value` with at most `digits` decimals, without trailing zeros, with a point.
#[must_use]
pub(crate) fn decimal(value: f64, digits: u8) -> String {
    let mut text = format!("{:.*}", usize::from(digits), round(value, digits));
    if text.contains('.') {
        text.truncate(text.trim_end_matches('0').len());
    } else {
        text.push('.');
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_says_what_snap_says() {
        assert_eq!(decimal(12.50, 3), "12.5");
        assert_eq!(decimal(-0.0001, 3), "0.");
        assert_eq!(decimal(7.0, 0), "7.");
        for units in [Units::Mm, Units::Inch] {
            let format = LengthFormat { units, digits: 4 };
            for mm in [0.0, 1.23456, -1335.00265, 1e-5] {
                let text: f64 = format.text(mm).parse().unwrap();
                assert!((text * units.mm() - format.snap(mm)).abs() < 1e-12);
            }
        }
    }
}
