//! Parsed instances and typed access to their arguments.

use super::StepError;
use super::part21::{name_length, skip_blank};

/// One argument.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Value<'a> {
    /// `$` or `*`.
    Unset,
    Number(f64),
    /// `.NAME.` without the dots.
    Enumeration(&'a [u8]),
    /// As written, without the outer quotes.
    Text(&'a [u8]),
    Reference(u64),
    List(Vec<Value<'a>>),
    /// `LENGTH_MEASURE(2.5)`.
    Typed(Vec<Value<'a>>),
}

/// An instance: one record, or several for a complex instance.
#[derive(Debug)]
pub(super) struct Entity<'a> {
    pub(super) id: u64,
    parts: Vec<Record<'a>>,
}

/// `NAME(arguments)` of instance `#id`.
#[derive(Debug)]
pub(super) struct Record<'a> {
    pub(super) id: u64,
    name: &'a [u8],
    pub(super) arguments: Vec<Value<'a>>,
}

impl<'a> Entity<'a> {
    /// The type of a simple instance, or the types of a complex one joined by `+`.
    pub(super) fn name(&self) -> String {
        let names: Vec<_> = self.parts.iter().map(|p| String::from_utf8_lossy(p.name)).collect();
        names.join("+")
    }

    /// Whether `name` is among the types.
    pub(super) fn is(&self, name: &str) -> bool {
        self.parts.iter().any(|p| p.name == name.as_bytes())
    }

    /// The record of type `name`.
    pub(super) fn part(&self, name: &'static str) -> Result<&Record<'a>, StepError> {
        let found = self.parts.iter().find(|p| p.name == name.as_bytes());
        found.ok_or_else(|| self.unexpected(name))
    }

    /// The record of a simple instance.
    pub(super) fn only(&self) -> Result<&Record<'a>, StepError> {
        match self.parts.as_slice() {
            [one] => Ok(one),
            _ => Err(self.unexpected("simple instance")),
        }
    }

    /// The type of a simple instance; empty for a complex one.
    pub(super) fn simple_name(&self) -> &str {
        match self.parts.as_slice() {
            [one] => std::str::from_utf8(one.name).unwrap_or_default(),
            _ => "",
        }
    }

    /// The error that this instance stands where `expected` is needed.
    pub(super) fn unexpected(&self, expected: &'static str) -> StepError {
        StepError::Unexpected { id: self.id, found: self.name(), expected }
    }

    /// All instances that this one refers to, in order.
    pub(super) fn references(&self) -> Vec<u64> {
        let mut found = Vec::new();
        for part in &self.parts {
            collect_references(&part.arguments, &mut found);
        }
        found
    }
}

fn collect_references(values: &[Value], found: &mut Vec<u64>) {
    for value in values {
        match value {
            Value::Reference(id) => found.push(*id),
            // Nesting is bounded by the parser.
            Value::List(inner) | Value::Typed(inner) => collect_references(inner, found),
            _ => {}
        }
    }
}

impl<'a> Record<'a> {
    fn wrong(&self, index: usize, expected: &'static str) -> StepError {
        StepError::Argument {
            id: self.id,
            name: String::from_utf8_lossy(self.name).into_owned(),
            index: index + 1,
            expected,
        }
    }

    /// The number at `index`, also when it is wrapped as in `LENGTH_MEASURE(2.5)`.
    pub(super) fn number(&self, index: usize) -> Result<f64, StepError> {
        let value = self.arguments.get(index).and_then(number);
        value.ok_or_else(|| self.wrong(index, "number"))
    }

    pub(super) fn count(&self, index: usize) -> Result<usize, StepError> {
        let n = self.number(index)?;
        let whole = n.fract() == 0.0 && (0.0..1e6).contains(&n);
        whole.then_some(n as usize).ok_or_else(|| self.wrong(index, "whole number"))
    }

    pub(super) fn reference(&self, index: usize) -> Result<u64, StepError> {
        self.optional_reference(index).ok_or_else(|| self.wrong(index, "reference"))
    }

    pub(super) fn optional_reference(&self, index: usize) -> Option<u64> {
        match self.arguments.get(index) {
            Some(Value::Reference(id)) => Some(*id),
            _ => None,
        }
    }

    pub(super) fn list(&self, index: usize) -> Result<&[Value<'a>], StepError> {
        match self.arguments.get(index) {
            Some(Value::List(items)) => Ok(items),
            _ => Err(self.wrong(index, "list")),
        }
    }

    /// A list of references; anything else in the list is an error.
    pub(super) fn references(&self, index: usize) -> Result<Vec<u64>, StepError> {
        self.items(self.list(index)?, index, "list of references", |v| match v {
            Value::Reference(id) => Some(*id),
            _ => None,
        })
    }

    pub(super) fn numbers(&self, index: usize) -> Result<Vec<f64>, StepError> {
        self.items(self.list(index)?, index, "list of numbers", number)
    }

    /// The rows of a table: `((a,b),(c,d))`.
    pub(super) fn table<T>(
        &self,
        index: usize,
        read: impl Fn(&Value<'a>) -> Option<T>,
    ) -> Result<Vec<Vec<T>>, StepError> {
        let rows = self.list(index)?.iter();
        rows.map(|row| match row {
            Value::List(items) => self.items(items, index, "table", &read),
            _ => Err(self.wrong(index, "table")),
        })
        .collect()
    }

    fn items<T>(
        &self,
        items: &[Value<'a>],
        index: usize,
        expected: &'static str,
        read: impl Fn(&Value<'a>) -> Option<T>,
    ) -> Result<Vec<T>, StepError> {
        let read: Option<Vec<T>> = items.iter().map(read).collect();
        read.ok_or_else(|| self.wrong(index, expected))
    }

    /// `.T.` or `.F.`.
    pub(super) fn flag(&self, index: usize) -> Result<bool, StepError> {
        match self.arguments.get(index) {
            Some(Value::Enumeration(b"T")) => Ok(true),
            Some(Value::Enumeration(b"F")) => Ok(false),
            _ => Err(self.wrong(index, ".T. or .F.")),
        }
    }

    /// The enumeration name at `index`, empty when there is none.
    pub(super) fn enumeration(&self, index: usize) -> &'a [u8] {
        match self.arguments.get(index) {
            Some(Value::Enumeration(name)) => name,
            _ => b"",
        }
    }

    /// The string at `index`, empty when there is none.
    pub(super) fn text(&self, index: usize) -> String {
        match self.arguments.get(index) {
            Some(Value::Text(raw)) => decode(raw),
            _ => String::new(),
        }
    }
}

/// A plain or measure-wrapped number.
pub(super) fn number(value: &Value) -> Option<f64> {
    match value {
        Value::Number(n) => Some(*n),
        Value::Typed(inner) => match inner.as_slice() {
            [Value::Number(n)] => Some(*n),
            _ => None,
        },
        _ => None,
    }
}

/// A reference.
pub(super) fn reference(value: &Value) -> Option<u64> {
    match value {
        Value::Reference(id) => Some(*id),
        _ => None,
    }
}

/// Undoes the string encoding (ISO 10303-21, 6.4.3): doubled quotes and backslashes, `\X\E4`, `\X2\00E4\X0\`,
/// `\X4\…\X0\` and `\S\d`. Escapes that make no sense stay as they are.
fn decode(raw: &[u8]) -> String {
    let text = String::from_utf8_lossy(raw).replace("''", "'");
    let mut out = String::with_capacity(text.len());
    let mut rest = text.as_str();
    while let Some(at) = rest.find('\\') {
        out.push_str(&rest[..at]);
        let (read, length) = escape(&rest[at..]).unwrap_or_else(|| ("\\".into(), 1));
        out.push_str(&read);
        rest = &rest[at + length..];
    }
    out.push_str(rest);
    out
}

/// What the escape at the start of `text` stands for, and its length.
fn escape(text: &str) -> Option<(String, usize)> {
    if text.starts_with("\\\\") {
        return Some(("\\".into(), 2));
    }
    if let Some(rest) = text.strip_prefix("\\X\\") {
        let byte = u8::from_str_radix(rest.get(..2)?, 16).ok()?;
        return Some((char::from(byte).into(), 5));
    }
    if let Some(rest) = text.strip_prefix("\\S\\") {
        let byte = u8::try_from(rest.chars().next()?).ok().filter(u8::is_ascii)?;
        return Some((char::from(byte + 128).into(), 4));
    }
    // A choice of code page for `\S\`: only the first is known here.
    if text.starts_with("\\P") && text.get(3..4) == Some("\\") {
        return Some((String::new(), 4));
    }
    for (head, width) in [("\\X2\\", 4), ("\\X4\\", 8)] {
        let Some(rest) = text.strip_prefix(head) else { continue };
        let code = &rest[..rest.find("\\X0\\")?];
        let unit = |i: usize| u32::from_str_radix(code.get(width * i..width * (i + 1))?, 16).ok();
        let units: Vec<u32> = (0..code.len() / width).filter_map(unit).collect();
        let read = if width == 4 {
            let units: Vec<u16> = units.iter().filter_map(|u| u16::try_from(*u).ok()).collect();
            String::from_utf16_lossy(&units)
        } else {
            units.into_iter().filter_map(char::from_u32).collect()
        };
        return Some((read, head.len() + code.len() + 4));
    }
    None
}

/// Lists may nest this deep; the deepest of the standard is 3.
const DEEPEST_LIST: usize = 16;

/// Parses the right-hand side of an instance. The error is the offset where it makes no sense.
pub(super) fn parse_instance(id: u64, text: &[u8]) -> Result<Entity<'_>, usize> {
    let mut parser = Parser { text, at: 0 };
    let mut parts = Vec::with_capacity(1);
    if parser.peek() == Some(b'(') {
        parser.at += 1;
        while parser.peek() != Some(b')') {
            parts.push(parser.record(id)?);
        }
        parser.at += 1;
    } else {
        parts.push(parser.record(id)?);
    }
    match parser.peek() {
        None => Ok(Entity { id, parts }),
        Some(_) => Err(parser.at),
    }
}

struct Parser<'a> {
    text: &'a [u8],
    at: usize,
}

impl<'a> Parser<'a> {
    fn peek(&mut self) -> Option<u8> {
        self.at = skip_blank(self.text, self.at);
        self.text.get(self.at).copied()
    }

    fn record(&mut self, id: u64) -> Result<Record<'a>, usize> {
        self.peek();
        let name = self.keyword()?;
        if self.peek() != Some(b'(') {
            return Err(self.at);
        }
        let arguments = self.list(0)?;
        Ok(Record { id, name, arguments })
    }

    fn keyword(&mut self) -> Result<&'a [u8], usize> {
        let rest = &self.text[self.at..];
        let length = name_length(rest);
        if length == 0 {
            return Err(self.at);
        }
        self.at += length;
        Ok(&rest[..length])
    }

    /// A parenthesised list; the cursor is on its `(`.
    fn list(&mut self, depth: usize) -> Result<Vec<Value<'a>>, usize> {
        if depth > DEEPEST_LIST {
            return Err(self.at);
        }
        self.at += 1;
        let mut items = Vec::new();
        if self.peek() == Some(b')') {
            self.at += 1;
            return Ok(items);
        }
        loop {
            items.push(self.value(depth)?);
            match self.peek() {
                Some(b',') => self.at += 1,
                Some(b')') => {
                    self.at += 1;
                    return Ok(items);
                }
                _ => return Err(self.at),
            }
        }
    }

    fn value(&mut self, depth: usize) -> Result<Value<'a>, usize> {
        let start = self.at;
        match self.peek().ok_or(start)? {
            b'$' | b'*' => {
                self.at += 1;
                Ok(Value::Unset)
            }
            b'(' => Ok(Value::List(self.list(depth + 1)?)),
            b'\'' => self.string(),
            b'"' => {
                let end = memchr::memchr(b'"', &self.text[self.at + 1..]).ok_or(self.at)?;
                self.at += end + 2;
                Ok(Value::Unset)
            }
            b'#' => {
                self.at += 1;
                let digits = self.take(u8::is_ascii_digit);
                parse(digits).map(Value::Reference).ok_or(start)
            }
            b'.' if self.text.get(self.at + 1).is_some_and(u8::is_ascii_alphabetic) => {
                self.at += 1;
                let name = self.keyword()?;
                if self.text.get(self.at) != Some(&b'.') {
                    return Err(self.at);
                }
                self.at += 1;
                Ok(Value::Enumeration(name))
            }
            b'+' | b'-' | b'.' | b'0'..=b'9' => {
                let at = self.at;
                let token = self.take(|b| matches!(b, b'+' | b'-' | b'.' | b'0'..=b'9' | b'E' | b'e'));
                parse(token).filter(|n: &f64| n.is_finite()).map(Value::Number).ok_or(at)
            }
            _ => {
                self.keyword()?;
                if self.peek() != Some(b'(') {
                    return Err(self.at);
                }
                Ok(Value::Typed(self.list(depth + 1)?))
            }
        }
    }

    fn string(&mut self) -> Result<Value<'a>, usize> {
        let start = self.at + 1;
        let mut end = start;
        loop {
            end += memchr::memchr(b'\'', self.text.get(end..).unwrap_or_default()).ok_or(self.at)?;
            if self.text.get(end + 1) != Some(&b'\'') {
                break;
            }
            end += 2;
        }
        self.at = end + 1;
        Ok(Value::Text(&self.text[start..end]))
    }

    fn take(&mut self, keep: impl Fn(&u8) -> bool) -> &'a [u8] {
        let rest = &self.text[self.at..];
        let length = rest.iter().position(|b| !keep(b)).unwrap_or(rest.len());
        self.at += length;
        &rest[..length]
    }
}

fn parse<T: std::str::FromStr>(token: &[u8]) -> Option<T> {
    std::str::from_utf8(token).ok()?.parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_kind_of_argument_is_understood() {
        let text = br#"X('it''s \X2\00E4\X0\', $, *, (1,-2.5E-3,.5,3.), .UNSPECIFIED., LENGTH_MEASURE(2.), "0F", #12,
            ((#1,#2),(#3)), .T.)"#;
        let e = parse_instance(5, text).unwrap();
        let r = e.only().unwrap();
        assert_eq!(r.text(0), "it's ä");
        assert_eq!(r.numbers(3).unwrap(), [1.0, -2.5e-3, 0.5, 3.0]);
        assert_eq!(r.enumeration(4), b"UNSPECIFIED");
        assert_eq!(r.number(5).unwrap(), 2.0);
        assert_eq!(r.reference(7).unwrap(), 12);
        assert_eq!(r.table(8, reference).unwrap(), [vec![1, 2], vec![3]]);
        assert!(r.flag(9).unwrap());
        assert_eq!(e.references(), [12, 1, 2, 3]);
        assert!(matches!(r.number(0), Err(StepError::Argument { id: 5, index: 1, .. })));
    }

    #[test]
    fn strings_are_decoded() {
        for (raw, text) in [
            (r"T\X\FCr", "Tür"),
            (r"T\S\|r", "Tür"),
            (r"\PA\T\S\|r", "Tür"),
            (r"T\X2\00FC\X0\r", "Tür"),
            (r"\X4\0001F697\X0\!", "\u{1F697}!"),
            (r"C:\\cars", r"C:\cars"),
            (r"it''s \X2\00", r"it's \X2\00"),
            (r"\X\ZZ\", r"\X\ZZ\"),
        ] {
            assert_eq!(decode(raw.as_bytes()), text, "{raw}");
        }
    }

    #[test]
    fn nonsense_is_refused_where_it_stands() {
        for bad in ["X(", "X(1", "X(,)", "X(1.2.3)", "X(#)", "X('a)", "X()Y", "(X()", "", "X(.T)"] {
            assert!(parse_instance(1, bad.as_bytes()).is_err(), "{bad}");
        }
        let deep = format!("X{}{}", "(".repeat(100_000), ")".repeat(100_000));
        assert!(parse_instance(1, deep.as_bytes()).is_err());
    }
}
