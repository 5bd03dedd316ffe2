//! The 80-column cards of a fixed-format file, sorted into sections.

/// Columns of a card that hold parameter data.
const PARAMETER_COLUMNS: usize = 64;
/// Columns of a card in front of the section letter.
const TEXT_COLUMNS: usize = 72;
/// Cards of the directory and of the parameter data that may be lost in one file; a number beyond is damage.
const MOST_LOST: [usize; 2] = [2000, 100_000];

/// The sections of a file.
#[derive(Debug, Default)]
pub(crate) struct Cards {
    /// Text of the global section.
    pub(crate) global: Vec<u8>,
    /// First and second card of each directory entry; entry `i` is `DE 2 i + 1`. Empty where a card is lost.
    pub(crate) directory: Vec<[Vec<u8>; 2]>,
    /// Parameter data, 64 columns a card, run together.
    pub(crate) parameters: Vec<u8>,
    /// Where in `parameters` the card with a sequence number starts; `usize::MAX` for lost cards.
    starts: Vec<usize>,
    /// Whether the terminate section was met.
    pub(crate) terminated: bool,
    /// Whether any start or global card was met.
    pub(crate) headed: bool,
    /// Cards that belong to no section.
    pub(crate) foreign: usize,
    /// Whether the cards are of the binary form.
    pub(crate) binary: bool,
    /// Directory and parameter cards, as counted and as the terminate section says.
    found: [usize; 2],
    declared: Option<[usize; 2]>,
}

impl Cards {
    pub(crate) fn new(bytes: &[u8]) -> Self {
        let mut cards = Cards::default();
        cards.parameters.reserve(bytes.len() * PARAMETER_COLUMNS / 81);
        let mut start = 0;
        let ends = memchr::memchr2_iter(b'\n', b'\r', bytes);
        for end in ends.chain(std::iter::once(bytes.len())) {
            if end > start {
                cards.add(&bytes[start..end]);
            }
            start = end + 1;
        }
        cards
    }

    /// The parameter data from the card with this sequence number on.
    pub(crate) fn parameters_from(&self, sequence: usize) -> Option<&[u8]> {
        let start = *self.starts.get(sequence)?;
        self.parameters.get(start..).filter(|data| !data.is_empty())
    }

    /// Whether the terminate section counts other cards than there are.
    pub(crate) fn miscounted(&self) -> bool {
        self.declared.is_some_and(|declared| declared != self.found)
    }

    fn add(&mut self, card: &[u8]) {
        let text = &card[..card.len().min(TEXT_COLUMNS)];
        match card.get(TEXT_COLUMNS) {
            Some(b'S') => self.headed = true,
            Some(b'G') => {
                self.headed = true;
                push_padded(&mut self.global, text, TEXT_COLUMNS);
            }
            Some(b'D') => {
                self.found[0] += 1;
                self.add_directory(text, sequence(card));
            }
            Some(b'P') => {
                self.found[1] += 1;
                self.add_parameters(text, sequence(card));
            }
            Some(b'T') => {
                self.terminated = true;
                self.declared = declared(text);
            }
            Some(b'B') => self.binary = true,
            _ => self.foreign += usize::from(!card.trim_ascii().is_empty()),
        }
    }

    fn add_directory(&mut self, text: &[u8], sequence: Option<usize>) {
        // Lost cards leave holes, but a number far ahead is damage, not loss.
        let expected = 2 * self.directory.len() + 1;
        let most = self.found[0] + MOST_LOST[0];
        let number =
            sequence.filter(|n| (1..=most).contains(n)).unwrap_or_else(|| match self.directory.last() {
                Some([_, second]) if second.is_empty() => expected - 1,
                _ => expected,
            });
        let entry = (number - 1) / 2;
        if entry >= self.directory.len() {
            self.directory.resize(entry + 1, Default::default());
        }
        self.directory[entry][(number - 1) % 2] = text.to_vec();
    }

    fn add_parameters(&mut self, text: &[u8], sequence: Option<usize>) {
        let expected = self.starts.len().max(1);
        let most = self.found[1] + MOST_LOST[1];
        let number = sequence.filter(|n| (1..=most).contains(n)).unwrap_or(expected);
        if number >= self.starts.len() {
            self.starts.resize(number + 1, usize::MAX);
        }
        self.starts[number] = self.parameters.len();
        let text = &text[..text.len().min(PARAMETER_COLUMNS)];
        push_padded(&mut self.parameters, text, PARAMETER_COLUMNS);
    }
}

/// Some writers drop trailing blanks, which counted strings need back.
fn push_padded(to: &mut Vec<u8>, text: &[u8], columns: usize) {
    to.extend_from_slice(text);
    to.resize(to.len() + columns - text.len(), b' ');
}

/// `S0000001G0000004D0000500P0001000`: the last two counts.
fn declared(text: &[u8]) -> Option<[usize; 2]> {
    let count = |letter: u8, from: usize| {
        let field = text.get(from..from + 8)?;
        let digits = std::str::from_utf8(field.strip_prefix(&[letter])?).ok()?;
        digits.trim().parse().ok()
    };
    Some([count(b'D', 16)?, count(b'P', 24)?])
}

/// Columns 74 to 80.
fn sequence(card: &[u8]) -> Option<usize> {
    let digits = card.get(TEXT_COLUMNS + 1..card.len().min(80))?.trim_ascii();
    std::str::from_utf8(digits).ok()?.parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lost_short_and_foreign_cards_are_survived() {
        let card = |text: &str, section: char, n: usize| format!("{text:<72}{section}{n:>7}\r\n");
        let mut file = card("start", 'S', 1) + &card("1H,,1H;;", 'G', 1) + "some mail header\r\n";
        for n in [1, 2, 4, 5, 6] {
            file += &card(&format!("entry card {n}"), 'D', n);
        }
        file += &card("110,1.,2.,", 'P', 1);
        file += &card("116,9.;", 'P', 3);
        let cards = Cards::new(file.as_bytes());
        assert!(cards.headed && !cards.terminated && !cards.binary);
        assert_eq!(cards.foreign, 1);
        assert_eq!(cards.directory.len(), 3);
        assert!(cards.directory[1][0].is_empty() && cards.directory[1][1].starts_with(b"entry card 4"));
        assert!(cards.parameters_from(1).unwrap().starts_with(b"110,1.,2."));
        assert!(cards.parameters_from(2).is_none());
        assert!(cards.parameters_from(3).unwrap().starts_with(b"116,9.;"));
        assert!(cards.parameters_from(4).is_none());
    }
}
