//! Words of one block: `X12.5`, `PL=3`, `PO[X]=(1,2)`, `#SPLINE`.

use crate::Refusal;

/// A block longer than this is not a program's, characters.
const LONGEST_BLOCK: usize = 4096;

/// What stands behind a word's letters.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Value {
    /// Nothing: `BSPLINE`.
    None,
    /// A number, how many digits it has behind the point and in all, and whether it has a point.
    Number { value: f64, decimals: usize, digits: usize, pointed: bool },
    /// Numbers in parentheses.
    List(Vec<f64>),
}

/// A word of a block.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Word<'a> {
    pub(crate) key: &'a str,
    /// What stands in brackets behind the key.
    pub(crate) index: Option<&'a str>,
    pub(crate) value: Value,
}

impl Word<'_> {
    pub(crate) fn number(&self) -> Option<f64> {
        match self.value {
            Value::Number { value, .. } => Some(value),
            _ => None,
        }
    }

    /// The code of a G or M word in tenths: 62 for `G06.2`.
    pub(crate) fn code(&self) -> Option<u32> {
        let tenths = (self.number()? * 10.0).round();
        (0.0..=1e6).contains(&tenths).then_some(tenths as u32)
    }
}

/// Which comments a dialect has.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Comments {
    /// `( … )` and `; …`.
    Parentheses,
    /// `; …` only; parentheses hold lists.
    Semicolon,
}

/// Cuts a block into words; comments are left out.
pub(crate) fn words(line: &str, comments: Comments) -> Result<Vec<Word<'_>>, Refusal> {
    if line.len() > LONGEST_BLOCK {
        return Err(syntax(format!("the block has {} characters, more than {LONGEST_BLOCK}", line.len())));
    }
    let mut words = Vec::with_capacity(6);
    let mut rest = line.trim_start();
    while let Some(first) = rest.chars().next() {
        if first == ';' {
            break;
        }
        if first == '(' && comments == Comments::Parentheses {
            let end = rest.find(')').ok_or_else(|| syntax("a comment is not closed"))?;
            rest = rest[end + 1..].trim_start();
            continue;
        }
        let (word, behind) = word(rest)?;
        words.push(word);
        rest = behind.trim_start();
    }
    Ok(words)
}

fn word(text: &str) -> Result<(Word<'_>, &str), Refusal> {
    let letters = text
        .char_indices()
        .find(|&(i, c)| !(c.is_ascii_alphabetic() || c == '_' || (i == 0 && matches!(c, '#' | '%' | '/'))))
        .map_or(text.len(), |(i, _)| i);
    if letters == 0 {
        return Err(syntax(format!("`{}` is no word", first_chars(text))));
    }
    let (key, mut rest) = text.split_at(letters);
    let mut index = None;
    if let Some(inside) = rest.strip_prefix('[') {
        let end = inside.find(']').ok_or_else(|| syntax("a bracket is not closed"))?;
        index = Some(&inside[..end]);
        rest = &inside[end + 1..];
    }
    let assigned = rest.strip_prefix('=');
    rest = assigned.unwrap_or(rest);
    if let Some(inside) = rest.strip_prefix('(').filter(|_| assigned.is_some()) {
        let end = inside.find(')').ok_or_else(|| syntax("a parenthesis is not closed"))?;
        let list =
            inside[..end].split(',').map(|n| Ok(number(n.trim())?.0)).collect::<Result<_, Refusal>>()?;
        return Ok((Word { key, index, value: Value::List(list) }, &inside[end + 1..]));
    }
    let length = rest.bytes().take_while(|b| matches!(b, b'0'..=b'9' | b'+' | b'-' | b'.')).count();
    if length == 0 {
        if assigned.is_some() {
            return Err(syntax(format!("`{key}=` has no value")));
        }
        return Ok((Word { key, index, value: Value::None }, rest));
    }
    let (text, behind) = rest.split_at(length);
    let (value, decimals, digits) = number(text)?;
    let pointed = text.contains('.');
    Ok((Word { key, index, value: Value::Number { value, decimals, digits, pointed } }, behind))
}

/// A decimal number, its digits behind the point and in all.
pub(crate) fn number(text: &str) -> Result<(f64, usize, usize), Refusal> {
    let bad = || syntax(format!("`{}` is no number", first_chars(text)));
    let value: f64 = text.parse().map_err(|_| bad())?;
    if !value.is_finite() || value.abs() > 1e9 {
        return Err(bad());
    }
    let decimals = text.split_once('.').map_or(0, |(_, d)| d.bytes().take_while(u8::is_ascii_digit).count());
    Ok((value, decimals, text.bytes().filter(u8::is_ascii_digit).count()))
}

pub(crate) fn syntax(detail: impl Into<String>) -> Refusal {
    Refusal::new("syntax", detail)
}

/// The beginning of a text, for messages.
pub(crate) fn first_chars(text: &str) -> String {
    text.chars().take(24).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_of_all_kinds() {
        let found = words("N10 G06.2 P4 X-1.25 (note) PL=3.5 ; rest", Comments::Parentheses).unwrap();
        let keys: Vec<_> = found.iter().map(|w| w.key).collect();
        assert_eq!(keys, ["N", "G", "P", "X", "PL"]);
        assert_eq!(found[1].code(), Some(62));
        assert_eq!(found[3].value, Value::Number { value: -1.25, decimals: 2, digits: 3, pointed: true });
        let poly = words("PO[X]=(0,-10) PO[]=(2,1) BSPLINE SD=2", Comments::Semicolon).unwrap();
        assert_eq!(poly[0].index, Some("X"));
        assert_eq!(poly[1].value, Value::List(vec![2.0, 1.0]));
        assert_eq!(poly[2].value, Value::None);
        for bad in ["X1.2.3", "(open", "PO[X=1", "PL=", "=3", "é"] {
            assert!(words(bad, Comments::Parentheses).is_err(), "{bad}");
        }
    }
}
