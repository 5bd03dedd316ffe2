//! Access to the entities of one file.

use std::sync::atomic::{AtomicBool, Ordering};

use super::cards::Cards;
use super::directory::Entry;
use super::fault::Fault;
use super::global::Global;
use super::tokens::{self, Tokens};

/// Counts beyond this are damage.
const MOST_ITEMS: i64 = 50_000_000;

/// The file, split and indexed; entities are read on demand.
#[derive(Debug)]
pub(crate) struct File {
    cards: Cards,
    pub(crate) global: Global,
    /// Entry `i` is `DE 2 i + 1`.
    entries: Vec<Option<Entry>>,
    used: Vec<AtomicBool>,
}

impl File {
    pub(crate) fn new(cards: Cards) -> Self {
        let entries: Vec<_> = cards.directory.iter().map(Entry::new).collect();
        File {
            global: Global::new(&cards.global),
            used: entries.iter().map(|_| AtomicBool::new(false)).collect(),
            entries,
            cards,
        }
    }

    /// All sound entries with their DE numbers.
    pub(crate) fn entries(&self) -> impl DoubleEndedIterator<Item = (i64, &Entry)> {
        let numbered = self.entries.iter().enumerate();
        numbered.filter_map(|(i, e)| Some((2 * i as i64 + 1, e.as_ref()?)))
    }

    /// Number of directory entries that could not be read.
    pub(crate) fn damaged_entries(&self) -> usize {
        self.entries.iter().filter(|e| e.is_none()).count()
    }

    pub(crate) fn is_used(&self, de: i64) -> bool {
        index(de).and_then(|i| self.used.get(i)).is_some_and(|used| used.load(Ordering::Relaxed))
    }

    pub(crate) fn is_terminated(&self) -> bool {
        self.cards.terminated
    }

    pub(crate) fn miscounted(&self) -> bool {
        self.cards.miscounted()
    }

    pub(crate) fn entry(&self, de: i64) -> Result<&Entry, Fault> {
        index(de).and_then(|i| self.entries.get(i)?.as_ref()).ok_or(Fault::Missing { de })
    }

    /// The parameters of `DE de`, behind the type number.
    pub(crate) fn record(&self, de: i64) -> Result<Record<'_>, Fault> {
        if let Some(used) = index(de).and_then(|i| self.used.get(i)) {
            used.store(true, Ordering::Relaxed);
        }
        self.unused_record(de)
    }

    /// As [`File::record`], without its being of use for a face.
    pub(crate) fn unused_record(&self, de: i64) -> Result<Record<'_>, Fault> {
        let (kind, record) = self.data(de)?;
        if kind == self.entry(de)?.kind { Ok(record) } else { Err(Fault::Mixed { de }) }
    }

    /// The type that the parameter data of `DE de` begin with, where it is not that of the directory.
    pub(crate) fn other_kind(&self, de: i64) -> Option<i64> {
        let (kind, _) = self.data(de).ok()?;
        (kind != self.entry(de).ok()?.kind).then_some(kind)
    }

    fn data(&self, de: i64) -> Result<(i64, Record<'_>), Fault> {
        let entry = self.entry(de)?;
        let data = self.cards.parameters_from(entry.data).ok_or(Fault::Ended { de })?;
        let mut record = Record { de, index: 0, tokens: Tokens::new(data, self.global.delimiters) };
        let kind = record.integer()?;
        record.index = 0;
        Ok((kind, record))
    }

    /// Number of directory entries, whether sound or not.
    pub(crate) fn size(&self) -> usize {
        self.entries.len()
    }

    /// Length of the parameter data of `DE de`, bytes.
    pub(crate) fn data_length(&self, de: i64) -> u64 {
        let Ok((_, record)) = self.data(de) else { return 0 };
        let before = record.tokens.left();
        let mut tokens = record.tokens;
        while tokens.next().is_some() {}
        (before - tokens.left()) as u64
    }
}

/// Which of all entries `DE de` is.
pub(crate) fn index(de: i64) -> Option<usize> {
    let de = usize::try_from(de).ok()?;
    (de % 2 == 1).then_some(de / 2)
}

/// The parameters of one entity, read in order.
#[derive(Debug, Clone)]
pub(crate) struct Record<'a> {
    pub(crate) de: i64,
    index: usize,
    tokens: Tokens<'a>,
}

impl<'a> Record<'a> {
    /// The next value as it stands in the file. Writers drop omitted values at the end of a record.
    pub(crate) fn raw(&mut self) -> Result<&'a [u8], Fault> {
        self.index += 1;
        match self.tokens.next() {
            Some(value) => Ok(value),
            None if self.tokens.cut_short() => Err(Fault::Ended { de: self.de }),
            None => Ok(b""),
        }
    }

    pub(crate) fn real(&mut self) -> Result<f64, Fault> {
        let value = self.raw()?;
        tokens::real(value).ok_or_else(|| self.unlike("a number", value))
    }

    pub(crate) fn reals<const N: usize>(&mut self) -> Result<[f64; N], Fault> {
        let mut values = [0.0; N];
        for value in &mut values {
            *value = self.real()?;
        }
        Ok(values)
    }

    pub(crate) fn integer(&mut self) -> Result<i64, Fault> {
        let value = self.raw()?;
        tokens::integer(value).ok_or_else(|| self.unlike("a whole number", value))
    }

    /// A number of items to follow.
    pub(crate) fn count(&mut self) -> Result<usize, Fault> {
        let value = self.raw()?;
        tokens::integer(value)
            .filter(|n| (0..=MOST_ITEMS).contains(n))
            .and_then(|n| usize::try_from(n).ok())
            .ok_or_else(|| self.unlike("a sensible count", value))
    }

    /// A count and that many pointers.
    pub(crate) fn pointers(&mut self) -> Result<Vec<i64>, Fault> {
        let count = self.count()?;
        self.required(count, Record::integer)
    }

    pub(crate) fn text(&mut self) -> Result<String, Fault> {
        Ok(tokens::text(self.raw()?))
    }

    /// `count` values that must all be there: a record that ends before is damaged.
    pub(crate) fn required<T>(
        &mut self,
        count: usize,
        read: impl Fn(&mut Self) -> Result<T, Fault>,
    ) -> Result<Vec<T>, Fault> {
        let mut values = Vec::new();
        for _ in 0..count {
            if self.tokens.ended() {
                return Err(Fault::Ended { de: self.de });
            }
            values.push(read(self)?);
        }
        Ok(values)
    }

    /// Bytes of parameter data from here to the end of the file: no more values follow.
    pub(crate) fn bytes_left(&self) -> usize {
        self.tokens.left()
    }

    /// Skips `count` values.
    pub(crate) fn skip(&mut self, count: usize) -> Result<(), Fault> {
        for _ in 0..count {
            if self.tokens.ended() {
                break;
            }
            self.raw()?;
        }
        Ok(())
    }

    /// Pointers to the properties that follow the entity's own parameters (behind its associativities).
    pub(crate) fn properties(mut self) -> Vec<i64> {
        if self.tokens.ended() || self.pointers().is_err() || self.tokens.ended() {
            return Vec::new();
        }
        self.pointers().unwrap_or_default()
    }

    fn unlike(&self, wanted: &'static str, found: &[u8]) -> Fault {
        let shown = &found[..found.len().min(24)];
        Fault::Value {
            de: self.de,
            index: self.index,
            found: String::from_utf8_lossy(shown).into_owned(),
            wanted,
        }
    }
}
