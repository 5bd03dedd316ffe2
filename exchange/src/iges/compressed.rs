//! The compressed ASCII form (IGES 5.3, 2.3), turned back into the cards of the fixed form.
//!
//! A compressed file starts with a card with `C` in column 73. Start, global and terminate sections are as in the
//! fixed form. Between them stands for each entity a record `D` and its directory number, followed by those of
//! the twenty directory fields that differ from the entity before, each as `@` number `_` value, and behind it
//! the parameter data on lines of their own.

use std::fmt::Write;

/// Columns of one field of a directory entry.
const FIELD: usize = 8;

/// Whether the bytes are of the compressed form.
pub(crate) fn is_compressed(bytes: &[u8]) -> bool {
    lines(bytes).next().is_some_and(|l| l.get(72) == Some(&b'C'))
}

fn lines(bytes: &[u8]) -> impl Iterator<Item = &[u8]> {
    bytes.split(|b| *b == b'\n' || *b == b'\r').filter(|l| !l.is_empty())
}

/// The same file in the fixed form. What makes no sense is left for the reader of that form to report.
pub(crate) fn expanded(bytes: &[u8]) -> Vec<u8> {
    let mut cards = Cards::default();
    let (mut head, mut tail) = (Vec::new(), Vec::new());
    for line in lines(bytes) {
        match (line.get(72), line) {
            (Some(b'C'), _) => {}
            (Some(b'S' | b'G'), _) => head.extend([line, b"\n"].concat()),
            (Some(b'T'), _) => tail.extend([line, b"\n"].concat()),
            (_, [b'D', digit, ..]) if digit.is_ascii_digit() => {
                cards.close();
                cards.open(line);
            }
            (_, [b'@', ..]) => cards.change(line),
            _ => cards.data.extend_from_slice(&line[..line.len().min(72)]),
        }
    }
    cards.close();
    [head, cards.directory.into_bytes(), cards.parameters.into_bytes(), tail].concat()
}

#[derive(Default)]
struct Cards {
    directory: String,
    parameters: String,
    count: usize,
    /// The directory number of the entity at hand; 0 before the first.
    number: usize,
    fields: [String; 20],
    data: Vec<u8>,
}

impl Cards {
    fn open(&mut self, line: &[u8]) {
        let digits: Vec<u8> = line[1..].iter().copied().take_while(u8::is_ascii_digit).take(7).collect();
        let number = String::from_utf8_lossy(&digits).parse().ok().filter(|n| n % 2 == 1);
        self.number = number.unwrap_or(self.number + 1 + self.number % 2);
        self.change(line);
    }

    /// Takes over the fields that a record names.
    fn change(&mut self, line: &[u8]) {
        for part in line.split(|b| *b == b'@').skip(1) {
            let text = String::from_utf8_lossy(part);
            let Some((number, value)) = text.split_once('_') else { continue };
            let index = number.trim().parse::<usize>().ok().and_then(|n| n.checked_sub(1));
            if let Some(field) = index.and_then(|i| self.fields.get_mut(i)) {
                let value = value.trim().trim_end_matches(';');
                *field = value.chars().filter(|c| (' '..='~').contains(c)).take(FIELD).collect();
            }
        }
    }

    /// Writes the cards of the entity at hand.
    fn close(&mut self) {
        if self.number == 0 {
            return;
        }
        let (number, first) = (self.number, self.count + 1);
        let data = std::mem::take(&mut self.data);
        for chunk in data.chunks(64) {
            self.count += 1;
            let text = String::from_utf8_lossy(chunk);
            let _ = writeln!(self.parameters, "{text:<64}{number:>8}P{:>7}", self.count);
        }
        let field = |k: usize| format!("{:>FIELD$}", self.fields[k - 1]);
        let lines = self.count + 1 - first;
        let middle: String = (3..=8).map(field).collect();
        let status = field(9).replace(' ', "0");
        let _ = writeln!(self.directory, "{}{first:>8}{middle}{status}D{number:>7}", field(1));
        let (weight, colour, form, label, subscript) =
            (field(12), field(13), field(15), field(18), field(19));
        let kind = field(1);
        let _ = writeln!(
            self.directory,
            "{kind}{weight}{colour}{lines:>8}{form}{:>16}{label}{subscript}D{:>7}",
            "",
            number + 1
        );
    }
}
