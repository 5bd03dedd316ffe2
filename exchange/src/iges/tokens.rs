//! Free-format data: values between delimiters, counted strings, numbers in Fortran notation.

/// The two delimiters that a file declares.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Delimiters {
    pub(crate) parameter: u8,
    pub(crate) record: u8,
}

/// Walks over the values of one record.
#[derive(Debug, Clone)]
pub(crate) struct Tokens<'a> {
    rest: &'a [u8],
    delimiters: Delimiters,
    ended: bool,
    cut_short: bool,
}

impl<'a> Tokens<'a> {
    pub(crate) fn new(data: &'a [u8], delimiters: Delimiters) -> Self {
        Tokens { rest: data, delimiters, ended: false, cut_short: false }
    }

    /// The next value without surrounding blanks, empty where the file leaves a default; counted strings
    /// keep their count. `None` after the record's end; data that stop without a record delimiter end there.
    pub(crate) fn next(&mut self) -> Option<&'a [u8]> {
        if self.ended {
            return None;
        }
        let blanks = self.rest.iter().take_while(|b| **b == b' ').count();
        let value = &self.rest[blanks..];
        // Delimiters inside a counted string are text.
        let text = string_length(value).map_or(0, |(head, count)| head.saturating_add(count));
        let Some(after) = value.get(text..) else {
            (self.ended, self.cut_short) = (true, true);
            return None;
        };
        let Delimiters { parameter, record } = self.delimiters;
        let Some(end) = memchr::memchr2(parameter, record, after) else {
            (self.ended, self.cut_short) = (true, true);
            return None;
        };
        self.ended = after[end] == record;
        self.rest = &after[end + 1..];
        Some(value[..text + end].trim_ascii_end())
    }

    /// Bytes behind the last value that was read.
    pub(crate) fn left(&self) -> usize {
        self.rest.len()
    }

    /// Whether the record's end was reached.
    pub(crate) fn ended(&self) -> bool {
        self.ended
    }

    /// Whether the data stopped without a record delimiter.
    pub(crate) fn cut_short(&self) -> bool {
        self.cut_short
    }
}

/// Length of the head `nnH` and of the text of a counted string.
fn string_length(value: &[u8]) -> Option<(usize, usize)> {
    let digits = value.iter().take(9).take_while(|b| b.is_ascii_digit()).count();
    if digits == 0 || !matches!(value.get(digits), Some(b'H' | b'h')) {
        return None;
    }
    let count = std::str::from_utf8(&value[..digits]).ok()?.parse().ok()?;
    Some((digits + 1, count))
}

/// The text of a counted string; anything else as it stands.
pub(crate) fn text(value: &[u8]) -> String {
    let text = match string_length(value) {
        Some((head, count)) => value[head..].get(..count).unwrap_or(&value[head..]),
        None => value,
    };
    String::from_utf8_lossy(text).trim().to_owned()
}

/// A real number, `D` exponents included; an omitted value is 0.
pub(crate) fn real(value: &[u8]) -> Option<f64> {
    let mut fortran = [0u8; 48];
    let number = match memchr::memchr2(b'D', b'd', value) {
        None if value.is_empty() => return Some(0.0),
        None => value,
        Some(at) => {
            let copy = fortran.get_mut(..value.len())?;
            copy.copy_from_slice(value);
            copy[at] = b'E';
            copy
        }
    };
    // `nan` and `inf` parse as numbers in Rust but are damage here.
    let numeric = number.iter().all(|b| matches!(b, b'0'..=b'9' | b'+' | b'-' | b'.' | b'e' | b'E'));
    let text = std::str::from_utf8(number).ok().filter(|_| numeric)?;
    text.parse().ok().filter(|x: &f64| x.is_finite())
}

/// A whole number; an omitted value is 0, and `3.` is 3.
pub(crate) fn integer(value: &[u8]) -> Option<i64> {
    let text = std::str::from_utf8(value).ok()?;
    if let Ok(number) = text.parse() {
        return Some(number);
    }
    let number = real(value)?;
    (number.fract() == 0.0 && number.abs() < 1e15).then_some(number as i64)
}

/// Number of digits behind the point (negative powers of ten of the last digit), exponent included; `None` for
/// values that carry no fraction.
pub(crate) fn decimals(value: &[u8]) -> Option<i32> {
    let exponent_at = value.iter().position(|b| matches!(b, b'e' | b'E' | b'd' | b'D'));
    let (mantissa, exponent) = match exponent_at {
        Some(at) => (&value[..at], integer(&value[at + 1..])?),
        None => (value, 0),
    };
    let point = mantissa.iter().position(|b| *b == b'.')?;
    let fraction = mantissa.len() - point - 1;
    let zero = mantissa.iter().all(|b| matches!(b, b'0' | b'.' | b'-' | b'+'));
    // Exponents beyond those of numbers are damage.
    let exponent = i32::try_from(exponent).ok().filter(|e| e.abs_diff(0) < 400)?;
    let decimals = i32::try_from(fraction).ok()? - exponent;
    (!zero && decimals > 0).then_some(decimals)
}

#[cfg(test)]
mod tests {
    use super::*;

    const USUAL: Delimiters = Delimiters { parameter: b',', record: b';' };

    #[test]
    fn strings_may_hold_delimiters() {
        let mut t = Tokens::new(b"406, 1, 5Ha,b;c ,,3. ;next", USUAL);
        let values: Vec<_> = std::iter::from_fn(|| t.next()).collect();
        assert_eq!(values, [&b"406"[..], b"1", b"5Ha,b;c", b"", b"3."]);
        assert!(t.ended());
        assert_eq!(text(values[2]), "a,b;c");
    }

    #[test]
    fn data_without_an_end_do_not_give_half_a_number() {
        let mut t = Tokens::new(b"110,1.0,2.5", USUAL);
        assert_eq!(t.next(), Some(&b"110"[..]));
        assert_eq!(t.next(), Some(&b"1.0"[..]));
        assert_eq!(t.next(), None);
        assert_eq!(Tokens::new(b"99999Habc,;", USUAL).next(), None);
    }

    #[test]
    fn numbers_in_every_notation() {
        for (token, value) in [
            ("1.", 1.0),
            ("-.5", -0.5),
            ("+2", 2.0),
            ("1.5D3", 1500.0),
            ("1.5d-3", 0.0015),
            ("0.1E+01", 1.0),
            ("", 0.0),
        ] {
            assert_eq!(real(token.as_bytes()), Some(value), "{token}");
        }
        for damaged in ["nan", "inf", "1.2.3", "12a", "1e999", "--1", "1,2"] {
            assert_eq!(real(damaged.as_bytes()), None, "{damaged}");
        }
        assert_eq!(integer(b"42"), Some(42));
        assert_eq!(integer(b"42."), Some(42));
        assert_eq!(integer(b"4.2"), None);
    }

    #[test]
    fn last_digits() {
        assert_eq!(decimals(b"-2305.251078"), Some(6));
        assert_eq!(decimals(b"1.5D-3"), Some(4));
        assert_eq!(decimals(b"1.25E1"), Some(1));
        assert_eq!(decimals(b"3."), None);
        assert_eq!(decimals(b"0.000"), None);
        assert_eq!(decimals(b"1.5E-2147483648"), None);
    }
}
