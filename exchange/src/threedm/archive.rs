//! The frame of an openNURBS archive: nested chunks of little-endian numbers.
//!
//! A chunk is a type code, a length and its content; the code's highest bit makes the length a value without
//! content, bit 15 puts a CRC-32 behind the content, which covers what belongs to the chunk itself and not to
//! chunks inside. Lengths have four bytes up to version 5 of the archive and eight from version 50 on
//! (openNURBS toolkit, `opennurbs_3dm.h` and `opennurbs_archive.cpp`).

use std::ops::Range;

use super::fault::Fault;

/// What every archive begins with; eight characters of version number follow.
pub(crate) const MAGIC: &[u8] = b"3D Geometry File Format ";
/// Magic and version number.
const HEADER: usize = 32;
/// Type codes of this bit have a value and no content.
const SHORT: u32 = 0x8000_0000;
/// Type codes of this bit end in a CRC-32.
const WITH_CRC: u32 = 0x8000;
/// Type code of chunks inside objects.
pub(super) const ANONYMOUS: u32 = 0x4000_8000;
/// Type code of identity and name, where they have a chunk of their own.
pub(super) const IDENTITY: u32 = 0x4000_8002;

/// The archive version of a file, `None` for a header without a number.
pub(super) fn version(bytes: &[u8]) -> Option<u32> {
    let digits = bytes.get(MAGIC.len()..HEADER)?;
    std::str::from_utf8(digits).ok()?.trim().parse().ok()
}

/// A reader of the chunks behind the header; `checked` says whether checksums must fit.
pub(super) fn body(bytes: &[u8], version: u32, checked: bool) -> Reader<'_> {
    let start = HEADER.min(bytes.len());
    let (end, wide) = (bytes.len(), version >= 50);
    Reader { bytes, at: start, end, start, wide, checked, crc: None, inner: Vec::new() }
}

/// One chunk.
#[derive(Debug, Clone)]
pub(super) struct Chunk<'a> {
    pub(super) code: u32,
    /// What a chunk without content says.
    pub(super) value: i64,
    pub(super) content: Reader<'a>,
}

/// Reads the content of one chunk from front to back.
#[derive(Debug, Clone)]
pub(super) struct Reader<'a> {
    bytes: &'a [u8],
    start: usize,
    at: usize,
    end: usize,
    /// Chunk lengths have eight bytes.
    wide: bool,
    checked: bool,
    crc: Option<u32>,
    /// Chunks inside, which the checksum leaves out.
    inner: Vec<Range<usize>>,
}

impl<'a> Reader<'a> {
    /// Offset in the file of the next byte.
    pub(super) fn position(&self) -> usize {
        self.at
    }

    /// Bytes left.
    pub(super) fn left(&self) -> usize {
        self.end - self.at
    }

    pub(super) fn take(&mut self, count: usize) -> Result<&'a [u8], Fault> {
        if count > self.left() {
            return Err(Fault::Ended { at: self.end });
        }
        let taken = &self.bytes[self.at..self.at + count];
        self.at += count;
        Ok(taken)
    }

    fn array<const N: usize>(&mut self) -> Result<[u8; N], Fault> {
        let at = self.at;
        self.take(N)?.try_into().map_err(|_| Fault::Ended { at })
    }

    pub(super) fn byte(&mut self) -> Result<u8, Fault> {
        self.array::<1>().map(|[b]| b)
    }

    pub(super) fn flag(&mut self) -> Result<bool, Fault> {
        self.byte().map(|b| b != 0)
    }

    pub(super) fn integer(&mut self) -> Result<i32, Fault> {
        self.array().map(i32::from_le_bytes)
    }

    pub(super) fn real(&mut self) -> Result<f64, Fault> {
        self.array().map(f64::from_le_bytes)
    }

    pub(super) fn reals<const N: usize>(&mut self) -> Result<[f64; N], Fault> {
        let mut out = [0.0; N];
        for x in &mut out {
            *x = self.real()?;
        }
        Ok(out)
    }

    /// A count of items that need at least `size` bytes each: more than what is left is damage.
    pub(super) fn count(&mut self, size: usize) -> Result<usize, Fault> {
        let at = self.at;
        let count = self.integer()?;
        usize::try_from(count).ok().filter(|n| n.saturating_mul(size) <= self.left()).ok_or_else(|| {
            Fault::Found { at, found: count.to_string(), wanted: "a count that fits into the data" }
        })
    }

    /// A count and as many items, each of at least `size` bytes.
    pub(super) fn list<T>(
        &mut self,
        size: usize,
        item: impl FnMut(&mut Self) -> Result<T, Fault>,
    ) -> Result<Vec<T>, Fault> {
        let count = self.count(size)?;
        self.times(count, item)
    }

    pub(super) fn times<T>(
        &mut self,
        count: usize,
        mut item: impl FnMut(&mut Self) -> Result<T, Fault>,
    ) -> Result<Vec<T>, Fault> {
        (0..count).map(|_| item(self)).collect()
    }

    pub(super) fn integers(&mut self) -> Result<Vec<i32>, Fault> {
        self.list(4, Self::integer)
    }

    pub(super) fn uuid(&mut self) -> Result<Uuid, Fault> {
        self.array().map(Uuid)
    }

    /// A colour; `None` when it is marked as unset.
    pub(super) fn colour(&mut self) -> Result<Option<[u8; 3]>, Fault> {
        self.array().map(|[r, g, b, a]| ([r, g, b, a] != [255; 4]).then_some([r, g, b]))
    }

    /// UTF-16 with a count of units, the terminator included.
    pub(super) fn text(&mut self) -> Result<String, Fault> {
        let units = self.list(2, |r| r.array().map(u16::from_le_bytes))?;
        Ok(String::from_utf16_lossy(units.strip_suffix(&[0]).unwrap_or(&units)))
    }

    /// Major and minor version in one byte.
    pub(super) fn version(&mut self) -> Result<(u8, u8), Fault> {
        self.byte().map(|b| (b >> 4, b & 15))
    }

    /// The type code of the next chunk.
    pub(super) fn peek(&self) -> Option<u32> {
        self.clone().array().ok().map(u32::from_le_bytes)
    }

    pub(super) fn chunk(&mut self) -> Result<Chunk<'a>, Fault> {
        let start = self.at;
        let code = self.array().map(u32::from_le_bytes)?;
        let at = self.at;
        let value = if self.wide {
            self.array().map(i64::from_le_bytes)?
        } else if code & SHORT != 0 {
            i64::from(self.integer()?)
        } else {
            i64::from(self.array().map(u32::from_le_bytes)?)
        };
        let mut content = Reader { start: self.at, end: self.at, crc: None, inner: Vec::new(), ..*self };
        if code & SHORT == 0 {
            let crc_size = if code & WITH_CRC != 0 { 4 } else { 0 };
            let length = usize::try_from(value).ok().filter(|n| *n >= crc_size).ok_or_else(|| {
                let wanted = "the length of a chunk";
                Fault::Found { at, found: value.to_string(), wanted }
            })?;
            self.take(length)?;
            content.end = self.at - crc_size;
            if let Ok(crc) = self.bytes[content.end..self.at].try_into() {
                content.crc = Some(u32::from_le_bytes(crc));
            }
        }
        self.inner.push(start..self.at);
        Ok(Chunk { code, value, content })
    }

    /// As [`Self::chunk`]; one that says to be longer than the file is cut off there.
    pub(super) fn chunk_or_rest(&mut self) -> Result<Chunk<'a>, Fault> {
        let mut probe = self.clone();
        if let Ok(chunk) = probe.chunk() {
            *self = probe;
            return Ok(chunk);
        }
        let code = self.array().map(u32::from_le_bytes)?;
        self.take(if self.wide { 8 } else { 4 })?;
        let content = Reader { start: self.at, crc: None, inner: Vec::new(), ..*self };
        self.at = self.end;
        Ok(Chunk { code, value: 0, content })
    }

    /// The next chunk, which must be of type `code`.
    pub(super) fn chunk_of(&mut self, code: u32, wanted: &'static str) -> Result<Reader<'a>, Fault> {
        let at = self.at;
        let chunk = self.chunk()?;
        if chunk.code != code {
            return Err(Fault::Found { at, found: format!("a chunk of type {:#010x}", chunk.code), wanted });
        }
        Ok(chunk.content)
    }

    /// The next chunk inside an object, which begins with a version in one byte; gives its minor version.
    pub(super) fn part(&mut self, what: &'static str) -> Result<(Reader<'a>, u8), Fault> {
        let mut part = self.chunk_of(ANONYMOUS, what)?;
        match part.version()? {
            (1, minor) => Ok((part, minor)),
            (version, _) => Err(Fault::Version { what, version }),
        }
    }

    /// The next chunk of type `code`, which begins with a version in two integers; gives its minor version.
    pub(super) fn long_part(&mut self, code: u32, what: &'static str) -> Result<(Reader<'a>, i32), Fault> {
        let mut part = self.chunk_of(code, what)?;
        let (major, minor) = (part.integer()?, part.integer()?);
        if major != 1 {
            return Err(Fault::Version { what, version: u8::try_from(major).unwrap_or(u8::MAX) });
        }
        Ok((part, minor))
    }

    /// Ends reading: where all was read, the checksum must fit. What newer versions appended is not hashed,
    /// since it may hold chunks.
    pub(super) fn finish(self) -> Result<(), Fault> {
        let Some(crc) = self.crc.filter(|_| self.checked && self.at == self.end) else { return Ok(()) };
        let mut hasher = crc32fast::Hasher::new();
        let mut from = self.start;
        for inner in &self.inner {
            hasher.update(&self.bytes[from..inner.start]);
            from = inner.end;
        }
        hasher.update(&self.bytes[from..self.end]);
        if hasher.finalize() == crc { Ok(()) } else { Err(Fault::Checksum { at: self.start }) }
    }
}

/// An identity as the archive stores it.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(super) struct Uuid([u8; 16]);

impl Uuid {
    /// From the usual notation, read as one number.
    pub(super) const fn new(text: u128) -> Self {
        let b = text.to_be_bytes();
        // The first three groups are stored as little-endian integers.
        Uuid([
            b[3], b[2], b[1], b[0], b[5], b[4], b[7], b[6], b[8], b[9], b[10], b[11], b[12], b[13], b[14],
            b[15],
        ])
    }

    pub(super) fn is_nil(self) -> bool {
        self.0 == [0; 16]
    }
}

impl std::fmt::Display for Uuid {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        for (i, k) in [3, 2, 1, 0, 5, 4, 7, 6, 8, 9, 10, 11, 12, 13, 14, 15].into_iter().enumerate() {
            if matches!(i, 4 | 6 | 8 | 10) {
                f.write_str("-")?;
            }
            write!(f, "{:02x}", self.0[k])?;
        }
        Ok(())
    }
}

impl std::fmt::Debug for Uuid {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        std::fmt::Display::fmt(self, f)
    }
}
